"""The angle-of-repose test in a campaign: settings, responses and cost.

The test itself is `dem.experiments.angle_of_repose`; `simulate` runs it as a job, `measure` evaluates its heaps.
"""

import math
from dataclasses import dataclass

from dem.experiments import angle_of_repose
from virtual_soil.calibration.response import Response
from virtual_soil.campaign.experiments import apparatus
from virtual_soil.campaign.experiments.common import (
    PREPARED_WITH_ADHESION,
    SOLID_FRACTION,
    USUAL_ANGLES_DEG,
    bulk_density,
    engine_of,
    engine_under_weight,
    filled_height_m,
    loose_column_m,
    scale_m,
    sliding,
    soil_of,
    time_step_s,
)
from virtual_soil.campaign.experiments.grading import grading_of
from virtual_soil.campaign.experiments.shapes import shape_of
from virtual_soil.campaign.experiments.unloaded import check_loads as check_loads
from virtual_soil.campaign.experiments.unloaded import floors as floors
from virtual_soil.campaign.experiments.unloaded import loads as loads
from virtual_soil.campaign.experiments.unloaded import strength as strength
from virtual_soil.campaign.settings import choice, defaults, setting

NAME = "repose"
#: Nouns for one simulation, for several, and for the samples that each seed prepares.
NOUNS = ("heap", "heaps", "heaps")
#: True if studies that name no experiments have it.
BY_DEFAULT = True

