"""Strength of a sheared soil: peak and plateau of a noisy history of shear stress.

The shear stress of a few thousand grains fluctuates by some 5 % as force chains build and buckle. The highest sample is
therefore the highest fluctuation, so the peak is that of a short running mean (see `PEAK_WINDOW_RATIO`).

Signs: shear stress is positive when the soil resists, normal stress positive in compression.
"""

from dataclasses import dataclass

import numpy as np

from dem.html import Rich

#: Window of the running mean, as a part of all samples. A peak over which the stress rises and falls as a parabola
#: within 30 % of the displacement on each side loses 1 % of its height; 100 samples with a noise of 5 % raise
#: it by 3 %, where the highest single sample would be 12 % too high.
PEAK_WINDOW_RATIO = 0.1

#: So that the running mean has at least 3 samples.
MIN_SAMPLES = 30

#: So that the plateau is a mean at all.
MIN_PLATEAU_SAMPLES = 5


class HistoryError(ValueError):
    """A shear history from which no strength can be read."""


@dataclass(frozen=True, kw_only=True)
class ShearStrength(Rich):
    """Shear stresses at peak and plateau, each with the normal stress on the shear plane over the same samples.

    `plane_normal_stress_pa` belongs to the plateau. `plateau_shear_stress_sd_pa` is the standard deviation of the
    single samples there; they are not independent, so it is not an error of the mean.
    """

    peak_shear_stress_pa: float
    peak_plane_normal_stress_pa: float
    peak_displacement_m: float
    plateau_shear_stress_pa: float
    plateau_shear_stress_sd_pa: float
    plane_normal_stress_pa: float


def strength(displacement_m, shear_stress_pa, plane_normal_stress_pa, plateau_window):
    """Peak and plateau strength of one direct-shear run.

    Parameters
    ----------
    displacement_m : array_like, shape (n,)
        Displacement of the moving frame, ascending in even steps; n is at least 30.
    shear_stress_pa, plane_normal_stress_pa : array_like, shape (n,)
        Window averages that belong to these displacements.
    plateau_window : float
        Last part of the displacement that is the plateau; above 0, at most 1.

    Returns
    -------
    ShearStrength
        The peak is the highest running mean over a tenth of the samples; the plateau is a plain mean.

    Raises
    ------
    HistoryError
        If the history is empty, too short, uneven in length, not finite, or does not move forward.
    """
    displacement, shear, normal = _checked(displacement_m, shear_stress_pa, plane_normal_stress_pa)
    plateau = _plateau(displacement, plateau_window)
    n_window = round(PEAK_WINDOW_RATIO * displacement.size)
    running_shear = _running_mean(shear, n_window)
    peak = np.argmax(running_shear)
    return ShearStrength(
        peak_shear_stress_pa=float(running_shear[peak]),
        peak_plane_normal_stress_pa=float(_running_mean(normal, n_window)[peak]),
        peak_displacement_m=float(_running_mean(displacement, n_window)[peak]),
        plateau_shear_stress_pa=float(shear[plateau].mean()),
        plateau_shear_stress_sd_pa=float(shear[plateau].std(ddof=1)),
        plane_normal_stress_pa=float(normal[plateau].mean()),
    )


def _checked(displacement_m, shear_stress_pa, plane_normal_stress_pa):
    columns = {
        "displacement_m": np.asarray(displacement_m, dtype=float),
        "shear_stress_pa": np.asarray(shear_stress_pa, dtype=float),
        "plane_normal_stress_pa": np.asarray(plane_normal_stress_pa, dtype=float),
    }
    n_samples = columns["displacement_m"].size
    if n_samples < MIN_SAMPLES:
        raise HistoryError(f"displacement_m has {n_samples} samples; at least {MIN_SAMPLES} are needed")
    for name, column in columns.items():
        if column.shape != (n_samples,):
            raise HistoryError(f"{name} has shape {column.shape}; ({n_samples},), one value a displacement, is allowed")
        finite = np.isfinite(column)
        if not finite.all():
            worst = np.argmin(finite)
            raise HistoryError(f"{name} is {column[worst]} in sample {worst}; only finite numbers are allowed")
    steps = np.diff(columns["displacement_m"])
    if (steps <= 0.0).any():
        raise HistoryError(f"displacement_m does not grow after sample {np.argmax(steps <= 0.0)}; it must ascend")
    return columns.values()


def _plateau(displacement, plateau_window):
    """Mask of the samples in the last part of the displacement."""
    if not 0.0 < plateau_window <= 1.0:
        raise HistoryError(f"plateau_window is {plateau_window}; above 0 and at most 1 is allowed")
    start, end = displacement[0], displacement[-1]
    plateau = displacement >= end - plateau_window * (end - start)
    n_samples = plateau.sum()
    if n_samples < MIN_PLATEAU_SAMPLES:
        raise HistoryError(f"plateau_window {plateau_window} holds {n_samples} samples; at least {MIN_PLATEAU_SAMPLES} are needed")
    return plateau


def _running_mean(values, n_window):
    """Means over each full window: (n - n_window + 1,) values."""
    return np.convolve(values, np.full(n_window, 1.0 / n_window), mode="valid")
