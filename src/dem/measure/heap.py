"""The angle of repose of a heap of grains, by two independent estimators.

`profile_angle` looks from above: the exact top surface of the spheres is sampled in ring x azimuth cells and averaged
over azimuth. `silhouette_angle` looks from the side: the outline that the spheres show, over many directions of view,
left and right. Both then fit a straight line through the part of the flank between 20 and 80 % of the heap's height,
which leaves out the rounded top and the toe, and both tell how much the angle varies around the heap.

Bias, measured on cones cut from a random packing (tests/dem/measure/test_heap.py). Both estimators see the grains some
part of a radius below the ideal cone; a depth that is the same all along the flank shifts the line, but does not turn
it.

- The profile's depth is the same everywhere, because each sample sees the one grain under it. Over several heaps of
  2000-3000 grains it reads within 0.25 degrees of the cone, from 10 to 58 degrees; one heap has a standard deviation of
  0.2-0.5 degrees. Taking the *highest* grain of larger cells would hide the pores, but not where the heap is a few
  grains thick: it reads 0.7 degrees high at 10 degrees.
- The silhouette shows the highest grain of the whole ridge in line of sight. The ridge widens as the square root of the
  distance from the axis, so more grains compete towards the toe and the outline there is closer to the cone: it reads
  0.2-0.5 degrees low with 2000-3000 grains and 0.1-0.3 with 17 000. A photograph of a heap has the same bias; it is not
  corrected. Real heaps are no cones: 85 heaps of the default study (lifted tube) read 0.4 degrees lower by the silhouette than by
  the profile in the mean (standard deviation 0.8; 1.2 lower above 45 degrees), heaps poured by another program 0.6-1.1 higher.

Frame: the plate's top is z = 0, z up. Inside this module lengths are in units of the mean grain radius, so that nothing
depends on the grains' size.
"""

from dataclasses import dataclass

import numpy as np

from dem.html import Rich

#: Part of the heap's height through which the line is fitted.
BAND_RATIOS = (0.2, 0.8)

#: In mean grain diameters. Single grains that lie around the foot are no flank, yet their outline is one grain high,
#: and a little more where sizes differ. The line ends above them; this binds only below a height of 6 diameters.
SINGLE_LAYER_RATIO = 1.25

#: In mean grain diameters. At this height the line runs from 1.25 to 2.4 diameters, little more than one layer of grains
#: (about 0.8 diameters thick); in a lower heap it would describe single grains and not a slope.
MIN_HEIGHT_RATIO = 3.0

#: A 30 degree cone of the smallest height has about 90 grains, a third of them above the bottom layer.
MIN_STANDING_GRAINS = 30

#: Spacing of all samples, in mean grain radii: a sphere is seen by some 50 samples.
SAMPLE_SPACING = 0.25

#: In units of sqrt(n grains) mean radii. A heap of the smallest height with a solid fraction of 0.55 has a foot of
#: 1.1 sqrt(n) radii; grains further out than this belong to no heap, and cost no memory.
REACH_RATIO = 2.0

#: Sectors of the profile (30 degrees each) and azimuth samples in each: half a radius apart at the foot of 3000 grains.
N_SECTORS = 12
N_AZIMUTHS_PER_SECTOR = 60

#: Directions of view over half a turn; each shows two flanks.
N_VIEWS = 36


class HeapError(ValueError):
    """Positions or radii that cannot be a heap of grains."""


@dataclass(frozen=True, kw_only=True)
class Flank:
    """A flank's slope in degrees, its standard deviation over azimuth, and the height of the curve it was read from.

    `height` has the length unit of what was fitted. The angle and its deviation are 0 where nothing stands.
    """

    angle_deg: float
    azimuth_sd_deg: float
    height: float
    stands: bool


@dataclass(frozen=True, kw_only=True)
class HeapShape(Rich):
    """Angles of repose, their spread over azimuth, and height of one heap; all angles are 0 where `is_flat`.

    `angle_azimuth_sd_deg` is over the 12 sectors of the profile, `silhouette_azimuth_sd_deg` over the 72 flanks seen.
    Both hold the grains' own roughness as well as real asymmetry: an ideal cone of 2000 grains has 0.9 and 0.5 degrees.
    """

    angle_profile_deg: float
    angle_silhouette_deg: float
    angle_azimuth_sd_deg: float
    silhouette_azimuth_sd_deg: float
    heap_height_m: float
    is_flat: bool


