"""Pairs of grains: the outer list from the cell grid, and the inner contact list pruned from it.

The outer list holds everything closer than r_i + r_j + skin, every pair once, in the row of one of its grains.
Contact history belongs to its entries and is carried over when the list is rebuilt. Every few steps the entries that could
touch before the next pruning are copied into the blocks that the contact stage reads, history and pair constants with them.
"""

import math

import numpy as np

from dem.jit import jit, lean_jit, strict_jit
from dem.layout import BLOCK, INVERSE_MASS, MOTION, PLACE, RADIUS, U, Y, Z
from dem.lists.blocks import finish_blocks, interleave, load_constants
from dem.lists.grid import cell_index, cell_size, frequencies, nearest_image, neighbour_cell, sort_into_cells
from dem.lists.history import load_history
from dem.lists.slabs import cut_slabs, used_slabs


@strict_jit
def find_pairs(grains, period, skin, row, owner, partner, order, slab):
    """Find every pair closer than r_i + r_j + skin, once; returns how many, or -1 when `partner` may be too short.

    A pair belongs to the row of the grain that comes first in cell order, so cells behind a grain need no look. Across a periodic
    face that closes a ring of slabs it is the last slab's (see `cut_slabs`).
    row : (n, 2) int64, begin and end of each grain's row; owner, partner : (capacity,) int32; order : (n,) grains in cell order;
    slab : (SLABS + 1,) see `cut_slabs`; all overwritten.
    """
    n = grains.place.shape[0] // PLACE
    cell = cell_size(grains, skin)
    low, shape, start = sort_into_cells(grains, period, cell, order)
    cut_slabs(start, shape, slab)
    in_order = np.empty((n, 5))
    for k in range(n):
        o = PLACE * order[k]
        for a in range(3):
            in_order[k, a] = grains.place[o + a]
        in_order[k, 3] = grains.place[o + RADIUS]
        in_order[k, 4] = grains.remainder[MOTION * order[k] + INVERSE_MASS]
    periodic = period[0] > 0.0 or period[1] > 0.0 or period[2] > 0.0
    frequency = frequencies(period)
    is_ring = period[0] > 0.0 and used_slabs(slab) > 1
    m = 0
    for rank in range(n):
        i = order[rank]
        row[i, 0] = m
        centre_x = cell_index(grains, i, 0, low, shape, period, cell)
        centre_y = cell_index(grains, i, 1, low, shape, period, cell)
        centre_z = cell_index(grains, i, 2, low, shape, period, cell)
        for dx in range(-1, 2):
            cx = neighbour_cell(centre_x, dx, shape[0], period[0])
            if is_ring and cx > centre_x + 1:
                continue  # the last layer's grains list this pair
            earliest = 0 if is_ring and 0 <= cx < centre_x - 1 else rank + 1
            for dy in range(-1, 2):
                cy = neighbour_cell(centre_y, dy, shape[1], period[1])
                if cx < 0 or cy < 0:
                    continue
                column = (cx * shape[1] + cy) * shape[2]
                for dz in range(-1, 2 if period[2] > 0.0 else 0):  # without period in z the three cells are one stretch
                    cz = neighbour_cell(centre_z, dz, shape[2], period[2])
                    bottom, top = cz, cz
                    if period[2] == 0.0:
                        bottom, top = max(centre_z - 1, 0), min(centre_z + 1, shape[2] - 1)
                    if bottom < 0:
                        continue
                    first, last = max(start[column + bottom], earliest), start[column + top + 1]
                    if first >= last:
                        continue
                    if m + last - first > partner.shape[0]:
                        return -1
                    if periodic:
                        m = scan_periodic(in_order, order, rank, first, last, skin, period, frequency, partner, m)
                    else:
                        m = scan(in_order, order, rank, first, last, skin, partner, m)
        row[i, 1] = m
        owner[row[i, 0] : m] = i
    return m


@lean_jit
def keep(in_order, order, rank, k, x, y, z, skin, partner, m):
    """Append the grain of rank k if it is near enough and not fixed together with the first; returns the new length.

    It is written in any case and only kept by advancing m: no branch to mispredict.
    """
    far = in_order[rank, 3] + in_order[k, 3] + skin
    near = x * x + y * y + z * z < far * far
    partner[m] = order[k]
    return m + int(near & (in_order[rank, 4] + in_order[k, 4] > 0.0))


@lean_jit
def scan(in_order, order, rank, first, last, skin, partner, m):
    """Append the neighbours of one grain among the ranks from first to last; returns the new length."""
    for k in range(first, last):
        x = in_order[rank, 0] - in_order[k, 0]
        y = in_order[rank, 1] - in_order[k, 1]
        z = in_order[rank, 2] - in_order[k, 2]
        m = keep(in_order, order, rank, k, x, y, z, skin, partner, m)
    return m


