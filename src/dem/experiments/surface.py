"""Surface and density of a bed that is periodic along x and y, above a floor at z = 0."""

import math

import numpy as np


def height_map(positions, radii, length_m: float, width_m: float, cell_m: float) -> np.ndarray:
    """Height in m of the highest grain whose centre is in each cell, (n along x, m along y); nan in cells without grains.

    Parameters
    ----------
    positions : array_like, shape (n, 3)
        Grain centres in metres; images along x (period length_m) and y (period width_m) are one.
    radii : array_like, shape (n,)
        Grain radii in metres.
    cell_m : float
        Side of a cell, rounded so that cells fill the bed. Two grain diameters leave no cell empty.
    """
    positions, radii = np.asarray(positions, float).reshape(-1, 3), np.asarray(radii, float)
    shape = np.maximum(1, np.rint(np.array([length_m, width_m]) / cell_m).astype(int))
    cell = np.floor(positions[:, :2] / [length_m, width_m] % 1.0 * shape).astype(int)
    heights = np.full(shape, -np.inf)
    np.maximum.at(heights, tuple(np.minimum(cell, shape - 1).T), positions[:, 2] + radii)
    return np.where(np.isinf(heights), np.nan, heights)


def layer_solid_fraction(positions, radii, area_m2: float, low_m: float, high_m: float) -> float:
    """Solid fraction between two heights of a bed of an area, by the parts of the spheres that are between them."""
    z, r = np.asarray(positions, float).reshape(-1, 3)[:, 2], np.asarray(radii, float)

    def below(height_m: float) -> np.ndarray:
        """Volume of each sphere below a height, a spherical cap."""
        h = np.clip(height_m - z + r, 0.0, 2.0 * r)
        return math.pi * h**2 * (r - h / 3.0)

    return float((below(high_m) - below(low_m)).sum()) / (area_m2 * (high_m - low_m))
