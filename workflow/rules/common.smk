# Shared by the other rules: the checked configuration, the design, batches of simulations, fingerprints of the code.
import functools
import sys

from snakemake.exceptions import WorkflowError

from virtual_soil.campaign import asked
from virtual_soil.campaign.apparatus import (
    apparatus,
    check_sizes,
    follow_cohesion,
    laboratory_curve,
    with_gravity,
)
from virtual_soil.campaign.batches import (
    NAME,
    batches,
    digest,
    later_stages,
    parts_of,
    stage_of,
    verification_stages,
)
from virtual_soil.campaign.code import Code
from virtual_soil.campaign.cost import (
    expected_s,
    memory_mb,
    requested_min,
    runtime_min,
    simulated_s,
)
from virtual_soil.campaign.experiments import module_of
from virtual_soil.campaign.experiments.registry import (
    BY_NAME,
    EXPERIMENTS,
    REDUCED,
    RESPONSES,
    chosen,
    with_optional,
)
from virtual_soil.campaign.experiments.shapes import resolved, screened_factors
from virtual_soil.campaign.folders import check_folders
from virtual_soil.campaign.provenance import versions
from virtual_soil.campaign.sections import LIMITS, Study
from virtual_soil.campaign.settings import in_declared_order
from virtual_soil.campaign.study import (
    as_printed,
    base_simulation,
    check_config,
    check_files,
    check_soils,
    design_rows,
    experiment_settings,
    file_of_checkout,
    first_answer_soils,
    planned_stages,
    proposed_rows,
    raw_files,
    simulations,
    soil_files,
)
from virtual_soil.campaign.variables import (
    adhesion_laws,
    fitting_twins,
    normal_form,
    with_walls,
)
from virtual_soil.errors import InputError
from virtual_soil.exports import PROGRAMS, shape_files


def in_words(function, *arguments):
    """Return the function's result; input errors are shown as one line, without a traceback."""
    try:
        return function(*arguments)
    except InputError as error:
        raise WorkflowError(str(error)) from None


# The study's results are written below the working directory; the checkout may be elsewhere (--directory, --snakefile).
CHECKOUT = Path(workflow.basedir)
in_words(check_folders, CHECKOUT, Path.cwd(), sys.executable)
in_words(
    check_files, workflow.overwrite_configfiles or [CHECKOUT / "config/config.yaml"]
)
in_words(check_config, config)
# Remove `soil` and the test of a first answer from the configuration: they must not trigger reruns.
FIRST_ANSWER_TEST = in_words(asked.taken, config)
FIRST_ANSWERS = in_words(first_answer_soils, config.pop("soil", None), config, CHECKOUT)
# Nor must the checkpoint interval.
CHECKPOINT_INTERVAL_S = str(
    config.pop("checkpoint_interval_s")
)  # Snakemake resources are integers or strings
# Nor must the batch size.
BATCH_MINUTES = config.pop("batch_minutes")
# Nor must the list of keys whose unusual numbers are meant.
INSIST = config.pop("insist")
# Nor must the bulk benchmarks, which are no part of a study.
BULK = config.pop("bulk")
# Nor must wheel, plates and cone, which run on what a study has found.
WHEEL, PLATE, CONE, SPREAD, WHEEL_CHECK = (
    config.pop(name)
    for name in ("wheel", "plate", "cone", "wheel_spread", "wheel_check")
)
in_words(check_soils, config, CHECKOUT)
SOIL_FILES = soil_files(config, CHECKOUT)
config.update(in_declared_order(config, Study))
config.update(in_words(apparatus, config, SOIL_FILES))
in_words(check_sizes, config, SOIL_FILES)
config.update(in_words(follow_cohesion, config, SOIL_FILES))
config["engine"] = with_gravity(config["engine"])
config["shear"]["curve"] = in_words(laboratory_curve, config, SOIL_FILES)
config["experiments"] = with_optional(config)
config["shape"] = in_words(resolved, config)
config["material"] = with_walls(config)
config["screening"]["factors"] = screened_factors(config)
config["design"] = in_words(normal_form, config)
config["twins"], LEFT_OUT = fitting_twins(config)
print(*LEFT_OUT, sep="\n", end="\n" if LEFT_OUT else "", file=sys.stderr)

RESULTS = f"results/{config['study']}"
LOGS = f"logs/{config['study']}"

# The simulations of the campaign are known at the start. Those of the later stages (rounds of refinement, then the verification)
# depend on the optima.
DESIGN = in_words(design_rows, config)
SIMULATIONS = in_words(simulations, config, DESIGN, INSIST)
ROUNDS = config["refine"]["rounds"]
LAST = f"{RESULTS}/rounds/{ROUNDS}"
MORE_SEEDS = config["verify"]["more_seeds"]
# Folders of the later stages' tables, below the results.
LATER_STAGES = later_stages(ROUNDS, MORE_SEEDS)
# Seeds of the first round of the verification.
FIRST_SEEDS = {
    key: config["verify"][key] for key in config["verify"] if key.endswith("_seeds")
}

