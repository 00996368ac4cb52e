"""Grains near walls: outer list and contacts, as for pairs."""

from dem.jit import jit, strict_jit
from dem.layout import INVERSE_MASS, MOTION, PLACE, RADIUS
from dem.lists.blocks import LINE, finish_blocks, load_constants
from dem.lists.history import load_history
from dem.walls import wall_separation


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
