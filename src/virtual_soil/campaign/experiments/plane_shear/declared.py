"""The plane shear test in a campaign: settings, responses and cost.

The test itself is `dem.experiments.plane_shear`; `simulate` runs it as a job, `measure` evaluates its curves by the definitions of
`dem.experiments.strength`, `mohr_coulomb` fits the strength lines through the tests of a point.
"""

from dataclasses import dataclass

from dem.experiments import plane_shear, specimen
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
    bulk_density,
    check_period,
    check_stiffness,
    engine_of,
    lid_stresses,
    normal_stresses_pa,
    scale_m,
    soil_of,
    stress_ratios,
    time_step_s,
)
from virtual_soil.campaign.experiments.grading import grading_of
from virtual_soil.campaign.experiments.shapes import shape_of
from virtual_soil.campaign.settings import setting

NAME = "plane_shear"
#: Nouns for one simulation, for several, and for the samples that each seed prepares.
NOUNS = ("plane shear test", "plane shear tests", "sheared beds")
#: True if studies that name no experiments have it.
BY_DEFAULT = True


def responses(state: str, scaling_error_deg: float) -> tuple[Response, Response]:
    """Cohesion and friction angle of one state of the soil, "peak" or "steady"; scaling_error_deg : that of the angle."""
    table = f"{state}_strength"
    return (
        Response(
            name=f"{state}_cohesion",
            column=f"{state}_cohesion_pa",
            unit="Pa",
            symbol=f"c {state}",
            table=table,
            error_column=f"{state}_cohesion_se_pa",
            usual=USUAL_COHESIONS_PA,
            signed=True,
            smallest_scale=10.0,  # as in the direct shear test
            of_consequence=20.0,
            decisive_error=5.0,
            scaling_error=0.0,  # a factor on all strengths adds no cohesion
        ),
        Response(
            name=f"{state}_friction_angle",
            column=f"{state}_friction_angle_deg",
            unit="deg",
            symbol=f"φ {state}",
            table=table,
            error_column=f"{state}_friction_angle_se_deg",
            maximum=90.0,
            usual=USUAL_ANGLES_DEG,
            of_consequence=2.0,
            decisive_error=0.5,
            scaling_error=scaling_error_deg,
        ),
    )


#: With the errors of scaling their angles (docs/scaling.md).
RESPONSES = (
    *responses("steady", 0.2),
    *responses("peak", 0.6),
    bulk_density("sheared_bulk_density", "ρb sheared", "plane_shear"),
)
#: Stresses on the lid in Pa, where neither the study, the soil nor a cohesion says others.
STRESSES_PA = (125.0, 250.0, 500.0, 1000.0)
#: Column of the load of a simulation.
LOAD = "normal_stress_pa"
#: Quantity for the comparison of the accelerated test with the reference.
COMPARED = "steady_stress_ratio"
#: Tables that `measure.reduce` computes from the table of all runs.
REDUCED = ("steady_strength", "peak_strength")
#: Stored table from which `measure.measured` computes the responses.
MEASURED_FROM = "history"

#: Keys of its section that act on measuring and on reducing, not on the simulations.
MEASURED_BY: tuple[str, ...] = ()
REDUCED_BY: tuple[str, ...] = ()
#: Entry of a soil file that `laboratory` reads: none yet.
LABORATORY = None

#: Settings of walls that may be design variables -> key of material that null stands for.
PROPERTIES: dict[str, str] = {}

#: Response of the bulk density -> measured solid fraction that it is the grains' density times, in simulations that count.
DENSITIES = {"sheared_bulk_density_kg_m3": "steady_solid_fraction"}

#: True if bodies of the test turn, for which the engine has kernels of their own.
TURNING = False

#: Section that states the laboratory's apparatus (`experiments.apparatus`).
APPARATUS = "shear_test"

#: Default seeds of each stage.
SEEDS = {"design": [1], "check": [1], "refine": [1, 2], "verify": [101, 102, 103, 104, 105]}

#: Status of the simulations that count; the others enter no fit.
SOUND = ("steady",)


@dataclass(frozen=True, kw_only=True)
class Settings:
    """Plane shear test: a bed without side walls is sheared between a rough floor and a rough lid until its strength is steady."""

    length_ratio: float = setting("length of the bed in grain radii, its period", 32.0, minimum=10)
    height_ratio: float = setting("nominal height of the bed in grain radii", 32.0, minimum=12)
    width_ratio: float = setting("width of the bed in grain radii, its period", 16.0, above=4.8)
    normal_stresses_pa: list[float] | None = lid_stresses(
        STRESSES_PA,
        "Every stress has a specimen of its own. Without gravity a bed has no scale, and one specimen under several stresses "
        "would be one and the same test.",
    )
    normal_stress_ratios: list[float] | None = stress_ratios()
    shear_strain: float = setting("shear strain at which the test ends if its strength is steady", 3.0, minimum=0.5)
    max_shear_strain: float = setting(
        "largest shear strain; a test that is not steady then enters no fit of the steady strength", 6.0, minimum=0.5
    )
    preparation_friction_ratio: float = setting(
        "factor on the grains' friction while the bed is prepared",
        0.3,
        minimum=0,
        maximum=1,
        note="Below 1 the bed is tamped, at 1 poured; the steady strength does not depend on it, the peak does.",
    )
    prepared_with_adhesion: bool = PREPARED_WITH_ADHESION


