"""Pairs of grains: the outer list from the cell grid, and the inner contact list pruned from it.

The outer list holds everything closer than r_i + r_j + skin, every pair once, in the row of one of its grains.
Contact history belongs to its entries and is carried over when the list is rebuilt. Every few steps the entries that could
touch before the next pruning are copied into the blocks that the contact stage reads, history and constants with them.
"""

import math
from typing import NamedTuple

import numpy as np

from dem.jit import jit, lean_jit, strict_inline_jit, strict_jit
from dem.layout import BLOCK, INVERSE_MASS, MOTION, PLACE, RADIUS, Period, U, Y, Z
from dem.lists.blocks import finish_block, interleave, load_pairs, raw_blocks
from dem.lists.grid import (
    cell_size,
    cells_of,
    frequencies,
    nearest,
    nearest_image,
    neighbour_cell,
    sort_into_cells,
)
from dem.lists.history import load_history
from dem.lists.sizes import append_far, far_pairs
from dem.lists.slabs import cut_slabs, used_slabs

#: Cells are wider than the cutoff of common grains, so that rounding makes none of these a large one.
WIDER = 1.0 + 1e-9
#: From this number of grains on cells are this many times as wide as usual where the largest cutoff is wider, if that is enough:
#: slabs are then a cell thick, and so many that steps are fused (`dem.step.schedule`). It is one width, whatever the fastest grain
#: does, as grains lie in memory in the order of the cells.
WIDE_FROM, WIDEST = 72_000, 1.25
#: Cost of a search through neighbouring cells as wide as the cutoff of common grains, over that of as many grains' far pairs:
#: 16 ns a grain and 0.5 us in 38 000 grains of sizes 2 : 1 (the bulk benchmarks' drum). Widths are tried in steps of WIDENING.
NEAR_COST, WIDENING = 0.03, 1.2


class Search(NamedTuple):
    """Input of a search through the cell grid.

    in_order (5, n): positions, shares of cutoffs, tags in cell order (grains of one tag are fixed together). low, shape, start,
    cell, period: the grid (`dem.lists.grid`). is_ring: the slabs close a ring across a periodic face. images: None, or Period.
    """

    in_order: np.ndarray
    order: np.ndarray
    low: np.ndarray
    shape: np.ndarray
    start: np.ndarray
    cell: float
    period: np.ndarray
    is_ring: bool
    images: Period | None


class Ahead(NamedTuple):
    """The grains of one cell, then those of the cells in which they search: columns of `Search.in_order` (5, n), numbers (n,).

    near (n,): whether they are partners of one grain.
    """

    in_order: np.ndarray
    number: np.ndarray
    near: np.ndarray


class Slots(NamedTuple):
    """One slab's part of the contacts: grains i and j, entry of the outer list."""

    first: np.ndarray
    second: np.ndarray
    slot: np.ndarray


@strict_jit
def find_pairs(grains, clumps, period, images, allowances, reach_m, usual, outer):
    """Find every pair closer than r_i + r_j + a_i + a_j + reach_m, once; returns their number, or -1 if the list may be too short.

    A pair belongs to the row of the grain that comes first in cell order, so only cells ahead of a grain are searched. Across a
    periodic face that closes a ring of slabs it belongs to the last slab (see `dem.lists.slabs.cut_slabs`). What large grains reach
    beyond the neighbouring cells is found by `dem.lists.sizes`.
    allowances (n,) : a_i in m; `usual`, that of the mean grain, serves for the size of the cells.
    clumps : `dem.clumps.records.Clumps`, or None. period (3,) : 0 where not periodic; images : its `Period`, or None. Overwrites
    `outer` except its history.
    """
    order = outer.order
    cell = cell_of(grains, allowances, reach_m, usual)
    reach = cells_of(farthest(grains, allowances) + 0.5 * reach_m, cell)
    low, shape, start = sort_into_cells(grains, period, cell, order)
    cut_slabs(start, shape, reach, outer.slab)
    is_ring = period[0] > 0.0 and used_slabs(outer.slab) > 1
    search = Search(
        in_cell_order(grains, clumps, allowances, reach_m, order), order, low, shape, start, cell, period, is_ring, images
    )
    far = far_pairs(grains, search, outer.partner.shape[0] if reach > 1 else 0)
    return fill_rows(search, far, outer)


