"""Grains near surfaces: outer list and contacts, as for pairs."""

from dem.bodies import separation
from dem.jit import jit, strict_jit
from dem.layout import BLOCK, INVERSE_MASS, MOTION, PLACE, RADIUS
from dem.lists.blocks import LINE, finish_block, load_pair, raw_blocks
from dem.lists.history import load_history
from dem.lists.slabs import slab_numbers


@strict_jit
def find_surface_pairs(grains, surfaces, skin, outer):
    """As `dem.lists.pairs.find_pairs`, for grains near surfaces."""
    row, owner, partner = outer.row, outer.owner, outer.partner
    n = grains.place.shape[0] // PLACE
    m = 0
    for i in range(n):
        row[i, 0] = m
        row[i, 1] = m
        if grains.remainder[MOTION * i + INVERSE_MASS] == 0.0:
            continue
        cutoff = grains.place[PLACE * i + RADIUS] + skin
        for w in range(surfaces.kind.shape[0]):
            x, y, z = separation(grains.place, PLACE * i, surfaces, w)
            if x * x + y * y + z * z < cutoff * cutoff:
                if m == partner.shape[0]:
                    return -1
                owner[m] = i
                partner[m] = w
                m += 1
        row[i, 1] = m
    return m


@jit
def prune_surfaces(state, surfaces, lists, cutoff, model):
    """Copy every outer entry closer than r_i + cutoff into contact blocks, slab by slab and there surface by surface."""
    outer, contacts = lists.surfaces.outer, lists.surfaces.contacts
    slab_of = slab_numbers(lists.pairs.outer)
    total = place_contacts(state.grains, surfaces, lists.surfaces, slab_of, cutoff)
    n_blocks = (total + BLOCK - 1) // BLOCK
    raw = raw_blocks(n_blocks, contacts.constants, model.laws)
    for part in range(contacts.count.shape[0]):
        load_part(part, state, surfaces, contacts, raw, model)
        load_history(part, contacts, outer.history)
    for k in range(n_blocks):
        finish_block(raw[k], contacts.constants[k], min(BLOCK, total - k * BLOCK), model.laws)


@jit
def place_contacts(grains, surfaces, neighbours, slab_of, cutoff):
    """Fill the contacts' numbers in every part: first count, then place them. Returns the number of entries, gaps included.

    slab_of : see `dem.lists.slabs.slab_numbers`.
    """
    outer, contacts = neighbours.outer, neighbours.contacts
    n_surfaces, n_entries = surfaces.kind.shape[0], outer.row[-1, 1] if outer.row.shape[0] else 0
    begin, count = contacts.begin, contacts.count
    total = 0
    for step in range(2):
        if step == 1:
            for part in range(count.shape[0]):
                begin[part] = total
                total += (count[part] + LINE - 1) // LINE * LINE
        count[:] = 0
        for k in range(n_entries):
            i, w = outer.owner[k], outer.partner[k]
            near = grains.place[PLACE * i + RADIUS] + cutoff
            x, y, z = separation(grains.place, PLACE * i, surfaces, w)
            if x * x + y * y + z * z < near * near:
                part = w + n_surfaces * slab_of[i] if slab_of.shape[0] else w
                if step == 1:
                    m = begin[part] + count[part]
                    contacts.first[m] = i
                    contacts.second[m] = w
                    contacts.slot[m] = k
                count[part] += 1
    return total


@jit
def load_part(part, state, surfaces, contacts, raw, model):
    """Store the pairs of one part of the contacts in raw (blocks, rows)."""
    grains = state.grains
    for q in range(contacts.begin[part], contacts.begin[part] + contacts.count[part]):
        i, w = contacts.first[q], contacts.second[q]
        pair = model.pair_table[state.material[i] * model.n_materials + surfaces.material[w]]
        radii = (grains.place[PLACE * i + RADIUS], 0.0)
        load_pair(raw[q // BLOCK], q % BLOCK, pair, radii, grains.remainder[MOTION * i + INVERSE_MASS], model.laws)
