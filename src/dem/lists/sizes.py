"""Far pairs: those of large or fast grains that reach beyond the neighbouring cells (see `dem.lists.pairs.cell_of`).

The search through neighbouring cells finds all pairs of common grains, and what lies next to the centres of large ones. The larger
grain of a pair finds the rest, over as many cells as it reaches grains no larger than itself; of two that reach over as many, the
first in cell order. So a few large grains cost what they touch, and not a search of all grains in cells of their size.
Hierarchical grids: Ogarko & Luding 2012, Computer Physics Communications 183, 931; here all sizes share one grid.
"""

import math
from typing import NamedTuple

import numpy as np

from dem.jit import lean_jit, strict_jit
from dem.lists.grid import cell_index, cells_of, nearest

#: Places within cells are known to this share of a cutoff.
TINY = 1e-9


class Far(NamedTuple):
    """Partners of far pairs: the grain of a rank owns partner[begin[rank] : begin[rank + 1]]."""

    begin: np.ndarray
    partner: np.ndarray


@strict_jit
def far_pairs(grains, search, capacity):
    """All far pairs, or just more than `capacity` of them (0: there are none). search : `dem.lists.pairs.Search`."""
    n = search.order.shape[0]
    if capacity == 0:
        return Far(np.zeros(n + 1, np.int64), np.empty(0, np.int32))
    finder, found = np.empty(capacity + 1, np.int32), np.empty(capacity + 1, np.int32)
    reach = np.empty(n, np.int32)
    for rank in range(n):
        reach[rank] = cells_of(search.in_order[3, rank], search.cell)
    widest = widest_in_cells(search)
    largest = widest.max()
    m = 0
    for rank in range(n):
        if reach[rank] > 1:
            begin, m = m, far_partners(rank, grains, search, reach, widest, largest, found, m)
            finder[begin:m] = rank
    return sorted_by_owner(grains, search, finder[:m], found[:m])


@strict_jit
def widest_in_cells(search):
    """Largest cutoff of the grains in each cell in m; 0 in an empty one."""
    widest = np.zeros(search.start.shape[0] - 1)
    for c in range(widest.shape[0]):
        for k in range(search.start[c], search.start[c + 1]):
            widest[c] = max(widest[c], search.in_order[3, k])
    return widest


@lean_jit
def gap(rank, axis, centre, offset, search):
    """Least distance in m along an axis from the grain of one rank, in cell `centre`, to the cell at an offset."""
    length, count = search.period[axis], search.shape[axis]
    width = length / count if length > 0.0 else search.cell
    inside = search.in_order[axis, rank] - search.low[axis] - centre * width
    if length > 0.0:
        inside -= length * math.floor((inside + 0.5 * (length - width)) / length)
        beyond = min(one_way(inside, offset - count, width), one_way(inside, offset + count, width))
        return min(one_way(inside, offset, width), beyond)
    return one_way(inside, offset, width)


@lean_jit
def one_way(inside, offset, width):
    """Distance in m from a place inside a cell to the cell at an offset."""
    return max(offset * width - inside, max(inside - (offset + 1) * width, 0.0))


@strict_jit
def far_partners(rank, grains, search, reach, widest, largest, found, m):
    """Write to `found`, from m on, the ranks of the far partners that the grain of one rank finds; returns the new length."""
    own = search.in_order[3, rank] * (1.0 + TINY)
    most = (own + largest) ** 2
    i, shape, period, k = search.order[rank], search.shape, search.period, reach[rank]
    centre_x = cell_index(grains, i, 0, search.low, shape, period, search.cell)
    centre_y = cell_index(grains, i, 1, search.low, shape, period, search.cell)
    centre_z = cell_index(grains, i, 2, search.low, shape, period, search.cell)
    for dx in range(-k, k + 1):
        cx = cell_at(centre_x, dx, shape[0], period[0])
        along = gap(rank, 0, centre_x, dx, search) ** 2
        if cx < 0 or along >= most:
            continue
        for dy in range(-k, k + 1):
            cy = cell_at(centre_y, dy, shape[1], period[1])
            across = along + gap(rank, 1, centre_y, dy, search) ** 2
            if cy < 0 or across >= most:
                continue
            column = (cx * shape[1] + cy) * shape[2]
            near = abs(dx) <= 1 and abs(dy) <= 1
            for dz in range(-k, k + 1):
                cz = cell_at(centre_z, dz, shape[2], period[2])
                if cz < 0 or (near and abs(dz) <= 1):
                    continue
                if across + gap(rank, 2, centre_z, dz, search) ** 2 < (own + widest[column + cz]) ** 2:
                    m = scan_far(rank, search.start[column + cz], search.start[column + cz + 1], search, reach, found, m)
    return m


@strict_jit
def cell_at(centre, offset, count, length):
    """Cell at an offset from `centre`, or -1 if there is none or if another offset already leads to it."""
    if length > 0.0:
        return (centre + offset) % count if -((count - 1) // 2) <= offset <= count // 2 else -1
    c = centre + offset
    return c if 0 <= c < count else -1


@lean_jit
def scan_far(rank, first, last, search, reach, found, m):
    """Write the partners of one grain among the ranks from first to last; returns the new length, at most that of `found`."""
    in_order, images = search.in_order, search.images
    for k in range(first, last):
        x = nearest(in_order[0, rank] - in_order[0, k], 0, images)
        y = nearest(in_order[1, rank] - in_order[1, k], 1, images)
        z = nearest(in_order[2, rank] - in_order[2, k], 2, images)
        cutoff = in_order[3, rank] + in_order[3, k]
        near = x * x + y * y + z * z < cutoff * cutoff
        mine = (reach[k] < reach[rank]) | ((reach[k] == reach[rank]) & (k > rank))
        if near & mine & (in_order[4, rank] != in_order[4, k]) & (m < found.shape[0]):
            found[m] = k
            m += 1
    return m


@strict_jit
def sorted_by_owner(grains, search, finder, found):
    """Far pairs by the rank of their owner."""
    n = search.order.shape[0]
    begin, partner = np.zeros(n + 2, np.int64), np.empty(found.shape[0], np.int32)
    for q in range(found.shape[0]):
        begin[2 + owner_rank(finder[q], found[q], grains, search)] += 1
    for rank in range(n):
        begin[rank + 2] += begin[rank + 1]
    for q in range(found.shape[0]):
        owner = owner_rank(finder[q], found[q], grains, search)
        partner[begin[owner + 1]] = search.order[finder[q] + found[q] - owner]
        begin[owner + 1] += 1
    return Far(begin, partner)


@strict_jit
def owner_rank(one, other, grains, search):
    """Rank of a pair's owner: the first in cell order, but across a periodic face that closes a ring of slabs the last."""
    first, last = min(one, other), max(one, other)
    crosses = search.is_ring and 2 * (layer(last, grains, search) - layer(first, grains, search)) > search.shape[0]
    return last if crosses else first


@strict_jit
def layer(rank, grains, search):
    """Index along x of the cell of the grain of one rank."""
    return cell_index(grains, search.order[rank], 0, search.low, search.shape, search.period, search.cell)


@strict_jit
def append_far(rank, far, partner, m):
    """Append the far partners of the grain of one rank to `partner` from m on; returns the new length, or -1 if it is too short."""
    begin, end = far.begin[rank], far.begin[rank + 1]
    if m + end - begin > partner.shape[0]:
        return -1
    for k in range(begin, end):
        partner[m + k - begin] = far.partner[k]
    return m + end - begin
