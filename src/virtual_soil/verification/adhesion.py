"""Adhesion: two grains, a grain on plate, wall and ceiling, a hanging chain and clusters, beside closed forms.

Symbols: w work of adhesion, R* effective radius, E* effective modulus, F_c pull-off force, k = 4/3 E* sqrt(R*), delta overlap,
p = F / F_c. Constant pull-off: F = k delta^(3/2) - F_c, F_c = 2 pi w R*. JKR: F_c = 3/2 pi w R*; with z = sqrt(a^3 / a_f^3),
p = (z^2 - 6 z) / 9, so z = 3 + 3 sqrt(1 + p) on the stable branch, delta / delta_f = (z^(4/3) - 4 z^(1/3)) / 3.
"""

import itertools
import math
from dataclasses import dataclass
from functools import partial

import numpy as np

import dem
from virtual_soil.verification.check import Check
from virtual_soil.verification.scene import PRECISIONS, mass_kg, record

GROUP = "Adhesion"
GRAIN = dem.Material(density_kg_m3=3000.0, poisson_ratio=0.2, shear_modulus_pa=5e7)
SOFTENED = dem.Material(density_kg_m3=3000.0, poisson_ratio=0.2, shear_modulus_pa=5e5)
RADIUS_M = 50e-6
WORK_J_M2 = 0.02
GRAVITY_M_S2 = 9.81
SOURCES = {"constant": "closed form (DMT 1975)", "jkr": "closed form (JKR 1971)"}
#: Steps of a drawn contact; the tear-off is known to one of them.
DRAWN_STEPS = 4000
#: Relative distance from a threshold at which both sides are simulated.
MARGIN = 0.02


@dataclass(frozen=True)
class Pair:
    """Closed forms of a contact of one law: effective radius (m), work of adhesion (J/m2), E* (Pa), mass m* (kg)."""

    law: str
    R_star_m: float
    work_j_m2: float
    modulus_pa: float
    mass_kg: float

    @property
    def pull_off_n(self) -> float:
        """F_c."""
        return {"constant": 2.0, "jkr": 1.5}[self.law] * math.pi * self.work_j_m2 * self.R_star_m

    @property
    def tear_off_radius_m(self) -> float:
        """a_f of JKR."""
        return (math.pi * self.work_j_m2 * self.R_star_m**2 / (8.0 * self.modulus_pa)) ** (1.0 / 3.0)

    @property
    def tear_off_m(self) -> float:
        """Gap at which the contact ends."""
        return 3.0 * self.tear_off_radius_m**2 / self.R_star_m if self.law == "jkr" else 0.0

    def overlap_m(self, force_n: float) -> float:
        """Overlap under a force; a pull is negative, and at least -F_c."""
        if self.law == "constant":
            return ((force_n + self.pull_off_n) / (4.0 / 3.0 * self.modulus_pa * math.sqrt(self.R_star_m))) ** (2.0 / 3.0)
        z = 3.0 + 3.0 * math.sqrt(1.0 + force_n / self.pull_off_n)
        return self.tear_off_m * (z ** (4.0 / 3.0) - 4.0 * z ** (1.0 / 3.0)) / 3.0

    def repulsive_n(self, force_n: float) -> float:
        """Repulsive part of a force, which limits sliding and rolling."""
        if self.law == "constant":
            return force_n + self.pull_off_n
        return self.pull_off_n / 9.0 * (3.0 + 3.0 * math.sqrt(1.0 + force_n / self.pull_off_n)) ** 2

    @property
    def stiffness_n_m(self) -> float:
        """DF / d delta without load: 2 E* sqrt(R* delta_0); of JKR 6/5 E* a_0."""
        if self.law == "constant":
            return 2.0 * self.modulus_pa * math.sqrt(self.R_star_m * self.overlap_m(0.0))
        return 1.2 * self.modulus_pa * math.sqrt(3.0 * self.R_star_m * self.overlap_m(0.0))

    @property
    def sticking_speed_m_s(self) -> float:
        """Speed below which an elastic impact sticks: that of the energy W = 7.0922 (w^5 R*^4 / E*^2)^(1/3)."""
        if self.law == "constant":
            return 0.0
        lost = 7.0922 * (self.work_j_m2**5 * self.R_star_m**4 / self.modulus_pa**2) ** (1.0 / 3.0)
        return math.sqrt(2.0 * lost / self.mass_kg)


