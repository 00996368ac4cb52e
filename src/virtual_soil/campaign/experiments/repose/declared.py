"""The angle-of-repose test in a campaign: settings, responses and cost.

The test itself is `dem.experiments.angle_of_repose`; `simulate` runs it as a job, `measure` evaluates its heaps.
"""

import math
from dataclasses import dataclass

from dem.experiments import angle_of_repose
from virtual_soil.calibration.response import Response
from virtual_soil.campaign.experiments.common import (
    engine_of,
    filled_height_m,
    loose_column_m,
    scale_m,
    sliding,
    soil_of,
    time_step_s,
)
from virtual_soil.campaign.settings import choice, setting

NAME = "repose"
#: Nouns for one simulation, for several, and for the samples that each seed prepares.
NOUNS = ("heap", "heaps", "heaps")

RESPONSES = (
    Response(
        name="angle_of_repose",
        column="angle_of_repose_deg",
        unit="deg",
        symbol="A",
        table="repose",
        maximum=90.0,
        sweep_form="log",
    ),
)
#: Column of the load of a simulation; None if a point has one simulation per seed.
LOAD = None
#: Quantity for the comparison of the accelerated test with the reference.
COMPARED = "angle_of_repose_deg"
#: Tables that `measure.reduce` computes from the table of all runs.
REDUCED: tuple[str, ...] = ()
#: Stored table from which `measure.measured` computes the responses.
MEASURED_FROM = "after"

#: Keys of its section that act on measuring and on reducing, not on the simulations.
MEASURED_BY = ("estimator",)
REDUCED_BY: tuple[str, ...] = ()
#: Entry of a soil file that `laboratory` reads.
LABORATORY = "repose_csv"

#: Default seeds of each stage.
SEEDS = {"design": [1], "check": [1], "refine": [1, 2], "verify": [101, 102, 103, 104, 105]}

#: Time until the filled grains are at rest, in free-fall times of the loose column.
FILL_FALL_TIMES = 2.0


@dataclass(frozen=True, kw_only=True)
class Settings:
    """Angle-of-repose test: a tube filled with grains is lifted off a plate."""

    n_particles: int = setting("grains in the tube", 3000, minimum=50)
    tube_diameter_ratio: float = setting("inner diameter of the tube in grain diameters", 15.0, minimum=4)
    plate_half_width_ratio: float = setting(
        "half width of the square plate in grain radii", 80.0, above=0, note="grains that fall off its edge leave the simulation"
    )
    wall_static_friction: float | None = setting("static friction of tube and plate; null = as between grains", None, minimum=0)
    wall_rolling_friction: float | None = setting("rolling friction of tube and plate; null = as between grains", None, minimum=0)
    max_time_s: float = setting(
        "simulated time after which a heap is measured even if it still moves",
        0.7,
        above=0,
        note="the paper's; from the start of the lift; scales with the geometry, as the lift height does",
    )
    estimator: str = choice("which estimator gives angle_of_repose_deg", "profile", ("profile", "silhouette"))


@dataclass(frozen=True, kw_only=True)
class Fidelity:
    """Numerical fidelity of the heaps; the defaults are the campaign's."""

    repose_stiffness_reduction: float = setting(
        "divisor of the grains' shear modulus in the angle-of-repose test, at material.radius_m; smaller if the geometry grows "
        "with the grains",
        100.0,
        minimum=1,
        note="The stress under a 1.5 mm column is about 26 Pa. With G/100, E*/p > 2e4: overlaps at rest are about (p/E*)^(2/3) = "
        "0.1 % of r, 2 to 3 % during impacts. Heaps of 500 um with G/100 and mu_s = 1.2 became unstable during filling.",
    )
    repose_time_step_rayleigh_ratio: float = setting(
        "time step over Rayleigh time in the angle-of-repose test",
        0.4,
        above=0,
        maximum=0.5,
        note="From 0.1 to 0.4 T_R the angle changes by less than the scatter between seeds.",
    )
    lift_speed_m_s: float = setting(
        "speed at which the tube is lifted", 5e-3, above=0, note="not accelerated: the angle depends strongly on it"
    )


#: Further settings of the check points.
CHECK: dict[str, tuple] = {}
#: The paper's fidelity, where it differs.
REFERENCE = {"repose_stiffness_reduction": 1.0, "repose_time_step_rayleigh_ratio": 0.2}


def loads(config: dict) -> list[float]:
    """Loads of the campaign: none, so one simulation per seed."""
    return [math.nan]


def check_loads(config: dict) -> list[float]:
    """Loads of the check points."""
    return [math.nan]


def wall_frictions(material: dict, config: dict) -> tuple[float, float]:
    """Static and rolling friction of the walls that the grains touch."""
    section = config[NAME]
    return (
        material["static_friction"] if section["wall_static_friction"] is None else section["wall_static_friction"],
        material["rolling_friction"] if section["wall_rolling_friction"] is None else section["wall_rolling_friction"],
    )


def canonical(material: dict, config: dict) -> dict:
    """Return the simulated material of a point: points with the same material share a simulation."""
    return sliding(material, config, wall_frictions)


def setup(config: dict, row: dict) -> dict:
    """Return keyword arguments of the test's Setup and of the engine for one row of the design.

    The lift height scales with the geometry, and so does the time limit. The stress under the column scales as well, so the
    stiffness reduction decreases in proportion.
    """
    fidelity = config["fidelity"][row["fidelity"]]
    protocol = {key: value for key, value in config[NAME].items() if key not in MEASURED_BY}
    scale = scale_m(config, row)
    grown = scale / config["material"]["radius_m"]
    protocol |= {
        "scale_radius_m": scale,
        "lift_speed_m_s": fidelity["lift_speed_m_s"],
        "max_time_s": protocol["max_time_s"] * grown,
    }
    engine = {
        **config["engine"],
        "time_step_rayleigh_ratio": fidelity["repose_time_step_rayleigh_ratio"],
        "stiffness_reduction": softening(fidelity["repose_stiffness_reduction"], grown),
    }
    return {"setup": protocol, "engine": engine}


def softening(reduction: float, grown: float) -> float:
    """Stiffness reduction of a heap whose geometry is `grown` times the base's: inversely proportional to `grown` above 1.

    E*/(rho g r) is then identical for all radii from the base radius on. The result is between 1 (the grains' own stiffness) and
    `reduction`.
    """
    return max(1.0, reduction / max(1.0, grown))


def cost(row: dict, settings: dict) -> tuple[int, float]:
    """Return the number of grains and the expected steps: fall of the column, then lift of the tube over the filled height."""
    soil, engine = soil_of(row), engine_of(settings)
    test = angle_of_repose.Setup(**settings["setup"])
    area = math.pi * (test.tube_diameter_ratio * test.scale_radius_m) ** 2
    fall_s = math.sqrt(2.0 * loose_column_m(soil, test.n_particles, area) / engine.gravity_m_s2)
    lift_s = min(filled_height_m(soil, test.n_particles, area) / test.lift_speed_m_s, test.max_time_s)
    return test.n_particles, (FILL_FALL_TIMES * fall_s + lift_s) / time_step_s(soil, engine)
