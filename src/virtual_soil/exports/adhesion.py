"""Conversion of virtual-soil's adhesion to the parameters of other programs, matched by the pull-off force of two mean grains.

Symbols: F_c pull-off force; gamma surface energy, w = 2 gamma work of adhesion; R* = r/2 between two mean grains, r at a wall; a_0
contact radius without load; k cohesion energy density. F_c = FACTOR pi gamma R* in every law with a surface energy. LIGGGHTS' sjkr:

    F = 4/3 E* sqrt(R*) delta^(3/2) - k 2 pi R* delta,   F_c = 2 pi^3 / 3 k^3 R*^2 / E*^2

Of clumps r is the mean radius of their spheres.

Equal pull-off forces are not equal cohesions, because the programs limit sliding and rolling by different forces (`SLIDING`).

Sources: LAMMPS, gran_sub_mod_normal.cpp (dmt, jkr: limit |F_n + 2 F_c|; no dashpot by restitution with either); YADE,
HertzMindlin.cpp (limit F_c + |F_n| of sliding, |F_n| of rolling); LIGGGHTS-PUBLIC, cohesion_model_sjkr.h; EDEM's user guide,
Hertz-Mindlin with JKR. Tests run LIGGGHTS and LAMMPS.
"""

import math
from typing import NamedTuple

from dem.contact.laws import hertz

#: Program -> law of virtual-soil -> (its law, FACTOR). LIGGGHTS and MercuryDPM have no surface energy.
LAWS = {
    "LAMMPS": {"constant": ("dmt", 4.0), "jkr": ("jkr", 3.0)},
    "YADE": {"constant": ("DMT", 4.0), "jkr": ("DMT", 4.0)},
    "EDEM": {"constant": ("JKR", 3.0), "jkr": ("JKR", 3.0)},
}
#: FACTOR of virtual-soil's laws.
FACTORS = {"constant": 4.0, "jkr": 3.0}
#: Law or program -> limit of sliding of a contact without load, in words of the notes.
SLIDING = {
    "constant": "mu F_c",
    "jkr": "4 mu F_c",
    "LAMMPS": "2 mu F_c (in general mu |F_n + 2 F_c|)",
    "YADE": "mu F_c (in general mu (F_c + |F_n|))",
    "EDEM": "4 mu F_c (by the positive repulsive part of JKR)",
    "LIGGGHTS": "27/4 mu F_c (by Hertz's part of the force; tangential_reduce is off)",
}
#: Program -> limit of rolling, beside that of virtual-soil, which is by the same force as its sliding.
ROLLING = {
    "LAMMPS": "as that of sliding",
    "YADE": "by |F_n|, without adhesion",
    "EDEM": "to be measured in EDEM",
    "LIGGGHTS": "as that of sliding",
}
#: Program -> what else to know of its law.
CAUTIONS = {
    "LAMMPS": [
        "LAMMPS has no dashpot by restitution beside adhesion: damping viscoelastic is virtual-soil's dashpot in a contact",
        "without load between mean grains; the restitution of impacts differs.",
    ],
    "YADE": ["At a wall YADE's R* is r/2 and F_c that of two grains: half of virtual-soil's."],
    "EDEM": [
        "EDEM's guide prints a pull-out force of 3/2 pi gamma R*, half of the minimum of its own force law, by which gamma is",
        "given here. MEASURE THE PULL-OFF OF TWO GRAINS IN EDEM first: if it is F_c/2, double gamma.",
    ],
}
OURS = {"constant": "constant pull-off force while grains touch (DMT)", "jkr": "JKR"}


class Adhesion(NamedTuple):
    """Values that the templates need.

    law : name of the program's law. gamma : surface energy in J/m2, 0 if the program has none. k, k_wall : cohesion energy density
    of sjkr in J/m3. eta, eta_wall : dashpot in 1/(m s) of LAMMPS' `damping viscoelastic`.
    """

    law: str
    gamma: float
    k: float
    k_wall: float
    eta: float
    eta_wall: float


def adhesion(card: dict, numbers: dict[str, float], program: str) -> Adhesion | None:
    """Convert a card's adhesion for a program; None for a soil without. numbers : as from `inputs.derived`."""
    pull_off = pull_off_n(card)
    if pull_off == 0.0:
        return None
    ours, E_star, r = card["adhesion"]["law"], numbers["effective_young_modulus_pa"], numbers["contact_radius_m"]
    law, factor = LAWS.get(program, {}).get(ours, ("", math.inf))
    k, k_wall = (density(force, E_star, R_star) for force, R_star in ((pull_off, 0.5 * r), (2.0 * pull_off, r)))
    dashpots = [dashpot(card, numbers, R_star, share) for R_star, share in ((0.5 * r, 0.5), (r, 1.0))]
    return Adhesion(law, pull_off / (factor * math.pi * 0.5 * r), k, k_wall, *dashpots)


