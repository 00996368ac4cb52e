"""Slope angles from the brackets of stored bisections."""

import math

import pandas as pd

NOTHING = {"slope_angle_deg": math.nan, "slope_half_width_deg": math.nan, "slope_bound_deg": math.nan}


def measured(run: dict, grains: pd.DataFrame | None, settings: dict) -> dict:
    """Return a run's row with its angle, the middle of its bracket: missing for a column and for a failed run.

    Where even the flattest cut falls, the angle lies between 0 and that of the cut, `slope_bound_deg`, and its value is the middle.
    """
    stands, falls = run["stands_deg"], run["falls_deg"]
    if run["status"] == "done":
        return {**run, **NOTHING, "slope_angle_deg": 0.5 * (stands + falls), "slope_half_width_deg": 0.5 * (falls - stands)}
    if run["status"] == "flat":
        return {**run, "slope_angle_deg": 0.5 * falls, "slope_half_width_deg": 0.5 * falls, "slope_bound_deg": falls}
    return {**run, **NOTHING}


def reduce(table: str, runs: pd.DataFrame, settings: dict, by_seed: bool = False) -> pd.DataFrame:
    """Return the runs unchanged: each run gives the response of its point and seed."""
    return runs


def compared(runs: pd.DataFrame) -> pd.Series:
    """Quantity for the comparison of the fidelities: slope angle in degrees."""
    return runs["slope_angle_deg"]
