"""Scatter over seeds, and the standard errors that follow from it.

A response's table has one of two forms, see `calibration.response`: each row is a run (no error column), or a regression through
several runs (an error column, n_runs and relative_scatter).
"""

import numpy as np
import pandas as pd
import scipy

from virtual_soil.calibration.response import Response
from virtual_soil.calibration.space import Space

#: Two numbers agree if they differ by no more than this number of standard errors of their difference.
NOISE_LIMIT = 2.0
#: Least standard uncertainty of a target that states none, in the response's unit: a target may be zero.
LEAST_UNCERTAINTY = 1.0
#: Degrees of freedom that a regression borrows from all regressions to know its own scatter: those of a line through 8 tests.
BORROWED = 6.0
#: Distance in the unit cube of the design over which repeated runs know the scatter of their neighbours.
NEIGHBOURHOOD = 0.2


def known_scatter(response: Response, table: pd.DataFrame) -> float:
    """Scatter that a campaign's table knows of a response in the mean over the design.

    Standard deviation over seeds in the response's unit, or, of regressions, their relative scatter. NaN without repeats.
    """
    if response.error_column is None:
        found = pooled_scatter(table[table[response.column].notna() & ~censored(response, table)], response.column)
        return found if np.isfinite(found) else bounded_scatter(response, table)
    return pooled_line_scatter(table[table["fidelity"] == "campaign"])


def bounded_scatter(response: Response, table: pd.DataFrame) -> float:
    """Scatter where no point has two measured values, as its repeats are bounded: theirs, at least what the bounds leave open.

    NaN without repeats.
    """
    found = pooled_scatter(table[table[response.column].notna()], response.column)
    bounds = (
        table.loc[censored(response, table), response.bound_column] if response.bound_column in table else pd.Series(dtype=float)
    )
    return float(np.fmax(found, bounds.max() / np.sqrt(12.0))) if np.isfinite(found) else found


def scatter_at(response: Response, table: pd.DataFrame, space: Space, values) -> np.ndarray:
    """Scatter at points (m,) of the design, as `error_of_mean` needs it; values maps each variable to m values.

    The variance of runs is that of the repeated points around, each weighted by its degrees of freedom and a Gaussian of its
    distance in the unit cube, and the pooled one, which counts as BORROWED degrees of freedom: far from all repeated points the
    scatter is the pooled one. Regressions know their own scatter, so theirs is pooled. NaN without repeats.
    """
    known, unit = known_scatter(response, table), space.unit(values)
    if response.error_column is not None or not np.isfinite(known):
        return np.full(len(unit), known)
    measured = table[table[response.column].notna() & ~censored(response, table)]
    groups = [rows for _, rows in measured.groupby(["point_id", "fidelity"]) if len(rows) > 1]
    if not groups:
        return np.full(len(unit), known)
    there = space.unit({name: np.array([rows[name].iloc[0] for rows in groups]) for name in space.variables})
    freedom = np.array([len(rows) - 1.0 for rows in groups])
    variance = np.array([rows[response.column].var(ddof=1) for rows in groups])
    squares = ((unit[:, None] - there[None]) ** 2).sum(axis=2)
    weights = freedom * np.exp(-0.5 * squares / NEIGHBOURHOOD**2)
    return np.sqrt((BORROWED * known**2 + weights @ variance) / (BORROWED + weights.sum(axis=1)))


def censored(response: Response, rows: pd.DataFrame) -> np.ndarray:
    """Mask (n,) of the runs of which only an upper bound of the response is known."""
    if response.bound_column not in rows:
        return np.zeros(len(rows), bool)
    return rows[response.bound_column].notna().to_numpy()


def censoring(response: Response, rows: pd.DataFrame) -> float:
    """Standard error of the mean of runs for those of which only an upper bound is known: that of a uniform distribution.

    All of them are bounded by the same slope, so more seeds do not make it smaller.
    """
    if not censored(response, rows).any():
        return 0.0
    return float((rows[response.bound_column].fillna(0.0) / np.sqrt(12.0)).mean())


def target_uncertainty(target, ratio: float) -> float:
    """Standard uncertainty of a row of the soil table: the stated one, or `ratio` of its value; never zero."""
    stated = target["standard_uncertainty"]
    return float(stated) if stated > 0 else max(ratio * abs(target["value"]), LEAST_UNCERTAINTY)


def student(freedom):
    """Factor on a standard error that rests on `freedom` degrees of freedom (any shape), to compare it with normal ones.

    An interval of two standard errors then has the probability of two normal standard deviations, however few the values.
    """
    return scipy.stats.t.ppf(scipy.stats.norm.cdf(NOISE_LIMIT), freedom) / NOISE_LIMIT


def error_of_mean(response: Response, rows: pd.DataFrame, scatter: float, n_seeds: int) -> float:
    """Standard error of a response at one point from the known scatter there (`scatter_at`).

    rows : those of the point in the response's table; the first regression counts. NaN where there is no regression.
    """
    if response.error_column is None:
        return float(np.hypot(scatter / np.sqrt(max(n_seeds, 1)), censoring(response, rows)))
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
