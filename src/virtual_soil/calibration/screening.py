"""Step 2: the grain parameters that change a response y, one at a time (Table 2).

Sensitivity derivative = |dy/y| / |dP/P| for a parameter P. A difference of means counts if it exceeds two of its standard errors.
The scatter over seeds is pooled over all rows, since three runs alone do not determine it.
"""

import numpy as np
import pandas as pd

from virtual_soil.calibration.errors import demand
from virtual_soil.calibration.noise import NOISE_LIMIT, pooled_sd
from virtual_soil.calibration.paper import printed_screening
from virtual_soil.calibration.points import point_at
from virtual_soil.calibration.response import Response


def changed_materials(material: dict, screening: dict) -> dict[str, dict]:
    """Parameter -> the material with its value multiplied by its factor in screening["factors"], rounded to four digits."""
    return {name: point_at(material, {name: factor * material[name]}) for name, factor in screening["factors"].items()}


def screening_table(response: Response, table: pd.DataFrame, material: dict, screening: dict, printed: bool) -> pd.DataFrame:
    """Screening of one response: base set first, then one row per changed parameter.

    table : of runs, with the response's column. material : the base values. screening : base_seeds, changed_seeds, factors.
    printed : True for the paper's values beside ours; else they are missing. Failed runs do not count; a parameter without any
    good run has NaN. Raises CalibrationError when no base run is left.
    """
    base = results(response, table, material, material, screening["base_seeds"])
    demand(len(base) > 0, "base runs of the screening that ended well", 0, "at least one")
    groups = {
        parameter: results(response, table, changed, material, screening["changed_seeds"])
        for parameter, changed in changed_materials(material, screening).items()
    }
    pooled = pooled_sd([base, *groups.values()])
    rows = [
        {
            "parameter": "base",
            "base_value": np.nan,
            "changed_value": np.nan,
            **summary(response, base),
            **compared(response, base, base, np.nan, 0.0),
        }
    ]
    for parameter, runs in groups.items():
        value, changed = material[parameter], changed_materials(material, screening)[parameter][parameter]
        rows.append(
            {
                "parameter": parameter,
                "base_value": float(value),
                "changed_value": float(changed),
                **summary(response, runs),
                **compared(response, base, runs, abs(changed / value - 1.0), pooled),
            }
        )
    found = pd.DataFrame(rows)
    return pd.concat([found, printed_screening(response.name if printed else "", found["parameter"])], axis=1)


def results(response: Response, table: pd.DataFrame, wanted: dict, material: dict, seeds) -> np.ndarray:
    """Values of a response from the runs with the wanted material values and seeds."""
    match = (table["fidelity"] == "campaign") & table["seed"].isin(seeds) & table[response.column].notna()
    for key in material:
        match &= np.isclose(table[key], wanted[key], rtol=1e-9, atol=0.0)
    return table.loc[match, response.column].to_numpy()


def summary(response: Response, runs: np.ndarray) -> dict:
    """Mean, standard deviation and number of runs."""
    mean = float(runs.mean()) if len(runs) else np.nan
    sd = float(runs.std(ddof=1)) if len(runs) > 1 else np.nan
    return {response.column: mean, f"sd_{response.suffix}": sd, "n_runs": len(runs)}


def compared(response: Response, base: np.ndarray, runs: np.ndarray, relative_change: float, pooled: float) -> dict:
    """Difference of the means with its standard error, and the sensitivity derivative."""
    difference, error, sensitivity = np.nan, np.nan, np.nan
    if len(runs):
        difference = float(runs.mean() - base.mean())
        error = float(pooled * np.sqrt(1.0 / len(base) + 1.0 / len(runs)))
        sensitivity = 100.0 * abs(difference / base.mean()) / relative_change if base.mean() > 0 else np.nan
    return {
        "sensitivity_percent": sensitivity,
        f"difference_{response.suffix}": difference,
        f"difference_se_{response.suffix}": error,
        "exceeds_noise": bool(abs(difference) > NOISE_LIMIT * error),
    }