RESPONSES = (
    Response(
        name="angle_of_repose",
        column="angle_of_repose_deg",
        unit="deg",
        symbol="A",
        table="repose",
        bound_column="angle_bound_deg",
        maximum=90.0,
        usual=USUAL_ANGLES_DEG,
        of_consequence=2.0,
        decisive_error=0.3,
        sweep_form="log",
        scaling_error=0.4,  # docs/scaling.md, as the next
        slow_error=2.0,
    ),
    bulk_density("bulk_density", "ρb", "repose"),
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

#: Settings of walls that may be design variables -> key of material that null stands for.
PROPERTIES = {"wall_static_friction": "static_friction", "wall_rolling_friction": "rolling_friction"}

#: Response of the bulk density -> measured solid fraction that it is the grains' density times, in simulations that count.
DENSITIES = {"bulk_density_kg_m3": "poured_solid_fraction"}

#: True if bodies of the test turn, for which the engine has kernels of their own.
TURNING = False

#: Section that states the laboratory's apparatus (`experiments.apparatus`).
APPARATUS = "repose_test"

#: Default seeds of each stage.
SEEDS = {"design": [1, 2], "check": [1], "refine": [1, 2], "verify": [101, 102, 103, 104, 105, 106, 107, 108, 109, 110]}

#: Status of the simulations that count; the others enter no fit.
SOUND = ("static", "flat")

#: Time until the filled grains are at rest, in free-fall times of the loose column.
FILL_FALL_TIMES = 2.0
#: Time limit: lift over this number of heights of the filled column (loose packings are higher than expected), then this number of
#: its free-fall times. Slopes of rough grains without rolling friction creep longest, for some 140 of them.
LIFT_HEIGHTS, REST_FALL_TIMES = 1.3, 200.0


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
    max_time_s: float | None = setting(
        "upper bound of the simulated time from the start of the lift; null: none beside the time limit that follows from column "
        "height, lift speed and free fall",
        None,
        above=0,
        note="scales with the geometry, as the lift height does. A heap that still moves then has no angle; if the tube is not "
        "clear of it then, its simulation has failed.",
    )
    prepared_with_adhesion: bool = PREPARED_WITH_ADHESION
    estimator: str = choice("which estimator gives angle_of_repose_deg", "profile", ("profile", "silhouette"))


@dataclass(frozen=True, kw_only=True)
class Fidelity:
    """Numerical fidelity of the heaps; the defaults are the campaign's."""

    repose_stiffness_number: float | None = setting(
        "E*/p of the softened grains in the angle-of-repose test; null: no softening",
        20000.0,
        above=0,
        note="p: stress under the filled column. Overlaps at rest are about (p/E*)^(2/3) = 0.1 % of r, 2 to 3 % during impacts.",
    )
    repose_time_step_rayleigh_ratio: float = setting(
        "time step over Rayleigh time in the angle-of-repose test",
        0.4,
        above=0,
        maximum=0.5,
        note="From 0.1 to 0.4 T_R the angle changes by less than the scatter between seeds.",
    )
    lift_speed_m_s: float = setting(
        "speed at which the tube is lifted",
        5e-3,
        above=0,
        usual=(1e-5, 1.0),
        note="not accelerated: the angle depends strongly on it",
    )


#: Further settings of the check points.
CHECK: dict[str, tuple] = {}
#: The paper's fidelity, where it differs.
REFERENCE = {"repose_stiffness_number": None, "repose_time_step_rayleigh_ratio": 0.2}


def as_printed(config: dict) -> bool:
    """True if the protocol is the paper's, which the defaults are; plate and estimator do not matter."""
    same = ("n_particles", "tube_diameter_ratio", "wall_static_friction", "wall_rolling_friction")
    papers, speed = defaults(Settings), defaults(Fidelity)["lift_speed_m_s"]
    own = apparatus.is_stated(config["repose_test"])
    return not own and all(config[NAME][key] == papers[key] for key in same) and lift_speed_m_s(config, "campaign") == speed


def lift_speed_m_s(config: dict, fidelity: str) -> float:
    """Speed at which the tube is lifted: the laboratory's, else that of the fidelity."""
    stated = config["repose_test"]["lift_speed_m_s"]
    return config["fidelity"][fidelity]["lift_speed_m_s"] if stated is None else stated


def gravity_m_s2(config: dict) -> float:
    """Gravity of the heaps: the laboratory's, else the engine's."""
    return apparatus.gravity_of(config, APPARATUS)


def wall_frictions(material: dict, config: dict) -> tuple[float, float]:
    """Static and rolling friction of the walls that the grains touch: design variables, settings, or those between grains."""
    stated = config[NAME] | apparatus.frictions(config)
    settings = {name: material.get(name, stated[name]) for name in PROPERTIES}
    static, rolling = (material[PROPERTIES[name]] if value is None else value for name, value in settings.items())
    return max(static, stated.get("tube_static_friction", 0.0)), rolling


def canonical(material: dict, config: dict) -> dict:
    """Return the simulated material of a point: points with the same material share a simulation."""
    return sliding(material, config, wall_frictions)


def setup(config: dict, row: dict) -> dict:
    """Return keyword arguments of the test's Setup and of the engine for one row of the design.

    Time limit and softening follow from the filled column, so they are right for grains and tubes of any size.
    """
    soil = soil_of(row, config)
    protocol = {key: value for key, value in config[NAME].items() if key not in MEASURED_BY}
    own = apparatus.tube(config, row)
    scale, gravity, speed = scale_m(config, row), gravity_m_s2(config), lift_speed_m_s(config, row["fidelity"])
    protocol |= {"scale_radius_m": scale} | own | {name: row[name] for name in PROPERTIES if name in row}
    column = filled_height_m(
        soil, protocol["n_particles"], tube_area_m2(protocol["tube_diameter_ratio"], protocol["scale_radius_m"])
    )
    limit, cap = time_limit_s(column, speed, gravity), protocol["max_time_s"]
    grown = 1.0 if "scale_radius_m" in own else scale / config["material"]["radius_m"]
    protocol |= {"lift_speed_m_s": speed, "max_time_s": limit if cap is None else min(limit, cap * grown)}
    engine = engine_under_weight(config, row, column, gravity, "repose")
    return {"setup": protocol, "engine": engine, **grading_of(config), **shape_of(config)}


def flat_bound_deg(n_particles: int) -> float:
    """Angle in degrees of the lowest cone of n grains that has a slope: it is as high as `angle_of_repose.FLAT_HEIGHT_RATIO`.

    From the volume of the grains, n 4/3 pi r^3 / solid fraction = pi h^3 / (3 tan^2 A).
    """
    height = 2.0 * angle_of_repose.FLAT_HEIGHT_RATIO  # in grain radii
    return math.degrees(math.atan(math.sqrt(height**3 * SOLID_FRACTION / (4.0 * n_particles))))


def tube_area_m2(tube_diameter_ratio: float, scale_radius_m: float) -> float:
    """Cross-section of the tube in m2."""
    return math.pi * (tube_diameter_ratio * scale_radius_m) ** 2


def time_limit_s(column_m: float, lift_speed_m_s: float, gravity_m_s2: float) -> float:
    """Time in s from the start of the lift in which a heap of any soil comes to rest."""
    return LIFT_HEIGHTS * column_m / lift_speed_m_s + REST_FALL_TIMES * math.sqrt(2.0 * column_m / gravity_m_s2)


def cost(row: dict, settings: dict) -> tuple[int, float]:
    """Return the number of spheres and the expected steps: fall of the column, then lift of the tube over the filled height."""
    soil, engine = soil_of(row, settings), engine_of(settings)
    test = angle_of_repose.Setup(**settings["setup"])
    area = tube_area_m2(test.tube_diameter_ratio, test.scale_radius_m)
    fall_s = math.sqrt(2.0 * loose_column_m(soil, test.n_particles, area) / engine.gravity_m_s2)
    lift_s = min(filled_height_m(soil, test.n_particles, area) / test.lift_speed_m_s, test.max_time_s)
    return round(test.n_particles * soil.n_spheres), (FILL_FALL_TIMES * fall_s + lift_s) / time_step_s(soil, engine)
