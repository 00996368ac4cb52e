"""What the page states of the curves: differences between the codes beside the scatter between slightly changed starts."""

from typing import NamedTuple

import numpy as np
import pandas as pd
from scipy import stats

from virtual_soil.bulk import drum


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
    """Largest difference of the means in standard errors of that difference, its time in s, and what is allowed."""

    errors: float
    time_s: float
    allowed: float


def beyond_chance(quantity: Apart, n_ours: int, n_theirs: int, least: float) -> Chance:
    """Compare the difference of the means with the scatter of n_ours and n_theirs starts, at its worst time.

    least : smallest standard error that counts, for times at which all starts agree. Allowed is what chance exceeds once in 20
    at a given time (Student's t, equal variances), so that the worst of many times is judged strictly.
    """
    error = np.sqrt(quantity.sd_ours**2 / n_ours + quantity.sd_theirs**2 / n_theirs)
    errors = np.abs(quantity.difference) / np.maximum(error, least)
    worst = int(errors.argmax())
    return Chance(float(errors[worst]), float(quantity.times_s[worst]), float(stats.t.ppf(0.975, n_ours + n_theirs - 2)))


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
