"""Rates of discharge from stored flows, and the slopes that stayed."""

import math

import pandas as pd

from dem.measure.draw_down import steady_rate
from virtual_soil.campaign.experiments.draw_down.declared import SOUND

NOTHING = {
    "discharge_rate_kg_s_m": math.nan,
    "discharge_rate_error_kg_s_m": math.nan,
    "draw_down_angle_deg": math.nan,
    "draw_down_bound_deg": math.nan,
}


def measured(run: dict, history: pd.DataFrame | None, settings: dict) -> dict:
    """Return a run's row with its rate and angle, the mean of both sides: missing unless it is done.

    Where a side is too low for a slope, the angle lies between 0 and that of the lowest slope, `draw_down_bound_deg`, and its value
    is the middle.
    """
    if run["status"] not in SOUND or history is None:
        return {**run, **NOTHING}
    rate, error = steady_rate(history["time_s"], history["mass_out_kg_m"])
    angle, bound = 0.5 * (run["draw_down_left_deg"] + run["draw_down_right_deg"]), math.nan
    if math.isnan(angle):
        bound = run["slope_least_deg"]
        angle = 0.5 * bound
    found = {"discharge_rate_kg_s_m": rate, "discharge_rate_error_kg_s_m": error}
    return {**run, **found, "draw_down_angle_deg": angle, "draw_down_bound_deg": bound}


def reduce(table: str, runs: pd.DataFrame, settings: dict, by_seed: bool = False) -> pd.DataFrame:
    """Return the runs unchanged: each run gives the responses of its point and seed."""
    return runs


def compared(runs: pd.DataFrame) -> pd.Series:
    """Quantity for the comparison of the fidelities: rate of discharge in kg/s per metre of the slot."""
    return runs["discharge_rate_kg_s_m"]
