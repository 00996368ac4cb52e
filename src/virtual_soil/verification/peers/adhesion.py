"""Adhesion beside other programs: two grains drawn apart and slid, and a hanging chain, in LAMMPS (dmt, jkr) and LIGGGHTS (sjkr).

The two laws of LAMMPS are virtual-soil's, with the same surface energy, but for the end of a JKR contact (LAMMPS: at the greatest
pull) and the limit of sliding. LIGGGHTS' sjkr is another law; it is compared with its closed form, which the exports rely on.
Grains, energies and closed forms are those of `virtual_soil.verification.adhesion`.
"""

import math
import tempfile
from functools import partial
from pathlib import Path

import numpy as np

from dem import rayleigh_time
from virtual_soil.verification import adhesion as exact
from virtual_soil.verification.check import Check
from virtual_soil.verification.peers import lammps, liggghts

GROUP = "Adhesion beside LAMMPS and LIGGGHTS"
#: Law of virtual-soil -> that of LAMMPS.
NAMES = {"constant": "dmt", "jkr": "jkr"}
YOUNG_PA = liggghts.young_modulus(exact.GRAIN.shear_modulus_pa, exact.GRAIN.poisson_ratio)
FRICTION = 0.3
CHAIN_WORK_J_M2, CHAIN_TIME_S = 1e-3, 5e-3
N_STEPS = 4000


def checks() -> list[Check]:
    """Run all cases of the installed programs."""
    with tempfile.TemporaryDirectory(prefix="peers-") as name:
        found = []
        if lammps.installed():
            found += [check for law in NAMES for case in (drawn, slid, chain) for check in case(law, Path(name))]
        return found + (sjkr(Path(name)) if liggghts.installed() else [])


def model(pair: exact.Pair, law: str, restitution: float = 1.0) -> str:
    """Contact model of LAMMPS; its dashpot is that of virtual-soil in a contact without load."""
    log_e = math.log(restitution)
    a_0 = math.sqrt(pair.R_star_m * pair.overlap_m(0.0) * {"constant": 1.0, "jkr": 3.0}[law])
    beta = -log_e / math.hypot(log_e, math.pi)
    eta = 2.0 * math.sqrt(5.0 / 6.0) * beta * math.sqrt(2.0 * pair.modulus_pa / (a_0 * pair.mass_kg))
    return (
        f"{NAMES[law]} {YOUNG_PA:.17g} {eta:.17g} {exact.GRAIN.poisson_ratio} {0.5 * pair.work_j_m2:.17g} "
        f"tangential mindlin NULL 1.0 {FRICTION} damping viscoelastic"
    )


def header(places_m, step_s: float, pair: exact.Pair, law: str, restitution: float = 1.0) -> list[str]:
    """Return the lines of a LAMMPS input up to the time step."""
    radius = exact.RADIUS_M
    box = 2.0 * np.abs(places_m).max() + 10.0 * radius
    return [
        *lammps.header_lines(box, places_m, 2.0 * radius, exact.GRAIN.density_kg_m3, 0.2 * radius),
        "pair_style granular", f"pair_coeff * * {model(pair, law, restitution)}", f"timestep {step_s:.17g}",
    ]  # fmt: skip


def two_grains(
    law: str, folder: Path, first_m: float, velocity_m_s, step_s: float, n_steps: int = N_STEPS
) -> dict[str, np.ndarray]:
    """Overlap, force and tangential force of two grains in LAMMPS, from an overlap on, the second at a velocity (x, y)."""
    radius = exact.RADIUS_M
    places = np.array([[0.0, 0.0, 0.0], [2.0 * radius - first_m, 0.0, 0.0]])
    lines = [
        *header(places, step_s, exact.pair_of(law), law),
        "set atom 2 vx {:.17g} vy {:.17g}".format(*velocity_m_s), "fix motion all nve/noforce",
    ]  # fmt: skip
    values = {"overlap": f"{2.0 * radius:.17g}-(x[2]-x[1])", "force": "-fx[1]", "tangential": "fy[1]"}
    return lammps.printed(folder, lines, values, n_steps)


def drawn(law: str, folder: Path) -> list[Check]:
    """Two grains drawn apart in both programs: greatest pull, the whole curve, and where the contact ends."""
    pair = exact.pair_of(law)
    first, last = pair.overlap_m(0.2 * pair.pull_off_n), -1.2 * max(pair.tear_off_m, 0.2 * pair.overlap_m(0.0))
    step = 1e-9
    peer = two_grains(law, folder, first, ((first - last) / (N_STEPS * step), 0.0), step)
    overlaps, forces = exact.force_curve(law, "float64", first, last)
    holds = np.flatnonzero(peer["force"])
    at = peer["overlap"][holds]
    ours = np.interp(at, overlaps[::-1], forces[::-1])
    spacing = (first - last) / N_STEPS
    # LAMMPS ends JKR at the greatest pull, z = 3 of the closed form
    ends = {"constant": 0.0, "jkr": -pair.tear_off_m * 3.0 ** (1.0 / 3.0) / 3.0}[law]
    check = partial(Check, group=GROUP, case=f"two grains drawn apart, {law} and LAMMPS {NAMES[law]}", source="LAMMPS")
    later = f"virtual-soil's ends at {-pair.tear_off_m:.4g} m" if law == "jkr" else "as virtual-soil's"
    return [
        check(
            quantity="pull-off force", unit="N", expected=-float(peer["force"].min()), obtained=-float(forces.min()),
            tolerance=pair.stiffness_n_m * spacing, note=f"closed form {pair.pull_off_n:.6g} N",
        ),
        check(
            quantity="largest difference of force over F_c", unit="-", expected=0.0, tolerance=1e-5,
            obtained=float(np.abs(ours - peer["force"][holds])[:-1].max() / pair.pull_off_n), note=f"{len(holds) - 1} overlaps",
        ),
        check(
            quantity="overlap at which LAMMPS' contact ends", unit="m", expected=ends, obtained=float(at[-1]),
            tolerance=1.01 * spacing, note=later,
        ),
    ]  # fmt: skip


