"""What the page states of the curves: differences between the codes beside the scatter between slightly changed starts."""

from typing import NamedTuple

import numpy as np
import pandas as pd

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


class Largest(NamedTuple):
    """Largest difference of a count over all grains, and its time in s."""

    share: float
    time_s: float


def zone_difference(ours: pd.DataFrame, theirs: pd.DataFrame, n_grains: int) -> Largest:
    """Largest difference of the grains of any material in any zone at any time."""
    columns = [f"{zone}_{name}" for zone in drum.ZONES for name in drum.GRAINS]
    apart_by = np.abs(ours[columns].to_numpy() - theirs[columns].to_numpy()).max(axis=1)
    k = int(apart_by.argmax())
    return Largest(float(apart_by[k]) / n_grains, float(ours.index[k]))


def lag_s(ours: pd.DataFrame, theirs: pd.DataFrame, quantity: str) -> float:
    """Time in s by which their curve is late: the shift, up to two samples, at which the curves are closest on average."""
    times, step = ours.index.to_numpy(), float(ours.index[1] - ours.index[0])
    inner = slice(2, -2)
    shifts = step * np.linspace(-2.0, 2.0, 81)
    distances = [
        np.abs(np.interp(times[inner] + shift, theirs.index, theirs[quantity]) - ours[quantity].to_numpy()[inner]).mean()
        for shift in shifts
    ]
    return float(shifts[int(np.argmin(distances))])
