"""What the page states of the curves: differences between the codes beside the scatter between slightly changed starts."""

from itertools import combinations
from typing import NamedTuple

import numpy as np
import pandas as pd

from virtual_soil.bulk import drum

#: Share of the divisions of all runs below which the codes differ by more than chance.
LEAST_SHARE = 0.05


class Apart(NamedTuple):
    """Of two codes at the same times (k,): times_s, their means, and the standard deviations between their starts."""

    times_s: np.ndarray
    ours: np.ndarray
    theirs: np.ndarray
    sd_ours: np.ndarray
    sd_theirs: np.ndarray

    @property
    def difference(self) -> np.ndarray:
        """Ours minus theirs."""
        return self.ours - self.theirs


def apart(ours: list[pd.DataFrame], theirs: list[pd.DataFrame], quantity: str) -> Apart:
    """Compare a quantity over starts, at least two in each code, with the same samples.

    Raises
    ------
    ValueError : fewer starts, or other samples.
    """
    stacks = []
    for runs in (ours, theirs):
        if len(runs) < 2:
            raise ValueError(f"starts are {len(runs)}; allowed: at least 2 in each code, for a scatter.")
        stacks.append(np.array([run[quantity].to_numpy() for run in runs]))
    times = ours[0].index.to_numpy()
    for run in (*ours, *theirs):
        if not np.allclose(run.index, times, rtol=0.0, atol=1e-9):
            raise ValueError("samples of the runs are at different times; allowed: the same in all runs.")
    a, b = stacks
    return Apart(times, a.mean(axis=0), b.mean(axis=0), a.std(axis=0, ddof=1), b.std(axis=0, ddof=1))


class Chance(NamedTuple):
    """Largest difference of the means in standard errors of that difference, its time in s, and how likely one as large is.

    share : of all ways to divide the runs of both codes into two groups of their sizes, those with as large a difference anywhere.
    """

    errors: float
    time_s: float
    share: float


def worst_errors(first: np.ndarray, second: np.ndarray, least: float) -> tuple[float, int]:
    """Largest difference of the means of curves (n, k) and (m, k) in its standard errors, at least `least`; and its sample."""
    error = np.sqrt(first.var(axis=0, ddof=1) / len(first) + second.var(axis=0, ddof=1) / len(second))
    errors = np.abs(first.mean(axis=0) - second.mean(axis=0)) / np.maximum(error, least)
    worst = int(errors.argmax())
    return float(errors[worst]), worst


def beyond_chance(ours: list[pd.DataFrame], theirs: list[pd.DataFrame], quantity: str, least: float) -> Chance:
    """Compare the difference of the means with the scatter of the starts, at its worst time.

    least : smallest standard error that counts, for times at which all starts agree. A permutation test on the worst time, so that
    neither the number of times nor their correlation matters: were both codes one, the share would be below 1/20 once in 20.

    Raises
    ------
    ValueError : so few starts that the share cannot be below 1/20.
    """
    runs, n = np.array([run[quantity].to_numpy() for run in (*ours, *theirs)]), len(ours)
    groups = list(combinations(range(len(runs)), n))
    if 2.0 / len(groups) >= LEAST_SHARE:
        raise ValueError(f"starts are {n} and {len(theirs)}; allowed: 4 and 4 or more, for a test that can fail.")
    found, worst = worst_errors(runs[:n], runs[n:], least)
    splits = (worst_errors(runs[list(group)], np.delete(runs, group, axis=0), least)[0] for group in groups)
    share = sum(errors >= found * (1.0 - 1e-9) for errors in splits) / len(groups)
    return Chance(found, float(ours[0].index[worst]), share)


class Largest(NamedTuple):
    """Largest difference of the means of a count, its time in s, and the scatter of the starts there; counts over all grains."""

    share: float
    time_s: float
    sd_ours: float
    sd_theirs: float


def zone_difference(ours: list[pd.DataFrame], theirs: list[pd.DataFrame], n_grains: int) -> Largest:
    """Largest difference of the grains of any material in any zone at any time, means over the starts.

    Raises ValueError as `apart`.
    """
    found = []
    for column in (f"{zone}_{name}" for zone in drum.ZONES for name in drum.GRAINS):
        count = apart(ours, theirs, column)
        k = int(np.abs(count.difference).argmax())
        shares = (abs(count.difference[k]), count.sd_ours[k], count.sd_theirs[k])
        share, *scatter = (float(grains) / n_grains for grains in shares)
        found.append(Largest(share, float(count.times_s[k]), *scatter))
    return max(found, key=lambda largest: largest.share)


def lag_s(curves: Apart) -> float:
    """Time in s by which their means are late: the shift, up to two samples, at which the curves are closest on average."""
    times, step = curves.times_s, float(curves.times_s[1] - curves.times_s[0])
    inner = slice(2, -2)
    shifts = step * np.linspace(-2.0, 2.0, 81)
    distances = [np.abs(np.interp(times[inner] + shift, times, curves.theirs) - curves.ours[inner]).mean() for shift in shifts]
    return float(shifts[int(np.argmin(distances))])