def measure_heap(positions, radii, grain_radii=None):
    """Shape of a settled heap by both estimators.

    Parameters
    ----------
    positions : array_like, shape (n, 3)
        Grain centres x, y, z in metres; the plate's top is z = 0.
    radii : array_like, shape (n,)
        Grain radii in metres.
    grain_radii : array_like, shape (m,), optional
        Of clumps, whose spheres the arguments above are: radii in metres of the spheres of equal volume. Lengths are then in units
        of their mean, and grains are whole clumps.

    Returns
    -------
    HeapShape
        `is_flat`, with both angles 0, where the profile is lower than three mean grain diameters.

    Raises
    ------
    HeapError
        If the shapes differ, a value is not finite or a radius is not positive.
    """
    profile = profile_angle(positions, radii, grain_radii)
    silhouette = silhouette_angle(positions, radii, grain_radii)
    # The outline is the higher of the two curves, so it still stands where the profile already lies flat.
    stands = profile.stands
    return HeapShape(
        angle_profile_deg=profile.angle_deg if stands else 0.0,
        angle_silhouette_deg=silhouette.angle_deg if stands else 0.0,
        angle_azimuth_sd_deg=profile.azimuth_sd_deg if stands else 0.0,
        silhouette_azimuth_sd_deg=silhouette.azimuth_sd_deg if stands else 0.0,
        heap_height_m=profile.height,
        is_flat=not stands,
    )


def profile_angle(positions, radii, grain_radii=None):
    """Flank of the top surface averaged over azimuth; height in metres. Arguments as in `measure_heap`."""
    return _flank_of(positions, radii, grain_radii, _sector_profiles)


def silhouette_angle(positions, radii, grain_radii=None):
    """Flank of the outline seen from the side, over many views; height in metres. Arguments as in `measure_heap`."""
    return _flank_of(positions, radii, grain_radii, _outlines)


def fit_flank(distance, heights, grain_diameter):
    """Slope of the mean of several curves, and the standard deviation of the slopes of each.

    One stretch of flank serves all curves. It begins where the mean curve last has 80 % of its height and ends where it
    first falls below 20 %, or to a single layer of grains (see `SINGLE_LAYER_RATIO`); strays further out do not count.

    Parameters
    ----------
    distance : array, shape (m,)
        Horizontal distance from the heap's axis, ascending.
    heights : array, shape (k, m)
        Height of the surface above the plate: one curve for each sector or view, all 0 at the last distance.
    grain_diameter : float
        Mean grain diameter, in the same unit.

    Returns
    -------
    Flank
        Not standing if the mean curve is lower than three grain diameters.
    """
    mean = heights.mean(axis=0)
    height = mean.max()
    if height < MIN_HEIGHT_RATIO * grain_diameter:
        return Flank(angle_deg=0.0, azimuth_sd_deg=0.0, height=float(height), stands=False)
    low, high = np.multiply(BAND_RATIOS, height)
    first = np.flatnonzero(mean >= high)[-1]
    last = first + np.argmax(mean[first:] < max(low, SINGLE_LAYER_RATIO * grain_diameter))
    # Both ends are in the fit, so that even a cliff between two samples has a slope.
    band = slice(first, last + 1)
    slopes = np.polyfit(distance[band], np.vstack([mean, heights])[:, band].T, 1)[0]
    angles = np.degrees(np.arctan(-slopes))
    return Flank(angle_deg=float(angles[0]), azimuth_sd_deg=float(angles[1:].std(ddof=1)), height=float(height), stands=True)


def _flank_of(positions, radii, grain_radii, curves_of):
    """Fit the curves that `curves_of` (grains, reach -> distance, heights) sees; lengths in metres at both ends."""
    positions, radii = _checked(positions, radii)
    if len(radii) == 0:
        return Flank(angle_deg=0.0, azimuth_sd_deg=0.0, height=0.0, stands=False)
    whole = radii if grain_radii is None else np.asarray(grain_radii, dtype=float)
    unit = whole.mean()
    grains, reach, n_standing = _centred(positions / unit, radii / unit, len(radii) / len(whole))
    distance, heights = curves_of(grains, reach)
    flank = fit_flank(distance, heights, grain_diameter=2.0)
    stands = flank.stands and n_standing >= MIN_STANDING_GRAINS
    return Flank(
        angle_deg=flank.angle_deg if stands else 0.0,
        azimuth_sd_deg=flank.azimuth_sd_deg if stands else 0.0,
        height=flank.height * float(unit),
        stands=stands,
    )


