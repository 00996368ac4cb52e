"""Shear strengths from stored curves, and the strength line of every point."""

import math

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
STRENGTHS = ("peak_shear_stress_pa", "plateau_shear_stress_pa", "plane_normal_stress_pa", "peak_plane_normal_stress_pa")


def measured(run: dict, history: pd.DataFrame | None, settings: dict) -> dict:
    """Return a run's row with its strengths and its dilation, missing for a failed run.

    settings : the experiment's section of the configuration.
    """
    if run["status"] == "failed" or history is None:
        return {**run, **dict.fromkeys((*STRENGTHS, "dilation_m"), math.nan)}
    displacement, shear, normal = (history[name] for name in ("displacement_m", "shear_stress_pa", "plane_normal_stress_pa"))
    result = strength(displacement.to_numpy(), shear.to_numpy(), normal.to_numpy(), PLATEAU_WINDOW)
    dilation = history["lid_height_m"].iloc[-1] - history["lid_height_m"].iloc[0]
    return {**run, **{key: getattr(result, key) for key in STRENGTHS}, "dilation_m": dilation}


def reduce(table: str, runs: pd.DataFrame, settings: dict, by_seed: bool = False) -> pd.DataFrame:
    """Fit the strength line of every point and fidelity (and seed, if by_seed)."""
    columns = COLUMNS[settings["strength"], settings["normal_stress"]]
    return strength_table(runs[runs["status"] == "done"], columns, by_seed)


def compared(runs: pd.DataFrame) -> pd.Series:
    """Quantity for the comparison of the fidelities: shear stress over normal stress on the shear plane, at the plateau."""
    return runs["plateau_shear_stress_pa"] / runs["plane_normal_stress_pa"]
