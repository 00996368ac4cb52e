"""Solid fraction of grains in a vessel, away from its walls.

Along a wall grains leave more void than inside, over some two diameters. A laboratory's vessel is hundreds of grains wide, so its
bulk density is that of the inside; that of a vessel filled with scaled-up grains is to be measured there.
"""

import math

import numpy as np
import scipy

#: Layer along walls, floor and surface that is left out, in mean grain diameters.
WALL_LAYER = 2.0
#: Part of a narrow vessel's radius that is measured at least.
LEAST_CORE = 0.5
#: log2 of the number of points that are looked up; their low discrepancy makes the fraction of them in grains right to 0.1 %.
N_LOG2 = 16
#: Centres around a point among which that of the grain around it is looked for, if sizes differ.
NEAREST = 16


def core_solid_fraction(positions, radii, vessel_radius_m: float, grain_radii=None) -> float:
    """Solid fraction of grains in an upright cylinder around the z axis that stands on z = 0.

    Parameters
    ----------
    positions : array_like, shape (n, 3)
        Grain centres in metres.
    radii : array_like, shape (n,)
        Grain radii in metres.
    vessel_radius_m : float
        Inner radius of the vessel.
    grain_radii : array_like, shape (m,), optional
        Of clumps, whose spheres the arguments above are: radii in metres of the spheres of equal volume. Overlaps count once.

    Returns
    -------
    float
        Of the core, WALL_LAYER from wall and floor and half of it from the surface (the height that nine tenths of the grains lie
        below); of a low filling its middle half. NaN without grains. The same in every run.
    """
    positions, radii = np.asarray(positions, float).reshape(-1, 3), np.asarray(radii, float)
    if len(radii) == 0:
        return math.nan
    layer = WALL_LAYER * 2.0 * float(np.mean(radii if grain_radii is None else grain_radii))
    low, high = levels(positions, layer)
    core = max(vessel_radius_m - layer, LEAST_CORE * vessel_radius_m)
    u, v, w = sobol_points().T
    along = np.column_stack([np.cos(2.0 * np.pi * v), np.sin(2.0 * np.pi * v)])
    return share_inside(np.column_stack([core * np.sqrt(u)[:, None] * along, low + (high - low) * w]), positions, radii)


def slice_solid_fraction(positions, radii, length_m: float, thickness_m: float, grain_radii=None) -> float:
    """Solid fraction of grains between end walls at x = 0 and length_m, periodic in y with thickness_m, on a floor at z = 0.

    Parameters and layers that are left out as in `core_solid_fraction`. NaN without grains. The same in every run.
    """
    positions, radii = np.asarray(positions, float).reshape(-1, 3), np.asarray(radii, float)
    if len(radii) == 0:
        return math.nan
    layer = WALL_LAYER * 2.0 * float(np.mean(radii if grain_radii is None else grain_radii))
    low, high = levels(positions, layer)
    margin = min(layer, 0.5 * (1.0 - LEAST_CORE) * length_m)
    points = scipy.stats.qmc.scale(sobol_points(), [margin, 0.0, low], [length_m - margin, thickness_m, high])
    copies = np.concatenate([positions + [0.0, k * thickness_m, 0.0] for k in (-1, 0, 1)])
    return share_inside(points, copies, np.tile(radii, 3))


def sobol_points() -> np.ndarray:
    """Points (n, 3) that fill the unit cube evenly, always the same."""
    return scipy.stats.qmc.Sobol(3, seed=0).random_base2(N_LOG2)


def levels(positions: np.ndarray, layer: float) -> tuple[float, float]:
    """Heights between which a filling is measured: a layer above the floor, half of one below the surface; else its middle half."""
    surface = float(np.quantile(positions[:, 2], 0.9))
    return min(layer, 0.25 * surface), max(surface - 0.5 * layer, 0.75 * surface)


def share_inside(points: np.ndarray, positions: np.ndarray, radii: np.ndarray) -> float:
    """Share of points that lie in a grain."""
    # the nearest centre need not be that of the grain around a point
    n_nearest = 1 if np.ptp(radii) == 0.0 else min(NEAREST, len(radii))
    distance, grain = scipy.spatial.cKDTree(positions).query(points, [*range(1, n_nearest + 1)], distance_upper_bound=radii.max())
    return float((distance < np.append(radii, 0.0)[grain]).any(axis=1).mean())
