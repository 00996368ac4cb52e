"""Settings of a study: the sections of the configuration that are not specific to an experiment, and the complete study."""

from dataclasses import dataclass

from dem.contact.model import DAMPING_MODELS, NORMAL, ROLLING, TANGENTIAL
from virtual_soil.campaign.experiments.apparatus import GRAVITY, SECTIONS
from virtual_soil.campaign.experiments.grading import Grading
from virtual_soil.campaign.experiments.registry import BY_DEFAULT, EXPERIMENTS, RESPONSES, responses_of
from virtual_soil.campaign.settings import NAMES, choice, make, section, setting
from virtual_soil.campaign.terrain import Cone, Plate, Wheel, WheelCheck, WheelSpread

#: Schema of a list of seeds.
SEED_LIST = {"minItems": 1, "uniqueItems": True}


def seeds(stage: str) -> dict:
    """Fields of the seeds of every experiment in a stage."""
    return {
        f"{experiment.NAME}_seeds": (
            list[int],
            setting(f"seeds of every {experiment.NOUNS[0]}", experiment.SEEDS[stage], minimum=0, of=SEED_LIST),
        )
        for experiment in EXPERIMENTS
    }


#: Schema of a shape, or of a list of shapes with their shares.
SHAPES = {
    "type": ["string", "array"],
    "minItems": 1,
    "items": {
        "type": "object",
        "additionalProperties": False,
        "required": ["shape", "share"],
        "description": "a shape and its share, {shape: dimer, share: 0.3}",
        "properties": {
            "shape": {"type": "string", "description": "sphere, dimer, trimer, tetra, or a file"},
            "share": {"type": "number", "minimum": 0, "description": "share of this shape in the number of grains"},
        },
    },
}


@dataclass(frozen=True, kw_only=True)
class Material:
    """The grains, unless the design varies them: the paper's base set (Briend et al. 2011, "Sensitivity analysis")."""

    shape: str = setting(
        "of the grains: sphere, dimer, trimer, tetra, or a file with a line x y z r for every sphere; or a list of such shapes "
        "with their shares of the number of grains, [{shape: sphere, share: 0.7}, {shape: dimer, share: 0.3}]",
        "sphere",
        note="Clumps are rigid unions of spheres; radii are those of the spheres of equal volume. Their shape stands in for "
        "rolling friction, so rolling_friction is usually 0 with them.",
        of=SHAPES,
    )
    aspect_ratio: float | None = setting("length over width of the dimers; null: 1.5, or no dimers", None, above=1, maximum=2)
    radius_m: float = setting("mean grain radius", 50e-6, above=0, usual=(1e-6, 0.1))
    radius_sd_ratio: float = setting(
        "standard deviation of the radii over their mean; 0 = equal spheres", 0.0, minimum=0, maximum=0.4
    )
    density_kg_m3: float = setting("density of the grains' solid", 3000.0, above=0, usual=(100.0, 25e3))
    poisson_ratio: float = setting("Poisson's ratio of the grains' solid", 0.2, above=-1, below=0.5)
    shear_modulus_pa: float = setting("shear modulus of the grains' solid", 5e7, above=0, usual=(1e4, 1e12))
    static_friction: float = setting("coefficient of static friction between grains", 0.3, minimum=0, usual=(0.0, 3.0))
    rolling_friction: float = setting("coefficient of rolling friction between grains", 0.1, minimum=0, usual=(0.0, 3.0))
    restitution: float = setting("coefficient of restitution", 0.5, above=0, maximum=1)
    adhesive_stress_pa: float = setting(
        "adhesion between grains: pull-off force of two mean grains over their diameter squared",
        0.0,
        minimum=0,
        usual=(0.0, 1e6),
        note="Cohesion is 0.3 to 0.5 of it, whatever the radius. Grains stick to plate, lid and floor, not to tube and frames.",
    )