def _checked(positions, radii):
    positions, radii = np.asarray(positions, dtype=float), np.asarray(radii, dtype=float)
    if radii.ndim != 1 or positions.shape != (radii.size, 3):
        raise HeapError(f"positions has shape {positions.shape} and radii {radii.shape}; (n, 3) and (n,) with one n are allowed")
    if not np.isfinite(positions).all():
        raise HeapError(f"positions of grain {np.argmin(np.isfinite(positions).all(axis=1))} are not finite numbers")
    good = np.isfinite(radii) & (radii > 0.0)
    if not good.all():
        raise HeapError(f"radii of grain {np.argmin(good)} is {radii[np.argmin(good)]}; a positive length is allowed")
    return positions, radii


def _centred(positions, radii, n_spheres):
    """Spheres (k, 4: x, y, z, radius) within reach of the heap's own axis, that reach, and how many grains stand on others.

    n_spheres : mean number of spheres of a grain.
    The axis is the median of the grains above the bottom layer: strays lie on the plate, so they do not move it. A
    centre that is off by e changes the mean height at distance s by e^2/(4 s) times the slope only.
    """
    standing = positions[:, 2] > 2.0
    axis = np.median(positions[standing if standing.any() else slice(None), :2], axis=0)
    grains = np.column_stack([positions[:, :2] - axis, positions[:, 2], radii])
    reach = REACH_RATIO * np.sqrt(radii.size / n_spheres)
    return grains[np.hypot(grains[:, 0], grains[:, 1]) < reach], reach + radii.max(), standing.sum() / n_spheres


def _sample_distances(reach):
    """Sample positions from 0 to just beyond the reach, where no grain is seen any more."""
    return np.arange(np.ceil(reach / SAMPLE_SPACING) + 2) * SAMPLE_SPACING


def _sector_profiles(grains, reach):
    """Distance (m,) and the top surface's mean height (n_sectors, m) in ring x sector cells."""
    distance = _sample_distances(reach)
    n_azimuths = N_SECTORS * N_AZIMUTHS_PER_SECTOR
    azimuth = (np.arange(n_azimuths) + 0.5) * (2.0 * np.pi / n_azimuths)
    surface = top_surface(grains, len(distance) - 1)
    column = np.rint(np.multiply.outer(np.cos(azimuth), distance) / SAMPLE_SPACING).astype(int) + len(distance) - 1
    row = np.rint(np.multiply.outer(np.sin(azimuth), distance) / SAMPLE_SPACING).astype(int) + len(distance) - 1
    cells = surface[column, row].reshape(N_SECTORS, N_AZIMUTHS_PER_SECTOR, len(distance))
    return distance, cells.mean(axis=1)


def top_surface(grains, half_width):
    """Height of the highest sphere over each node of a square raster of 2 half_width + 1 nodes a side; 0 = plate."""
    node_x, gap_x = _nodes_under(grains[:, 0], grains[:, 3])
    node_y, gap_y = _nodes_under(grains[:, 1], grains[:, 3])
    square = grains[:, 3, None, None] ** 2 - gap_x[:, :, None] ** 2 - gap_y[:, None, :] ** 2
    covered = square > 0.0
    top = (grains[:, 2, None, None] + np.sqrt(np.maximum(square, 0.0)))[covered]
    surface = np.zeros((2 * half_width + 1, 2 * half_width + 1))
    node_x, node_y = np.broadcast_arrays(node_x[:, :, None], node_y[:, None, :])
    np.maximum.at(surface, (node_x[covered] + half_width, node_y[covered] + half_width), top)
    return surface


def _outlines(grains, reach):
    """Distance (m,) and the height of the outline (2 n_views, m): each view's right and left flank."""
    distance = _sample_distances(reach)
    half_width = len(distance) - 1
    flanks = []
    for azimuth in np.arange(N_VIEWS) * (np.pi / N_VIEWS):
        across = grains[:, 0] * np.cos(azimuth) + grains[:, 1] * np.sin(azimuth)
        node, gap = _nodes_under(across, grains[:, 3])
        square = grains[:, 3, None] ** 2 - gap**2
        covered = square > 0.0
        outline = np.zeros(2 * half_width + 1)
        top = (grains[:, 2, None] + np.sqrt(np.maximum(square, 0.0)))[covered]
        np.maximum.at(outline, node[covered] + half_width, top)
        flanks += [outline[half_width:], outline[half_width::-1]]
    return distance, np.array(flanks)


def _nodes_under(coordinate, radius):
    """Whole-number nodes (n, w) that each grain may cover along one axis, and their distance from its centre."""
    n_beside = int(np.ceil(radius.max() / SAMPLE_SPACING))
    node = np.rint(coordinate / SAMPLE_SPACING).astype(int)[:, None] + np.arange(-n_beside, n_beside + 1)
    return node, node * SAMPLE_SPACING - coordinate[:, None]
