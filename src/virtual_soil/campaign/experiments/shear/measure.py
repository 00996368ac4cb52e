"""Shear strengths from stored curves, and the strength line of every point."""

import math

import numpy as np
import pandas as pd

from dem.measure.shear import strength
from virtual_soil.campaign.experiments.mohr_coulomb import strength_table
from virtual_soil.campaign.experiments.shear.definitions import PLATEAU_WINDOW

#: Configured strength and normal stress -> columns of the shear table.
COLUMNS = {
    ("peak", "plane"): ("peak_shear_stress_pa", "peak_plane_normal_stress_pa"),
    ("plateau", "plane"): ("plateau_shear_stress_pa", "plane_normal_stress_pa"),
    ("peak", "applied"): ("peak_shear_stress_pa", "normal_stress_pa"),
    ("plateau", "applied"): ("plateau_shear_stress_pa", "normal_stress_pa"),
}
#: Normal stresses that differ by less are one: laboratories load by dead weights.
SAME_STRESS = 0.05
#: Displacements at which two curves are compared.
N_COMPARED = 100
STRENGTHS = ("peak_shear_stress_pa", "plateau_shear_stress_pa", "plane_normal_stress_pa", "peak_plane_normal_stress_pa")


def measured(run: dict, history: pd.DataFrame | None, settings: dict) -> dict:
    """Return a run's row with its strengths, its dilation and its distance from the laboratory's curve, missing for a failed run.

    settings : the experiment's section of the configuration; its `curve` is a laboratory's or None, see `curve_distance`.
    """
    if run["status"] == "failed" or history is None:
        return {**run, **dict.fromkeys((*STRENGTHS, "dilation_m", "curve_distance"), math.nan)}
    displacement, shear, normal = (history[name] for name in ("displacement_m", "shear_stress_pa", "plane_normal_stress_pa"))
    result = strength(displacement.to_numpy(), shear.to_numpy(), normal.to_numpy(), PLATEAU_WINDOW)
    dilation = history["lid_height_m"].iloc[-1] - history["lid_height_m"].iloc[0]
    distance = curve_distance(history, settings.get("curve"), settings.get("curve_range_m"))
    return {**run, **{key: getattr(result, key) for key in STRENGTHS}, "dilation_m": dilation, "curve_distance": distance}


def curve_distance(history: pd.DataFrame, curve: list[dict] | None, range_m: list[float] | None) -> float:
    """Root mean square difference of shear over normal stress between a simulated test and the laboratory's, dimensionless.

    curve : the laboratory's tests, each with normal_stress_pa and, (n,) each, displacement_m and stress_ratio. The one whose normal
    stress is the test's counts, over the displacements in range_m that both have; NaN if there is none.
    """
    stress = float(history["applied_normal_stress_pa"].median())
    found = [test for test in curve or () if abs(test["normal_stress_pa"] / stress - 1.0) <= SAME_STRESS]
    if not found:
        return math.nan
    u, ratio = history["displacement_m"].to_numpy(), (history["shear_stress_pa"] / history["plane_normal_stress_pa"]).to_numpy()
    ends = [(u.min(), u.max()), range_m or (0.0, math.inf)]
    squares = []
    for test in found:
        theirs = np.asarray(test["displacement_m"], float)
        low, high = max(theirs.min(), *(end[0] for end in ends)), min(theirs.max(), *(end[1] for end in ends))
        if high > low:
            x = np.linspace(low, high, N_COMPARED)
            squares.append(((np.interp(x, u, ratio) - np.interp(x, theirs, test["stress_ratio"])) ** 2).mean())
    return float(np.sqrt(np.mean(squares))) if squares else math.nan


def reduce(table: str, runs: pd.DataFrame, settings: dict, by_seed: bool = False) -> pd.DataFrame:
    """Fit the strength line of every point and fidelity (and seed, if by_seed)."""
    columns = COLUMNS[settings["strength"], settings["normal_stress"]]
    return strength_table(runs[runs["status"] == "done"], columns, by_seed)


def compared(runs: pd.DataFrame) -> pd.Series:
    """Quantity for the comparison of the fidelities: shear stress over normal stress on the shear plane, at the plateau."""
    return runs["plateau_shear_stress_pa"] / runs["plane_normal_stress_pa"]
