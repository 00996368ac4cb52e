"""What a draw-down test tells: the steady rate of discharge, and the slopes that stay on both sides of the slot.

Both read what a laboratory sees, too: the mass that has flowed out over time, and the free surface at rest.
"""

import math
from dataclasses import dataclass

import numpy as np

from dem.html import Rich
from dem.measure.heap import MIN_HEIGHT_RATIO, SAMPLE_SPACING, fit_flank, top_surface

#: Shares of all that flows out between which the discharge counts as steady: the flow has begun, and there is soil above the slot.
STEADY_SHARES = (0.1, 0.6)
#: Blocks of equal time into which the steady part is divided for the error of its rate.
N_BLOCKS = 8
#: Distance from the end walls in mean radii where no slope is read: single grains stand on each other along a wall.
WALL_RADII = 4.0
#: Strips along the slot that show how much a slope varies, and the width of one in mean radii (wider slices have more).
LEAST_STRIPS, STRIP_RADII = 2, 8.0


@dataclass(frozen=True, kw_only=True)
class Slopes(Rich):
    """Angles of the slopes left and right of the slot, nan where one is too low to have any (without grains all are nan).

    scatter_deg : standard deviation over both sides and strips. height_m : of the mean surface at its highest. bound_deg : slope of
    the lowest surface that has an angle; others are flatter.
    """

    left_deg: float
    right_deg: float
    scatter_deg: float
    height_m: float
    bound_deg: float

    @property
    def angle_deg(self) -> float:
        """Mean of both sides; nan unless both have an angle."""
        return 0.5 * (self.left_deg + self.right_deg)


def steady_rate(time_s, mass) -> tuple[float, float]:
    """Rate of discharge, and its standard error, in units of `mass` per second.

    The rate is the slope of the least-squares line through the part between STEADY_SHARES of the last mass; the error is that of
    the mean of the rates in N_BLOCKS blocks of that part, which contain the fluctuations of the flow.

    Parameters
    ----------
    time_s, mass : array_like, shape (n,)
        Ascending times, and the mass that has flowed out until then (of the whole slot, or per length of it).

    Returns
    -------
    (rate, standard error); nan where fewer than N_BLOCKS + 1 samples are in that part.
    """
    time_s, mass = np.asarray(time_s, float), np.asarray(mass, float)
    low, high = np.multiply(STEADY_SHARES, mass[-1] if len(mass) else 0.0)
    steady = (mass >= low) & (mass <= high)
    if steady.sum() <= N_BLOCKS or high <= 0.0:
        return math.nan, math.nan
    t, m = time_s[steady], mass[steady]
    ends = np.linspace(t[0], t[-1], N_BLOCKS + 1)
    rates = np.diff(np.interp(ends, t, m)) / np.diff(ends)
    return float(np.polyfit(t - t[0], m, 1)[0]), float(rates.std(ddof=1) / math.sqrt(N_BLOCKS))


def slopes(positions, radii, length_m: float, slot_m: float, thickness_m: float, grain_radii=None) -> Slopes:
    """Slopes that grains at rest form from both end walls of a box down to a slot in the middle of its floor.

    Each is the line through 20 to 80 % of the height of the surface, averaged along the slot (`dem.measure.heap.fit_flank`),
    without the WALL_RADII next to the wall.

    Parameters
    ----------
    positions : array_like, shape (n, 3)
        Grain centres in metres: x from 0 to length_m across the slot, y periodic with thickness_m, the floor at z = 0.
    radii : array_like, shape (n,)
        Grain radii in metres.
    grain_radii : array_like, shape (m,), optional
        Of clumps, whose spheres the arguments above are: radii in metres of the spheres of equal volume, the unit of lengths.
    """
    positions, radii = np.asarray(positions, float).reshape(-1, 3), np.asarray(radii, float)
    if len(radii) == 0:
        return Slopes(left_deg=math.nan, right_deg=math.nan, scatter_deg=math.nan, height_m=math.nan, bound_deg=math.nan)
    unit_m = float(np.mean(radii if grain_radii is None else grain_radii))
    distance, heights = side_surfaces(positions / unit_m, radii / unit_m, length_m / unit_m, thickness_m / unit_m)
    flanks = [fit_flank(distance, side, grain_diameter=2.0) for side in heights]
    both = fit_flank(distance, heights.reshape(-1, len(distance)), grain_diameter=2.0)
    left, right = (flank.angle_deg if flank.stands else math.nan for flank in flanks)
    return Slopes(
        left_deg=left,
        right_deg=right,
        scatter_deg=both.azimuth_sd_deg if both.stands else math.nan,
        height_m=both.height * unit_m,
        bound_deg=math.degrees(math.atan2(MIN_HEIGHT_RATIO * 2.0 * unit_m, 0.5 * (length_m - slot_m) - WALL_RADII * unit_m)),
    )


def side_surfaces(positions: np.ndarray, radii: np.ndarray, length: float, thickness: float) -> tuple[np.ndarray, np.ndarray]:
    """Distance from an end wall to the middle (m,), and heights (2 sides, n strips, m) of the surface; all in mean grain radii."""
    places, sizes = positions - [0.5 * length, 0.0, 0.0], radii
    places[:, 1] = places[:, 1] % thickness - 0.5 * thickness
    copies = np.concatenate([places + [0.0, shift, 0.0] for shift in (-thickness, 0.0, thickness)])
    grains = np.column_stack([copies, np.tile(sizes, 3)])
    grains = grains[np.abs(grains[:, 1]) < 0.5 * thickness + sizes.max()]
    half = math.ceil((max(0.5 * length, 0.5 * thickness + sizes.max()) + sizes.max()) / SAMPLE_SPACING) + 2
    surface = top_surface(grains, half)
    n_across, n_along = int(0.5 * length / SAMPLE_SPACING), int(thickness / SAMPLE_SPACING)
    along = half - n_along // 2 + np.arange(n_along)
    steps = np.arange(int(WALL_RADII / SAMPLE_SPACING), n_across + 1)
    sides = [surface[np.ix_(half + sign * (n_across - steps), along)] for sign in (-1, 1)]
    strips = np.array_split(np.arange(n_along), max(LEAST_STRIPS, int(thickness / STRIP_RADII)))
    return steps * SAMPLE_SPACING, np.array([[side[:, strip].mean(axis=1) for strip in strips] for side in sides])
