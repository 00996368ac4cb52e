"""Shared by the experiments of a campaign: soil and engine of a design row, and closed forms for their costs."""

from collections.abc import Callable
from typing import Any

from dem import stable_time_step
from dem.contact.model import ROLLING
from dem.experiments.soil import Engine, Soil
from dem.factory import SPACING_RATIO
from virtual_soil.calibration.errors import CalibrationError, demand
from virtual_soil.calibration.response import Response
from virtual_soil.campaign.experiments.grading import radii_of
from virtual_soil.campaign.experiments.shapes import clump_of, shape_of
from virtual_soil.campaign.settings import setting

#: Numbers of a design row that are a soil's, and those that describe its grains, their shape included.
SOIL_KEYS = tuple(name for name in Soil.__dataclass_fields__ if name != "shape")
MATERIAL_KEYS = (*SOIL_KEYS, "aspect_ratio")
#: Solid fraction of grains in tube and box.
SOLID_FRACTION = 0.57
#: Largest overlap over the radius with which a run is as it should be; beyond it the grains are too soft for what happens to them.
LARGEST_OVERLAP_RATIO = 0.05
#: Numbers that nobody need insist on: others are most often in another unit (kPa, MPa, radians).
USUAL_STRESSES_PA, USUAL_COHESIONS_PA, USUAL_ANGLES_DEG = (1.0, 5e6), (-1e5, 1e6), (1.0, 75.0)
#: Setting of all tests: whether grains stick while their sample is prepared.
PREPARED_WITH_ADHESION = setting(
    "grains stick while the sample is prepared, too",
    False,
    note="true: they pack the more loosely the more they stick, so that each normal stress shears another packing.",
)
#: Keys of the stresses in the settings of a shear test.
STRESSES = ("normal_stresses_pa", "normal_stress_ratios")
#: Cohesions closer than this fraction of the largest normal stress are one: no regression through the tests tells them apart.
RESOLVED_RATIO = 0.01
#: Duration of a consolidation under the lid: inertial times, and minimum number of steps.
CONSOLIDATION_TIMES, CONSOLIDATION_STEPS = 40.0, 5500
#: Least period of a box over the length of a clump, which the engine refuses to touch its own image.
LEAST_PERIOD = 1.25
#: Minimum of E*/p with grains that are not softened: overlaps of (p/E*)^(2/3) = 1 % of the radius.
LEAST_STIFFNESS = 1000.0


def bulk_density(name: str, symbol: str, table: str) -> Response:
    """Response of a bulk density; its error is the scatter over seeds."""
    return Response(
        name=name,
        column=f"{name}_kg_m3",
        unit="kg/m3",
        symbol=symbol,
        table=table,
        usual=(100.0, 1e4),
        of_consequence=30.0,
        decisive_error=10.0,
    )


def lid_stresses(usually: tuple[float, ...], note: str) -> Any:
    """Declare the stresses of a shear test in Pa; usually : those that null stands for where no cohesion says better."""
    listed = ", ".join(f"{stress:g}" for stress in usually)
    return setting(
        "stresses on the lid; null: half of the cohesion to five times, where grains may stick and a case asks for one, else "
        + listed,
        None,
        above=0,
        usual=USUAL_STRESSES_PA,
        of={"minItems": 3, "uniqueItems": True},
        note=note,
    )


def stress_ratios() -> Any:
    """Declare the stresses of a shear test in units of the grains' weight."""
    meaning = "stresses on the lid over rho g d of the point's grains, in place of normal_stresses_pa; null: normal_stresses_pa"
    return setting(meaning, None, above=0, of={"minItems": 3, "uniqueItems": True})


def normal_stresses_pa(
    section: dict, usually: tuple[float, ...], material: dict, gravity_m_s2: float, factor: float = 1.0
) -> list[float]:
    """Normal stresses in Pa on the grains of a point, to four digits: those of a shear test's settings.

    section : settings with `normal_stresses_pa` (None: `usually`), and `normal_stress_ratios` in their place if given; a stress of
    rho g d is the weight of a grain over its diameter squared, but for a factor of pi/6. factor : on the stresses in Pa.
    """
    ratios, stated = section["normal_stress_ratios"], section["normal_stresses_pa"] or usually
    weight = material["density_kg_m3"] * gravity_m_s2 * 2.0 * material["radius_m"]
    stresses = [factor * value for value in stated] if ratios is None else [weight * k for k in ratios]
    return [float(f"{value:.4g}") for value in stresses]


def soil_of(row: dict, settings: dict) -> Soil:
    """Return the virtual soil of a design row; settings : of the simulation, or the configuration of the study (grading, shape).

    Raises CalibrationError if the grains cannot have such radii.
    """
    soil = Soil(**{key: row[key] for key in SOIL_KEYS if key in row}, **radii_of(settings), shape=clump_of(row, settings))
    try:
        soil.sizes  # noqa: B018 (the engine refuses impossible ones)
    except ValueError as error:
        raise CalibrationError(f"grading: {error}") from None
    return soil


def engine_of(settings: dict) -> Engine:
    """Return the engine settings of a simulation."""
    return Engine(**settings["engine"])