# The engine's fingerprint is part of a simulation's identity. Every rule has the parameter `code`, the fingerprint of its script and
# of all modules that the script imports. Snakemake itself compares only the script's modification time (profiles/default disables
# that).
CODE = Code(CHECKOUT)
ENGINE = CODE.of_package("src/dem", without="src/dem/measure")

# Names of the study's experiments.
TESTS = [experiment.NAME for experiment in reversed(chosen(config["experiments"]))]
# Modules that read laboratory files.
LABORATORY = [
    module_of(experiment.NAME, "laboratory")
    for experiment in EXPERIMENTS
    if experiment.LABORATORY
]
# Modules that simulate, and modules that describe the experiments in the report.
SIMULATED = [module_of(name, "simulate") for name in TESTS]
DESCRIBED = [f"virtual_soil.report.experiments.{name}" for name in TESTS]
# Names of all tables of responses.
MEASURED = [*TESTS, *(name for name, test in REDUCED.items() if test.NAME in TESTS)]
# Response -> the study's experiment that measures it; experiments whose results may stand beside those that the paper prints.
BY_RESPONSE = {
    response.name: experiment.NAME
    for experiment in chosen(config["experiments"])
    for response in experiment.RESPONSES
}
AS_PRINTED = as_printed(config)
# Parameters of the rules that compare predictions with simulations.
COMPARED_BY = {
    **{
        key: config[key] for key in ("experiments", "material", "design", "uncertainty")
    },
    "verify": {name: config["verify"][name] for name in LIMITS},
    "settings": {name: config[name] for name in TESTS},
}
# Sections that say how the simulations of a later stage are made.
SIMULATED_BY = (
    *("experiments", "material", "shape", "grading", "design", *TESTS, "engine"),
    *("repose_test", "shear_test", "slope_test", "draw_down_test", "drum_test"),
)
# Least scales of the responses' errors.
FLOORS = {
    name: floor
    for experiment in chosen(config["experiments"])
    for name, floor in experiment.floors(config).items()
}

# The code fingerprint does not cover the templates and the card's schema, so they are input files.
CASES = [case["case"] for case in config["optimise"]["cases"]]
EXPORT_FILES = [name for name, _ in PROGRAMS.values()]
# Further files of grains that are clumps.
CLUMP_FILES = (
    shape_files(len(config["shape"].get("mix", ["one shape"])))
    if config["shape"]
    else []
)
EXPORT_TEMPLATES = [
    file_of_checkout(f"src/virtual_soil/exports/{name}", CHECKOUT)
    for name in (
        "material.schema.json",
        *(f"templates/{name}.j2" for name in EXPORT_FILES),
    )
]


wildcard_constraints:
    batch=NAME,
    simulation="[0-9a-f]{10}",
    round=r"\d+",
    soil=r"[\w-]+",
    case=r"[\w-]+",
    experiment="|".join(TESTS),
    reduced="|".join(REDUCED),
    # folder of a stage's tables below results/<study>; empty for the campaign
    stage=r"|/rounds/\d+|/verification|/verification/\d+",
    more=r"\d+",


# Rules that take a second or two and read only small tables. As a cluster job each would take ten seconds.
localrules:
    all,
    animations,
    check_acceleration,
    compare_round,
    conclude,
    design,
    export,
    first_answer,
    manifest,
    measure_soils,
    paraview,
    reachability,
    refinement_design,
    screening,
    reduce,
    twins,
    verification_design,
    compare_seeds,
    more_seeds,
    verify,
    verify_equivalents,
    check_manifest,


def stage_rows(stage):
    """Return the design rows of a stage by simulation; those of a later stage are read from its design table, which must exist."""
    if not stage:
        return SIMULATIONS
    path = Path(f"{RESULTS}{stage}") / "design.parquet"
    return proposed_simulations(str(path), path.stat().st_mtime_ns)


@functools.cache
def proposed_simulations(path, changed_ns):
    """Return the design rows of a later stage by simulation; cached until the file's modification time changes."""
    return in_words(simulations, config, in_words(proposed_rows, path), INSIST)


def settings_of(row):
    """Settings of a simulation's experiment at its fidelity."""
    return experiment_settings(config, row)


BATCHES = {}