GRID = {"static_friction": [0.0, 0.1, 0.3, 0.5, 0.9, 1.3, 1.7], "rolling_friction": [0.0, 0.05, 0.1, 0.2, 0.3]}
COUPLES = [{"static_friction": 0.3, "rolling_friction": 0.1}, {"static_friction": 0.9, "rolling_friction": 0.2}]
CHECK_COUPLES = [{"static_friction": 0.3, "rolling_friction": 0.1}]
LEVELS = {"type": "array", "minItems": 1, "uniqueItems": True}
RANGE = {"type": "array", "minItems": 2, "maxItems": 2, "items": {"type": "number"}}
COUPLE = {"type": "object", "additionalProperties": {"type": "number", "minimum": 0}, "minProperties": 1}

Design = make(
    "Design",
    "The simulated points: a full factorial of the grid variables, and sweeps of others at constant couples of the grid variables; "
    "or points that fill the box of the variables.",
    {
        "variables": (
            list[str],
            setting(
                "what the optimiser may change, material keys or wall frictions; as names: a factorial of grid and sweep; as "
                "ranges, {static_friction: [0.1, 1.0]}: points that fill the box",
                ["radius_m", "static_friction", "rolling_friction"],
                note="All else stays at its value in material. Entries of grid and sweep that are no variables are ignored.",
                of={
                    "type": ["array", "object"],
                    "minItems": 1,
                    "minProperties": 1,
                    "uniqueItems": True,
                    "additionalProperties": RANGE,
                },
            ),
        ),
        "n_points": (
            int | None,
            setting("number of points that fill the box; null: 16 for every variable", None, minimum=4, maximum=4096),
        ),
        "points_csv": (
            str | None,
            setting("file of points in place of those that fill the box: CSV with a column for every variable; null: none", None),
        ),
        "grid": (
            dict[str, list[float]],
            setting(
                "values of the full factorial at material.radius_m; fits f",
                GRID,
                of={"minProperties": 1, "additionalProperties": {**LEVELS, "items": {"type": "number", "minimum": 0}}},
            ),
        ),
        "sweep": (
            dict[str, list[float]],
            setting(
                "values of each variable swept alone; fits g",
                {"radius_m": [25e-6, 50e-6, 100e-6, 200e-6, 500e-6]},
                of={"additionalProperties": {**LEVELS, "items": {"type": "number", "exclusiveMinimum": 0}}},
            ),
        ),
        "sweep_couples": (
            list[dict[str, float]],
            setting(
                "values of the grid variables at which the sweep is run",
                COUPLES,
                note="the paper does not print its couples; these span weak to strong",
                of={"minItems": 1, "items": COUPLE},
            ),
        ),
        "geometry": (
            str,
            choice(
                "scaled: tube and box scale with the grain radius; fixed: they have the size for material.radius_m",
                "scaled",
                ("scaled", "fixed"),
                note="with fixed, 3 grains of 500 um would fill the tube",
            ),
        ),
        **seeds("design"),
    },
)


@dataclass(frozen=True, kw_only=True)
class Screening:
    """Screening of the grain parameters (the paper's Table 2): one changed at a time."""

    response: str = choice("screened response", "angle_of_repose", RESPONSES)
    base_seeds: list[int] = setting(
        "seeds at the base set, at least two: the scatter between seeds is the noise of the surrogates",
        [1, 2, 3, 4, 5],
        minimum=0,
        of={"minItems": 2, "uniqueItems": True},
    )
    changed_seeds: list[int] = setting("seeds at every changed set", [1, 2, 3], minimum=0, of=SEED_LIST)
    factors: dict[str, float] = setting(
        "material key -> factor on its value; the product is rounded to four digits",
        {
            "radius_m": 2.0,
            "density_kg_m3": 1.3333,
            "poisson_ratio": 2.0,
            "shear_modulus_pa": 1.4,
            "static_friction": 1.6667,
            "rolling_friction": 2.0,
            "restitution": 0.6,
        },
        above=0,
    )


Check = make(
    "Check",
    "Points that are simulated at both fidelities; the report compares the bias with the scatter between seeds.",
    {
        "couples": (
            list[dict[str, float]],
            setting("points simulated at both fidelities; may be empty", CHECK_COUPLES, of={"items": COUPLE}),
        ),
        **seeds("check"),
        **{name: entry for experiment in EXPERIMENTS for name, entry in experiment.CHECK.items()},
    },
)


