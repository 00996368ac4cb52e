"""Angles of repose from stored heaps."""

import pandas as pd

from dem.measure.heap import measure_heap
from virtual_soil.campaign.experiments.repose.declared import SOUND, flat_bound_deg
from virtual_soil.campaign.grains import grain_radii_m

NOTHING = {"angle_profile_deg": None, "angle_silhouette_deg": None, "angle_azimuth_sd_deg": None, "heap_height_m": None}


def measured(run: dict, grains: pd.DataFrame | None, settings: dict) -> dict:
    """Return a run's row with its angles: missing for a failed run.

    Where no heap remains the estimators give 0. The angle of repose then lies between 0 and that of the lowest heap,
    `angle_bound_deg`, and its value is the middle. A heap that still moves has angles by the estimators, but no angle of repose: no
    fit and no comparison uses it.
    settings : the experiment's section of the configuration.
    """
    row = {**run, **angles(run, grains)}
    bound = flat_bound_deg(run["n_particles"]) if row["status"] == "flat" else None
    angle = row[f"angle_{settings['estimator']}_deg"] if row["status"] in SOUND else None
    return {**row, "angle_of_repose_deg": angle if bound is None else 0.5 * bound, "angle_bound_deg": bound}


def angles(run: dict, grains: pd.DataFrame | None) -> dict:
    """Return angles and height of a heap by all estimators, and its status."""
    if run["status"] == "failed" or grains is None:
        return dict.fromkeys(NOTHING)
    if run["status"] == "flat":
        return dict.fromkeys(NOTHING, 0.0)
    shape = measure_heap(grains[["x_m", "y_m", "z_m"]].to_numpy(), grains["radius_m"].to_numpy(), grain_radii_m(grains))
    flat = shape.is_flat and run["status"] == "static"  # what still moves may end higher or lower
    return {"status": "flat" if flat else run["status"], **{key: getattr(shape, key) for key in NOTHING}}


def reduce(table: str, runs: pd.DataFrame, settings: dict, by_seed: bool = False) -> pd.DataFrame:
    """Return the runs unchanged: each run gives the response of its point and seed."""
    return runs


def compared(runs: pd.DataFrame) -> pd.Series:
    """Quantity for the comparison of the fidelities: angle of repose in degrees."""
    return runs["angle_of_repose_deg"]
