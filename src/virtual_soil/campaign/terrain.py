"""Settings of wheel, plate and cone on a calibrated soil (targets `wheel`, `plate`, `cone`, `wheel_spread`, `check_wheel_soil`).

No calibration depends on them.
"""

from dataclasses import dataclass

from dem.experiments.wheel_setup import HELD, RIMS
from dem.meshes.files import UNITS
from virtual_soil.calibration.further import FURTHER_RATIO
from virtual_soil.campaign.experiments.apparatus import GRAVITY
from virtual_soil.campaign.experiments.common import USUAL_STRESSES_PA
from virtual_soil.campaign.settings import choice, section, setting


@dataclass(frozen=True, kw_only=True)
class Grousers:
    """Straight grousers on the rim."""

    count: int = setting("number of grousers; 0: a smooth wheel", 0, minimum=0, maximum=1000)
    height_m: float = setting("height above the rim", 0.005, above=0, usual=(1e-4, 0.2))
    thickness_m: float = setting("thickness along the rim", 0.002, above=0, usual=(1e-4, 0.1))


@dataclass(frozen=True, kw_only=True)
class WheelShape:
    """The wheel, its axle across the bed."""

    radius_m: float = setting("radius of the rim, to which slip and sinkage refer", 0.058, above=0, usual=(1e-3, 2.0))
    width_m: float = setting("width of the rim", 0.050, above=0, usual=(1e-3, 2.0))
    rim: str = choice(
        "smooth, or sandpaper: the soil's grains glued to the rim, their tops at radius_m; without grousers and mesh",
        "smooth",
        RIMS,
    )
    grousers: Grousers = section(Grousers)


@dataclass(frozen=True, kw_only=True)
class WheelMesh:
    """The wheel as a mesh, in place of the parametric one; its width and radius must be those of wheel.shape."""

    file: str | None = setting("STL, OBJ, PLY or STEP file of the wheel; null: the parametric wheel", None)
    unit: str = choice("unit of the file's coordinates", "mm", UNITS)
    axis: str = choice("axle of the wheel in the file, through its origin", "y", ("x", "y", "z"))


@dataclass(frozen=True, kw_only=True)
class SoilBed:
    """The bed, periodic along and across the travel; prepared once per case and seed, for wheel, plates and cone."""

    length_ratio: float = setting("length over the wheel's radius", 5.5, above=0, maximum=100)
    width_ratio: float = setting("width over the wheel's width", 3.4, above=0, maximum=100)
    depth_ratio: float = setting("nominal depth over the wheel's radius", 1.8, above=0, maximum=100)
    preparation_friction_ratio: float = setting(
        "factor on the grains' frictions while they settle: below 1 a denser bed, above a looser one", 1.0, minimum=0, maximum=10
    )
    bulk_density_kg_m3: float | None = setting(
        "bulk density of the beds: preparation_friction_ratio is found on columns of each case's soil; null: it is what is stated",
        None,
        above=0,
        usual=(100.0, 10e3),
        note="Over material.density_kg_m3 it is the solid fraction; one that the grains do not reach is refused with what they do.",
    )
    prepared_with_adhesion: bool = setting("grains stick while they settle, too", False)
    seeds: list[int] = setting("seeds of the beds of every case", [1, 2], minimum=0, of={"minItems": 1, "uniqueItems": True})


@dataclass(frozen=True, kw_only=True)
class MeasuredWheel:
    """Measurements of the wheel, to stand beside the runs."""

    file: str | None = setting(
        "CSV file: slip, load_n, and drawbar_pull_n, torque_n_m or sinkage_m, each with its *_sd_*, if known; null: none", None
    )
    source: str | None = setting("where the file's numbers come from, for the page", None)


@dataclass(frozen=True, kw_only=True)
class MeasuredPlates:
    """Measurements of plates, to stand beside the tests."""

    file: str | None = setting("CSV file: diameter_m, sinkage_m, pressure_pa, and pressure_sd_pa, if known; null: none", None)
    source: str | None = setting("where the file's numbers come from, for the page", None)
    compared_m: list[float] = setting(
        "lowest and highest sinkage at which pressures have a verdict",
        [0.010, 0.020],
        minimum=0,
        usual=(0.0, 1.0),
        of={"minItems": 2, "maxItems": 2},
    )