def pull_off_n(card: dict) -> float:
    """F_c of two mean grains in N; 0 for a soil without adhesion."""
    return card["adhesion"]["pull_off_force_n"] if "adhesion" in card else 0.0


def density(pull_off: float, E_star: float, R_star: float) -> float:
    """Cohesion energy density k in J/m3 with which LIGGGHTS' sjkr has this pull-off force."""
    return (1.5 * pull_off * E_star**2 / (math.pi**3 * R_star**2)) ** (1.0 / 3.0)


def dashpot(card: dict, numbers: dict[str, float], R_star: float, mass_share: float) -> float:
    """Coefficient in 1/(m s) of a dashpot eta a m* v that is virtual-soil's in a contact without load.

    virtual-soil's is 2 sqrt(5/6) beta sqrt(2 E* a m*) v, so eta = 2 sqrt(5/6) beta sqrt(2 E* / (a_0 m*)).
    """
    E_star, w = numbers["effective_young_modulus_pa"], card["adhesion"]["work_of_adhesion_j_m2"]
    factor = {"constant": 1.5, "jkr": 4.5}[card["adhesion"]["law"]]  # a_0^3 = 3 F_c R*/(4 E*); of JKR 9 pi w R*^2/(2 E*)
    a_0 = (factor * math.pi * w * R_star**2 / E_star) ** (1.0 / 3.0)
    mass = mass_share * numbers["density_kg_m3"] * 4.0 / 3.0 * math.pi * numbers["radius_m"] ** 3
    return hertz.DASHPOT_FACTOR * hertz.damping_ratio(numbers["restitution"]) * math.sqrt(2.0 * E_star / (a_0 * mass))


def explanation(card: dict, program: str) -> list[str]:
    """Return comment lines about adhesion, for soils that have it: what is matched, and what is not the same."""
    if pull_off_n(card) == 0.0:
        return []
    said, ours = card["adhesion"], card["adhesion"]["law"]
    return [
        f"Adhesion: {OURS[ours]}; two mean grains hold with F_c = {said['pull_off_force_n']:.6g} N, an adhesive stress of",
        f"{card['parameters']['adhesive_stress_pa']['value']:.6g} Pa, w = {said['work_of_adhesion_j_m2']:.6g} J/m2, "
        f"gamma = w/2 = {said['surface_energy_j_m2']:.6g} J/m2 in virtual-soil's law.",
        *carried(ours, program),
    ]


def carried(ours: str, program: str) -> list[str]:
    """Return the lines about what the program has of adhesion."""
    if program not in SLIDING:
        return [f"{program}: ADHESION IS NOT CARRIED, this file has no law of it: the soil written here has no cohesion."]
    return [
        *matched(ours, program),
        f"Limit of sliding of a contact without load: {SLIDING[ours]} in virtual-soil,",
        f"{SLIDING[program]} in {program}; limit of rolling: {ROLLING[program]}.",
        "So equal pull-off forces are not equal cohesions. CARRY c, NOT gamma: shear the soil in this program and change gamma",
        "(or k) until c is right.",
        "Walls: plate, lid and floor have the grains' adhesion, tube and side frames none. It is switched on when the sample is",
        "ready, unless material.json says that it was prepared with adhesion.",
    ]


def matched(ours: str, program: str) -> list[str]:
    """Return the lines about the program's law and the parameter that gives it the pull-off force."""
    if program == "LIGGGHTS":
        return [
            "LIGGGHTS: sjkr, a pull in proportion to the area of contact. k = (3 F_c E*^2/(2 pi^3 R*^2))^(1/3) gives F_c for",
            "this E* and this size of grains only: F_c goes with k^3 R*^2/E*^2. Softer or other grains need another k.",
        ]
    law, factor = LAWS[program][ours]
    lines = [f"{program}: {law}, F_c = {factor:g} pi gamma R*, with gamma so that F_c is virtual-soil's.", *CAUTIONS[program]]
    if program == "LAMMPS" and ours == "jkr":
        lines.append("LAMMPS tears a contact at the greatest pull, virtual-soil at the end of the theory's curve.")
    if factor != FACTORS[ours]:
        lines.append("The law is another than virtual-soil's; only F_c is the same.")
    return lines