def pair_of(law: str, work_j_m2: float = WORK_J_M2, material: dem.Material = GRAIN) -> Pair:
    """Two equal grains."""
    modulus = material.shear_modulus_pa / (1.0 - material.poisson_ratio)
    return Pair(law, 0.5 * RADIUS_M, work_j_m2, modulus, 0.5 * mass_kg(material, RADIUS_M))


def on_wall(law: str, work_j_m2: float) -> Pair:
    """A grain on a wall of its own material."""
    modulus = GRAIN.shear_modulus_pa / (1.0 - GRAIN.poisson_ratio)
    return Pair(law, RADIUS_M, work_j_m2, modulus, mass_kg(GRAIN, RADIUS_M))


def checks() -> list[Check]:
    """Run all cases of adhesion."""
    rows = []
    for law, precision in itertools.product(SOURCES, PRECISIONS):
        for case in (drawn, vibration, impact, hanging, chain, dragged, on_a_vertical_wall, clusters):
            rows += case(law, precision)
    return rows + [check for law in SOURCES for check in [*softened(law), *energy(law)]]


def scene(law, precision, *, work=WORK_J_M2, restitution=1.0, friction=(0.0, 0.0), material=GRAIN, steps=0.02, **settings):
    """Create a simulation of one material; friction : static and rolling. steps : time step over Rayleigh time.

    In float64 all have an energy ledger, as one of them needs it: it alters nothing, and each kernel takes a minute to compile.
    """
    static, rolling = friction
    touch = dem.Interaction(
        restitution=restitution, static_friction=static, rolling_friction=rolling, work_of_adhesion_j_m2=work
    )  # fmt: skip
    settings.setdefault("gravity_m_s2", (0.0, 0.0, 0.0))
    return dem.Simulation(
        materials={"grain": material}, interactions={("grain", "grain"): touch}, smallest_radius_m=RADIUS_M, adhesion=law,
        precision=precision, time_step_rayleigh_ratio=steps, energy_ledger=precision == "float64", **settings,
    )  # fmt: skip


def hook() -> dem.Box:
    """A point that touches nothing, to hold a grain."""
    return dem.Box(name="hook", material="grain", low_m=(0.0, 0.0, 1.0), high_m=(0.0, 0.0, 1.0))


def compare(law: str, case: str):
    """`Check` with the fields that all checks of a case share."""
    return partial(Check, group=GROUP, case=f"{law}: {case}", source=SOURCES[law])


def holds(check, quantity: str, obtained: bool, expected: bool, note: str = "") -> Check:
    """A yes or no, as 1 or 0."""
    return check(quantity=quantity, unit="-", expected=float(expected), obtained=float(obtained), note=note)


def force_curve(law: str, precision: str, first_m: float, last_m: float):
    """Overlaps (n,) and forces (n,) in N of two grains that pass from one overlap to another, fast enough not to be held."""
    exact = pair_of(law)
    range_m = abs(last_m - first_m)
    speed = 10.0 * math.sqrt(exact.pull_off_n * range_m / exact.mass_kg)
    step = range_m / (DRAWN_STEPS * speed)
    simulation = scene(law, precision, steps=step / dem.rayleigh_time(RADIUS_M, GRAIN))
    half = RADIUS_M - 0.5 * first_m
    apart = 0.5 * speed if last_m < first_m else -0.5 * speed
    simulation.add_grains([(-half, 0.0, 0.0), (half, 0.0, 0.0)], RADIUS_M, "grain", [(-apart, 0.0, 0.0), (apart, 0.0, 0.0)])
    run = record(simulation, DRAWN_STEPS)
    speeds = run.velocities_m_s[:, 1, 0] - run.velocities_m_s[:, 0, 0]
    overlaps = 2.0 * RADIUS_M - np.ptp(run.positions_m[:-1, :, 0], axis=1)
    return overlaps, exact.mass_kg * np.diff(speeds) / simulation.time_step_s


