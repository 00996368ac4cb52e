"""Angles of stored surfaces of rotating drums."""

import math
from dataclasses import asdict

import pandas as pd

from dem.measure.drum import angles_of, steady_angle
from virtual_soil.campaign.experiments.rotating_drum.declared import SOUND

#: Attribute of the angle -> column.
COLUMNS = {
    "mean_deg": "drum_angle_deg",
    "error_deg": "drum_angle_error_deg",
    "scatter_deg": "drum_scatter_deg",
    "upper_deg": "drum_upper_angle_deg",
    "lower_deg": "drum_lower_angle_deg",
}


def measured(run: dict, history: pd.DataFrame | None, settings: dict) -> dict:
    """Return a run's row with the angles at its Froude number: missing unless it is done."""
    if run["status"] not in SOUND or history is None:
        return {**run, **dict.fromkeys(COLUMNS.values(), math.nan)}
    found = asdict(steady_angle(*angles_of(history, run["froude_number"]), settings["turns_before"]))
    return {**run, **{column: found[name] for name, column in COLUMNS.items()}}


def reduce(table: str, runs: pd.DataFrame, settings: dict, by_seed: bool = False) -> pd.DataFrame:
    """Return the runs unchanged: each run gives the response of its point and seed."""
    return runs


def compared(runs: pd.DataFrame) -> pd.Series:
    """Quantity for the comparison of the fidelities: angle of the surface."""
    return runs["drum_angle_deg"]