@dataclass(frozen=True, kw_only=True)
class Handbook:
    """The handbook's rigid wheel (Wong & Reece 1967), a line beside the runs."""

    internal_friction_angle_deg: float | None = setting(
        "angle of internal friction of the soil; null: no line", None, minimum=0, below=90
    )
    cohesion_pa: float = setting("cohesion of the soil", 0.0, minimum=0, usual=(0.0, 1e6))
    shear_displacement_m: float = setting(
        "shear displacement K at which 63 % of the strength is mobilised", 0.01, above=0, usual=(1e-4, 0.2)
    )
    plates: str = choice(
        "plates whose law p = k z^n it takes, of the diameter nearest to the wheel's width: measured or simulated ones",
        "measured",
        ("measured", "simulated"),
    )


@dataclass(frozen=True, kw_only=True)
class Wheel:
    """A wheel on the calibrated soil (targets `wheel`, `plate`, `cone`): bed and wheel. Not part of `all`."""

    cases: list[str] = setting(
        "cases of optimise.cases whose optimum the wheel runs on; empty: all of them",
        [],
        of={"uniqueItems": True, "items": {"type": "string"}},
    )
    shape: WheelShape = section(WheelShape)
    mesh: WheelMesh = section(WheelMesh)
    load_n: float = setting("load on the axle, the wheel's weight included", 24.5, above=0, usual=(1e-3, 1e5))
    mass_kg: float | None = setting("inertia along the vertical; null: load over gravity", None, above=0, usual=(1e-4, 1e4))
    gravity_m_s2: float | None = setting(
        "gravity of bed and tools: a number, or earth, moon, mars; null: engine.gravity_m_s2", None, of=GRAVITY
    )
    slips: list[float] = setting(
        "slips, one run each on every bed: -1 locked, 0 rolling, towards 1 spinning on the spot",
        [-0.2, 0.0, 0.1, 0.23, 0.5, 0.75],
        minimum=-1,
        below=1,
        of={"minItems": 1, "uniqueItems": True},
    )
    held: str = choice(
        "travel: the axle's speed, the rim's follows from the slip; rim: the other way round; free: the rim's speed, and the axle "
        "travels against drawbar_load_n (slips are not used)",
        "travel",
        HELD,
    )
    drawbar_load_n: float = setting("load that a free wheel pulls; 0 unless held is free", 0.0, usual=(-1e5, 1e5))
    speed_m_s: float = setting("speed that is held", 0.1, above=0, usual=(1e-4, 2.0))
    travel_ratio: float = setting("travel over the wheel's radius; means are taken over its last 40 %", 2.2, above=0, maximum=100)
    grains_per_radius: float = setting(
        "wheel's radius over the mean grain diameter",
        14.5,
        minimum=5,
        maximum=200,
        note="Calibrated grains are mostly too small to fill a bed: frictions and adhesive stress are theirs, the radius is not.",
    )
    bed: SoilBed = section(SoilBed)
    wheel_static_friction: float = setting("coefficient of static friction between grains and wheel", 0.5, minimum=0, maximum=3)
    wheel_rolling_friction: float | None = setting(
        "coefficient of rolling friction of grains on the wheel; null: as on each other",
        None,
        minimum=0,
        maximum=3,
        note="Spheres can roll along a smooth rim, and then less than its friction acts; 1: they slide.",
    )
    shear_modulus_pa: float | None = setting(
        "shear modulus of the grains under the tools, softer than the solid's; null: the soil's own",
        2e7,
        above=0,
        usual=(1e4, 1e12),
        note="E* should be 2000 times the mean pressure load / (1.2 radius width); the log warns below.",
    )
    time_step_rayleigh_ratio: float = setting("time step over the Rayleigh time of the smallest grain", 0.35, above=0, maximum=0.8)
    measured: MeasuredWheel = section(MeasuredWheel)
    handbook: Handbook = section(Handbook)


@dataclass(frozen=True, kw_only=True)
class Plate:
    """Round plates pressed into the beds of wheel.bed (target `plate`)."""

    diameters_m: list[float] = setting(
        "diameters, one test each on every bed; empty: no plates",
        [0.06, 0.08, 0.10],
        above=0,
        usual=(1e-3, 2.0),
        of={"uniqueItems": True},
    )
    depth_m: float = setting("sinkage below the bed's surface at which the test ends", 0.025, above=0, usual=(1e-4, 1.0))
    speed_m_s: float = setting("speed of the plate", 0.03, above=0, usual=(1e-4, 1.0))
    static_friction: float = setting("coefficient of static friction between grains and plate", 0.5, minimum=0, maximum=3)
    measured: MeasuredPlates = section(MeasuredPlates)