def drawn(law: str, precision: str) -> list[Check]:
    """Two grains approach, are pressed, and are drawn apart."""
    exact = pair_of(law)
    reach = max(exact.tear_off_m, 0.2 * exact.overlap_m(0.0))
    check = compare(law, f"two grains drawn apart, {precision}")
    together, pressed = force_curve(law, precision, -0.5 * reach, 0.5 * reach)
    apart, force = force_curve(law, precision, exact.overlap_m(0.2 * exact.pull_off_n), -1.2 * reach)
    per_step = abs(apart[1] - apart[0])
    least, last, first = int(np.argmin(force)), int(np.flatnonzero(force)[-1]), int(np.flatnonzero(pressed)[0])
    rounding = 1e3 * PRECISIONS[precision]
    slope = 2.0 * exact.stiffness_n_m * per_step
    at_touch, at_tear = {"constant": (1.0, 1.0), "jkr": (8.0 / 9.0, 5.0 / 9.0)}[law]
    # near tear-off JKR's force changes as the root of the distance from it
    steep = exact.pull_off_n * math.sqrt(per_step / reach) if law == "jkr" else (per_step / reach) * exact.pull_off_n
    zero = float(np.interp(0.0, force[:least][::-1], apart[:least][::-1]))
    rows = [
        ("pull-off force", "N", exact.pull_off_n, -force[least], rounding * exact.pull_off_n + 0.05 * slope),
        ("overlap without load", "m", exact.overlap_m(0.0), zero, rounding * exact.overlap_m(0.0) + 0.1 * per_step),
        ("force at first touch", "N", -at_touch * exact.pull_off_n, pressed[first], slope + steep),
        ("force at tear-off", "N", -at_tear * exact.pull_off_n, force[last], slope + 2.0 * steep),
        ("overlap at tear-off", "m", -exact.tear_off_m, apart[last], per_step + 1e-4 * reach),
        ("overlap at first touch", "m", 0.0, together[first], abs(together[1] - together[0])),
    ]
    if law == "jkr":
        flattest = -exact.tear_off_m * 3.0 ** (1.0 / 3.0) / 3.0  # z = 3
        rows.append(("overlap at pull-off", "m", flattest, apart[least], 0.02 * exact.tear_off_m))
    return [
        check(quantity=name, unit=unit, expected=float(expected), obtained=float(obtained), tolerance=float(tolerance))
        for name, unit, expected, obtained, tolerance in rows
    ]


def vibration(law: str, precision: str) -> list[Check]:
    """Period of a small vibration of two free grains about their overlap without load."""
    exact = pair_of(law)
    rest = exact.overlap_m(0.0)
    period = 2.0 * math.pi * math.sqrt(exact.mass_kg / exact.stiffness_n_m)
    simulation = scene(law, precision)
    simulation.add_grains([(0.0, 0.0, 0.0), (2.0 * RADIUS_M - 1.02 * rest, 0.0, 0.0)], RADIUS_M, "grain")
    times, overlaps = [], []
    for _ in range(int(5.2 * period / simulation.time_step_s)):
        times.append(simulation.time_s)
        overlaps.append(2.0 * RADIUS_M - np.ptp(simulation.grains.positions_m[:, 0]))
        simulation.advance(1)
    off = np.array(overlaps) - rest
    ups = np.flatnonzero((off[:-1] < 0.0) & (off[1:] >= 0.0))
    crossings = [times[k] + (times[k + 1] - times[k]) * off[k] / (off[k] - off[k + 1]) for k in ups]
    measured = (crossings[-1] - crossings[0]) / (len(crossings) - 1)
    return [
        compare(law, f"vibration of two grains, {precision}")(
            quantity="period", unit="s", expected=period, obtained=float(measured), tolerance=3e-3 * period,
            note="amplitude 2 % of the overlap",
        )
    ]  # fmt: skip


def rebound(law: str, precision: str, speed: float, material: dem.Material = GRAIN) -> float:
    """Speed after an elastic impact of two grains over the speed before; 0 where they stick."""
    exact = pair_of(law, material=material)
    simulation = scene(law, precision, material=material, steps=0.005)
    ahead = (1.0 + 1e-6) * RADIUS_M
    simulation.add_grains(
        [(-ahead, 0.0, 0.0), (ahead, 0.0, 0.0)], RADIUS_M, "grain", [(0.5 * speed, 0.0, 0.0), (-0.5 * speed, 0.0, 0.0)]
    )
    period = 2.0 * math.pi * math.sqrt(exact.mass_kg / exact.stiffness_n_m)
    simulation.run(3.0 * period)
    grains = simulation.grains
    gap = np.ptp(grains.positions_m[:, 0]) - 2.0 * RADIUS_M
    return float(np.ptp(grains.velocities_m_s[:, 0])) / speed if gap > exact.tear_off_m else 0.0