def slid(law: str, folder: Path) -> list[Check]:
    """Two grains that touch without load and are slid along each other."""
    pair = exact.pair_of(law)
    peer = two_grains(law, folder, pair.overlap_m(0.0), (0.0, 1.0), 1e-10, 1000)
    return [
        Check(
            group=GROUP, case=f"two grains slid without load, LAMMPS {NAMES[law]}", quantity="limit of sliding / (mu F_c)",
            unit="-", source="LAMMPS' manual", expected=2.0, obtained=float(peer["tangential"][-1] / (FRICTION * pair.pull_off_n)),
            tolerance=0.01, note=f"virtual-soil: {pair.repulsive_n(0.0) / pair.pull_off_n:.3g}",
        )
    ]  # fmt: skip


def chain_holds(law: str, folder: Path, n_grains: int) -> bool:
    """True if in LAMMPS a chain of n grains stays below a held one; it starts at the overlaps of its loads."""
    pair = exact.pair_of(law, CHAIN_WORK_J_M2)
    heights = exact.chain_heights_m(pair, n_grains)
    places = np.column_stack([np.zeros((len(heights), 2)), heights])
    step = 0.1 * rayleigh_time(exact.RADIUS_M, exact.GRAIN)
    lines = [
        *header(places, step, pair, law, restitution=0.3),
        f"group free id 2:{n_grains + 1}", f"fix weight free gravity {exact.GRAVITY_M_S2} vector 0 0 -1",
        "fix motion free nve/sphere",
    ]  # fmt: skip
    n_steps = round(CHAIN_TIME_S / step)
    last = lammps.printed(folder, lines, {"z": f"z[{n_grains + 1}]"}, n_steps, n_steps)["z"][-1]
    return bool(heights[-1] - last < 0.1 * exact.RADIUS_M)


def chain(law: str, folder: Path) -> list[Check]:
    """The longest chain that hangs, in both programs."""
    pair = exact.pair_of(law, CHAIN_WORK_J_M2)
    longest = int(pair.pull_off_n / (2.0 * pair.mass_kg * exact.GRAVITY_M_S2))
    check = partial(
        Check, group=GROUP, case=f"hanging chain, {law} and LAMMPS {NAMES[law]}, w = 1 mJ/m2", source="LAMMPS", unit="-"
    )
    return [
        check(
            quantity=f"{n} grains hang", expected=float(chain_holds(law, folder, n)),
            obtained=float(exact.chain_holds(law, "float64", n, CHAIN_WORK_J_M2)),
            note="closed form: " + ("yes" if n == longest else "no"),
        )
        for n in (longest, longest + 1)
    ]  # fmt: skip


def sjkr(folder: Path) -> list[Check]:
    """Pull-off force of LIGGGHTS' sjkr at the exported k, and at the same k with softer grains."""
    pair = exact.pair_of("constant")
    k = (1.5 * pair.pull_off_n * pair.modulus_pa**2 / (math.pi**3 * pair.R_star_m**2)) ** (1.0 / 3.0)
    check = partial(Check, group=GROUP, source="closed form (2 pi^3 / 3) k^3 R*^2 / E*^2", quantity="pull-off force", unit="N")
    return [
        check(
            case=f"two grains drawn apart, LIGGGHTS sjkr, k = {k:.4g} J/m3, E* / {softer}", expected=softer**2 * pair.pull_off_n,
            obtained=sjkr_pull_off(folder, k, softer), tolerance=tolerance * softer**2 * pair.pull_off_n, note=note,
        )
        for softer, tolerance, note in (
            (1, 3e-3, "k is chosen for 3.14159 uN; LIGGGHTS takes the area of the lens"),
            (4, 3e-2, "softening changes the cohesion"),
        )
    ]  # fmt: skip


def sjkr_pull_off(folder: Path, k_j_m3: float, softer: float) -> float:
    """Greatest pull in N between two grains drawn apart in LIGGGHTS."""
    radius, pair = exact.RADIUS_M, exact.pair_of("constant")
    first = 1.5 * (math.pi * k_j_m3 * math.sqrt(pair.R_star_m) * softer / pair.modulus_pa) ** 2  # beyond the overlap at pull-off
    step = 1e-9
    places = np.array([[0.0, 0.0, 0.0], [2.0 * radius - first, 0.0, 0.0]])
    velocities = np.array([[0.0, 0.0, 0.0], [first / (N_STEPS * step), 0.0, 0.0]])
    box = [(-20.0 * radius, 20.0 * radius)] * 3
    data = folder / "grains.data"
    data.write_text(
        liggghts.data_text("two", box, 1, places, np.full(2, radius), exact.GRAIN.density_kg_m3, velocities_m_s=velocities)
    )
    materials = liggghts.material_lines(
        exact.GRAIN.shear_modulus_pa / softer, exact.GRAIN.poisson_ratio, 1.0, [[FRICTION]], [[0.0]], cohesion_j_m3=[[k_j_m3]]
    )
    lines = [
        *liggghts.header_lines("f f f", data, 0.2 * radius), *materials, f"timestep {step:.9g}", "fix motion all nve/noforce",
        "variable pull equal fx[1]", "fix most all ave/time 1 1 1 v_pull mode scalar file pull.txt",
    ]  # fmt: skip
    with liggghts.Liggghts(folder, lines) as peer:
        peer.run(N_STEPS)
    return float(np.loadtxt(folder / "pull.txt", ndmin=2)[:, 1].max())
