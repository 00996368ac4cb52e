"""The direct-shear test in a campaign: settings, responses and cost.

The test itself is `dem.experiments.direct_shear`; `simulate` runs it as a job, `measure` evaluates its curves, `mohr_coulomb` fits
the strength line through the tests of a point.
"""

from dataclasses import dataclass

from dem.experiments import direct_shear, specimen
from dem.experiments.soil import Soil
from virtual_soil.calibration.errors import demand
from virtual_soil.calibration.response import Response
from virtual_soil.campaign.experiments import apparatus
from virtual_soil.campaign.experiments.common import (
    CONSOLIDATION_STEPS,
    CONSOLIDATION_TIMES,
    PREPARED_WITH_ADHESION,
    RESOLVED_RATIO,
    STRESSES,
    USUAL_ANGLES_DEG,
    USUAL_COHESIONS_PA,
    USUAL_STRESSES_PA,
    check_period,
    check_stiffness,
    engine_of,
    lid_stresses,
    normal_stresses_pa,
    scale_m,
    sliding,
    soil_of,
    stress_ratios,
    time_step_s,
)
from virtual_soil.campaign.experiments.grading import grading_of
from virtual_soil.campaign.experiments.shapes import shape_of
from virtual_soil.campaign.settings import choice, defaults, setting

NAME = "shear"
#: Nouns for one simulation, for several, and for the samples that each seed prepares.
NOUNS = ("shear test", "shear tests", "specimens")
#: True if studies that name no experiments have it.
BY_DEFAULT = False

RESPONSES = (
    Response(
        name="cohesion",
        column="cohesion_pa",
        unit="Pa",
        symbol="c",
        table="strength",
        error_column="cohesion_se_pa",
        usual=USUAL_COHESIONS_PA,
        signed=True,
        smallest_scale=10.0,  # dry sand has no cohesion, and shear tests cannot resolve a few Pa
        of_consequence=20.0,  # 2 % and 0.5 % of the largest normal stress of the default study
        decisive_error=5.0,
    ),
    Response(
        name="friction_angle",
        column="friction_angle_deg",
        unit="deg",
        symbol="φ",
        table="strength",
        error_column="friction_angle_se_deg",
        maximum=90.0,
        usual=USUAL_ANGLES_DEG,
        of_consequence=2.0,
        decisive_error=0.5,
    ),
    Response(
        name="curve_distance",
        column="curve_distance",
        unit="1",
        symbol="Δ(τ/σ)",
        table="shear",
        signed=True,  # its target is zero
        usual=(0.0, 2.0),
        of_consequence=0.02,
        decisive_error=0.01,
        optional=True,
    ),
)
#: Stresses on the lid in Pa, where neither the study, the soil nor a cohesion says others.
STRESSES_PA = (150.0, 250.0, 500.0, 1000.0)
#: Column of the load of a simulation.
LOAD = "normal_stress_pa"
#: Quantity for the comparison of the accelerated test with the reference.
COMPARED = "shear_stress_ratio"
#: Tables that `measure.reduce` computes from the table of all runs.
REDUCED = ("strength",)
#: Stored table from which `measure.measured` computes the responses.
MEASURED_FROM = "history"

#: Keys of its section that act on measuring and on reducing, not on the simulations.
MEASURED_BY = ("curve_range_m", "curve")
REDUCED_BY = ("strength", "normal_stress")
#: Entry of a soil file that `laboratory` reads.
LABORATORY = "direct_shear_csv"

#: Settings of walls that may be design variables -> key of material that null stands for.
PROPERTIES: dict[str, str] = {"frame_static_friction": "static_friction"}

#: Response of the bulk density -> measured solid fraction that it is the grains' density times, in simulations that count.
DENSITIES: dict[str, str] = {}

#: True if bodies of the test turn, for which the engine has kernels of their own.
TURNING = False

#: Section that states the laboratory's apparatus (`experiments.apparatus`).
APPARATUS = "shear_test"

#: Default seeds of each stage.
SEEDS = {"design": [1, 2], "check": [1, 2], "refine": [1, 2], "verify": [101, 102, 103, 104, 105]}

#: Least stress on the lid, in weights of the soil above the shear plane.
LEAST_LID_RATIO = 10.0

