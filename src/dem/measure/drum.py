"""What a rotating drum tells: the angle of its surface over time, its mean, and the angles between which avalanches run.

They read what a camera sees through a glass front: heights of the surface across the drum at many times.
"""

import math
from dataclasses import dataclass

import numpy as np

from dem.html import Rich

#: Part of the surface's width, about its middle, to which the line is fitted: away from the shell, where it bends.
MIDDLE_SHARE = 0.5
#: First guess of that part, in radii of the drum on both sides of the axis; fewest heights of a line; most repetitions of its fit.
FIRST_HALF, LEAST_HEIGHTS, MAX_FITS = 0.5, 5, 20
#: Blocks of equal time for the error of the mean angle.
N_BLOCKS = 8
#: A turning point of the angle counts if the angle then moves away from it by this number of standard deviations.
TURNING_SDS = 1.0


@dataclass(frozen=True, kw_only=True)
class DrumAngle(Rich):
    """Angle of the surface at one rate.

    mean_deg, error_deg : mean over time, and its standard error from blocks of time. scatter_deg : standard deviation over time.
    upper_deg, lower_deg : means of its maxima and minima. Avalanches begin at the upper and end at the lower; in a steady flow both
    lie one or two scatters from the mean, and tell nothing else. n_avalanches : number of maxima.
    """

    mean_deg: float
    error_deg: float
    scatter_deg: float
    upper_deg: float
    lower_deg: float
    n_avalanches: int


NOTHING = DrumAngle(
    mean_deg=math.nan, error_deg=math.nan, scatter_deg=math.nan, upper_deg=math.nan, lower_deg=math.nan, n_avalanches=0
)


def surface_angle_deg(x, height) -> float:
    """Angle of the middle part of a surface, positive if it rises along x.

    The line is fitted to the heights within MIDDLE_SHARE of the chord that it cuts from the drum, about the chord's middle, and
    fitted again until these heights stay the same.

    Parameters
    ----------
    x, height : array_like, shape (m,)
        Place across the drum and height of the surface from the drum's axis, over its radius; heights may be nan.

    Returns
    -------
    Angle in degrees; nan where fewer than LEAST_HEIGHTS heights are left, or no line crosses the drum.
    """
    x, height = np.asarray(x, float), np.asarray(height, float)
    known = np.isfinite(height)
    used = known & (np.abs(x) < FIRST_HALF)
    slope = math.nan
    for _ in range(MAX_FITS):
        if used.sum() < LEAST_HEIGHTS:
            return math.nan
        slope, at_axis = np.polyfit(x[used], height[used], 1)
        stretch = 1.0 + slope * slope
        half_squared = 1.0 - at_axis * at_axis / stretch
        if half_squared <= 0.0:
            return math.nan
        middle = -at_axis * slope / stretch
        again = known & (np.abs(x - middle) * math.sqrt(stretch) < MIDDLE_SHARE * math.sqrt(half_squared))
        if (again == used).all():
            break
        used = again
    return math.degrees(math.atan(slope))


def steady_angle(turns, angle_deg, turns_before: float) -> DrumAngle:
    """Mean and turning points of an angle after a number of turns.

    Parameters
    ----------
    turns, angle_deg : array_like, shape (n,)
        Turns since this rate began, ascending, and the angle of the surface; angles may be nan.

    Returns
    -------
    DrumAngle : nan with fewer than two angles for each block.
    """
    turns, angle = np.asarray(turns, float), np.asarray(angle_deg, float)
    angle = angle[(turns >= turns_before) & np.isfinite(angle)]
    if len(angle) < 2 * N_BLOCKS:
        return NOTHING
    means, scatter = [block.mean() for block in np.array_split(angle, N_BLOCKS)], float(angle.std(ddof=1))
    highs, lows = turning_points(angle, TURNING_SDS * scatter)
    return DrumAngle(
        mean_deg=float(angle.mean()),
        error_deg=float(np.std(means, ddof=1) / math.sqrt(N_BLOCKS)),
        scatter_deg=scatter,
        upper_deg=float(np.mean(highs)) if highs else math.nan,
        lower_deg=float(np.mean(lows)) if lows else math.nan,
        n_avalanches=len(highs),
    )


def turning_points(values: np.ndarray, step: float) -> tuple[list[float], list[float]]:
    """Maxima and minima of a series from and to which it moves by more than a step; its two ends are none."""
    highs: list[float] = []
    lows: list[float] = []
    high = low = values[0]
    rises: bool | None = None
    for value in values[1:]:
        high, low = max(high, value), min(low, value)
        if rises is not False and value < high - step:
            highs += [float(high)] if rises else []
            rises, low = False, value
        elif rises is not True and value > low + step:
            lows += [float(low)] if rises is False else []
            rises, high = True, value
    return highs, lows


def angles_of(history, froude_number: float) -> tuple[np.ndarray, np.ndarray]:
    """Turns (n,) and angles in degrees (n,) at one Froude number.

    history : columns froude_number, turns, x_ratio and height_ratio of `dem.experiments.rotating_drum.RotatingDrum.history`.
    """
    chosen = np.asarray(history["froude_number"], float) == froude_number
    turns, x, heights = (np.asarray(history[name], float)[chosen] for name in ("turns", "x_ratio", "height_ratio"))
    looks, first = np.unique(turns, return_index=True)
    parts = list(zip(np.split(x, first[1:]), np.split(heights, first[1:]), strict=True)) if len(looks) else []
    return looks, np.array([surface_angle_deg(*part) for part in parts])
