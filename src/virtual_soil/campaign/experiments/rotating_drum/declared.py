"""The rotating drum in a campaign: settings, responses and cost.

The test itself is `dem.experiments.rotating_drum`; `simulate` runs it as a job, `measure` reads the angle of its surface.
"""

import math
from dataclasses import dataclass

from dem.experiments import rotating_drum
from virtual_soil.calibration.errors import CalibrationError, demand
from virtual_soil.calibration.response import Response
from virtual_soil.campaign.experiments import apparatus
from virtual_soil.campaign.experiments.common import (
    USUAL_ANGLES_DEG,
    check_period,
    engine_of,
    engine_under_weight,
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

NAME = "rotating_drum"
#: Nouns for one simulation, for several, and for the samples that each seed prepares.
NOUNS = ("drum", "drums", "filled drums")
#: True if studies that name no experiments have it.
BY_DEFAULT = False

RESPONSES = (
    Response(
        name="drum_angle",
        column="drum_angle_deg",
        unit="deg",
        symbol="θ",
        table="rotating_drum",
        maximum=90.0,
        usual=USUAL_ANGLES_DEG,
        of_consequence=3.0,
        decisive_error=1.0,
        sweep_form="log",
    ),
)
#: Column of the load of a simulation; None if a point has one simulation per seed.
LOAD = None
#: Quantity for the comparison of the accelerated test with the reference.
COMPARED = "drum_angle_deg"
#: Tables that `measure.reduce` computes from the table of all runs.
REDUCED: tuple[str, ...] = ()
#: Stored table from which `measure.measured` computes the responses.
MEASURED_FROM = "history"

#: Keys of its section that act on measuring and on reducing, not on the simulations.
MEASURED_BY = ("turns_before",)
REDUCED_BY: tuple[str, ...] = ()
#: Entry of a soil file that `laboratory` reads: none, a laboratory states the angle with its drum.
LABORATORY = None

#: Settings of walls that may be design variables -> key of material that null stands for.
PROPERTIES: dict[str, str] = {}

#: Response of the bulk density -> measured solid fraction that it is the grains' density times: none.
DENSITIES: dict[str, str] = {}

#: True if bodies of the test turn, for which the engine has kernels of their own.
TURNING = True

#: Section that states the laboratory's apparatus (`experiments.apparatus`).
APPARATUS = "drum_test"

#: Default seeds of each stage.
SEEDS = {"design": [1, 2], "check": [1], "refine": [1, 2], "verify": [101, 102, 103, 104]}

#: Status of the simulations that count.
SOUND = ("done",)

#: Time until the filled drum is at rest, in free-fall times across it.
FILL_FALL_TIMES = 6.0


@dataclass(frozen=True, kw_only=True)
class Settings:
    """Rotating drum: the surface of soil in a horizontal cylinder that turns."""

    diameter_ratio: float = setting(
        "diameter of the drum in grain radii; drum_test.diameter_m goes before it",
        60.0,
        minimum=2.0 * rotating_drum.LEAST_ACROSS,
        note="the shell is lined with grains",
    )
    thickness_ratio: float = setting(
        "thickness of the simulated slice in grain radii, its period; drum_test.thickness_m goes before it",
        8.0,
        minimum=2.0 * rotating_drum.LEAST_THICKNESS,
    )
    fill_ratio: float = setting(
        "share of the drum's volume that the soil fills; drum_test.fill_ratio goes before it",
        0.4,
        minimum=rotating_drum.FILLS[0],
        maximum=rotating_drum.FILLS[1],
    )
    froude_number: float = setting(
        "omega^2 R / g at which drum_angle_deg is measured; the rate of drum_test goes before it",
        0.01,
        above=0,
        maximum=rotating_drum.LARGEST_FROUDE,
        note="slow drums take long: the cost goes as 1 / sqrt(Fr)",
    )
    further_froude_numbers: list[float] = setting(
        "further ones that are tried in the same drum, for the report's curve",
        [0.05],
        above=0,
        maximum=rotating_drum.LARGEST_FROUDE,
        of={"uniqueItems": True},
    )
    turns: float = setting("turns at each Froude number", 1.5, above=0)
    turns_before: float = setting("turns at each Froude number before its angle is measured", 0.5, minimum=0)


@dataclass(frozen=True, kw_only=True)
class Fidelity:
    """Numerical fidelity of the drums; the defaults are the campaign's."""

    drum_stiffness_number: float | None = setting(
        "E*/p of the softened grains in the drum; null: no softening",
        20000.0,
        above=0,
        note="p: stress under the filling, and what adhesion adds.",
    )
    drum_time_step_rayleigh_ratio: float = setting(
        "time step over Rayleigh time in the drum", 0.4, above=0, maximum=0.5, note="as in the angle-of-repose test"
    )


#: Further settings of the check points.
CHECK: dict[str, tuple] = {}
#: The paper's fidelity, where it differs.
REFERENCE = {"drum_stiffness_number": None, "drum_time_step_rayleigh_ratio": 0.2}


def as_printed(config: dict) -> bool:
    """False: the paper has no such test."""
    return False


def canonical(material: dict, config: dict) -> dict:
    """Return the simulated material of a point: its own, because the lining's grains turn with the drum alone."""
    return material


def gravity_m_s2(config: dict) -> float:
    """Gravity of the drums: the laboratory's, else the engine's."""
    return apparatus.gravity_of(config, APPARATUS)


def setup(config: dict, row: dict) -> dict:
    """Return keyword arguments of the test's Setup and of the engine for one row of the design.

    The energy ledger is off: it does not book bodies that turn. Raises CalibrationError if the grains are too large for the drum,
    or if no turns are left to measure.
    """
    soil, section = soil_of(row, config), config[NAME]
    demand(section["turns_before"] < section["turns"], f"{NAME}.turns_before", section["turns_before"], f"less than {NAME}.turns")
    gravity = gravity_m_s2(config)
    own = {key: value for key, value in section.items() if key not in MEASURED_BY}
    protocol = own | {"scale_radius_m": scale_m(config, row)} | apparatus.drum(config, row, gravity)
    try:
        test = rotating_drum.Setup(**protocol)
        rotating_drum.check(soil, test)
    except ValueError as error:
        raise CalibrationError(f"{NAME}, {APPARATUS}: {error}") from None
    check_period(soil, test.thickness_m, f"{NAME}.thickness_ratio")
    engine = engine_under_weight(config, row, test.depth_m, gravity, "drum") | {"energy_ledger": False}
    return {"setup": protocol, "engine": engine, **grading_of(config), **shape_of(config)}


def cost(row: dict, settings: dict) -> tuple[int, float]:
    """Return the number of spheres, those of the lining included, and the expected steps: the filling, and all turns."""
    soil, engine, test = soil_of(row, settings), engine_of(settings), rotating_drum.Setup(**settings["setup"])
    turning_s = sum(test.turns * 2.0 * math.pi / rotating_drum.rate_rad_s(froude, test, engine) for froude in test.froude_numbers)
    seconds = FILL_FALL_TIMES * rotating_drum.fall_time_s(test, engine) + turning_s
    spheres = round(rotating_drum.n_grains(soil, test) * soil.n_spheres) + len(rotating_drum.lining(soil, test))
    return spheres, seconds / time_step_s(soil, engine)
