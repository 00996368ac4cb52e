"""Step 2: the grain parameters that change a response y, one at a time (Table 2).

Sensitivity derivative = |dy/y| / |dP/P| for a parameter P. A difference of means counts if it exceeds two of its standard errors.
The scatter over seeds is pooled over all rows, since three runs alone do not determine it. Where a response is a regression through
the runs of a point, whatever their seeds, its value takes the place of the mean, with the standard error of `noise.line_errors`.
"""

from typing import NamedTuple

import numpy as np
import pandas as pd

from virtual_soil.calibration.errors import demand
from virtual_soil.calibration.noise import NOISE_LIMIT, known_scatter, line_errors, pooled_sd
from virtual_soil.calibration.paper import printed_screening
from virtual_soil.calibration.points import point_at
from virtual_soil.calibration.response import Response


def changed_materials(material: dict, screening: dict) -> dict[str, dict]:
    """Parameter -> the material with its value multiplied by its factor in screening["factors"], rounded to four digits."""
    return {name: point_at(material, {name: factor * material[name]}) for name, factor in screening["factors"].items()}


class Group(NamedTuple):
    """What the runs of one material say of a response: mean, its standard error, standard deviation over seeds, number of runs."""

    mean: float
    error: float
    sd: float
    n_runs: int


def screening_table(response: Response, table: pd.DataFrame, material: dict, screening: dict, printed: bool) -> pd.DataFrame:
    """Screening of one response: base set first, then one row per changed parameter.

    table : of runs or regressions, with the response's column. material : the base values. screening : base_seeds, changed_seeds,
    factors. printed : True for the paper's values beside ours; else they are missing. Failed runs do not count; a parameter without
    any good run has NaN, and so has the standard deviation of a regression. Raises CalibrationError when no base run is left.
    """
    changes = changed_materials(material, screening)
    wanted = {"base": (material, "base_seeds")} | {name: (changed, "changed_seeds") for name, changed in changes.items()}
    of = grouped if response.error_column is None else fitted
    groups = of(response, table, {name: (values, screening[seeds]) for name, (values, seeds) in wanted.items()})
    base = groups.pop("base")
    demand(base.n_runs > 0, "base runs of the screening that ended well", 0, "at least one")
    itself = base._replace(error=0.0)
    rows = [row_of(response, "base", itself, itself, np.nan, np.nan)]
    rows += [row_of(response, name, base, group, material[name], changes[name][name]) for name, group in groups.items()]
    found = pd.DataFrame(rows)
    return pd.concat([found, printed_screening(response.name if printed else "", found["parameter"])], axis=1)


def matching(response: Response, table: pd.DataFrame, material: dict) -> pd.Series:
    """Mask of the rows of a table with these material values and a result."""
    match = (table["fidelity"] == "campaign") & table[response.column].notna()
    for key, value in material.items():
        match &= np.isclose(table[key], value, rtol=1e-9, atol=0.0)
    return match


def grouped(response: Response, table: pd.DataFrame, wanted: dict) -> dict[str, Group]:
    """Groups of a table of runs; wanted : name -> material values and seeds."""
    values = {
        name: table.loc[matching(response, table, material) & table["seed"].isin(seeds), response.column].to_numpy()
        for name, (material, seeds) in wanted.items()
    }
    pooled = pooled_sd(list(values.values()))
    return {name: group_of(runs, pooled) for name, runs in values.items()}


def group_of(runs: np.ndarray, pooled: float) -> Group:
    """Group of values (n,) with a known scatter."""
    if not len(runs):
        return Group(np.nan, np.nan, np.nan, 0)
    sd = float(runs.std(ddof=1)) if len(runs) > 1 else np.nan
    return Group(float(runs.mean()), float(pooled / np.sqrt(len(runs))), sd, len(runs))


def fitted(response: Response, table: pd.DataFrame, wanted: dict) -> dict[str, Group]:
    """As `grouped`, of a table of regressions, each of all seeds of its point."""
    errors, found = line_errors(table, str(response.error_column), known_scatter(response, table)), {}
    for name, (material, _) in wanted.items():
        match = matching(response, table, material).to_numpy()
        mean, n_runs = table.loc[match, response.column].mean(), int(table.loc[match, "n_runs"].sum())
        found[name] = Group(float(mean), float(errors[match].mean()) if match.any() else np.nan, np.nan, n_runs)
    return found


def row_of(response: Response, parameter: str, base: Group, group: Group, value: float, changed: float) -> dict:
    """Row of a parameter: its values, the group's, and what differs from the base."""
    difference, error = group.mean - base.mean, float(np.hypot(base.error, group.error))
    relative_change = abs(changed / value - 1.0)
    return {
        "parameter": parameter,
        "base_value": float(value),
        "changed_value": float(changed),
        response.column: group.mean,
        f"sd_{response.suffix}": group.sd,
        "n_runs": group.n_runs,
        "sensitivity_percent": 100.0 * abs(difference / base.mean) / relative_change if base.mean > 0 else np.nan,
        f"difference_{response.suffix}": difference,
        f"difference_se_{response.suffix}": error,
        "exceeds_noise": bool(abs(difference) > NOISE_LIMIT * error),
    }