def scale_m(config: dict, row: dict) -> float:
    """Reference radius of the geometry: the grain radius, or material.radius_m if the geometry is fixed."""
    return row["radius_m"] if config["design"]["geometry"] == "scaled" else config["material"]["radius_m"]


def sliding(material: dict, config: dict, wall_frictions: Callable[[dict, dict], tuple[float, float]]) -> dict:
    """Return the simulated material of a point: if grains can only slide, rolling friction is set to twice the static friction.

    The frictional torque at a contact is at most mu_s F_n R, and a law that brakes spins (type A) stops any spin that a torque of
    mu_r F_n R can stop. If mu_s < mu_r at all contacts, a grain at rest never starts to spin. Simulations that differ only in such
    a mu_r are therefore bitwise identical. At mu_s = mu_r they are not, because of rounding. Clumps turn by forces, too.
    wall_frictions(material, config) : static and rolling friction of the walls.
    """
    static = material["static_friction"]
    brakes = not ROLLING[config["engine"]["rolling_model"]].SEPARATE_SPINS
    if not brakes or material["rolling_friction"] <= static or shape_of(config):
        return material
    simulated = {**material, "rolling_friction": 2.0 * static}
    wall_static, wall_rolling = wall_frictions(simulated, config)
    return simulated if wall_static == 0.0 or wall_static < wall_rolling else material


def check_stiffness(soil: Soil, stress_pa: float, number: float | None, key: str) -> None:
    """Raise CalibrationError, naming the shear modulus that would do, if the grains are too soft for a stress.

    number : E*/p that softening aims at, the setting `key`; None: the grains are not softened, and LEAST_STIFFNESS is demanded.
    Softer grains than that overlap so much that they are no grains any more. Adhesion presses them as a stress does. On
    the smallest sphere of a clump forces press the more; it has LEAST_STIFFNESS, too.
    """
    wanted = LEAST_STIFFNESS if number is None else number
    wanted = max(wanted, min(wanted, LEAST_STIFFNESS) * soil.pressed_ratio)
    stress_pa += soil.contact_stress_pa
    least = wanted * stress_pa * (1.0 - soil.poisson_ratio)
    demand(
        soil.shear_modulus_pa >= least,
        "shear_modulus_pa",
        f"{soil.shear_modulus_pa:.3g}",
        f"at least {least:.3g}, so that E*/p is {wanted:g} under {stress_pa:.3g} Pa ({key})",
    )


def softening(soil: Soil, stress_pa: float, number: float | None) -> float:
    """By how much to soften the grains so that E* over the largest stress of a test is `number`; None leaves them as they are.

    Never stiffer than they are. Adhesion presses the grains as a stress does; of clumps the smallest sphere counts.
    """
    if number is None:
        return 1.0
    pressed = (stress_pa + soil.contact_stress_pa) * soil.pressed_ratio
    return max(1.0, soil.shear_modulus_pa / (1.0 - soil.poisson_ratio) / (number * pressed))


def engine_under_weight(config: dict, row: dict, height_m: float, gravity_m_s2: float, name: str) -> dict:
    """Return the engine of a test whose soil is height_m high and softened for its own weight.

    name : how the test's settings of a fidelity begin. Raises CalibrationError if the grains are too soft (`check_stiffness`).
    """
    fidelity, soil, key = config["fidelity"][row["fidelity"]], soil_of(row, config), f"{name}_stiffness_number"
    stress, number = SOLID_FRACTION * soil.density_kg_m3 * gravity_m_s2 * height_m, fidelity[key]
    check_stiffness(soil, stress, number, f"fidelity.{row['fidelity']}.{key}")
    return {
        **config["engine"],
        "gravity_m_s2": gravity_m_s2,
        "time_step_rayleigh_ratio": fidelity[f"{name}_time_step_rayleigh_ratio"],
        "stiffness_reduction": softening(soil, stress, number),
    }


def check_period(soil: Soil, period_m: float, key: str) -> None:
    """Raise CalibrationError, naming the setting `key` of a period, if grains of this shape could meet their own images in it."""
    length = 2.0 * soil.sizes.largest_m * soil.bounding_ratio
    least = LEAST_PERIOD * length
    if soil.shape is not None:
        sizes = f"{1e3 * period_m:.3g} mm with grains up to {1e3 * length:.3g} mm long"
        demand(period_m > least, key, sizes, f"more than {1e3 * least:.3g} mm, {LEAST_PERIOD:g} of their lengths")


def time_step_s(soil: Soil, engine: Engine) -> float:
    """Time step in s of a test with this soil."""
    return stable_time_step(soil.smallest_sphere_m, soil.softened(engine.stiffness_reduction), engine.time_step_rayleigh_ratio)


def loose_column_m(soil: Soil, n_grains: int, area_m2: float) -> float:
    """Height in m of the lattice of n grains over an area before they are dropped (see `dem.factory`)."""
    spacing = 2.0 * SPACING_RATIO * soil.sizes.largest_m * soil.bounding_ratio
    return n_grains * spacing**3 / area_m2


def filled_height_m(soil: Soil, n_grains: int, area_m2: float) -> float:
    """Height in m of n settled grains over an area."""
    return n_grains * soil.grain_volume_m3 / (SOLID_FRACTION * area_m2)