@dataclass(frozen=True, kw_only=True)
class Fidelity:
    """Numerical fidelity of the plane shear tests; the defaults are the campaign's."""

    plane_shear_stiffness_number: float | None = setting(
        "E*/p of the softened grains in the plane shear test; null: no softening", 5000.0, above=0, note="p: stress on the lid."
    )
    plane_shear_time_step_rayleigh_ratio: float = setting(
        "time step over Rayleigh time in the plane shear test", 0.3, above=0, maximum=0.5
    )
    plane_shear_inertial_number: float = setting("inertial number; determines the shear rate", 5e-3, above=0, maximum=0.1)


#: Further settings of the check points: the stresses are those of the direct shear test.
CHECK: dict[str, tuple] = {}
#: The paper's fidelity, where it differs.
REFERENCE = {
    "plane_shear_stiffness_number": None,
    "plane_shear_time_step_rayleigh_ratio": 0.2,
    "plane_shear_inertial_number": 2e-3,
}


def loads(config: dict, material: dict) -> list[float]:
    """Normal stresses in Pa of a point."""
    stated = apparatus.stresses_pa(config)
    return normal_stresses_pa(config[NAME], STRESSES_PA, material, config["engine"]["gravity_m_s2"]) if stated is None else stated


def check_loads(config: dict) -> list[float]:
    """Normal stresses in Pa of the check points."""
    return apparatus.check_stresses_pa(config)


def floors(config: dict) -> dict[str, float]:
    """Least scale of the errors of a response: the test resolves no smaller ones."""
    least = RESOLVED_RATIO * max(loads(config, config["material"]))
    return {response.name: least for response in RESPONSES if response.signed}


def strength(config: dict, response: str) -> str:
    """Which strength a response is: peak or steady, as its name says."""
    return response.partition("_")[0]


def as_printed(config: dict) -> bool:
    """False: the paper has no such test."""
    return False


def canonical(material: dict, config: dict) -> dict:
    """Return the simulated material of a point: its own. Whether points could share one, as in other tests, was not tried."""
    return material


def setup(config: dict, row: dict) -> dict:
    """Return keyword arguments of the test's Setup and of the engine for one row of the design."""
    fidelity = config["fidelity"][row["fidelity"]]
    protocol = {key: value for key, value in config[NAME].items() if key not in STRESSES}
    protocol |= {
        "scale_radius_m": scale_m(config, row),
        "inertial_number": fidelity["plane_shear_inertial_number"],
        "normal_stress_pa": row[LOAD],
    }
    least, largest = protocol["shear_strain"], protocol["max_shear_strain"]
    demand(least <= largest, f"{NAME}.max_shear_strain", largest, f"at least {NAME}.shear_strain, {least:g}")
    number, soil = fidelity["plane_shear_stiffness_number"], soil_of(row, config)
    for side in ("length", "width"):
        check_period(soil, protocol[f"{side}_ratio"] * protocol["scale_radius_m"], f"{NAME}.{side}_ratio")
    check_stiffness(soil, row[LOAD], number, f"fidelity.{row['fidelity']}.plane_shear_stiffness_number")
    engine = {
        **config["engine"],
        "time_step_rayleigh_ratio": fidelity["plane_shear_time_step_rayleigh_ratio"],
        "stiffness_reduction": specimen.stiffness_reduction(soil, plane_shear.Setup(**protocol), number, 0.0),
    }
    return {"setup": protocol, "engine": engine, **grading_of(config), **shape_of(config)}


def cost(row: dict, settings: dict) -> tuple[int, float]:
    """Return the number of spheres and the expected steps: consolidation, then the shear strain at which most tests are steady."""
    soil = soil_of(row, settings)
    step = time_step_s(soil, engine_of(settings))
    test = plane_shear.Setup(**settings["setup"])
    consolidation = max(CONSOLIDATION_STEPS, CONSOLIDATION_TIMES * specimen.inertial_time(soil, test) / step)
    strain_s = test.shear_strain / plane_shear.shear_rate(soil, test)
    return round(specimen.n_grains(soil, test) * soil.n_spheres), consolidation + strain_s / step