@strict_jit
def fill_rows(search, far, outer):
    """As `find_pairs`, for grains in cells; far : their far pairs."""
    order, shape, start, n = search.order, search.shape, search.start, search.order.shape[0]
    ahead = Ahead(np.empty((5, n)), np.empty(n, np.int32), np.empty(n, np.int8))
    m = 0
    for x in range(shape[0]):
        for y in range(shape[1]):
            for z in range(shape[2]):
                c = (x * shape[1] + y) * shape[2] + z
                n_ahead = collect(x, y, z, search, ahead) if start[c] < start[c + 1] else 0
                for rank in range(start[c], start[c + 1]):
                    if m + n_ahead > outer.partner.shape[0]:
                        return -1
                    begin = m
                    m += scan(rank - start[c], n_ahead, ahead, search.images, outer.partner[m:])
                    if far.partner.shape[0] > 0:  # each call costs what its arrays cost to pass
                        m = append_far(rank, far, outer.partner, m)
                        if m < 0:
                            return -1
                    outer.row[order[rank], 0], outer.row[order[rank], 1] = begin, m
                    outer.owner[begin:m] = order[rank]
    return m


@strict_jit
def cell_of(grains, allowances, reach_m, usual):
    """Edge of a cell in m, at which the search costs least: from the cutoff of common grains (`cell_size`) to the largest one."""
    n, fine = allowances.shape[0], WIDER * cell_size(grains, 2.0 * usual + reach_m)
    wide = WIDER * (2.0 * farthest(grains, allowances) + reach_m)
    if wide <= fine:
        return fine
    if n >= WIDE_FROM and wide <= WIDEST * fine:
        return WIDEST * fine
    best, lowest = wide, NEAR_COST * (wide / fine) ** 3
    cell = fine
    while cell < wide:
        n_far = 0
        for i in range(n):
            n_far += int(2.0 * (grains.place[PLACE * i + RADIUS] + allowances[i]) + reach_m > cell)
        cost = NEAR_COST * (cell / fine) ** 3 + n_far / n
        if cost < lowest:
            best, lowest = cell, cost
        cell *= WIDENING
    return best


@strict_jit
def farthest(grains, allowances):
    """Largest sum of a grain's radius and its allowance in m."""
    most = 0.0
    for i in range(allowances.shape[0]):
        most = max(most, grains.place[PLACE * i + RADIUS] + allowances[i])
    return most


@strict_jit
def in_cell_order(grains, clumps, allowances, reach_m, order):
    """Position, share r + a + reach_m / 2 of the cutoff and tag of the grains in cell order, (5, n)."""
    in_order = np.empty((5, order.shape[0]))
    for k in range(order.shape[0]):
        o = PLACE * order[k]
        for a in range(3):
            in_order[a, k] = grains.place[o + a]
        in_order[3, k] = grains.place[o + RADIUS] + allowances[order[k]] + 0.5 * reach_m
        in_order[4, k] = tag(order[k], grains, clumps)
    return in_order


@lean_jit
def tag(i, grains, clumps):
    """Number that grain i shares with those only that it is fixed to: 0 if glued, below 0 in a clump, else its own."""
    if grains.remainder[MOTION * i + INVERSE_MASS] == 0.0:
        return 0
    if clumps is not None:
        if clumps.owner[i] >= 0:
            return -1 - np.int64(clumps.owner[i])
    return 1 + i


@strict_jit
def collect(x, y, z, search, ahead):
    """Copy the grains of cell (x, y, z), then those of the neighbouring cells in which they search; returns their number.

    So all grains of the cell look through one block of memory, not each through nine columns of cells.
    """
    shape, start, period = search.shape, search.start, search.period
    own = (x * shape[1] + y) * shape[2] + z
    n = copy_ranks(start[own], start[own + 1], search, ahead, 0)
    for dx in range(-1, 2):
        cx = neighbour_cell(x, dx, shape[0], period[0])
        if search.is_ring and cx > x + 1:
            continue  # listed by the last layer's grains
        earliest = 0 if search.is_ring and 0 <= cx < x - 1 else start[own + 1]
        for dy in range(-1, 2):
            cy = neighbour_cell(y, dy, shape[1], period[1])
            if cx >= 0 and cy >= 0:
                n = collect_column((cx * shape[1] + cy) * shape[2], z, earliest, search, ahead, n)
    return n


@strict_inline_jit
def collect_column(column, z, earliest, search, ahead, n):
    """As `collect`, from the cells of one column that are next to z; only ranks from `earliest` on. n : of the grains so far."""
    shape, start, period_z = search.shape, search.start, search.period[2]
    for dz in range(-1, 2 if period_z > 0.0 else 0):  # without period in z the three cells are contiguous
        cz = neighbour_cell(z, dz, shape[2], period_z)
        bottom, top = cz, cz
        if period_z == 0.0:
            bottom, top = max(z - 1, 0), min(z + 1, shape[2] - 1)
        if bottom >= 0:
            n = copy_ranks(max(start[column + bottom], earliest), start[column + top + 1], search, ahead, n)
    return n


@strict_inline_jit
def copy_ranks(first, last, search, ahead, n):
    """Copy the grains of the ranks from first to last behind the n that are there; returns the new number."""
    for k in range(first, last):
        for t in range(5):
            ahead.in_order[t, n] = search.in_order[t, k]
        ahead.number[n] = search.order[k]
        n += 1
    return n


