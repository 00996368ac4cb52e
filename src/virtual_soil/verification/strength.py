"""Strength: plane shear beside published steady strengths of spheres, and what its result must not depend on.

Published: the ratio of shear to normal stress of slowly and steadily sheared spheres without rolling resistance, in the limit of
rigid grains and low rates. Those simulations have no walls; ours shear 16 grains between glued layers. Values of different authors
differ by 5 to 10 %, hence the tolerance. The strength of frictionless beads falls as a power of 0.39 with the rate, so that no
affordable test reaches its limit, which is a lower bound.

Independence: rigid grains without adhesion and weight have no scale of force or length, so the ratio depends neither on the stress
nor on the radius; and it may depend neither on stiffness and rate, if these are of a quasi-static test, nor on the bed's size.
Means over few seeds are compared. A single test scatters by 1 to 3 % (docs/precision.md).
"""

from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from dem.experiments import direct_shear, plane_shear
from dem.experiments.soil import Engine, Soil
from dem.experiments.specimen import stiffness_reduction
from dem.experiments.strength import steady
from virtual_soil.verification import bulk
from virtual_soil.verification.check import Check

GROUP = "Strength"
SOIL = replace(bulk.SOIL, static_friction=0.5)
BED = plane_shear.Setup(
    length_ratio=32.0, height_ratio=32.0, width_ratio=16.0, normal_stress_pa=500.0, inertial_number=5e-3, shear_strain=3.0,
    max_shear_strain=3.0, preparation_friction_ratio=0.3, scale_radius_m=SOIL.radius_m,
)  # fmt: skip
#: A shear box with a slice four times as wide as the paper's, sheared by twice its displacement.
BOX = replace(bulk.BOX, width_ratio=20.0, displacement_ratio=18.0)
STIFFNESS_NUMBER = bulk.SHEAR_STIFFNESS_NUMBER

CHIALVO = "Chialvo, Sun & Sundaresan 2012 (Phys. Rev. E 85, 021305), yield stress ratio"
PEYNEAU = "Peyneau & Roux 2008 (Phys. Rev. E 78, 011307), frictionless beads, 5.76°"
#: Static friction -> published ratio of shear to normal stress, source, relation and note of the check.
PUBLISHED = {
    0.0: (float(np.tan(np.radians(5.76))), PEYNEAU, "at least", "limit of vanishing rate; ours is 0.113 at a fifth of the rate"),
    0.1: (0.268, CHIALVO, "equal", ""),
    0.3: (0.357, CHIALVO, "equal", ""),
    0.5: (0.382, CHIALVO, "equal", ""),
}
PUBLISHED_TOLERANCE = 0.1
#: Radii spread by this fraction, so that equal spheres do not order along floor and lid.
SPREAD = 0.1

#: Variant -> changes of soil, bed and stiffness number, that must not change the steady strength.
VARIANTS: dict[str, tuple[dict[str, Any], dict[str, Any], float]] = {
    "ten times the radius": ({"radius_m": 500e-6}, {"scale_radius_m": 500e-6}, 1.0),
    "four times the stress": ({}, {"normal_stress_pa": 2000.0}, 1.0),
    "four times as stiff": ({}, {}, 4.0),
    "four times the rate": ({}, {"inertial_number": 2e-2}, 1.0),
    "twice as long": ({}, {"length_ratio": 64.0}, 1.0),
    "twice as wide": ({}, {"width_ratio": 32.0}, 1.0),
}
BASE_SEEDS, VARIANT_SEEDS = (1, 2, 3, 4), (1, 2)
#: Standard deviation of a single test over its strength, and standard errors that a difference may have.
SCATTER, ERRORS = 0.02, 3.0
INDEPENDENCE_TOLERANCE = ERRORS * SCATTER * float(np.sqrt(1.0 / len(BASE_SEEDS) + 1.0 / len(VARIANT_SEEDS)))


def checks() -> list[Check]:
    """Run all cases of strength."""
    base = mean_ratio(SOIL, BED, STIFFNESS_NUMBER, BASE_SEEDS)
    return [*published(), *independence(base), beside_the_box(base)]


def ratio(soil: Soil, bed: plane_shear.Setup, number: float, seed: int) -> float:
    """Steady ratio of shear to normal stress of one plane shear test."""
    engine = Engine(time_step_rayleigh_ratio=0.3, stiffness_reduction=stiffness_reduction(soil, bed, number, 0.0))
    history = plane_shear.run(soil, bed, engine, seed).history
    found = steady(history["shear_strain"], history["shear_stress_pa"], history["plane_normal_stress_pa"])
    return found.shear_stress_pa / found.normal_stress_pa


def mean_ratio(soil: Soil, bed: plane_shear.Setup, number: float, seeds) -> float:
    """Mean of the steady ratio over seeds."""
    return float(np.mean([ratio(soil, bed, number, seed) for seed in seeds]))


def published() -> list[Check]:
    """Spheres without rolling resistance beside published steady strengths."""
    found = []
    for friction, (expected, source, relation, note) in PUBLISHED.items():
        soil = replace(SOIL, static_friction=friction, rolling_friction=0.0, radius_sd_ratio=SPREAD)
        obtained = mean_ratio(soil, BED, STIFFNESS_NUMBER, VARIANT_SEEDS)
        found.append(
            Check(
                group=GROUP, case=f"plane shear, µs {friction:g}, no rolling resistance",
                quantity="steady shear over normal stress", unit="-", source=source, expected=expected, obtained=obtained,
                tolerance=PUBLISHED_TOLERANCE * expected, relation=relation, note=note,
            )
        )  # fmt: skip
    return found


def independence(base: float) -> list[Check]:
    """The steady strength of variants that must not change it; base : that of the unchanged test."""
    found = []
    for name, (of_soil, of_bed, stiffer) in VARIANTS.items():
        soil, bed = replace(SOIL, **of_soil), replace(BED, **of_bed)
        obtained = mean_ratio(soil, bed, stiffer * STIFFNESS_NUMBER, VARIANT_SEEDS)
        found.append(
            Check(
                group=GROUP, case=f"plane shear, {name}", quantity="steady shear over normal stress", unit="-",
                source="the unchanged test", expected=base, obtained=obtained, tolerance=INDEPENDENCE_TOLERANCE * base,
            )
        )  # fmt: skip
    return found


def beside_the_box(base: float) -> Check:
    """The direct shear box at a displacement of nine grains: still above the steady strength, as its band is still dilating."""
    engine = partial(stiffness_reduction, SOIL, BOX, STIFFNESS_NUMBER)
    history = direct_shear.run(SOIL, BOX, Engine(time_step_rayleigh_ratio=0.3, stiffness_reduction=engine(9.81)), 1).history
    late = history["displacement_m"] > 0.7 * history["displacement_m"][-1]
    obtained = float(history["shear_stress_pa"][late].mean() / history["plane_normal_stress_pa"][late].mean())
    return Check(
        group=GROUP, case="direct shear box, 12.6 to 18 r of displacement", quantity="shear over normal stress on the plane",
        unit="-", source="plane shear", expected=base, obtained=obtained, relation="at least",
        tolerance=INDEPENDENCE_TOLERANCE * base,
        note="the paper's box ends at 9 r: its plateau is not the steady strength",
    )  # fmt: skip
