# What the files of rules share: the checked configuration, the design, fingerprints of the code.
import sys

sys.path.insert(0, str(Path(workflow.basedir) / "workflow" / "scripts"))

from _cost import memory_mb, runtime_min
from _study import (
    base_simulation,
    check_config,
    check_soils,
    experiment_settings,
    fingerprint,
    first_answer_soils,
    proposed_simulations,
    raw_files,
    simulations,
    soil_files,
)
from _provenance import versions
from exports import PROGRAMS

check_config(config)
# what --config soil=... asks for is no part of the study, so that it makes nothing run again
FIRST_ANSWERS = first_answer_soils(config.pop("soil", None), config)
# nor is how often a simulation is saved
CHECKPOINT_INTERVAL_S = config.pop("checkpoint_interval_s")
check_soils(config)

RESULTS = f"results/{config['study']}"
LOGS = f"logs/{config['study']}"

# The campaign is known beforehand. Later stages simulate where the optima lie: rounds of refinement, then the verification.
SIMULATIONS = simulations(config)
ROUNDS = config["refine"]["rounds"]
LAST = f"{RESULTS}/rounds/{ROUNDS}"

# Snakemake watches a rule's script, not the packages it imports; these close the gap. Comments and layout do not count.
ENGINE = fingerprint("src/dem", without="src/dem/measure")
ESTIMATORS = fingerprint("src/dem/measure")
INFERENCE = fingerprint("src/calibration")

# Python's fingerprints do not see the templates; they and the card's schema are input files.
CASES = [case["case"] for case in config["optimise"]["cases"]]
EXPORT_FILES = [name for name, _ in PROGRAMS.values()]
EXPORT_TEMPLATES = [
    "src/exports/material.schema.json",
    *(f"src/exports/templates/{name}.j2" for name in EXPORT_FILES),
]


wildcard_constraints:
    simulation="[0-9a-f]{10}",
    round=r"\d+",
    soil=r"[\w-]+",
    case=r"[\w-]+",
    # where a stage's tables lie below results/<study>; the campaign's lie right there
    stage=r"|/rounds/\d+|/verification",


localrules:
    all,
    animations,
    design,
    first_answer,
    manifest,
    measure_soils,
    verify_results,
    paraview,


def simulation_row(wildcards):
    """The design row of one simulation, so that a change of its values reruns just that simulation."""
    name = wildcards.simulation
    row = SIMULATIONS.get(name) or proposed_simulations(RESULTS)[name]
    return {key: value for key, value in row.items() if key != "purposes"}


def simulation_settings(wildcards):
    """The settings of one simulation's experiment at its fidelity."""
    return experiment_settings(config, simulation_row(wildcards))


def simulation_runtime(wildcards, attempt):
    """Minutes to ask a scheduler for; more at every attempt."""
    return runtime_min(
        simulation_row(wildcards), simulation_settings(wildcards), attempt
    )


def simulation_memory(wildcards, attempt):
    """Memory in MB to ask a scheduler for; more at every attempt."""
    return memory_mb(simulation_row(wildcards), simulation_settings(wildcards), attempt)


def stage_rows(stage):
    """Design rows of a stage; those of the later stages are known when its checkpoint has run."""
    if not stage:
        return SIMULATIONS
    if stage.endswith("verification"):
        checkpoints.verification_design.get()
    else:
        checkpoints.refinement_design.get(round=stage.rpartition("/")[2])
    return proposed_simulations(RESULTS, stage)


def simulated(experiment, file):
    """Input function: a file of every simulation of one experiment in a stage."""

    def paths(wildcards):
        rows = stage_rows(wildcards.stage)
        names = [name for name, row in rows.items() if row["experiment"] == experiment]
        return expand(
            f"{RESULTS}/sims/{experiment}/{{simulation}}/{file}", simulation=names
        )

    return paths


def known_tables(name):
    """Input function: a table of the campaign and of all rounds up to this one."""

    def paths(wildcards):
        rounds = [f"{RESULTS}/rounds/{k}" for k in range(1, int(wildcards.round) + 1)]
        return [f"{folder}/{name}.parquet" for folder in (RESULTS, *rounds)]

    return paths


def previous(name):
    """Input function: a file of the round before."""
    return lambda wildcards: f"{RESULTS}/rounds/{int(wildcards.round) - 1}/{name}"
