"""A cell grid over all grains, and separations to the nearest periodic image."""

import math

import numpy as np

from dem.jit import jit, lean_jit, strict_jit
from dem.layout import PLACE, RADIUS

#: Grains farther from the origin, in radii, have been thrown out by an unstable contact.
FARTHEST = 1e5

#: Maximum number of cells per axis; beyond it, cells are made larger.
MAX_CELLS = 400


@strict_jit
def is_sound(grains):
    """True if every grain's position is finite and within the span of a cell grid."""
    for i in range(grains.place.shape[0] // PLACE):
        for a in range(3):
            if not abs(grains.place[PLACE * i + a]) < FARTHEST * grains.place[PLACE * i + RADIUS]:
                return False
    return True


@strict_jit
def grid_shape(grains, period, cell):
    """Lower corner and number of cells (3 each) of a grid over all grains; a periodic axis spans its period."""
    n = grains.place.shape[0] // PLACE
    low = np.empty(3)
    shape = np.empty(3, np.int64)
    for a in range(3):
        if period[a] > 0.0:
            low[a] = 0.0
            shape[a] = max(1, int(period[a] / cell))
            continue
        least, most = grains.place[a], grains.place[a]
        for i in range(n):
            least = min(least, grains.place[PLACE * i + a])
            most = max(most, grains.place[PLACE * i + a])
        low[a] = least
        shape[a] = int((most - least) / cell) + 1
    return low, shape


@strict_jit
def cell_size(grains, skin):
    """Edge of a cell in m: cutoff distance of the largest pair of the common grains, or more where grains are spread very far.

    Common are all grains unless at least half of them have no more than half of the largest radius, and so on: a few large grains
    would put hundreds of small ones into each cell. Larger grains reach over several cells (`cells_of`).
    """
    n = grains.place.shape[0] // PLACE
    largest = largest_radius(grains)
    smaller = n
    while 2 * smaller >= n > 0:
        smaller = 0
        for i in range(n):
            smaller += int(grains.place[PLACE * i + RADIUS] <= 0.5 * largest)
        if 2 * smaller >= n:
            largest *= 0.5
    cell = 2.0 * largest + skin
    for a in range(3):
        least, most = grains.place[a], grains.place[a]
        for i in range(n):
            least = min(least, grains.place[PLACE * i + a])
            most = max(most, grains.place[PLACE * i + a])
        cell = max(cell, (most - least) / MAX_CELLS)
    return cell


@strict_jit
def largest_radius(grains):
    """Radius of the largest grain in m; 0 without grains."""
    largest = 0.0
    for i in range(grains.place.shape[0] // PLACE):
        largest = max(largest, grains.place[PLACE * i + RADIUS])
    return largest


@lean_jit
def cells_of(share, cell):
    """Number of cells over which a grain with this share of cutoffs, in m, reaches those with no larger ones."""
    return max(1, int(math.ceil(2.0 * share / cell)))


@strict_jit
def cell_index(grains, i, a, low, shape, period, cell):
    """Index along axis a of the cell of grain i."""
    x = grains.place[PLACE * i + a]
    if period[a] > 0.0:
        x -= period[a] * math.floor(x / period[a])
        return min(int(x / period[a] * shape[a]), shape[a] - 1)
    return min(int((x - low[a]) / cell), shape[a] - 1)


@strict_jit
def sort_into_cells(grains, period, cell, order):
    """Counting sort: fills `order`, the grains in cell order; returns (low, shape, first rank of each cell)."""
    n = grains.place.shape[0] // PLACE
    low, shape = grid_shape(grains, period, cell)
    n_cells = shape[0] * shape[1] * shape[2]
    start = np.zeros(n_cells + 1, np.int64)
    where = np.empty(n, np.int64)
    for i in range(n):
        c = 0
        for a in range(3):
            c = c * shape[a] + cell_index(grains, i, a, low, shape, period, cell)
        where[i] = c
        start[c + 1] += 1
    for c in range(n_cells):
        start[c + 1] += start[c]
    fill = start[:-1].copy()
    for i in range(n):
        order[fill[where[i]]] = i
        fill[where[i]] += 1
    return low, shape, start


@strict_jit
def neighbour_cell(centre, offset, count, length):
    """Cell next to `centre`, or -1 if there is none or if another offset already leads to it."""
    c = centre + offset
    if length > 0.0:
        if count == 1 and offset != 0:
            return -1
        if count == 2 and offset < 0:
            return -1
        return (c + count) % count
    return c if 0 <= c < count else -1


@jit
def frequencies(period):
    """Reciprocal periods (3,), 0 where an axis is not periodic."""
    frequency = np.zeros(3)
    for a in range(3):
        if period[a] > 0.0:
            frequency[a] = 1.0 / period[a]
    return frequency


@lean_jit
def nearest_image(dx, period, frequency):
    """Separation to the nearest periodic image; without branches, since a frequency of 0 leaves dx as it is."""
    return dx - period * np.rint(dx * frequency)


@lean_jit
def nearest(dx, axis, images):
    """Component of a separation along an axis, to the nearest image; images : Period, or None if no axis is periodic."""
    if images is None:
        return dx
    return nearest_image(dx, images.length[axis], images.frequency[axis])
