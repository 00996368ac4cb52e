"""The outline of a heap over its ground, and the slope of both flanks.

The line of a flank is fitted as that of a simulated heap's silhouette is (`dem.measure.heap.fit_flank`): between 20 and
80 % of the height.
Lengths are pixels; angles are positive where the ground rises to the right.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy import ndimage, optimize, signal

from dem.measure.heap import BAND_RATIOS, fit_flank
from virtual_soil.calibration.errors import CalibrationError
from virtual_soil.campaign.laboratory.photo.image import WORKING_SIZE

#: Heights below have too few pixels between 20 and 80 % for a slope: one pixel more at one end is 2 degrees there.
LEAST_HEIGHT = 25.0
#: Part of the heap's width whose lower edge is the ground: the feet are ragged.
GROUND_BAND = (0.1, 0.9)
#: A lower edge that leaves its line by more than this part of the heap's height (root mean square) is no plate.
MOST_UNEVEN = 0.1
#: A camera held by hand is level to a few degrees.
MOST_TILT_DEG = 10.0
#: Standard error of the tilt in degrees, beyond which the lower edge is no plate.
MOST_TILT_ERROR_DEG = 3.0
#: Width at 80 % of the height over the width at 20 %: a cone has 0.25, a heap with a flat top of a fifth of its base 0.43,
#: a parabola 0.5, a half circle 0.61, a box 1.
MOST_BLUNT = 0.45
#: Part of the area under the outline that belongs to the heap; what overhangs leaves a gap.
LEAST_SOLID = 0.93
#: Prominence of a second hump over the heap's height.
SECOND_HUMP = 0.1
#: Departure of a flank from its line over the heap's height (root mean square).
MOST_BENT = 0.05
#: Angles of a flank that a heap can have, and of its two flanks against each other.
FLANKS_DEG = (5.0, 70.0)
MOST_SKEW_DEG = 10.0


class NoHeap(CalibrationError):
    """A mask whose outline is not a heap's; the message is what can be said of the outline."""


@dataclass(frozen=True, kw_only=True)
class Ground:
    """The line on which a heap stands: through the point (x, y), rising to the right by `tilt_deg`, known to `tilt_error_deg`.

    departure : root mean square of the heap's lower edge from the line, 0 for a line that is given.
    """

    x: float
    y: float
    tilt_deg: float
    tilt_error_deg: float
    departure: float = 0.0

    def frame(self, x, y):
        """Distance along the ground and height above it of points of the picture."""
        t = np.radians(self.tilt_deg)
        return (x - self.x) * np.cos(t) - (y - self.y) * np.sin(t), -(x - self.x) * np.sin(t) - (y - self.y) * np.cos(t)

    def picture(self, along, height):
        """Points (..., 2: x, y) of the picture at distances along the ground and heights above it."""
        t = np.radians(self.tilt_deg)
        x = self.x + along * np.cos(t) - height * np.sin(t)
        return np.stack([x, self.y - along * np.sin(t) - height * np.cos(t)], axis=-1)

    def turned(self, angle_deg: float) -> "Ground":
        """The same ground, rising more by an angle."""
        return replace(self, tilt_deg=self.tilt_deg + angle_deg)


@dataclass(frozen=True, kw_only=True)
class Side:
    """One flank: its angle, the standard error of its line, and its departure from it (root mean square, pixels).

    line : (2, 2), both ends of the line: distance along the ground, height.
    """

    angle_deg: float
    error_deg: float
    departure: float
    line: np.ndarray


@dataclass(frozen=True, kw_only=True)
class Outline:
    """Height of a heap's outline (m,) at distances (m,) along its ground, its axis, and both flanks."""

    ground: Ground
    along: np.ndarray
    height: np.ndarray
    left: Side
    right: Side

    @property
    def angle_deg(self) -> float:
        """Mean of both flanks' angles."""
        return 0.5 * (self.left.angle_deg + self.right.angle_deg)

    @property
    def departure(self) -> float:
        """Departure of both flanks and of the lower edge from their lines (root mean square) over the heap's height."""
        parts = self.left.departure, self.right.departure, self.ground.departure
        return float(np.sqrt(np.mean(np.square(parts))) / self.height.max())


