"""Step 2: which grain parameters change the angle of repose (Table 2).

Sensitivity derivative = |dA/A| / |dP/P|. A difference of means counts when it exceeds two of its standard errors; the scatter
over seeds is pooled over all rows, since three runs alone do not tell it.
"""

import numpy as np
import pandas as pd

from virtual_soil.calibration import paper
from virtual_soil.calibration.errors import demand
from virtual_soil.calibration.noise import pooled_sd

ANGLE = "angle_of_repose_deg"
NOISE_LIMIT = 2.0


def screening_table(repose: pd.DataFrame, material: dict, screening: dict) -> pd.DataFrame:
    """Base set first, then one row per changed parameter.

    repose : the table of heaps. material : the base values. screening : base_seeds, changed_seeds, changes. Failed runs do not
    count; a parameter without any good run has NaN. Raises CalibrationError when no base run is left.
    """
    base = angles(repose, material, material, screening["base_seeds"])
    demand(len(base) > 0, "base runs of the screening that ended well", 0, "at least one")
    groups = {
        parameter: angles(repose, {**material, parameter: value}, material, screening["changed_seeds"])
        for parameter, value in screening["changes"].items()
    }
    pooled = pooled_sd([base, *groups.values()])
    rows = [
        {
            "parameter": "base",
            "base_value": np.nan,
            "changed_value": np.nan,
            **summary(base),
            **compared(base, base, np.nan, 0.0),
        }
    ]
    for parameter, runs in groups.items():
        value, changed = material[parameter], screening["changes"][parameter]
        rows.append(
            {
                "parameter": parameter,
                "base_value": float(value),
                "changed_value": float(changed),
                **summary(runs),
                **compared(base, runs, abs(changed / value - 1.0), pooled),
            }
        )
    table = pd.DataFrame(rows)
    printed = [paper.SCREENING.get(name, (np.nan, np.nan, np.nan)) for name in table["parameter"]]
    columns = ["paper_angle_deg", "paper_sd_deg", "paper_sensitivity_percent"]
    return pd.concat([table, pd.DataFrame(printed, columns=columns).astype(float)], axis=1)


def angles(repose: pd.DataFrame, wanted: dict, material: dict, seeds) -> np.ndarray:
    """Angles in deg of the heaps with the wanted material values and seeds."""
    match = (repose["fidelity"] == "campaign") & repose["seed"].isin(seeds) & repose[ANGLE].notna()
    for key in material:
        match &= np.isclose(repose[key], wanted[key], rtol=1e-9, atol=0.0)
    return repose.loc[match, ANGLE].to_numpy()


def summary(runs: np.ndarray) -> dict:
    """Mean, standard deviation and number of runs."""
    mean = float(runs.mean()) if len(runs) else np.nan
    return {ANGLE: mean, "sd_deg": float(runs.std(ddof=1)) if len(runs) > 1 else np.nan, "n_runs": len(runs)}


def compared(base: np.ndarray, runs: np.ndarray, relative_change: float, pooled: float) -> dict:
    """Difference of the means with its standard error, and the sensitivity derivative."""
    if not len(runs):
        return {"sensitivity_percent": np.nan, "difference_deg": np.nan, "difference_se_deg": np.nan, "exceeds_noise": False}
    difference = float(runs.mean() - base.mean())
    error = pooled * np.sqrt(1.0 / len(base) + 1.0 / len(runs))
    return {
        "sensitivity_percent": 100.0 * abs(difference / base.mean()) / relative_change if base.mean() > 0 else np.nan,
        "difference_deg": difference,
        "difference_se_deg": float(error),
        "exceeds_noise": bool(abs(difference) > NOISE_LIMIT * error),
    }
