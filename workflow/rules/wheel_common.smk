# Shared by the rules of wheel, plates and cone: what is run, where it is stored, and the soil under the tools.
from virtual_soil.wheel import cost as wheel_cost
from virtual_soil.wheel import measurements as wheel_measurements
from virtual_soil.wheel import setups as wheel_setups
from virtual_soil.wheel import soil as wheel_soil
from virtual_soil.wheel import spread_runs as wheel_spread

if WHEEL["mesh"]["file"] is not None:
    WHEEL["mesh"]["file"] = file_of_checkout(WHEEL["mesh"]["file"], CHECKOUT)
WHEEL_CASES = in_words(wheel_soil.cases_of, WHEEL, CASES)
WHEEL_GRAINS = wheel_soil.grain_settings(WHEEL)
WHEEL_ENGINE = wheel_soil.engine_settings(config, WHEEL)
# The answer is read when a target of this file is asked for. It is no input file: `wheel` must not start a calibration.
ANSWER = f"{RESULTS}/calibration.parquet"
BED = f"{RESULTS}/wheel/{{case}}/{{bed_seed}}"
PREPARATION = f"{RESULTS}/wheel/{{case}}/preparation.parquet"
BED_LOG = f"{LOGS}/wheel/{{case}}/{{bed_seed}}"
BED_CHECKPOINT = f"{RESULTS}/checkpoints/wheel/{{case}}_{{bed_seed}}"
ON_BEDS = {"case": WHEEL_CASES, "bed_seed": WHEEL["bed"]["seeds"]}
WHEEL_RUNS = expand(
    f"{BED}/slip_{{slip}}", slip=wheel_setups.run_names(WHEEL), **ON_BEDS
)
# The run of the target `wheel_film`: on the first bed, the middle one of the slips.
FIRST_BED = BED.format(case=WHEEL_CASES[0], bed_seed=WHEEL["bed"]["seeds"][0])
WHEEL_NAMES = wheel_setups.run_names(WHEEL)
WHEEL_FILM = f"{FIRST_BED}/slip_{WHEEL_NAMES[len(WHEEL_NAMES) // 2]}"
PLATE_RUNS = expand(
    f"{BED}/plate_{{diameter}}",
    diameter=[f"{diameter:g}" for diameter in PLATE["diameters_m"]],
    **ON_BEDS,
)
CONE_RUNS = [] if CONE["base_area_m2"] is None else expand(f"{BED}/cone", **ON_BEDS)
WHEEL["measured"]["file"], PLATE["measured"]["file"] = (
    None if file is None else file_of_checkout(file, CHECKOUT)
    for file in (WHEEL["measured"]["file"], PLATE["measured"]["file"])
)
IS_MEASURED = not (WHEEL["measured"]["file"] is PLATE["measured"]["file"] is None)
HAS_HANDBOOK = WHEEL["handbook"]["internal_friction_angle_deg"] is not None
# Tools of the page: the wheel, and those of plates and cone that have runs.
TOOLS = ["wheel", *(["plate"] if PLATE_RUNS else []), *(["cone"] if CONE_RUNS else [])]
# Case of `wheel_spread`, and the plate that is pressed into its beds.
SPREAD_CASE = WHEEL_CASES[0]
SPREAD_PLATE = SPREAD["plate_diameter_m"]


WHEEL_SECTIONS = {"wheel": WHEEL, "plate": PLATE, "cone": CONE}
WHEEL_KERNELS = f"{RESULTS}/wheel/kernels.txt"


def calibrated_soil(wildcards):
    """Parameter function: the soil of a case under the tools."""
    return in_words(wheel_soil.soil_of_case, config, ANSWER, wildcards.case)


def soils_under_tools(wildcards):
    """Parameter function: case -> keys and values of its grains under the tools."""
    soils = {
        case: in_words(wheel_soil.soil_of_case, config, ANSWER, case)
        for case in WHEEL_CASES
    }
    return {case: wheel_soil.card(soil, WHEEL_GRAINS) for case, soil in soils.items()}


def wheel_job(soil, wheel=WHEEL):
    """What the scripts of wheel, plates and cone get, with a soil and a section `wheel`."""
    return {
        "soil": soil,
        "grains": wheel_soil.grain_settings(wheel),
        "engine": WHEEL_ENGINE,
        "bed": wheel_setups.bed_settings(wheel),
    }


def nothing_refused(wildcards):
    """Input function without files: refuses a wheel, grains or a bed with which no run can begin, before a bed is prepared."""
    job = wheel_job(calibrated_soil(wildcards))
    in_words(wheel_setups.check_setups, WHEEL, job)
    return []


