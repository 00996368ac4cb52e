"""The draw-down test in a campaign: settings, responses and cost.

The test itself is `dem.experiments.draw_down`; `simulate` runs it as a job, `measure` reads the rate of its flow and its slopes.
"""

import math
from dataclasses import dataclass

from dem.experiments import draw_down
from virtual_soil.calibration.errors import CalibrationError
from virtual_soil.calibration.response import Response
from virtual_soil.campaign.experiments import apparatus
from virtual_soil.campaign.experiments.common import (
    PREPARED_WITH_ADHESION,
    USUAL_ANGLES_DEG,
    bulk_density,
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

NAME = "draw_down"
#: Nouns for one simulation, for several, and for the samples that each seed prepares.
NOUNS = ("draw-down", "draw-downs", "filled boxes")
#: True if studies that name no experiments have it.
BY_DEFAULT = False

RESPONSES = (
    Response(
        name="discharge_rate",
        column="discharge_rate_kg_s_m",
        unit="kg/(s m)",
        symbol="Q",
        table="draw_down",
        usual=(1e-5, 1e4),
        of_consequence=0.01,  # small, as it goes with the slot's width: a wider one wants its own in verify
        decisive_error=0.003,
    ),
    Response(
        name="draw_down_angle",
        column="draw_down_angle_deg",
        unit="deg",
        symbol="α",
        table="draw_down",
        bound_column="draw_down_bound_deg",
        maximum=90.0,
        usual=USUAL_ANGLES_DEG,
        of_consequence=3.0,
        decisive_error=1.0,
        sweep_form="log",
    ),
    bulk_density("box_bulk_density", "ρx", "draw_down"),
)
#: Column of the load of a simulation; None if a point has one simulation per seed.
LOAD = None
#: Quantity for the comparison of the accelerated test with the reference.
COMPARED = "discharge_rate_kg_s_m"
#: Tables that `measure.reduce` computes from the table of all runs.
REDUCED: tuple[str, ...] = ()
#: Stored table from which `measure.measured` computes the responses.
MEASURED_FROM = "history"

#: Keys of its section that act on measuring and on reducing, not on the simulations.
MEASURED_BY: tuple[str, ...] = ()
REDUCED_BY: tuple[str, ...] = ()
#: Entry of a soil file that `laboratory` reads: none, a laboratory states the numbers with its box.
LABORATORY = None

#: Settings of walls that may be design variables -> key of material that null stands for.
PROPERTIES: dict[str, str] = {}

#: Response of the bulk density -> measured solid fraction that it is the grains' density times, in simulations that count.
DENSITIES = {"box_bulk_density_kg_m3": "box_solid_fraction"}

#: True if bodies of the test turn, for which the engine has kernels of their own.
TURNING = False

#: Section that states the laboratory's apparatus (`experiments.apparatus`).
APPARATUS = "draw_down_test"

#: Default seeds of each stage: the rates of equal boxes differ by some 3 %, their slopes by 2 to 3 degrees (docs/decisions/12).
SEEDS = {"design": [1, 2], "check": [1], "refine": [1, 2], "verify": [101, 102, 103, 104, 105, 106]}

#: Status of the simulations that count.
SOUND = ("done",)

#: Time until the filled box is at rest, in free-fall times of the loose column; time until the flow has ended, over that of the
#: whole filling at Beverloo's rate; then of the slopes' coming to rest, in free-fall times of the filling; mean share of the grains
#: that is in the box meanwhile.
FILL_FALL_TIMES, FLOW_TIMES, REST_FALL_TIMES, SHARE_INSIDE = 2.0, 1.2, 8.0, 0.5


@dataclass(frozen=True, kw_only=True)
class Settings:
    """Draw-down: soil flows out of a flat-bottomed box through a slot in the middle of its floor."""

    slot_ratio: float = setting(
        "width of the slot in grain radii; draw_down_test.slot_width_m goes before it",
        20.0,
        minimum=2.0 * draw_down.LEAST_SLOT,
        note="narrower ones arch; grains that roll badly arch over 14 radii, too",
    )
    length_ratio: float = setting(
        "distance of the end walls in grain radii; draw_down_test.box_length_m goes before it",
        84.0,
        minimum=4.0 * draw_down.LEAST_FLOOR,
    )
    height_ratio: float = setting(
        "height of the filling in grain radii; draw_down_test.fill_height_m goes before it",
        40.0,
        minimum=2.0 * draw_down.LEAST_HEIGHT,
    )
    thickness_ratio: float = setting(
        "thickness of the simulated slice in grain radii, its period; draw_down_test.thickness_m goes before it",
        8.0,
        minimum=2.0 * draw_down.LEAST_THICKNESS,
    )
    preparation_friction_ratio: float = setting(
        "factor on the grains' friction while the box is filled",
        0.3,
        minimum=0,
        maximum=1,
        note="below 1 the filling is tamped; poured grains that roll badly are a house of cards and stand as walls",
    )
    prepared_with_adhesion: bool = PREPARED_WITH_ADHESION


@dataclass(frozen=True, kw_only=True)
class Fidelity:
    """Numerical fidelity of the draw-downs; the defaults are the campaign's."""

    draw_down_stiffness_number: float | None = setting(
        "E*/p of the softened grains in the draw-down test; null: no softening",
        20000.0,
        above=0,
        note="p: stress under the filling, and what adhesion adds.",
    )
    draw_down_time_step_rayleigh_ratio: float = setting(
        "time step over Rayleigh time in the draw-down test", 0.4, above=0, maximum=0.5, note="as in the angle-of-repose test"
    )


#: Further settings of the check points.
CHECK: dict[str, tuple] = {}
#: The paper's fidelity, where it differs.
REFERENCE = {"draw_down_stiffness_number": None, "draw_down_time_step_rayleigh_ratio": 0.2}


def as_printed(config: dict) -> bool:
    """False: the paper has no such test."""
    return False


def canonical(material: dict, config: dict) -> dict:
    """Return the simulated material of a point: its own, because the floor's glued grains do not turn."""
    return material


def gravity_m_s2(config: dict) -> float:
    """Gravity of the draw-downs: the laboratory's, else the engine's."""
    return apparatus.gravity_of(config, APPARATUS)


def setup(config: dict, row: dict) -> dict:
    """Return keyword arguments of the test's Setup and of the engine for one row of the design.

    Raises CalibrationError if the grains are too large for the box.
    """
    soil = soil_of(row, config)
    protocol = config[NAME] | {"scale_radius_m": scale_m(config, row)} | apparatus.draw_down_box(config, row)
    try:
        test = draw_down.Setup(**protocol)
        draw_down.check(soil, test)
    except ValueError as error:
        raise CalibrationError(f"{NAME}, {APPARATUS}: {error}") from None
    check_period(soil, test.thickness_m, f"{NAME}.thickness_ratio")
    gravity = gravity_m_s2(config)
    engine = engine_under_weight(config, row, test.height_m, gravity, "draw_down")
    return {"setup": protocol, "engine": engine, **grading_of(config), **shape_of(config)}


def cost(row: dict, settings: dict) -> tuple[int, float]:
    """Return the number of spheres and the expected steps of all of them: fall of the filling, then the flow of ever fewer."""
    soil, engine, test = soil_of(row, settings), engine_of(settings), draw_down.Setup(**settings["setup"])
    n = draw_down.n_grains(soil, test)
    fall_s = math.sqrt(2.0 * loose_column_m(soil, n, test.length_m * test.thickness_m) / engine.gravity_m_s2)
    flow_s = FLOW_TIMES * draw_down.flow_time_s(soil, test, engine) + REST_FALL_TIMES * draw_down.fall_time_s(test, engine)
    return round(n * soil.n_spheres), (FILL_FALL_TIMES * fall_s + SHARE_INSIDE * flow_s) / time_step_s(soil, engine)