def fidelity_fields() -> dict:
    """Fields of a fidelity: those of every experiment."""
    return {
        name: (experiment.Fidelity.__annotations__[name], field)
        for experiment in reversed(EXPERIMENTS)
        for name, field in experiment.Fidelity.__dataclass_fields__.items()
    }


FidelityOfAll = make("FidelityOfAll", "Numerical fidelity of all experiments.", fidelity_fields())
REFERENCE = {key: value for experiment in EXPERIMENTS for key, value in experiment.REFERENCE.items()}


@dataclass(frozen=True, kw_only=True)
class Fidelity:
    """Numerical fidelity of the simulations."""

    campaign: FidelityOfAll = section(FidelityOfAll, "Fidelity of every simulation, except the reference.")  # type: ignore[valid-type]
    reference: FidelityOfAll = section(FidelityOfAll, "The paper's fidelity, used only at the check points.", **REFERENCE)  # type: ignore[valid-type]
    check: Check = section(Check)  # type: ignore[valid-type]


#: Laws of adhesion that need no more than an adhesive stress.
STICKY = [name for name, law in NORMAL.items() if set(law.PROPERTIES) == {"restitution", "work_of_adhesion_j_m2"}]


@dataclass(frozen=True, kw_only=True)
class Engine:
    """Numerical settings common to all experiments; the names are those of `dem.Simulation`."""

    rolling_model: str = choice("type_a: EDEM's; type_c: elastic-plastic", "type_a", ROLLING)
    damping_model: str = choice(
        "edem: the contact force may become attractive during rebound; no_pull: it never does; both have restitution e",
        "edem",
        DAMPING_MODELS,
    )
    tangential_model: str = choice(
        "edem: spring and dashpot together obey Coulomb's limit; liggghts: the spring alone does, as in LIGGGHTS",
        "edem",
        TANGENTIAL,
    )
    adhesion: str = choice(
        "law of grains with adhesive_stress_pa; constant: pull-off force while they touch (DMT); jkr: until they are torn off",
        "constant",
        STICKY,
    )
    precision: str = choice(
        "precision of the contact arithmetic",
        "float32",
        ("float32", "float64"),
        note="positions are always float64, velocities have at least 48 bits",
    )
    energy_ledger: bool = setting(
        "record the energy balance of every step (energy_dissipated_j, energy_residual_ratio in the tables); several times slower",
        False,
    )
    vector_code: bool = setting("explicit vector code for the main kernels; false: plain numba, identical within rounding", True)
    gravity_m_s2: float = setting(
        "gravitational acceleration: a number, or earth, moon, mars",
        9.81,
        usual=(0.1, 1000.0),
        of=GRAVITY | {"type": ["number", "string"]},
    )


@dataclass(frozen=True, kw_only=True)
class Form:
    """The surrogate of one response."""

    f: str = choice("polynomial of total degree two in the grid variables", "quadratic", ("quadratic",))
    g: str = choice("dependence on each sweep variable x/x0: a + b x + c x^2, or 1 - b ln x", "quadratic", ("quadratic", "log"))
    model: str = choice(
        "surrogate that the optimiser uses; best: the one with the smaller leave-one-out error",
        "best",
        ("best", "quadratic", "gaussian_process"),
    )


Surrogates = make(
    "Surrogates",
    "f and g: the paper's polynomials (Equation 3), always fitted; model: the surrogate that the optimiser uses.",
    {name: (Form, section(Form, g=response.sweep_form)) for name, response in RESPONSES.items()},
)

#: Name of the cost term that prefers large grains (the paper's phi4).
LARGE_GRAINS = "large_grains"
TERMS = sorted([*RESPONSES, LARGE_GRAINS])
#: Those of a study that names no experiments.
USUAL_TERMS = sorted([*responses_of(BY_DEFAULT), LARGE_GRAINS])
#: What the paper's soils have targets for.
EQUAL = dict.fromkeys(("angle_of_repose", "steady_cohesion", "steady_friction_angle"), 1.0)
WEIGHTS = {
    "type": "object",
    "additionalProperties": False,
    "minProperties": 1,
    "properties": {name: {"type": "number", "minimum": 0} for name in TERMS},
}


