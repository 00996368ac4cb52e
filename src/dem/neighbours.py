"""Who may touch whom: a cell list, an outer list of pairs and walls, and the inner contact list pruned from it.

The outer list holds everything closer than r_i + r_j + skin, every pair once, in the row of one of its grains.
Contact history belongs to its entries and is carried over when the list is rebuilt. Every few steps the entries that could
touch before the next pruning are copied into the blocks that the contact stage reads, history and pair constants with them.
"""

import math

import numpy as np

from dem.contact import hertz, mindlin
from dem.jit import jit, lean_jit, strict_jit
from dem.layout import (
    BLOCK,
    C_N,
    C_T,
    INV_R_SUM,
    INVERSE_MASS,
    K_N,
    K_T,
    MOTION,
    MU_R,
    MU_S,
    PAIR_BETA,
    PAIR_E,
    PAIR_G,
    PAIR_MU_R,
    PAIR_MU_S,
    PLACE,
    RADIUS,
    ROLLING_SHARE,
    U,
    Y,
    Z,
)
from dem.walls import wall_separation

#: Grains farther than so many radii from the origin have been thrown out by an unstable contact.
FARTHEST = 1e5
#: A grid has at most about so many cells per axis; beyond, cells are made larger.
MOST_CELLS = 400

#: Most slabs, and fewest grains that are worth a slab: what belongs to a few slabs stays in the second-level cache.
SLABS = 128
GRAINS_PER_SLAB = 2000

#: Neighbouring contacts in a block should not share a grain, or their scatters wait for each other.
STRIDE = 16

#: The contacts of each wall begin at a multiple of this, at a cache line of float32: no vector of them straddles two.
LINE = 16


