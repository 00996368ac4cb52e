"""Scatter over seeds, and the standard errors that follow from it.

A response's table has one of two forms, see `calibration.response`: each row is a run (no error column), or a regression through
several runs (an error column, n_runs and relative_scatter).
"""

import numpy as np
import pandas as pd
from scipy import stats

from virtual_soil.calibration.response import Response

#: Two numbers agree if they differ by no more than this number of standard errors of their difference.
NOISE_LIMIT = 2.0
#: Least standard uncertainty of a target that states none, in the response's unit: a target may be zero.
LEAST_UNCERTAINTY = 1.0
#: Degrees of freedom that a regression borrows from all regressions to know its own scatter: those of a line through 8 tests.
BORROWED = 6.0


def known_scatter(response: Response, table: pd.DataFrame) -> float:
    """Scatter that a campaign's table knows of a response; `error_of_mean` turns it into an error.

    Standard deviation over seeds in the response's unit, or, of regressions, their relative scatter. NaN without repeats.
    """
    if response.error_column is None:
        return pooled_scatter(table[table[response.column].notna()], response.column)
    return pooled_line_scatter(table[table["fidelity"] == "campaign"])


def target_uncertainty(target, ratio: float) -> float:
    """Standard uncertainty of a row of the soil table: the stated one, or `ratio` of its value; never zero."""
    stated = target["standard_uncertainty"]
    return float(stated) if stated > 0 else max(ratio * abs(target["value"]), LEAST_UNCERTAINTY)


def student(freedom):
    """Factor on a standard error that rests on `freedom` degrees of freedom (any shape), to compare it with normal ones.

    An interval of two standard errors then has the probability of two normal standard deviations, however few the values.
    """
    return stats.t.ppf(stats.norm.cdf(NOISE_LIMIT), freedom) / NOISE_LIMIT


def error_of_mean(response: Response, rows: pd.DataFrame, scatter: float, n_seeds: int) -> float:
    """Standard error of a response at one point from the known scatter.

    rows : those of the point in the response's table; the first regression counts. NaN where there is no regression.
    """
    if response.error_column is None:
        return scatter / np.sqrt(max(n_seeds, 1))
    return float(line_errors(rows, response.error_column, scatter)[0]) if len(rows) else np.nan


def pooled_line_scatter(regressions: pd.DataFrame) -> float:
    """Relative scatter of the runs about their regressions, pooled over a table of regressions."""
    freedom = regressions["n_runs"] - 2
    return float(np.sqrt((freedom * regressions["relative_scatter"] ** 2).sum() / freedom.sum()))


def line_errors(regressions: pd.DataFrame, error: str, pooled: float) -> np.ndarray:
    """Standard errors of regressions (n,), column `error`, each with its scatter moderated by that of all regressions.

    The column's errors have Student's factor for the regression's own degrees of freedom, the result that for the moderated ones.

    A line through few runs can be straight by chance and would then count as certain. Its variance is averaged with the pooled one,
    weighted by degrees of freedom: the posterior mean of a variance whose prior is worth BORROWED of them (Smyth 2004).
    """
    freedom, own = regressions["n_runs"].to_numpy() - 2.0, regressions["relative_scatter"].to_numpy()
    moderated = np.sqrt((BORROWED * pooled**2 + freedom * own**2) / (BORROWED + freedom))
    factor = student(BORROWED + freedom) / student(freedom)
    return regressions[error].to_numpy() * factor * moderated / np.maximum(own, 1e-12)


def pooled_sd(groups: list[np.ndarray]) -> float:
    """Standard deviation over seeds, pooled over groups of two and more runs; NaN if there are none."""
    groups = [np.asarray(group, float) for group in groups if len(group) > 1]
    freedom = sum(len(group) - 1 for group in groups)
    return float(np.sqrt(sum(((group - group.mean()) ** 2).sum() for group in groups) / freedom)) if freedom else float("nan")


def pooled_scatter(runs: pd.DataFrame, quantity: str) -> float:
    """Standard deviation of a column over seeds, pooled over points and fidelities; NaN without repeats."""
    return pooled_sd([group.to_numpy() for _, group in runs.groupby(["point_id", "fidelity"])[quantity]])