@lean_jit
def scan_periodic(in_order, order, rank, first, last, skin, period, frequency, partner, m):
    """As `scan`, to the nearest periodic images."""
    for k in range(first, last):
        x = nearest_image(in_order[rank, 0] - in_order[k, 0], period[0], frequency[0])
        y = nearest_image(in_order[rank, 1] - in_order[k, 1], period[1], frequency[1])
        z = nearest_image(in_order[rank, 2] - in_order[k, 2], period[2], frequency[2])
        m = keep(in_order, order, rank, k, x, y, z, skin, partner, m)
    return m


@strict_jit
def deepest_overlap(grains, period, row, partner):
    """Largest overlap among the pairs of an outer list over the smaller radius; 0 where none overlap."""
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
def prune_slab(s, grains, period, frequency, periodic, outer, reach, contacts, pair_table, n_materials, material):
    """Copy every outer pair of slab s closer than r_i + r_j + reach into its contact blocks.

    Sets the slab's count, to -1 when there is no room for all.
    """
    begin, end = contacts.begin[s], contacts.begin[s + 1]
    first, second, slot = contacts.first[begin:end], contacts.second[begin:end], contacts.slot[begin:end]
    if periodic:
        m = near_periodic_pairs(s, grains, period, frequency, outer, reach, first, second, slot)
    else:
        m = near_pairs(s, grains, outer, reach, first, second, slot)
    contacts.count[s] = m
    for k0 in range(0, m - BLOCK + 1, BLOCK):
        interleave(first[k0 : k0 + BLOCK])
        interleave(second[k0 : k0 + BLOCK])
        interleave(slot[k0 : k0 + BLOCK])
    load_history(s, contacts, outer.history)
    if contacts.alike[0]:
        return
    constants = contacts.constants[begin // BLOCK :]
    for q in range(m):
        i, j = first[q], second[q]
        pair = pair_table[material[i] * n_materials + material[j]]
        inverse_masses = grains.remainder[MOTION * i + INVERSE_MASS] + grains.remainder[MOTION * j + INVERSE_MASS]
        load_constants(constants, q, pair, grains.place[PLACE * i + RADIUS], grains.place[PLACE * j + RADIUS], inverse_masses)
    finish_blocks(constants, m)


@lean_jit
def entries_of(s, outer):
    """Where the outer list's entries of slab s begin and end: its rows stand one after another, in cell order."""
    first, last = outer.slab[s], outer.slab[s + 1] - 1
    if last < first:
        return 0, 0
    return outer.row[outer.order[first], 0], outer.row[outer.order[last], 1]


@lean_jit
def near_pairs(s, grains, outer, reach, first, second, slot):
    """List (i, j, entry) of every outer pair of slab s closer than r_i + r_j + reach; returns how many, -1 without enough room.

    Every pair is written and only kept by advancing m: no branch to mispredict, nor a short loop over each grain's row.
    """
    m, place = 0, grains.place
    begin, end = entries_of(s, outer)
    for k in range(begin, end):
        if m == first.shape[0]:
            return -1
        i, j = outer.owner[k], outer.partner[k]
        o, p = np.uint64(i * PLACE), np.uint64(j * PLACE)
        x, y, z = place[o] - place[p], place[o + U[Y]] - place[p + U[Y]], place[o + U[Z]] - place[p + U[Z]]
        near = place[o + U[RADIUS]] + place[p + U[RADIUS]] + reach
        first[m] = i
        second[m] = j
        slot[m] = k
        m += int(x * x + y * y + z * z < near * near)
    return m


@lean_jit
def near_periodic_pairs(s, grains, period, frequency, outer, reach, first, second, slot):
    """As `near_pairs`, by nearest image."""
    m, place = 0, grains.place
    begin, end = entries_of(s, outer)
    for k in range(begin, end):
        if m == first.shape[0]:
            return -1
        i, j = outer.owner[k], outer.partner[k]
        o, p = np.uint64(i * PLACE), np.uint64(j * PLACE)
        x = nearest_image(place[o] - place[p], period[0], frequency[0])
        y = nearest_image(place[o + U[Y]] - place[p + U[Y]], period[1], frequency[1])
        z = nearest_image(place[o + U[Z]] - place[p + U[Z]], period[2], frequency[2])
        near = place[o + U[RADIUS]] + place[p + U[RADIUS]] + reach
        first[m] = i
        second[m] = j
        slot[m] = k
        m += int(x * x + y * y + z * z < near * near)
    return m