def impact(law: str, precision: str) -> list[Check]:
    """Elastic impacts around the sticking speed."""
    sticking = pair_of(law).sticking_speed_m_s
    check = compare(law, f"elastic impact of two grains, {precision}")
    speeds = [1.2 * sticking, 3.0 * sticking] if sticking else [5e-4, 3e-2]
    rows = [
        check(
            quantity=f"rebound at {speed * 1e3:.3g} mm/s", unit="-", expected=math.sqrt(1.0 - (sticking / speed) ** 2),
            obtained=rebound(law, precision, speed), tolerance=5e-3,
        )
        for speed in speeds
    ]  # fmt: skip
    if sticking:
        rows.append(holds(check, f"sticks at {1 - MARGIN} v_s", rebound(law, precision, (1.0 - MARGIN) * sticking) == 0.0, True))
    return rows


def hangs(law: str, precision: str, work: float) -> bool:
    """True if a grain stays at a ceiling that it touches."""
    ceiling = dem.Box(name="ceiling", material="grain", low_m=(-1.0, -1.0, 0.0), high_m=(1.0, 1.0, 0.1))
    gravity = (0.0, 0.0, -GRAVITY_M_S2)
    simulation = scene(law, precision, work=work, restitution=0.3, steps=0.2, walls=[ceiling], gravity_m_s2=gravity)
    simulation.add_grains([(0.0, 0.0, -RADIUS_M * (1.0 - 1e-7))], RADIUS_M, "grain")
    simulation.run(5e-3)
    return bool(simulation.grains.positions_m[0, 2] > -1.01 * RADIUS_M)


def hanging(law: str, precision: str) -> list[Check]:
    """A grain under a ceiling hangs where F_c exceeds its weight; JKR is let go at first touch, where it pulls with 8/9 F_c."""
    share = {"constant": 2.0 / 3.0, "jkr": 8.0 / 9.0}[law]
    least = share * GRAIN.density_kg_m3 * GRAVITY_M_S2 * RADIUS_M**2
    at_touch = {"constant": 1.0, "jkr": 9.0 / 8.0}[law]
    check = compare(law, f"grain under a ceiling, {precision}")
    above, below = (1.0 + MARGIN) * at_touch * least, (1.0 - MARGIN) * least
    return [
        holds(check, f"hangs with w = {above * 1e6:.4g} uJ/m2", hangs(law, precision, above), True),
        holds(check, f"hangs with w = {below * 1e6:.4g} uJ/m2", hangs(law, precision, below), False),
    ]


def chain_heights_m(exact: Pair, n_grains: int) -> np.ndarray:
    """Heights (n + 1,) in m of a held grain and of n below it, at the overlaps of their loads."""
    weight = 2.0 * exact.mass_kg * GRAVITY_M_S2
    overlaps = [max(exact.overlap_m(max(-n * weight, -exact.pull_off_n)), 1e-7 * RADIUS_M) for n in range(n_grains, 0, -1)]
    return -np.concatenate([[0.0], np.cumsum(2.0 * RADIUS_M - np.array(overlaps))])


def chain_holds(law: str, precision: str, n_grains: int, work: float) -> bool:
    """True if a chain of n grains stays below a held one; it starts at the overlaps of its loads, or at touch."""
    heights = chain_heights_m(pair_of(law, work), n_grains)
    simulation = scene(law, precision, work=work, restitution=0.3, steps=0.2, gravity_m_s2=(0.0, 0.0, -GRAVITY_M_S2))
    simulation.add_wall(hook())
    simulation.add_grains([(0.0, 0.0, z) for z in heights], RADIUS_M, "grain")
    simulation.glue([0], "hook")
    simulation.run(5e-3)
    fallen = heights - simulation.grains.positions_m[:, 2]
    return bool(fallen.max() < 0.1 * RADIUS_M)


