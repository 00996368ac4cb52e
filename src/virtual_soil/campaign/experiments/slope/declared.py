"""The cut slope in a campaign: settings, responses and cost.

The test itself is `dem.experiments.cut_slope`; `simulate` runs it as a job, `measure` reads its bracket of the angle.
"""

import math
from dataclasses import dataclass

from dem.experiments import cut_slope
from virtual_soil.calibration.response import Response
from virtual_soil.campaign.experiments import apparatus
from virtual_soil.campaign.experiments.common import (
    PREPARED_WITH_ADHESION,
    check_period,
    engine_of,
    engine_under_weight,
    loose_column_m,
    scale_m,
    soil_of,
    time_step_s,
)
from virtual_soil.campaign.experiments.grading import grading_of
from virtual_soil.campaign.experiments.shapes import shape_of
from virtual_soil.campaign.experiments.unloaded import check_loads as check_loads
from virtual_soil.campaign.experiments.unloaded import floors as floors
from virtual_soil.campaign.experiments.unloaded import loads as loads
from virtual_soil.campaign.experiments.unloaded import strength as strength
from virtual_soil.campaign.settings import setting

NAME = "slope"
#: Nouns for one simulation, for several, and for the samples that each seed prepares.
NOUNS = ("cut slope", "cut slopes", "beds to be cut")
#: True if studies that name no experiments have it.
BY_DEFAULT = False

RESPONSES = (
    Response(
        name="slope_angle",
        column="slope_angle_deg",
        unit="deg",
        symbol="β",
        table="slope",
        bound_column="slope_bound_deg",
        maximum=90.0,
        usual=(1.0, 89.0),  # a cut of a soil that coheres may be as steep
        of_consequence=3.0,
        decisive_error=1.0,
        sweep_form="log",
    ),
)
#: Column of the load of a simulation; None if a point has one simulation per seed.
LOAD = None
#: Quantity for the comparison of the accelerated test with the reference.
COMPARED = "slope_angle_deg"
#: Tables that `measure.reduce` computes from the table of all runs.
REDUCED: tuple[str, ...] = ()
#: Stored table from which `measure.measured` computes the responses.
MEASURED_FROM = "after"

#: Keys of its section that act on measuring and on reducing, not on the simulations.
MEASURED_BY: tuple[str, ...] = ()
REDUCED_BY: tuple[str, ...] = ()
#: Entry of a soil file that `laboratory` reads: none, a laboratory states an angle with its height.
LABORATORY = None

#: Settings of walls that may be design variables -> key of material that null stands for.
PROPERTIES: dict[str, str] = {}

#: Response of the bulk density -> measured solid fraction that it is the grains' density times, in simulations that count.
DENSITIES: dict[str, str] = {}

#: True if bodies of the test turn, for which the engine has kernels of their own.
TURNING = False

#: Section that states the laboratory's apparatus (`experiments.apparatus`).
APPARATUS = "slope_test"

#: Default seeds of each stage: beds of the same grains differ by 1 to 4 degrees (docs/decisions/10).
SEEDS = {"design": [1, 2], "check": [1], "refine": [1, 2], "verify": [101, 102, 103, 104, 105, 106]}

#: Status of the simulations that count. A column has no angle: it stands at any.
SOUND = ("done", "flat")

#: Time until the bed is at rest, in free-fall times of the loose column.
FILL_FALL_TIMES = 2.0
#: A cut has this share of the bed's grains, and takes this share of its longest time: what falls ends early.
CUT_SHARE, STAND_SHARE = 0.4, 0.7


@dataclass(frozen=True, kw_only=True)
class Settings:
    """Cut slope: a settled bed is cut, and the steepest cut that stands is found by bisection."""

    height_ratio: float = setting(
        "height of the slope in grain radii; slope_test.height_m goes before it",
        30.0,
        minimum=12,
        note="with cohesion the angle depends on c over rho_b g H, so state the height in slope_test",
    )
    length_ratio: float = setting("distance of the end walls over the height of the slope", 3.0, minimum=1.5)
    thickness_ratio: float = setting("thickness of the simulated slice in grain radii, its period", 8.0, above=4.8)
    tolerance_deg: float = setting("bracket of the angle at which the bisection ends", 1.0, above=0, maximum=20)
    preparation_friction_ratio: float = setting(
        "factor on the grains' friction while the bed settles", 0.3, minimum=0, maximum=1, note="below 1 the bed is tamped"
    )
    prepared_with_adhesion: bool = PREPARED_WITH_ADHESION


@dataclass(frozen=True, kw_only=True)
class Fidelity:
    """Numerical fidelity of the slopes; the defaults are the campaign's."""

    slope_stiffness_number: float | None = setting(
        "E*/p of the softened grains in the cut slope; null: no softening",
        20000.0,
        above=0,
        note="p: stress under the bed, and what adhesion adds.",
    )
    slope_time_step_rayleigh_ratio: float = setting(
        "time step over Rayleigh time in the cut slope", 0.4, above=0, maximum=0.5, note="as in the angle-of-repose test"
    )


#: Further settings of the check points.
CHECK: dict[str, tuple] = {}
#: The paper's fidelity, where it differs.
REFERENCE = {"slope_stiffness_number": None, "slope_time_step_rayleigh_ratio": 0.2}


def as_printed(config: dict) -> bool:
    """False: the paper has no such test."""
    return False


def canonical(material: dict, config: dict) -> dict:
    """Return the simulated material of a point: its own, because the floor's glued grains do not turn."""
    return material


def gravity_m_s2(config: dict) -> float:
    """Gravity of the slopes: the laboratory's, else the engine's."""
    return apparatus.gravity_of(config, APPARATUS)


def setup(config: dict, row: dict) -> dict:
    """Return keyword arguments of the test's Setup and of the engine for one row of the design.

    Length and softening follow from the height, so they are right for grains and slopes of any size.
    """
    soil = soil_of(row, config)
    protocol = config[NAME] | {"scale_radius_m": scale_m(config, row)} | apparatus.slope(config, row)
    protocol["length_ratio"] *= protocol["height_ratio"]
    check_period(soil, protocol["thickness_ratio"] * protocol["scale_radius_m"], f"{NAME}.thickness_ratio")
    gravity, height = gravity_m_s2(config), protocol["height_ratio"] * protocol["scale_radius_m"]
    engine = engine_under_weight(config, row, height, gravity, "slope")
    return {"setup": protocol, "engine": engine, **grading_of(config), **shape_of(config)}


def cost(row: dict, settings: dict) -> tuple[int, float]:
    """Return the number of spheres and the expected steps of all of them: fall of the bed, then the cuts of the bisection."""
    soil, engine, test = soil_of(row, settings), engine_of(settings), cut_slope.Setup(**settings["setup"])
    n = cut_slope.n_grains(soil, test)
    fall_s = math.sqrt(2.0 * loose_column_m(soil, n, test.length_m * test.thickness_m) / engine.gravity_m_s2)
    n_cuts = 1 + max(0, math.ceil(math.log2((cut_slope.VERTICAL_DEG - test.least_deg) / test.tolerance_deg)))
    cuts_s = n_cuts * CUT_SHARE * STAND_SHARE * cut_slope.STAND_FALL_TIMES * cut_slope.fall_time_s(test, engine)
    return round(n * soil.n_spheres), (FILL_FALL_TIMES * fall_s + cuts_s) / time_step_s(soil, engine)