@dataclass(frozen=True, kw_only=True)
class Cone:
    """A cone pushed into the beds of wheel.bed (target `cone`)."""

    base_area_m2: float | None = setting("area of the base; null: no cone", 323e-6, above=0, usual=(1e-6, 0.1))
    angle_deg: float = setting("angle at the tip, between opposite flanks", 60.0, minimum=10, maximum=150)
    depth_m: float = setting("depth of the base below the bed's surface at which the test ends", 0.05, above=0, usual=(1e-4, 2.0))
    speed_m_s: float = setting("speed of the cone", 0.03, above=0, usual=(1e-4, 1.0))
    static_friction: float = setting("coefficient of static friction between grains and cone", 0.5, minimum=0, maximum=3)


@dataclass(frozen=True, kw_only=True)
class WheelSpread:
    """Does it matter under the wheel which of the equivalent soils is taken (target `wheel_spread`)? Wheel, bed: as `wheel`."""

    slip: float = setting("slip of all runs", 0.3, minimum=-1, below=1)
    optimum_seeds: list[int] = setting(
        "seeds of the beds of the optimum: the noise", [1, 2, 3, 4, 5], minimum=0, of={"minItems": 2, "uniqueItems": True}
    )
    soils: int = setting("number of sets of equivalents.parquet, the farthest apart in what acts under the wheel", 8, minimum=2)
    soil_seeds: list[int] = setting("seeds of the beds of each of them", [1, 2], minimum=0, of={"minItems": 1, "uniqueItems": True})
    plate_diameter_m: float | None = setting(
        "plate that is pressed into every bed, as a further measurement; null: none", 0.06, above=0, usual=(1e-3, 2.0)
    )
    plate_sinkage_m: float = setting("sinkage at which its pressure counts", 0.010, above=0, usual=(1e-4, 1.0))
    measured_ratio: float = setting(
        "standard uncertainty of a further measurement over its value", FURTHER_RATIO, above=0, maximum=1
    )


@dataclass(frozen=True, kw_only=True)
class WheelCheck:
    """Is the soil of coarser, softer grains still the calibrated one (target `check_wheel_soil`)? Wheel, bed, cases: as `wheel`.

    A run with one changed setting beside a run of `wheel` as it is, on each bed; null: not run.
    """

    slip: float = setting("slip of all runs", 0.3, minimum=-1, below=1)
    bed_seeds: list[int] = setting(
        "seeds of the beds, a pair of runs each; two or more measure the scatter of beds",
        [1, 2],
        minimum=0,
        of={"minItems": 1, "uniqueItems": True},
    )
    finer_grains_factor: float | None = setting("factor on wheel.grains_per_radius", 1.35, above=1, maximum=4)
    speed_factor: float | None = setting("factor on wheel.speed_m_s", 0.5, above=0, below=1)
    stiffness_factor: float | None = setting("factor on wheel.shear_modulus_pa", 2.0, above=1, maximum=1000)
    width_factor: float | None = setting("factor on wheel.bed.width_ratio", 1.5, above=1, maximum=10)
    wheel_static_friction: float | None = setting("in place of wheel.wheel_static_friction", 1.0, minimum=0, maximum=3)
    wheel_rolling_friction: float | None = setting("in place of wheel.wheel_rolling_friction", 1.0, minimum=0, maximum=3)
    test_seeds: list[int] = setting(
        "seeds of the calibration's own tests, repeated with the wheel's grains",
        [1, 2, 3, 4, 5, 6, 7, 8],
        minimum=0,
        of={"minItems": 3, "uniqueItems": True},
    )
    normal_stresses_pa: list[float] | None = setting(
        "normal stresses of the shear tests; null: 3/4, 1 and 3/2 of load / (1.2 radius width), the mean pressure under the wheel",
        None,
        above=0,
        usual=USUAL_STRESSES_PA,
        of={"minItems": 3, "uniqueItems": True},
    )
    drawbar_ratio_limit: float = setting("difference of the drawbar pull over the load that matters", 0.02, above=0)
    traction_coefficient_limit: float = setting("difference of the torque over load and radius that matters", 0.02, above=0)
    sinkage_limit_ratio: float = setting("difference of the sinkage, over the sinkage, that matters", 0.1, above=0)
