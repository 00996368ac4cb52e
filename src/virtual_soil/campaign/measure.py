"""Tables of measured responses from stored simulations, with the estimators of the experiments."""

from collections.abc import Iterable, Sequence
from importlib import import_module
from pathlib import Path

import numpy as np
import pandas as pd

from virtual_soil.calibration.response import Responses
from virtual_soil.campaign.experiments import module_of
from virtual_soil.campaign.experiments.common import LARGEST_OVERLAP_RATIO
from virtual_soil.campaign.experiments.registry import BY_NAME, REDUCED
from virtual_soil.campaign.tables import TableError, batch_results, empty_table

#: Column of an experiment that records overlaps.
OVERLAP = "max_overlap_ratio"


def measured_table(experiment: str, design: pd.DataFrame, runs, results, timings, settings: dict) -> pd.DataFrame:
    """Return one row per design row of an experiment, with the responses measured in its simulation.

    runs, results, timings : corresponding files of the batches; results are the tables from which the experiment measures.
    settings : the experiment's section of the configuration.

    Raises TableError if the batches lack simulations of the design.
    """
    estimate = import_module(module_of(experiment, "measure")).measured
    schema = {"after": "grains", "before": "grains", "history": f"{experiment}_history"}[BY_NAME[experiment].MEASURED_FROM]
    found = batch_results(runs, f"{experiment}_run", results, schema, timings)
    rows = [estimate(run, table, settings) for run, table in found]
    check_complete(design.loc[design["experiment"] == experiment, "simulation_id"], [row["simulation_id"] for row in rows], runs)
    if not rows:  # a round of refinement without new points
        return empty_table(experiment)
    measured = pd.DataFrame(rows)
    if OVERLAP in measured:
        measured["overlaps_too_much"] = measured[OVERLAP].astype(float) > LARGEST_OVERLAP_RATIO
    texts = {"simulation_id", "status", "reason", "overlaps_too_much"}
    counts = {name for name in measured if measured[name].dtype.kind == "i"}
    numbers = {name: float for name in measured if name not in texts | counts}
    table = design.merge(measured.astype(numbers), on="simulation_id", validate="many_to_one")
    for column, fraction in BY_NAME[experiment].DENSITIES.items():
        measured_fraction = table.get(fraction, np.nan)  # simulations made before it was measured lack it
        table[column] = (table["density_kg_m3"] * measured_fraction).where(table["status"].isin(BY_NAME[experiment].SOUND))
    return table


def check_complete(planned: Iterable[str], measured: Iterable[str], runs: Sequence) -> None:
    """Raise TableError if planned simulations are not among the measured ones: their batches are of another design.

    Snakemake repeats a batch whose simulations have changed, unless it is told to look at nothing but times (--rerun-triggers).
    """
    missing = sorted(set(planned) - set(measured))
    if missing:
        folders = sorted({str(Path(path).parent) for path in runs}) or ["no batch"]
        where = ", ".join(folders[:3]) + (f" and {len(folders) - 3} more" if len(folders) > 3 else "")
        raise TableError(
            f"{where}: {len(missing)} of the planned simulations missing, {missing[0]} the first; these are results of another "
            "design. Delete them and run again, without --rerun-triggers."
        )


def reduced_table(name: str, runs: pd.DataFrame, settings: dict, by_seed: bool = False) -> pd.DataFrame:
    """Reduce all runs of an experiment to a table with one row per point and fidelity (and seed, if by_seed)."""
    experiment = REDUCED[name].NAME
    return import_module(module_of(experiment, "measure")).reduce(name, runs, settings, by_seed)


def spoiled(tables: dict[str, pd.DataFrame]) -> dict[str, int]:
    """Return point -> number of its simulations that failed or did not come to rest, over all experiments in the tables."""
    sound = {name: experiment.SOUND for name, experiment in BY_NAME.items() if name in tables}
    runs = [tables[name].loc[~tables[name]["status"].isin(status), "point_id"] for name, status in sound.items()]
    return pd.concat(runs).value_counts().to_dict()


def largest_overlaps(tables: dict[str, pd.DataFrame]) -> dict[str, float]:
    """Return point -> largest overlap over the radius in its simulations, over all experiments in the tables."""
    runs = [table[["point_id", OVERLAP]] for name, table in tables.items() if name in BY_NAME and OVERLAP in table]
    return pd.concat(runs).groupby("point_id")[OVERLAP].max().to_dict() if runs else {}


def responses_by_seed(responses: Responses, tables: dict[str, pd.DataFrame], settings: dict) -> dict[str, pd.DataFrame]:
    """Return response -> table with one row per point and seed that contains the response's column.

    tables : table of all runs of each experiment, by name. settings : configuration sections of the experiments.
    """
    found = {}
    for name, response in responses.items():
        experiment = REDUCED.get(response.table)
        if experiment is None:
            found[name] = tables[response.table]
        else:
            found[name] = reduced_table(response.table, tables[experiment.NAME], settings[experiment.NAME], by_seed=True)
    return found