def ground_under(mask: np.ndarray) -> Ground:
    """The line along a mask's lower edge, and the standard error of its tilt. Raises NoHeap where the edge is no line."""
    columns = np.flatnonzero(mask.any(axis=0))
    low, high = np.quantile(columns, GROUND_BAND)
    columns = columns[(columns >= low) & (columns <= high)]
    rows = mask.shape[0] - np.argmax(mask[::-1, columns], axis=0) - 0.5
    x = float(columns.mean())
    # soft L1: rows are whole numbers, so that medians of slopes would prefer zero
    start = np.polyfit(columns - x, rows, 1)
    slope, level = optimize.least_squares(lambda line: np.polyval(line, columns - x) - rows, start, loss="soft_l1").x
    departures = rows - level - slope * (columns - x)
    height = np.ptp(np.flatnonzero(mask.any(axis=1)))
    departure = float(np.sqrt(np.mean(departures**2)))
    if departure > MOST_UNEVEN * height:
        raise NoHeap("has no straight lower edge; GROUND=x0,y0,x1,y1 can say where the heap stands")
    tilt, error = float(np.degrees(np.arctan(-slope))), float(np.degrees(slope_error(columns, departures)))
    if abs(tilt) > MOST_TILT_DEG:
        raise NoHeap(f"has a lower edge that is inclined by {tilt:.0f} deg, where {MOST_TILT_DEG:.0f} are the most")
    if error > MOST_TILT_ERROR_DEG:
        raise NoHeap(
            f"has a lower edge whose tilt is known to +- {error:.1f} deg only; GROUND=x0,y0,x1,y1 can say where the heap stands"
        )
    return Ground(x=x, y=float(level), tilt_deg=tilt, tilt_error_deg=error, departure=departure)


def slope_error(x: np.ndarray, departures: np.ndarray) -> float:
    """Standard error of a line's slope; neighbours that depart together count as fewer.

    With the correlation r of neighbours, n values of an autoregressive process count as n (1 - r)/(1 + r) ones.
    """
    n, energy = len(x), float((departures**2).sum())
    if n < 4 or energy == 0.0:
        return 0.0
    r = float(np.clip((departures[1:] * departures[:-1]).sum() / energy, 0.0, 1.0 - 2.0 / n))
    count = max(n * (1.0 - r) / (1.0 + r), 3.0)
    return float(np.sqrt(energy / n / ((count - 2.0) * x.var())))


def outline_of(mask: np.ndarray, ground: Ground | None = None) -> Outline:
    """Outline and flanks of a mask (rows, columns).

    Parameters
    ----------
    mask : (rows, columns)
        Pixels of the heap.
    ground : Ground, optional
        The line on which it stands; found along its lower edge if left out.

    Raises
    ------
    NoHeap
        If the mask touches the picture's edge or is not one hump.
    """
    size = mask.any(axis=1).sum(), mask.any(axis=0).sum()
    if min(size) < LEAST_HEIGHT:
        raise NoHeap(size_said(size[1], size[0]))
    rim = {"left": mask[:, :2], "right": mask[:, -2:], "upper": mask[:2], "lower": mask[-2:]}
    touched = [side for side, pixels in rim.items() if pixels.any() and (side != "lower" or ground is None)]
    if touched:
        raise NoHeap(f"touches the {touched[0]} edge; the whole heap must be seen, with something around it")
    ground = ground_under(mask) if ground is None else ground
    along, height, solid = heights_over(mask, ground)
    check_hump(along, height, solid)
    # the half of the outline's area that lies left and right of the axis
    axis = int(np.searchsorted(np.cumsum(height), 0.5 * height.sum()))
    right = side_of(along[axis:] - along[axis], height[axis:])
    left = side_of(along[axis] - along[axis::-1], height[axis::-1])
    left, right = (replace(s, line=s.line * (sign, 1.0) + (along[axis], 0.0)) for s, sign in ((left, -1.0), (right, 1.0)))
    return Outline(ground=ground, along=along, height=height, left=left, right=right)


