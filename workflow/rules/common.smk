# What every rule file uses: the checked configuration, the design, fingerprints of the code.
import sys

sys.path.insert(0, str(Path(workflow.basedir) / "workflow" / "scripts"))

from _study import (
    check_config,
    experiment_settings,
    fingerprint,
    simulations,
    soil_files,
)
from _provenance import versions

check_config(config)

RESULTS = f"results/{config['study']}"
LOGS = f"logs/{config['study']}"

SIMULATIONS = simulations(config)
REPOSE = [name for name, row in SIMULATIONS.items() if row["experiment"] == "repose"]
SHEAR = [name for name, row in SIMULATIONS.items() if row["experiment"] == "shear"]

# Snakemake watches a rule's script, not the packages it imports; these close the gap. Comments and layout do not count.
ENGINE = fingerprint("src/dem", without="src/dem/measure")
ESTIMATORS = fingerprint("src/dem/measure")
INFERENCE = fingerprint("src/calibration")


wildcard_constraints:
    simulation="[0-9a-f]{10}",


localrules:
    all,
    design,
    measure_soils,


def simulation_row(wildcards):
    """The design row of one simulation, so that a change of its values reruns just that simulation."""
    return SIMULATIONS[wildcards.simulation]


def simulation_settings(wildcards):
    """The settings of one simulation's experiment at its fidelity."""
    return experiment_settings(config, SIMULATIONS[wildcards.simulation])
