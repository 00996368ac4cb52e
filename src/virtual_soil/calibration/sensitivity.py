"""Sensitivity to the variables over the whole design: Sobol indices of the surrogates (Saltelli et al. 2010), by SALib.

First order: the share of a response's variance that one variable explains alone; total: alone and together with others.
"""

import numpy as np
import pandas as pd
from SALib.analyze import sobol as analysis
from SALib.sample import sobol as sampling

from virtual_soil.calibration.space import SOBOL_SEED, Space

#: Base samples; the surrogate is evaluated this many times (number of variables + 2).
SAMPLES = 2**12


def sobol_table(models: dict, space: Space) -> pd.DataFrame:
    """One row per response and variable: first-order and total index, each with the half width of its 95 % interval."""
    problem = {"num_vars": len(space.variables), "names": list(space.variables), "bounds": [[0.0, 1.0]] * len(space.variables)}
    unit = sampling.sample(problem, SAMPLES, calc_second_order=False, seed=SOBOL_SEED)
    rows = []
    for response, model in models.items():
        values = model.predict(space.values(unit))
        constant = values.std() <= 1e-9 * (abs(values.mean()) + 1.0)
        found: dict[str, np.ndarray] = (
            {} if constant else analysis.analyze(problem, values, calc_second_order=False, seed=SOBOL_SEED)
        )
        for k, variable in enumerate(space.variables):
            index = {key: 0.0 if constant else float(found[key][k]) for key in ("S1", "S1_conf", "ST", "ST_conf")}
            rows.append(
                {
                    "response": response,
                    "variable": variable,
                    "first_order": index["S1"],
                    "first_order_ci95": index["S1_conf"],
                    "total": index["ST"],
                    "total_ci95": index["ST_conf"],
                    "response_sd": float(values.std()),
                }
            )
    return pd.DataFrame(rows)