def stage_batches(stage, experiment):
    """Return batch -> ids of its simulations, for one experiment in a stage."""
    rows = stage_rows(stage)
    known, found = BATCHES.get((stage, experiment), (None, {}))
    if known is not rows:
        expected = {
            name: expected_s(row, settings_of(row)) if BATCH_MINUTES else 0.0
            for name, row in rows.items()
            if row["experiment"] == experiment
        }
        found = batches(expected, 60.0 * BATCH_MINUTES, stage)
        BATCHES[stage, experiment] = rows, found
    return found


def members_of(batch, experiment):
    """Return design row and settings of every simulation in a batch."""
    stages = planned_stages(RESULTS) if stage_of(batch) is None else [stage_of(batch)]
    for stage in stages:
        rows = stage_rows(stage)
        names = stage_batches(stage, experiment).get(batch, ())
        if names:
            return [(rows[name], settings_of(rows[name])) for name in names]
    raise WorkflowError(
        f"{batch}: no {experiment} simulation or batch of this name is planned."
    )


def file_of(simulation, experiment, file):
    """Return the path of a file of the batch that contains a simulation."""
    for stage in planned_stages(RESULTS):
        for batch, names in stage_batches(stage, experiment).items():
            if simulation in names:
                return f"{RESULTS}/sims/{experiment}/{batch}/{file}"
    raise WorkflowError(
        f"{simulation}: no {experiment} simulation of this name is planned."
    )


def members(wildcards, input):
    """Parameter function: simulations of a batch. With the argument `input`, Snakemake records only `members_digest`."""
    return members_of(wildcards.batch, wildcards.experiment)


def members_digest(wildcards):
    """Parameter function: digest of a batch's simulations; a change in any of them reruns only this batch."""
    return digest(members_of(wildcards.batch, wildcards.experiment))


def batch_runtime(wildcards, attempt):
    """Resource function: requested run time in minutes; increases with every attempt."""
    return runtime_min(members_of(wildcards.batch, wildcards.experiment), attempt)


def batch_memory(wildcards, attempt):
    """Resource function: requested memory in MB; increases with every attempt."""
    return memory_mb(members_of(wildcards.batch, wildcards.experiment), attempt)


def settings_for(experiment, act):
    """Settings of an experiment that act on measuring (MEASURED_BY) or on reducing (REDUCED_BY)."""
    return {key: config[experiment.NAME][key] for key in getattr(experiment, act)}


def code_with(script, part):
    """Parameter function: fingerprint of a script and of one module of its experiment."""
    return lambda wildcards: CODE.of_script(
        script, module_of(wildcards.experiment, part)
    )


def stored_in_stage(stage, experiment, file):
    """Return a file of every batch of one experiment in a stage; later stages wait for their checkpoint."""
    kind, number = parts_of(stage)
    if kind == "rounds":
        checkpoints.refinement_design.get(round=number)
    elif number:
        checkpoints.more_seeds.get(more=number)
    elif kind:
        checkpoints.verification_design.get()
    names = sorted(stage_batches(stage, experiment))
    return [f"{RESULTS}/sims/{experiment}/{name}/{file}" for name in names]


def simulated(file):
    """Input function: one file of every batch of the experiment in a stage."""
    return lambda wildcards: stored_in_stage(
        wildcards.stage, wildcards.experiment, file
    )


def measured_from(wildcards):
    """Input function: stored tables from which an experiment measures its responses."""
    file = f"{BY_NAME[wildcards.experiment].MEASURED_FROM}.parquet"
    return stored_in_stage(wildcards.stage, wildcards.experiment, file)


def simulated_in_all(file):
    """Input function: one file of every batch of all experiments in all stages."""
    return lambda wildcards: list(
        dict.fromkeys(
            path
            for stage in ("", *LATER_STAGES)
            for experiment in TESTS
            for path in stored_in_stage(stage, experiment, file)
        )
    )


def base_settings(experiment):
    """Return row and settings of an experiment's simulation at the base point."""
    row = base_simulation(config, DESIGN, experiment)
    return row, experiment_settings(config, row)


def known_tables(wildcards):
    """Input function: tables of responses of the campaign and of all rounds up to this one."""
    rounds = [f"{RESULTS}/rounds/{k}" for k in range(1, int(wildcards.round) + 1)]
    return [
        f"{folder}/{name}.parquet" for folder in (RESULTS, *rounds) for name in MEASURED
    ]


def verified(more):
    """Return the tables of responses of the verification up to a round of further seeds; 0: of its first seeds."""
    return [
        f"{RESULTS}{stage}/{name}.parquet"
        for stage in verification_stages(more)
        for name in MEASURED
    ]


def previous(name):
    """Input function: a file of the previous round."""
    return lambda wildcards: f"{RESULTS}/rounds/{int(wildcards.round) - 1}/{name}"