def size_said(width: float, height: float) -> str:
    """What is said of an outline that is too small."""
    allowed = f"{LEAST_HEIGHT:.0f} pixels of {WORKING_SIZE} a picture are needed; BOX=left,top,right,bottom takes less of it"
    return f"is {width:.0f} x {height:.0f} pixels large: {allowed}"


def heights_over(mask: np.ndarray, ground: Ground) -> tuple[np.ndarray, np.ndarray, float]:
    """Distance (m,) along the ground, the outline's height (m,), 0 at both ends, and the part of the area under it that is heap."""
    rows, columns = np.nonzero(mask)
    s, h = ground.frame(columns + 0.5, rows + 0.5)
    above = h > 0.0
    if not above.any():
        raise NoHeap("is nowhere above the ground")
    bins = np.floor(s[above]).astype(int)
    first = bins.min() - 2
    height = np.zeros(np.ptp(bins) + 5)
    np.maximum.at(height, bins - first, h[above] + 0.5)
    along = first + 0.5 + np.arange(len(height))
    return along, height, float(above.sum() / height.sum())


def check_hump(along: np.ndarray, height: np.ndarray, solid: float) -> None:
    """Raise NoHeap unless an outline is one hump that stands on its ground."""
    top = float(height.max())
    if top < LEAST_HEIGHT:
        raise NoHeap(size_said(len(height), top))
    upper, lower = (int((height >= ratio * top).sum()) for ratio in BAND_RATIOS[::-1])
    if upper > MOST_BLUNT * lower:
        raise NoHeap(f"is {upper / lower:.2f} times as wide at 80 % of its height as at 20 %, where {MOST_BLUNT} is the most")
    if solid < LEAST_SOLID:
        raise NoHeap(f"overhangs: {100 * (1 - solid):.0f} % of the area under it are empty")
    smooth = ndimage.gaussian_filter1d(height, 0.02 * lower)
    humps = signal.find_peaks(smooth, prominence=SECOND_HUMP * top)[0]
    if len(humps) != 1:
        raise NoHeap(f"has {len(humps)} humps")


def side_of(distance: np.ndarray, height: np.ndarray) -> Side:
    """A flank: distance (m,) from the axis, ascending, and height (m,)."""
    # twice the same curve: the deviation between curves is not asked for; a grain is as small as a pixel
    flank = fit_flank(distance, np.stack([height, height]), grain_diameter=1.0)
    top = height.max()
    first = np.flatnonzero(height >= BAND_RATIOS[1] * top)[-1]
    last = first + int(np.argmax(height[first:] < BAND_RATIOS[0] * top))
    x, y = distance[first : last + 1], height[first : last + 1]
    slope = -np.tan(np.radians(flank.angle_deg))
    departures = y - y.mean() - slope * (x - x.mean())
    ends = x[[0, -1]]
    return Side(
        angle_deg=flank.angle_deg,
        error_deg=float(np.degrees(slope_error(x, departures) / (1.0 + slope**2))),
        departure=float(np.sqrt(np.mean(departures**2))),
        line=np.column_stack([ends, y.mean() + slope * (ends - x.mean())]),
    )


def check_flanks(outline: Outline) -> None:
    """Raise NoHeap unless both flanks are straight, have slopes that grains can have, and are alike."""
    left, right, height = outline.left, outline.right, outline.height.max()
    for name, side in (("left", left), ("right", right)):
        if not FLANKS_DEG[0] <= side.angle_deg <= FLANKS_DEG[1]:
            allowed = f"{FLANKS_DEG[0]:.0f} to {FLANKS_DEG[1]:.0f} deg"
            raise NoHeap(f"has a {name} flank of {side.angle_deg:.0f} deg, where a heap has {allowed}")
        if side.departure > MOST_BENT * height:
            raise NoHeap(f"has a {name} flank that leaves its line by {100 * side.departure / height:.0f} % of the height")
    if abs(left.angle_deg - right.angle_deg) > MOST_SKEW_DEG:
        raise NoHeap(f"has flanks as unlike as {left.angle_deg:.0f} and {right.angle_deg:.0f} deg")