def chain(law: str, precision: str) -> list[Check]:
    """A chain of grains hangs while its weight is at most F_c."""
    work = 1e-3
    exact = pair_of(law, work)
    longest = int(exact.pull_off_n / (2.0 * exact.mass_kg * GRAVITY_M_S2))
    check = compare(law, f"chain of grains, w = 1 mJ/m2, {precision}")
    return [holds(check, f"{n} grains hang", chain_holds(law, precision, n, work), n == longest) for n in (longest, longest + 1)]


def dragged(law: str, precision: str) -> list[Check]:
    """A grain that rolling friction keeps from turning lies on a plate that is drawn from under it: force over mu_s."""
    friction = 0.3
    exact = on_wall(law, WORK_J_M2)
    weight = exact.mass_kg * GRAVITY_M_S2
    floor = dem.Box(
        name="floor", material="grain", low_m=(-1.0, -1.0, -1.0), high_m=(1.0, 1.0, 0.0), velocity_m_s=(10.0, 0.0, 0.0)
    )  # fmt: skip
    simulation = scene(
        law, precision, friction=(friction, 10.0), walls=[floor], gravity_m_s2=(0.0, 0.0, -GRAVITY_M_S2)
    )  # fmt: skip
    simulation.add_grains([(0.0, 0.0, RADIUS_M - exact.overlap_m(weight))], RADIUS_M, "grain")
    simulation.advance(100)
    expected = exact.repulsive_n(weight)
    return [
        compare(law, f"grain on a plate that is drawn away, {precision}")(
            quantity="sliding force / mu_s", unit="N", expected=expected, tolerance=1e-3 * expected,
            obtained=float(np.linalg.norm(simulation.mean_wall_forces_n["floor"][:2])) / friction,
            note=f"{expected / weight:.4g} times its weight",
        )
    ]  # fmt: skip


def stays(law: str, precision: str, static_friction: float, rolling_friction: float) -> bool:
    """True if a grain stays at a vertical wall."""
    exact = on_wall(law, WORK_J_M2)
    wall = dem.Box(name="wall", material="grain", low_m=(-1.0, -1.0, -1.0), high_m=(0.0, 1.0, 1.0))
    simulation = scene(
        law, precision, restitution=0.3, friction=(static_friction, rolling_friction), steps=0.2, walls=[wall],
        gravity_m_s2=(0.0, 0.0, -GRAVITY_M_S2),
    )  # fmt: skip
    simulation.add_grains([(RADIUS_M - exact.overlap_m(0.0), 0.0, 0.0)], RADIUS_M, "grain")
    simulation.run(5e-3)
    return bool(simulation.grains.positions_m[0, 2] > -0.01 * RADIUS_M)


def on_a_vertical_wall(law: str, precision: str) -> list[Check]:
    """A grain at a vertical wall neither slides nor rolls while both frictions times the repulsive part carry its weight."""
    exact = on_wall(law, WORK_J_M2)
    least = exact.mass_kg * GRAVITY_M_S2 / exact.repulsive_n(0.0)
    check = compare(law, f"grain at a vertical wall, {precision}")
    high, low = (1.0 + MARGIN) * least, (1.0 - MARGIN) * least
    return [
        holds(check, "stays, both frictions 2 % above", stays(law, precision, high, high), True),
        holds(check, "stays, mu_s 2 % below", stays(law, precision, low, 2.0 * high), False),
        holds(check, "stays, mu_r 2 % below", stays(law, precision, 2.0 * high, low), False),
    ]