#: Status of the simulations that count; the others enter no fit.
SOUND = ("done",)


@dataclass(frozen=True, kw_only=True)
class Settings:
    """Direct-shear test: a periodic slice of soil is sheared in a split box under a loaded lid."""

    length_ratio: float = setting("box length in grain radii", 60.0, minimum=10)
    height_ratio: float = setting("nominal filling height in grain radii", 32.0, minimum=8)
    width_ratio: float = setting("thickness of the periodic slice in grain radii", 5.0, above=4.8)
    normal_stresses_pa: list[float] | None = lid_stresses(
        STRESSES_PA,
        "Below ten times the weight of the soil above the shear plane they are refused: arches would carry the lid.",
    )
    normal_stress_ratios: list[float] | None = stress_ratios()
    stresses: str = choice(
        "scaled: where the geometry scales with the grain radius, the stresses hold at material.radius_m and scale with it; fixed: "
        "they hold for all radii",
        "scaled",
        ("scaled", "fixed"),
    )
    displacement_ratio: float = setting("displacement of the lower frame in grain radii", 9.0, above=0)
    frame_static_friction: float = setting(
        "static friction of the side walls", 0.0, minimum=0, note="smooth: rough walls would carry the lid's load, as in a silo"
    )
    preparation_friction_ratio: float = setting(
        "factor on the grains' friction while the specimen is prepared",
        0.3,
        minimum=0,
        maximum=1,
        note="Below 1 the specimen is tamped, at 1 poured. Poured grains with high sliding and rolling friction form a loose "
        "structure (solid fraction 0.41) that collapses under the lid before it shears.",
    )
    curve_range_m: list[float] | None = setting(
        "displacements between which curve_distance compares a test with the laboratory's curve; null: all that both have",
        None,
        minimum=0,
        of={"minItems": 2, "maxItems": 2},
    )
    strength: str = choice("strength used for the Mohr-Coulomb line", "plateau", ("peak", "plateau"))
    normal_stress: str = choice(
        "normal stress used for the Mohr-Coulomb line",
        "plane",
        ("plane", "applied"),
        note="plane: measured on the shear plane; applied: load on the lid",
    )
    prepared_with_adhesion: bool = PREPARED_WITH_ADHESION


@dataclass(frozen=True, kw_only=True)
class Fidelity:
    """Numerical fidelity of the shear tests; the defaults are the campaign's."""

    shear_stiffness_number: float | None = setting(
        "E*/p of the softened grains in the shear test; null: no softening",
        5000.0,
        above=0,
        note="p: stress on the shear plane. Identical at every stress; mean overlaps are about 1 % of r.",
    )
    shear_time_step_rayleigh_ratio: float = setting(
        "time step over Rayleigh time in the shear test",
        0.3,
        above=0,
        maximum=0.5,
        note="Sheared specimens of very rough grains (mu_s = 1.7) overlap by several percent, which stiffens their contacts: at "
        "0.4 T_R some become unstable, at 0.3 T_R none.",
    )
    shear_inertial_number: float = setting(
        "inertial number of the shear band; determines the shear speed",
        5e-3,
        above=0,
        maximum=0.1,
        note="I = (U/h) d sqrt(rho/p), h = 10 d: below 1e-2 the strength changes by less than the scatter between seeds.",
    )


#: Further settings of the check points.
CHECK = {
    "normal_stresses_pa": (
        list[float],
        setting(
            "stresses on the lid at the check points",
            [500.0],
            above=0,
            usual=USUAL_STRESSES_PA,
            of={"minItems": 1, "uniqueItems": True},
        ),
    )
}
#: The paper's fidelity, where it differs.
REFERENCE = {"shear_stiffness_number": None, "shear_time_step_rayleigh_ratio": 0.2, "shear_inertial_number": 2e-3}


def loads(config: dict, material: dict) -> list[float]:
    """Normal stresses in Pa of a point; a box that grows with the grains is loaded in proportion."""
    stated = apparatus.stresses_pa(config)
    if stated is not None:
        return stated
    grows = config["design"]["geometry"] == "scaled" and config[NAME]["stresses"] == "scaled"
    factor = material["radius_m"] / config["material"]["radius_m"] if grows else 1.0
    return normal_stresses_pa(config[NAME], STRESSES_PA, material, config["engine"]["gravity_m_s2"], factor)