@dataclass(frozen=True, kw_only=True)
class Optimise:
    """The search for grain parameters."""

    cases: list[dict] = setting(
        "cases to calibrate: name, soil, and weights of responses and of large grains; what has no weight, or 0, is left out",
        [
            {"case": "sand", "soil": "silica_barco_sand", "weights": EQUAL},
            {"case": "regolith", "soil": "lunar_regolith", "weights": EQUAL},
        ],
        of={
            "minItems": 1,
            "items": {
                "type": "object",
                "additionalProperties": False,
                "required": ["case", "soil", "weights"],
                "properties": {
                    "case": {**NAMES, "description": "name of the case and of its export folder: letters, digits, - and _"},
                    "soil": {"type": "string", "description": "one of soils"},
                    "weights": WEIGHTS,
                },
            },
        },
    )
    errors: str = choice(
        "combined: errors in units of the combined standard uncertainty of target and surrogate; relative: over the target, as in "
        "the paper",
        "combined",
        ("combined", "relative"),
    )
    tolerance: float = setting("the paper's epsilon on |dx|, x = (r in um, mu_s, mu_r)", 1e-3, above=0)
    max_iterations: int = setting("maximum number of Gauss-Newton iterations", 500, minimum=1)
    n_starts: int = setting("number of initial guesses", 32, minimum=1)
    unreachable: str = choice(
        "unreachable target: nearest: use the nearest reachable value; as_given: use the target itself, as the paper does",
        "nearest",
        ("nearest", "as_given"),
    )


@dataclass(frozen=True, kw_only=True)
class Uncertainty:
    """Uncertainty of the calibration."""

    target_uncertainty_ratio: float = setting(
        "relative standard uncertainty of a target if the soil file states none", 0.05, above=0, maximum=1
    )
    n_samples: int = setting("number of stored posterior samples per case", 1000, minimum=100, maximum=28800)
    n_equivalents: int = setting("number of stored equivalent parameter sets per case", 30, minimum=1)


Refine = make(
    "Refine",
    "Rounds of refinement: new simulations near the optima.",
    {
        "rounds": (int, setting("number of rounds; 0 is the paper's method", 1, minimum=0, maximum=100)),
        "points_per_case": (
            int,
            setting(
                "number of new points per case and round",
                3,
                minimum=1,
                note="the optimum, competing minima, then probable points with the largest predictive uncertainty",
            ),
        ),
        **seeds("refine"),
        "tolerance_ratio": (
            float,
            setting(
                "difference of predicted and simulated response, relative to the target, below which a case needs no further round",
                0.05,
                above=0,
            ),
        ),
    },
)


def by_column(meaning: str, values: str, note: str) -> tuple:
    """Field of a number for every response, by its column; values : attribute of the responses with the defaults."""
    columns = {response.column: getattr(response, values) for response in RESPONSES.values()}
    numbers = {column: {"type": "number", "exclusiveMinimum": 0} for column in columns}
    of = {"additionalProperties": False, "required": list(columns), "properties": numbers}
    return dict[str, float], setting(meaning, columns, note=note, of=of)


#: Settings that decide the verdicts (see `calibration.verify`) -> their fields.
LIMITS = {
    "difference_of_consequence": by_column(
        "smallest difference of consequence of each response",
        "of_consequence",
        "A prediction is confirmed only if an error of this size would have shown at two standard errors.",
    ),
    "standard_error": by_column(
        "largest standard error of the simulated mean of each response with which a soil can match its target",
        "decisive_error",
        "With a larger one a soil that misses its target would match for being blunt; the answer is then: not decided.",
    ),
}
Verify = make(
    "Verify",
    "Every optimum is simulated with seeds that no fit has used.",
    {
        **seeds("verify"),
        "more_seeds": (
            int,
            setting(
                "rounds of further seeds for optima of which the tests cannot tell whether they match their targets; each doubles "
                "the number of seeds; 0: none",
                1,
                minimum=0,
                maximum=6,
            ),
        ),
        "equivalents": (
            int,
            setting("number of equivalent parameter sets per case that are simulated with the seeds above; 0: none", 1, minimum=0),
        ),
        **LIMITS,
    },
)