def clusters(law: str, precision: str) -> list[Check]:
    """A cloud of grains of unlike radii collides and sticks: momentum and angular momentum stay."""
    simulation = scene(
        law, precision, restitution=0.5, friction=(0.4, 0.0), steps=0.2, material=SOFTENED
    )  # fmt: skip
    rng = np.random.default_rng(1)
    lattice = np.stack(np.meshgrid(*[np.arange(4)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    radii = RADIUS_M * rng.uniform(1.0, 1.5, len(lattice))
    places = (lattice - 1.5) * 3.05 * RADIUS_M
    velocities = -50.0 * places + rng.normal(0.0, 2e-3, places.shape)
    simulation.add_grains(places, radii, "grain", velocities, rng.normal(0.0, 50.0, places.shape))
    before = momenta(simulation, radii)
    simulation.run(0.02)
    after = momenta(simulation, radii)
    check = compare(law, f"64 grains that collide and stick, {precision}")
    spread = np.linalg.norm(np.ptp(simulation.grains.positions_m, axis=0))
    tolerance = 1e4 * PRECISIONS[precision]
    return [
        check(
            quantity=f"change of {name} over its scale", unit="-", expected=0.0,
            obtained=float(np.linalg.norm(b - a) / scale), tolerance=tolerance,
        )
        for name, a, b, scale in zip(("momentum", "angular momentum"), before[:2], after[:2], before[2:], strict=True)
    ] + [
        check(
            quantity="size of the cluster at the end", unit="m", expected=float(np.linalg.norm(np.ptp(places, axis=0))),
            obtained=float(spread), relation="at most", note="it has not flown apart",
        )
    ]  # fmt: skip


def momenta(simulation: dem.Simulation, radii: np.ndarray):
    """Momentum and angular momentum about the origin, and the sums of their magnitudes."""
    grains, masses = simulation.grains, mass_kg(SOFTENED, radii)
    linear = masses[:, None] * grains.velocities_m_s
    spins = 0.4 * (masses * radii**2)[:, None] * grains.angular_velocities_rad_s
    # stored velocities are half a step behind the positions
    angular = np.cross(grains.positions_m - 0.5 * simulation.time_step_s * grains.velocities_m_s, linear) + spins
    return linear.sum(axis=0), angular.sum(axis=0), np.abs(linear).sum(), np.abs(angular).sum()


def softened(law: str) -> list[Check]:
    """G / 100: the pull-off force stays, the overlap without load grows, and so does JKR's sticking speed."""
    exact = pair_of(law, material=SOFTENED)
    check = compare(law, "softened by 100, float64")
    simulation = scene(law, "float64", restitution=0.3, material=SOFTENED)
    simulation.add_grains([(0.0, 0.0, 0.0), (2.0 * RADIUS_M - 1e-6 * RADIUS_M, 0.0, 0.0)], RADIUS_M, "grain")
    simulation.run(5e-3)
    rest = 2.0 * RADIUS_M - np.ptp(simulation.grains.positions_m[:, 0])
    rows = [
        check(
            quantity="overlap at rest / r", unit="-", expected=exact.overlap_m(0.0) / RADIUS_M, obtained=float(rest / RADIUS_M),
            tolerance=1e-4 * exact.overlap_m(0.0) / RADIUS_M,
        )
    ]  # fmt: skip
    if law == "jkr":
        speed = 1.2 * exact.sticking_speed_m_s
        rows.append(
            check(
                quantity="rebound at 1.2 v_s", unit="-", expected=math.sqrt(1.0 - 1.0 / 1.44),
                obtained=rebound(law, "float64", speed, SOFTENED), tolerance=5e-3, note=f"v_s = {speed / 1.2 * 1e3:.3g} mm/s",
            )
        )  # fmt: skip
    return rows


def energy(law: str) -> list[Check]:
    """Elastic grains without friction collide, stick and tear off: the ledger closes at second order."""
    residuals = []
    for steps in (0.1, 0.025):
        simulation = scene(law, "float64", steps=steps, restitution=0.7, friction=(0.3, 0.1))
        rng = np.random.default_rng(2)
        lattice = np.stack(np.meshgrid(*[np.arange(3)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
        places = (lattice - 1.0) * 2.05 * RADIUS_M
        simulation.add_grains(places, RADIUS_M, "grain", -600.0 * places + rng.normal(0.0, 0.02, places.shape))
        simulation.run(6e-4)
        energies = simulation.energies_j
        residuals.append(abs(energies["residual"]) / energies["dissipated"])
    check = compare(law, "27 grains that collide, stick and tear off, float64")
    common = {"unit": "-", "relation": "at most"}
    return [
        check(quantity="residual / dissipated, 0.1 T_R", expected=1e-2, obtained=residuals[0], **common),
        check(quantity="residual / dissipated, 0.025 T_R", expected=1e-3, obtained=residuals[1], **common),
    ]
