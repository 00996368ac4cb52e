"""Search for triangles near a grain: a static grid in each body's frame, whose cells list the triangles within a cutoff.

Neither grid nor triangles change as bodies move. The cutoff is the largest radius and the skin of the outer lists, so larger grains
need another grid.
"""

from typing import NamedTuple

import numpy as np

from dem.jit import inline_jit, strict_jit
from dem.meshes.triangles import Triangles, nearest_on_triangle

#: Maximum number of cells: this many per triangle, and this many besides; beyond it, cells are made larger.
CELLS_PER_TRIANGLE, LEAST_CELLS = 32, 4096


class Grid(NamedTuple):
    """Cells of n surfaces: low (n, 3) in m, frequency (n,) in 1/m, shape (n, 3), number of the first cell (n,).

    start (cells + 1,), listed: triangles of each cell, in ascending order. cutoff (1,) in m.
    """

    low: np.ndarray
    frequency: np.ndarray
    shape: np.ndarray
    first: np.ndarray
    start: np.ndarray
    listed: np.ndarray
    cutoff: np.ndarray


def no_grid(n: int) -> Grid:
    """A grid of n surfaces that finds nothing."""
    first, start, listed = (np.zeros(k, np.int64) for k in (n, 1, 0))
    return Grid(np.zeros((n, 3)), np.zeros(n), np.zeros((n, 3), np.int64), first, start, listed, np.full(1, -1.0))


def grid_of(triangles: Triangles, cutoff: float) -> Grid:
    """The grid for centres of grains within `cutoff` (m) of a triangle."""
    n = len(triangles.solid)
    low, frequency, shape = np.zeros((n, 3)), np.zeros(n), np.zeros((n, 3), np.int64)
    surface = triangles.surface[triangles.patch]
    for w in np.unique(surface).tolist():
        own = triangles.corners[surface == w].reshape(-1, 3)
        low[w] = own.min(axis=0) - cutoff
        extent, cell = own.max(axis=0) + cutoff - low[w], cutoff
        while np.prod(np.ceil(extent / cell)) > CELLS_PER_TRIANGLE * len(own) // 3 + LEAST_CELLS:
            cell *= 1.25
        frequency[w], shape[w] = 1.0 / cell, np.ceil(extent / cell).astype(np.int64)
    counts = shape.prod(axis=1)
    first, start = np.cumsum(counts) - counts, np.zeros(counts.sum() + 1, np.int64)
    grid = Grid(low, frequency, shape, first, start, np.zeros(0, np.int64), np.array([cutoff]))
    fill(triangles, grid, start[1:])
    start[:] = np.cumsum(start)
    grid = grid._replace(listed=np.zeros(start[-1], np.int64))
    fill(triangles, grid, start[:-1].copy())
    return grid


@strict_jit
def fill(triangles, grid, cursor):
    """Advance every cell's cursor by the number of triangles near it, and enter them where the cursor was, if there are entries."""
    centre, cutoff, enters = np.empty(3), grid.cutoff[0], grid.listed.shape[0] > 0
    from_cell, to_cell = np.empty(3, np.int64), np.empty(3, np.int64)
    for m in range(triangles.patch.shape[0]):
        w = triangles.surface[triangles.patch[m]]
        low, cell, shape = grid.low[w], 1.0 / grid.frequency[w], grid.shape[w]
        for a in range(3):
            corners = triangles.corners[m, :, a]
            from_cell[a] = max(int((corners.min() - cutoff - low[a]) / cell) - 1, 0)
            to_cell[a] = min(int((corners.max() + cutoff - low[a]) / cell) + 1, shape[a] - 1)
        widest = cutoff + 0.8660255 * cell  # half a cell's diagonal, rounded up
        for i in range(from_cell[0], to_cell[0] + 1):
            centre[0] = low[0] + (i + 0.5) * cell
            for j in range(from_cell[1], to_cell[1] + 1):
                centre[1] = low[1] + (j + 0.5) * cell
                for k in range(from_cell[2], to_cell[2] + 1):
                    centre[2] = low[2] + (k + 0.5) * cell
                    _, _, _, d2, _ = nearest_on_triangle(triangles.values[m], triangles.feature[m], centre[0], centre[1], centre[2])
                    if d2 <= widest * widest:
                        c = grid.first[w] + (i * shape[1] + j) * shape[2] + k
                        if enters:
                            grid.listed[cursor[c]] = m
                        cursor[c] += 1


@inline_jit
def cell_of(grid, w, x, y, z):
    """Cell of surface w at a point in its body's frame, -1 outside the grid."""
    u = (x - grid.low[w, 0]) * grid.frequency[w]
    v = (y - grid.low[w, 1]) * grid.frequency[w]
    t = (z - grid.low[w, 2]) * grid.frequency[w]
    if u < 0.0 or v < 0.0 or t < 0.0:
        return -1
    if u >= grid.shape[w, 0] or v >= grid.shape[w, 1] or t >= grid.shape[w, 2]:
        return -1
    return grid.first[w] + (int(u) * grid.shape[w, 1] + int(v)) * grid.shape[w, 2] + int(t)