def wheel_work(wildcards, rule, wheel=WHEEL):
    """Expected work of a job of a rule, with a section `wheel`."""
    job = wheel_job(calibrated_soil(wildcards), wheel)
    sections = WHEEL_SECTIONS | {"wheel": wheel}
    return in_words(wheel_cost.of_rule, rule, job, sections, dict(wildcards.items()))


def wheel_runtime(wildcards, attempt, rulename):
    """Resource function: requested run time in minutes; increases with every attempt."""
    return requested_min(wheel_work(wildcards, rulename).expected_s, attempt)


def wheel_memory(wildcards, attempt, rulename):
    """Resource function: requested memory in MB; increases with every attempt."""
    return wheel_cost.requested_mb(rulename, wheel_work(wildcards, rulename), attempt)


def wheel_jobs(n_cases, n_beds, names, diameters, has_cone):
    """Rule, wildcards and number of the jobs on beds, for the summary of their cost."""
    steered = WHEEL["bed"]["bulk_density_kg_m3"] is not None
    return [
        ("prepare_bed", {}, n_beds),
        ("steer_density", {}, n_cases if steered else 0),
        ("lower_wheel", {}, n_beds if names else 0),
        *(("drive_wheel", {"slip": name}, n_beds) for name in names),
        *(("press_plate", {"diameter": diameter}, n_beds) for diameter in diameters),
        ("push_cone", {}, n_beds if has_cone else 0),
    ]


def jobs_of_target(target):
    """Rule, wildcards and number of the jobs of a target."""
    if target == "wheel_spread":
        n_members = SPREAD["soils"] * len(SPREAD["soil_seeds"])
        n_beds = len(SPREAD["optimum_seeds"]) + n_members
        plates = [] if SPREAD_PLATE is None else [SPREAD_PLATE]
        slip = f"{SPREAD['slip']:g}"
        return wheel_jobs(1 + SPREAD["soils"], n_beds, [slip], plates, False)
    n_cases, n_beds = len(WHEEL_CASES), len(WHEEL_CASES) * len(WHEEL["bed"]["seeds"])
    names = WHEEL_NAMES if target == "wheel" else []
    plates = PLATE["diameters_m"] if target in ("wheel", "plate") else []
    has_cone = bool(CONE_RUNS) and target in ("wheel", "cone")
    return wheel_jobs(n_cases, n_beds, names, plates, has_cone)


def planned(jobs, wheel=WHEEL):
    """Rule, work and number of jobs, with the study's own material: the cost follows from sizes, not from frictions."""
    job = wheel_job(wheel_soil.soil_with(config, {}), wheel)
    sections = WHEEL_SECTIONS | {"wheel": wheel}
    return [
        (rule, in_words(wheel_cost.of_rule, rule, job, sections, wildcards), number)
        for rule, wildcards, number in jobs
        if number  # a cone that is not there has no size
    ]


@functools.cache
def tell_cost(target):
    """Print once what a target is expected to take."""
    line = wheel_cost.summary(target, planned(jobs_of_target(target)))
    print(line, file=sys.stderr)


def cost_told(target):
    """Input function without files, of a target: prints what it is expected to take."""
    return lambda wildcards: tell_cost(target) or []


def measurements(wildcards):
    """Input function: files of measurements, refused before anything runs if a value cannot be one of this wheel and its plates."""
    gravity = WHEEL_ENGINE["gravity_m_s2"]
    return in_words(wheel_measurements.checked_files, WHEEL, PLATE, gravity)


def preparation(wildcards):
    """Input function: the friction ratio that was found for the beds' bulk density, if one is asked for."""
    sought = WHEEL["bed"]["bulk_density_kg_m3"] is not None
    return PREPARATION if sought else []


def verdicts(wildcards):
    """Parameter function: verdicts of the answers."""
    return in_words(wheel_soil.verdicts_of, ANSWER, WHEEL_CASES)


def files_of(runs, file):
    """One file of every run."""
    return [f"{run}/{file}.parquet" for run in runs]


def checkpoint_of(test):
    """Parameter function: checkpoint of a job."""
    return lambda wildcards: (BED_CHECKPOINT + test).format(**dict(wildcards.items()))


def spread_files(of_bed):
    """Input function: one file of every bed of the optimum and of its equivalent sets."""

    def files(wildcards):
        beds = in_words(
            wheel_spread.beds_of, ANSWER, SPREAD_CASE, config["design"], SPREAD
        )
        return [
            f"{BED}/{of_bed}".format(case=case, bed_seed=seed) for case, seed in beds
        ]

    return files


# A study that names cases of the wheel is told when it is planned.
if WHEEL["cases"] and workflow.is_main_process:
    tell_cost("wheel")