@strict_jit
def is_sound(grains):
    """Whether every grain's place is a finite number of a size that a cell grid can span."""
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
    """Edge of a cell in m: what the largest pair can reach, or more where the grains are spread very far."""
    n = grains.place.shape[0] // PLACE
    largest = 0.0
    for i in range(n):
        largest = max(largest, grains.place[PLACE * i + RADIUS])
    cell = 2.0 * largest + skin
    for a in range(3):
        least, most = grains.place[a], grains.place[a]
        for i in range(n):
            least = min(least, grains.place[PLACE * i + a])
            most = max(most, grains.place[PLACE * i + a])
        cell = max(cell, (most - least) / MOST_CELLS)
    return cell


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
def cut_slabs(start, shape, slab):
    """Cut the grains in cell order into slabs of whole layers of cells along x: slab s has the ranks slab[s] to slab[s + 1].

    The pairs of a slab touch its own grains and the first layer of the next slab, which for the last one is slab 0, across a
    periodic face. The number of slabs is 1 or even: so those of even number share no grain, nor do those of odd number. It depends
    on the grains alone, not on the number of threads; unused slabs at the end are empty.
    """
    n, layers, area = start[-1], shape[0], shape[1] * shape[2]
    used = min(SLABS, n // GRAINS_PER_SLAB, layers)
    used -= used % 2
    slab[:] = n
    slab[0] = 0
    layer = 0
    for s in range(1, used):
        layer += 1
        while start[layer * area] < n * s // used and layer < layers - (used - s):
            layer += 1
        slab[s] = start[layer * area]


def most_slabs(n_grains: int) -> int:
    """How many slabs so many grains can be cut into, at most."""
    return max(1, min(SLABS, n_grains // GRAINS_PER_SLAB))


@lean_jit
def used_slabs(begin):
    """How many slabs there are, one or an even number, from where they begin: unused ones begin at the end."""
    used = 1
    while used < SLABS and begin[used] < begin[SLABS]:
        used += 1
    return used


@strict_jit
def cut_contacts(row, order, slab, n_entries, begin):
    """Where each slab's contacts begin in the contact blocks: room in proportion to its entries, at a whole block."""
    used = used_slabs(slab)
    room = begin[SLABS] // BLOCK - used
    for s in range(used):
        begin[s] = (row[order[slab[s]], 0] * room // max(n_entries, 1) + s) * BLOCK if slab[SLABS] > 0 else 0
    begin[used:SLABS] = begin[SLABS]


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


@strict_jit
def find_wall_pairs(grains, walls, skin, row, owner, partner):
    """As `find_pairs`, for grains near walls."""
    n = grains.place.shape[0] // PLACE
    m = 0
    for i in range(n):
        row[i, 0] = m
        row[i, 1] = m
        if grains.remainder[MOTION * i + INVERSE_MASS] == 0.0:
            continue
        reach = grains.place[PLACE * i + RADIUS] + skin
        for w in range(walls.kind.shape[0]):
            x, y, z = wall_separation(grains.place, PLACE * i, walls, w)
            if x * x + y * y + z * z < reach * reach:
                if m == partner.shape[0]:
                    return -1
                owner[m] = i
                partner[m] = w
                m += 1
        row[i, 1] = m
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


@strict_jit
def carry_history(old, new, in_pairs):
    """Copy the history of every entry that was in the old list; new entries start at zero.

    A pair may have changed hands: the history of (j, i) is that of (i, j) with the sign turned. Walls (in_pairs False) cannot.
    """
    for i in range(new.row.shape[0]):
        for k in range(new.row[i, 0], new.row[i, 1]):
            j = new.partner[k]
            new.history[k] = 0.0
            found = copy_entry(old, i, j, new, k, 1)
            if in_pairs and not found:
                copy_entry(old, j, i, new, k, -1)


@strict_jit
def copy_entry(old, i, j, new, k, sign):
    """Copy the history of entry (i, j) of the old list, times sign, to entry k of the new; says whether there was one."""
    for q in range(old.row[i, 0], old.row[i, 1]):
        if old.partner[q] == j:
            for t in range(new.history.shape[1]):
                new.history[k, t] = sign * old.history[q, t]
            return True
    return False


@lean_jit
def interleaved(q):
    """Position in the outer order of slot q of a full block."""
    return (q % STRIDE) * (BLOCK // STRIDE) + q // STRIDE


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


@jit
def common_constants(grains, contacts, pair_table, n_materials, material):
    """Set `contacts.alike`: whether all grains are of one size, mass and material; then fill `contacts.common`."""
    contacts.alike[0] = 0
    for i in range(1, material.shape[0]):
        if grains.place[PLACE * i + RADIUS] != grains.place[RADIUS] or material[i] != material[0]:
            return
        if grains.remainder[MOTION * i + INVERSE_MASS] != grains.remainder[INVERSE_MASS]:
            return
    if material.shape[0] == 0 or grains.remainder[INVERSE_MASS] == 0.0:
        return
    pair = pair_table[material[0] * n_materials + material[0]]
    for q in range(BLOCK):
        load_constants(contacts.common, q, pair, grains.place[RADIUS], grains.place[RADIUS], 2.0 * grains.remainder[INVERSE_MASS])
    finish_blocks(contacts.common, BLOCK)
    contacts.alike[0] = 1


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


@jit
def interleave(values):
    """Reorder one block in place so that pairs of the same grain stand apart."""
    copy = values.copy()
    for q in range(BLOCK):
        values[q] = copy[interleaved(q)]


@jit
def slab_numbers(outer):
    """Slab of every grain (n,) int32, from the outer list of pairs; (0,) with a single slab."""
    used = used_slabs(outer.slab)
    numbers = np.empty(outer.order.shape[0] if used > 1 else 0, np.int32)
    for s in range(used if used > 1 else 0):
        for k in range(outer.slab[s], outer.slab[s + 1]):
            numbers[outer.order[k]] = s
    return numbers


@jit
def prune_walls(grains, walls, outer, slab_of, reach, contacts, pair_table, n_materials, material):
    """Copy every outer wall entry closer than r_i + reach into contact blocks, slab by slab and there wall by wall.

    slab_of : see `slab_numbers`.
    """
    n_walls, n_entries = walls.kind.shape[0], outer.row[-1, 1] if outer.row.shape[0] else 0
    begin, count = contacts.begin, contacts.count
    total = 0
    for step in range(2):  # first count the contacts of every part, then put them where the counts say
        if step == 1:
            for part in range(count.shape[0]):
                begin[part] = total
                total += (count[part] + LINE - 1) // LINE * LINE
        count[:] = 0
        for k in range(n_entries):
            i, w = outer.owner[k], outer.partner[k]
            near = grains.place[PLACE * i + RADIUS] + reach
            x, y, z = wall_separation(grains.place, PLACE * i, walls, w)
            if x * x + y * y + z * z < near * near:
                part = w + n_walls * slab_of[i] if slab_of.shape[0] else w
                if step == 1:
                    m = begin[part] + count[part]
                    contacts.first[m] = i
                    contacts.second[m] = w
                    contacts.slot[m] = k
                count[part] += 1
    for part in range(count.shape[0]):
        for q in range(begin[part], begin[part] + count[part]):
            i, w = contacts.first[q], contacts.second[q]
            pair = pair_table[material[i] * n_materials + walls.material[w]]
            inverse_mass = grains.remainder[MOTION * i + INVERSE_MASS]
            load_constants(contacts.constants, q, pair, grains.place[PLACE * i + RADIUS], 0.0, inverse_mass)
        load_history(part, contacts, outer.history)
    finish_blocks(contacts.constants, total)


@lean_jit
def load_constants(constants, q, pair, r_i, r_j, inverse_masses):
    """Raw material of contact q for `finish_blocks`: radii and the sum of the inverse masses.

    r_j = 0 stands for a wall (flat, infinitely heavy).
    """
    c, k = constants[q // BLOCK], q % BLOCK
    c[INV_R_SUM * BLOCK + k] = r_i
    c[ROLLING_SHARE * BLOCK + k] = r_j
    c[C_T * BLOCK + k] = inverse_masses
    c[K_N * BLOCK + k] = pair[PAIR_E]
    c[K_T * BLOCK + k] = pair[PAIR_G]
    c[C_N * BLOCK + k] = pair[PAIR_BETA]
    c[MU_S * BLOCK + k] = pair[PAIR_MU_S]
    c[MU_R * BLOCK + k] = pair[PAIR_MU_R]


@lean_jit
def in_block(k, end):
    """How many of the contacts from k to end stand in one block with k."""
    return min(end, (k // BLOCK + 1) * BLOCK) - k


@lean_jit
def load_history(s, contacts, history):
    """Copy the contact history of part s of the contacts from the outer list to the blocks."""
    k, end = contacts.begin[s], contacts.begin[s] + contacts.count[s]
    while k < end:
        n = in_block(k, end)
        slot, h = contacts.slot[k : k + n], contacts.history[k // BLOCK, k % BLOCK :]
        for t in range(history.shape[1]):
            for q in range(n):
                h[t * BLOCK + q] = history[slot[q], t]
        k += n


@lean_jit
def finish_blocks(constants, n_contacts):
    """Turn radii, masses and moduli of all contacts into pair constants, whole blocks at a time."""
    for k0 in range(0, n_contacts, BLOCK):
        finish_block(constants[k0 // BLOCK], min(BLOCK, n_contacts - k0))


@lean_jit
def finish_block(c, n):
    """Pair constants of one block from what `load_constants` put there."""
    for q in range(n):
        r_i = c[INV_R_SUM * BLOCK + q]
        r_j = c[ROLLING_SHARE * BLOCK + q]
        flat = r_j == 0.0
        R_sum = r_i + r_j
        R_star = r_i if flat else r_i * r_j / R_sum
        m_star = 1 / c[C_T * BLOCK + q]
        E_star = c[K_N * BLOCK + q]
        G_star = c[K_T * BLOCK + q]
        beta = c[C_N * BLOCK + q]
        c[INV_R_SUM * BLOCK + q] = 1 / R_sum
        c[K_N * BLOCK + q] = hertz.stiffness(E_star, R_star)
        c[C_N * BLOCK + q] = hertz.damping(E_star, R_star, m_star, beta)
        c[K_T * BLOCK + q] = mindlin.stiffness(G_star, R_star)
        c[C_T * BLOCK + q] = mindlin.damping(G_star, R_star, m_star, beta)
        c[ROLLING_SHARE * BLOCK + q] = R_star / r_i


@lean_jit
def save_history(s, contacts, history):
    """Copy the contact history of part s of the contacts from the blocks back to the outer list, and forget the contacts."""
    k, end = contacts.begin[s], contacts.begin[s] + contacts.count[s]
    while k < end:
        n = in_block(k, end)
        slot, h = contacts.slot[k : k + n], contacts.history[k // BLOCK, k % BLOCK :]
        for t in range(history.shape[1]):
            for q in range(n):
                history[slot[q], t] = h[t * BLOCK + q]
        k += n
    contacts.count[s] = 0
