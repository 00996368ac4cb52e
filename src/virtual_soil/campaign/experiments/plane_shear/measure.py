"""Peak and steady strengths from stored curves, and the strength lines of every point."""

import math

import pandas as pd

from dem.experiments.strength import STEADY_PART, peak, steady
from virtual_soil.campaign.experiments.mohr_coulomb import strength_table

MEASURED = (
    *("peak_shear_stress_pa", "peak_normal_stress_pa", "peak_shear_strain"),
    *("steady_shear_stress_pa", "steady_normal_stress_pa", "steady_stress_ratio_se", "steady_solid_fraction", "dilation_m"),
)
#: Table -> status of the tests that count, and prefix of its responses. A peak needs no steady end.
LINES = {"steady_strength": (("steady",), "steady"), "peak_strength": (("steady", "unsteady"), "peak")}


def measured(run: dict, history: pd.DataFrame | None, settings: dict) -> dict:
    """Return a run's row with its strengths, solid fraction and dilation, missing for a failed run."""
    if run["status"] == "failed" or history is None:
        return {**run, **dict.fromkeys(MEASURED, math.nan)}
    curve = [history[name].to_numpy() for name in ("shear_strain", "shear_stress_pa", "plane_normal_stress_pa")]
    highest, last = peak(*curve), steady(*curve)
    part = history["shear_strain"] >= (1.0 - STEADY_PART) * history["shear_strain"].iloc[-1]
    return {
        **run,
        "peak_shear_stress_pa": highest.shear_stress_pa,
        "peak_normal_stress_pa": highest.normal_stress_pa,
        "peak_shear_strain": highest.position,
        "steady_shear_stress_pa": last.shear_stress_pa,
        "steady_normal_stress_pa": last.normal_stress_pa,
        "steady_stress_ratio_se": last.stress_ratio_se,
        "steady_solid_fraction": float(history.loc[part, "solid_fraction"].mean()),
        "dilation_m": float(history["lid_height_m"].iloc[-1] - history["lid_height_m"].iloc[0]),
    }


def reduce(table: str, runs: pd.DataFrame, settings: dict, by_seed: bool = False) -> pd.DataFrame:
    """Fit the strength line of every point and fidelity (and seed, if by_seed), for peak or steady strength."""
    statuses, state = LINES[table]
    columns = f"{state}_shear_stress_pa", f"{state}_normal_stress_pa"
    return strength_table(runs[runs["status"].isin(statuses)], columns, by_seed, f"{state}_")


def compared(runs: pd.DataFrame) -> pd.Series:
    """Quantity for the comparison of the fidelities: steady shear stress over normal stress."""
    return runs["steady_shear_stress_pa"] / runs["steady_normal_stress_pa"]