def check_loads(config: dict) -> list[float]:
    """Normal stresses in Pa of the check points."""
    return apparatus.check_stresses_pa(config)


def floors(config: dict) -> dict[str, float]:
    """Least scale of the errors of a response: the test resolves no smaller ones."""
    return {"cohesion": RESOLVED_RATIO * max(loads(config, config["material"]))}


def strength(config: dict, response: str) -> str:
    """Which strength a response is: peak or plateau, as configured."""
    return config[NAME]["strength"]


def as_printed(config: dict) -> bool:
    """True if the protocol is the paper's slice, which the defaults are; stresses and evaluation do not matter."""
    same = ("length_ratio", "height_ratio", "width_ratio", "displacement_ratio", "frame_static_friction")
    return not apparatus.is_stated(config["shear_test"]) and all(config[NAME][key] == defaults(Settings)[key] for key in same)


def wall_frictions(material: dict, config: dict) -> tuple[float, float]:
    """Static and rolling friction of the walls that the grains touch."""
    return material.get("frame_static_friction", config[NAME]["frame_static_friction"]), 0.0


def canonical(material: dict, config: dict) -> dict:
    """Return the simulated material of a point: points with the same material share a simulation."""
    return sliding(material, config, wall_frictions)


def setup(config: dict, row: dict) -> dict:
    """Return keyword arguments of the test's Setup and of the engine for one row of the design."""
    fidelity, not_simulated = config["fidelity"][row["fidelity"]], {*STRESSES, "stresses", *MEASURED_BY, *REDUCED_BY}
    protocol = {key: row.get(key, value) for key, value in config[NAME].items() if key not in not_simulated}
    protocol |= {
        "scale_radius_m": scale_m(config, row),
        "inertial_number": fidelity["shear_inertial_number"],
        "normal_stress_pa": row[LOAD],
        **apparatus.box(config, row),
    }
    engine = {**config["engine"], "time_step_rayleigh_ratio": fidelity["shear_time_step_rayleigh_ratio"]}
    number, gravity = fidelity["shear_stiffness_number"], engine["gravity_m_s2"]
    test, soil = direct_shear.Setup(**protocol), soil_of(row, config)
    check_lid(soil, test, gravity)
    check_period(soil, test.width_m, f"{NAME}.width_ratio")
    stress = specimen.plane_stress_pa(soil, test, gravity)
    check_stiffness(soil, stress, number, f"fidelity.{row['fidelity']}.shear_stiffness_number")
    return {
        "setup": protocol,
        "engine": engine | {"stiffness_reduction": specimen.stiffness_reduction(soil, test, number, gravity)},
        **grading_of(config),
        **shape_of(config),
    }


def check_lid(soil: Soil, test: direct_shear.Setup, gravity_m_s2: float) -> None:
    """Raise CalibrationError, naming the stress that would do, if the lid presses too little beside the soil's own weight."""
    weight = specimen.plane_stress_pa(soil, test, gravity_m_s2) - test.normal_stress_pa
    demand(
        test.normal_stress_pa >= LEAST_LID_RATIO * weight,
        "shear.normal_stresses_pa",
        f"{test.normal_stress_pa:.3g} Pa on grains of {1e6 * soil.radius_m:.3g} um",
        f"at least {LEAST_LID_RATIO * weight:.3g} Pa, {LEAST_LID_RATIO:g} times the weight of the soil above the shear plane",
    )


def cost(row: dict, settings: dict) -> tuple[int, float]:
    """Return the number of spheres and the expected steps: consolidation, then displacement of the lower frame."""
    soil = soil_of(row, settings)
    step = time_step_s(soil, engine_of(settings))
    test = direct_shear.Setup(**settings["setup"])
    n = specimen.n_grains(soil, test)
    consolidation = max(CONSOLIDATION_STEPS, CONSOLIDATION_TIMES * specimen.inertial_time(soil, test) / step)
    way_s = test.displacement_ratio * test.scale_radius_m / direct_shear.shear_speed(soil, test)
    return round(n * soil.n_spheres), consolidation + way_s / step