@dataclass(frozen=True, kw_only=True)
class Bulk:
    """Bulk benchmarks beside LIGGGHTS (target `bulk`); no study depends on them."""

    packings: str = setting(
        "folder of the published packings, relative to the checkout: penetration_25000.parquet, drum_38000.parquet and so on",
        "../shared/bulk-benchmarks",
    )
    cases: list[str] = setting(
        "cases that are run and stand on the page",
        ["impact", "drum", "silo"],
        of={"minItems": 1, "uniqueItems": True, "items": {"type": "string", "enum": ["impact", "drum", "silo"]}},
    )
    impact_grains: list[int] = setting(
        "grains of the beds on which the ball falls",
        [25_000],
        of={"minItems": 1, "uniqueItems": True, "items": {"type": "integer", "enum": [25_000, 50_000]}},
    )
    drum: str = choice("soft: E / 500, minutes; hard: the benchmark's, hours to days", "soft", ("soft", "hard"))
    silo: str = choice(
        "scaled: 30 000 softer grains for 0.6 s, minutes; full: 100 000 for 5 s, hours to days", "scaled", ("scaled", "full")
    )


TWIN = {
    "type": "object",
    "properties": {key: {"type": "array", **SEED_LIST, "items": {"type": "integer", "minimum": 0}} for key in seeds("design")},
    "additionalProperties": {"type": "number", "minimum": 0},
}

Study = make(
    "Study",
    "A study.",
    {
        "study": (str, setting("name of the results folder, results/<study>: letters, digits, - and _", "default", of=NAMES)),
        "checkpoint_interval_s": (
            float,
            setting("wall time in s between two saves of a running simulation; results do not depend on it", 300, above=0),
        ),
        "batch_minutes": (
            float,
            setting(
                "target duration in min of a job of short simulations; 0: one job per simulation; results do not depend on it",
                0.5,
                minimum=0,
            ),
        ),
        "insist": (
            list[str],
            setting(
                "keys whose unusual numbers are meant, as the message that refuses them names them; results do not depend on it",
                [],
                of={"uniqueItems": True, "items": {"type": "string"}},
            ),
        ),
        "experiments": (
            list[str],
            setting(
                "virtual tests of the study; a soil's targets are the responses that they measure",
                BY_DEFAULT,
                of={
                    "minItems": 1,
                    "uniqueItems": True,
                    "items": {"type": "string", "enum": [experiment.NAME for experiment in reversed(EXPERIMENTS)]},
                },
            ),
        ),
        "material": (Material, section(Material)),
        "grading": (Grading, section(Grading)),
        "design": (Design, section(Design)),
        "screening": (Screening, section(Screening)),
        "fidelity": (Fidelity, section(Fidelity)),
        **{experiment.NAME: (experiment.Settings, section(experiment.Settings)) for experiment in reversed(EXPERIMENTS)},
        **{name: (kind, section(kind)) for name, kind in SECTIONS.items()},
        "engine": (Engine, section(Engine)),
        "surrogate": (Surrogates, section(Surrogates)),
        "soils": (
            list[str],
            setting(
                "soils to calibrate: names of files in config/soils",
                ["silica_barco_sand", "lunar_regolith"],
                of={"uniqueItems": True, "items": NAMES},
            ),
        ),
        "optimise": (Optimise, section(Optimise)),
        "uncertainty": (Uncertainty, section(Uncertainty)),
        "refine": (Refine, section(Refine)),
        "verify": (Verify, section(Verify)),
        "wheel": (Wheel, section(Wheel)),
        "plate": (Plate, section(Plate)),
        "cone": (Cone, section(Cone)),
        "wheel_spread": (WheelSpread, section(WheelSpread)),
        "wheel_check": (WheelCheck, section(WheelCheck)),
        "bulk": (Bulk, section(Bulk)),
        "twins": (
            dict[str, dict],
            setting(
                "virtual soils to be recovered: name -> values of the design variables, and seeds; see config/twin.yaml",
                {},
                of={"propertyNames": {key: NAMES[key] for key in ("maxLength", "pattern")}, "additionalProperties": TWIN},
            ),
        ),
    },
)