@lean_jit
def scan(own, n, ahead, images, partner):
    """Write the partners of a grain among those after it to `partner`; returns their number. own, n : its place among n grains.

    Pairs that are fixed together are left out. Distances are vector code. Then every grain is written and kept by advancing m: no
    branch to mispredict. Slices begin at the first grain, as an index that could be below 0 prevents vector code.
    """
    places, share, tag_, number = ahead.in_order, ahead.in_order[3], ahead.in_order[4], ahead.number[own + 1 :]
    at = (places[0][own], places[1][own], places[2][own], share[own], tag_[own])
    x_, y_, z_ = places[0][own + 1 :], places[1][own + 1 :], places[2][own + 1 :]
    share, tag_ = share[own + 1 :], tag_[own + 1 :]
    for k in range(n - own - 1):
        x, y, z = nearest(at[0] - x_[k], 0, images), nearest(at[1] - y_[k], 1, images), nearest(at[2] - z_[k], 2, images)
        cutoff = at[3] + share[k]
        ahead.near[k] = (x * x + y * y + z * z < cutoff * cutoff) & (at[4] != tag_[k])
    m = 0
    for k in range(n - own - 1):
        partner[m] = number[k]
        m += int(ahead.near[k])
    return m


@strict_jit
def deepest_overlap(grains, period, row, partner):
    """Largest overlap among the pairs of an outer list over the smaller radius; 0 without overlap."""
    frequency, place = frequencies(period), grains.place
    deepest = 0.0
    for i in range(row.shape[0]):
        o = PLACE * i
        for k in range(row[i, 0], row[i, 1]):
            p = PLACE * partner[k]
            d2 = 0.0
            for a in range(3):
                d2 += nearest_image(place[o + a] - place[p + a], period[a], frequency[a]) ** 2
            r_i, r_j = place[o + RADIUS], place[p + RADIUS]
            deepest = max(deepest, (r_i + r_j - math.sqrt(d2)) / min(r_i, r_j))
    return deepest


@jit
def prune_slab(s, state, lists, model):
    """Copy every outer pair of slab s closer than within[i] + within[j] into its contact blocks.

    Grains count where they got their inner allowances. Sets the slab's count, to -1 if the capacity is too small.
    """
    outer, contacts = lists.pairs.outer, lists.pairs.contacts
    begin, end = contacts.begin[s], contacts.begin[s + 1]
    slots = Slots(contacts.first[begin:end], contacts.second[begin:end], contacts.slot[begin:end])
    m = near_pairs(s, lists.place, outer, lists.within, model.access.images, slots)
    contacts.count[s] = m
    for k0 in range(0, m - BLOCK + 1, BLOCK):
        interleave(slots.first[k0 : k0 + BLOCK])
        interleave(slots.second[k0 : k0 + BLOCK])
        interleave(slots.slot[k0 : k0 + BLOCK])
    load_history(s, contacts, outer.history)
    if not contacts.alike[0]:
        load_constants(m, state, slots, contacts.constants[begin // BLOCK :], model)


@jit
def load_constants(m, state, slots, constants, model):
    """Fill the constants of m contacts of a slab."""
    raw = raw_blocks(1, constants, model.laws)[0]
    for k0 in range(0, m, BLOCK):
        n = min(BLOCK, m - k0)
        load_pairs(slots.first[k0 : k0 + n], slots.second[k0 : k0 + n], state.grains, state.material, model, raw)
        finish_block(raw, constants[k0 // BLOCK], n, model.laws)


@lean_jit
def entries_of(s, outer):
    """First and last (excluded) of the outer list's entries of slab s: its rows follow each other in cell order."""
    first, last = outer.slab[s], outer.slab[s + 1] - 1
    if last < first:
        return 0, 0
    return outer.row[outer.order[first], 0], outer.row[outer.order[last], 1]


@lean_jit
def near_pairs(s, place, outer, within, images, slots):
    """List (i, j, entry) of every outer pair of slab s closer than within[i] + within[j]; returns their number, -1 if too many.

    Every pair is written and kept by advancing m: no branch to mispredict, nor a short loop over each grain's row.
    """
    m = 0
    first, second, slot = slots
    begin, end = entries_of(s, outer)
    for k in range(begin, end):
        if m == first.shape[0]:
            return -1
        i, j = outer.owner[k], outer.partner[k]
        o, p = np.uint64(i * PLACE), np.uint64(j * PLACE)
        x = nearest(place[o] - place[p], 0, images)
        y = nearest(place[o + U[Y]] - place[p + U[Y]], 1, images)
        z = nearest(place[o + U[Z]] - place[p + U[Z]], 2, images)
        near = within[i] + within[j]
        first[m] = i
        second[m] = j
        slot[m] = k
        m += int(x * x + y * y + z * z < near * near)
    return m
