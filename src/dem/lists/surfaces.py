"""Grains near surfaces: outer list and contacts, as for pairs."""

import numpy as np

from dem.bodies import separation
from dem.jit import inline_jit, jit, lean_jit, strict_jit
from dem.layout import BLOCK, INVERSE_MASS, MOTION, PLACE, RADIUS, GrainArrays
from dem.lists.blocks import LINE, finish_block, load_pair, raw_blocks
from dem.lists.history import load_history
from dem.lists.slabs import slab_numbers
from dem.meshes.contacts import TOO_MANY, find_behind, has_space, list_patches, note_triangles, triangles_near
from dem.shapes import MESH


@strict_jit
def find_surface_pairs(grains, surfaces, rigid, images, allowances, cutoff, outer):
    """As `dem.lists.pairs.find_pairs`, for grains closer than r_i + a_i + cutoff to surfaces, or to patches of meshes.

    rigid : None, or `dem.poses.Rigid`.
    """
    row = outer.row
    n = grains.place.shape[0] // PLACE
    m = 0
    for i in range(n):
        row[i, 0] = m
        row[i, 1] = m
        if grains.remainder[MOTION * i + INVERSE_MASS] == 0.0:
            continue
        near = grains.place[PLACE * i + RADIUS] + allowances[i] + cutoff
        for w in range(surfaces.kind.shape[0]):
            m = list_surface(i, w, grains, surfaces, rigid, images, near, outer, m)
            if m < 0:
                return -1
        row[i, 1] = m
    return m


@inline_jit
def list_surface(i, w, grains, surfaces, rigid, images, cutoff, outer, m):
    """Append surface w to the outer list of m entries if grain i is near; returns their number, or -1 if the list is too short."""
    if rigid is None:
        return list_shape(i, w, w, grains, surfaces, cutoff, outer, m)
    else:  # noqa: RET505  # numba prunes the branch of a missing type only in this form
        return list_any(i, w, grains, surfaces, rigid, images, cutoff, outer, m)


@lean_jit
def list_shape(i, w, key, grains, surfaces, cutoff, outer, m):
    """As `list_surface`, for a surface that is no mesh, under the number `key`."""
    x, y, z = separation(grains.place, PLACE * i, surfaces, w)
    if x * x + y * y + z * z < cutoff * cutoff:
        if m == outer.partner.shape[0]:
            return -1
        outer.owner[m] = i
        outer.partner[m] = key
        m += 1
    return m


@lean_jit
def list_any(i, w, grains, surfaces, rigid, images, cutoff, outer, m):
    """As `list_surface`, where there may be meshes."""
    if surfaces.kind[w] == MESH:
        return list_patches(i, w, rigid, surfaces.body[w], grains, images, cutoff, outer, m)
    return list_shape(i, w, rigid.triangles.first_key[w], grains, surfaces, cutoff, outer, m)


@inline_jit
def surface_of(rigid, key):
    """Number of the surface that a patch, or a surface that is no mesh, has in the lists."""
    if rigid is None:
        return key
    else:  # noqa: RET505  # see `list_surface`
        return rigid.triangles.surface[key]


@inline_jit
def count_near(i, key, grains, surfaces, rigid, images, cutoff, near, m):
    """Number of triangles of a patch within a cutoff of grain i, entered in near.triangle from m on; of another surface 1 or 0."""
    if rigid is None:
        return is_near(i, key, grains, surfaces, cutoff)
    else:  # noqa: RET505  # see `list_surface`
        return count_near_any(i, key, grains, surfaces, rigid, images, cutoff, near, m)


@lean_jit
def is_near(i, w, grains, surfaces, cutoff):
    """1 if grain i is within a cutoff of a surface that is no mesh, else 0."""
    x, y, z = separation(grains.place, PLACE * i, surfaces, w)
    return int(x * x + y * y + z * z < cutoff * cutoff)


@lean_jit
def count_near_any(i, key, grains, surfaces, rigid, images, cutoff, near, m):
    """As `count_near`, where there may be meshes."""
    w = rigid.triangles.surface[key]
    if surfaces.kind[w] == MESH:
        return triangles_near(i, key, rigid, surfaces.body[w], grains, images, cutoff, near.triangle, m)
    return is_near(i, w, grains, surfaces, cutoff)


@jit
def prune_surfaces(state, surfaces, rigid, lists, cutoff, model, near):
    """Copy every outer entry closer than within[i] + cutoff into contact blocks, slab by slab and there surface by surface.

    Grains count where they got their inner allowances. near : working memory for meshes, which gets the triangles within that
    distance. Returns LISTED, TOO_MANY if there is no space for these (and no contact then), or GRAIN_BEHIND; see
    `dem.meshes.contacts`.
    """
    outer, contacts, images = lists.surfaces.outer, lists.surfaces.contacts, model.access.images
    grains = GrainArrays(lists.place, state.grains.motion, state.grains.remainder)
    n_near = np.empty(outer.row[-1, 1] if outer.row.shape[0] else 0, np.int64)
    slab_of = slab_numbers(lists.pairs.outer)
    if not count_contacts(grains, surfaces, rigid, images, lists, slab_of, cutoff, near, n_near):
        contacts.count[:] = 0
        return TOO_MANY
    total = place_contacts(surfaces, rigid, lists.surfaces, slab_of, near, n_near)
    n_blocks = (total + BLOCK - 1) // BLOCK
    raw = raw_blocks(n_blocks, contacts.constants, model.laws)
    for part in range(contacts.count.shape[0]):
        load_part(part, state, surfaces, rigid, contacts, raw, model)
        load_history(part, contacts, outer.history)
    for k in range(n_blocks):
        finish_block(raw[k], contacts.constants[k], min(BLOCK, total - k * BLOCK), model.laws)
    return find_behind(rigid, surfaces, grains, images, contacts, near)


@lean_jit
def part_number(i, w, surfaces, slab_of):
    """Part of the contacts in which grain i touches surface w; slab_of : see `dem.lists.slabs.slab_numbers`."""
    return w + surfaces.kind.shape[0] * slab_of[i] if slab_of.shape[0] else w


@jit
def count_contacts(grains, surfaces, rigid, images, lists, slab_of, cutoff, near, n_near):
    """Count the contacts of every part, and what `count_near` counts for every entry; False if `near` has too little space."""
    outer, contacts, m = lists.surfaces.outer, lists.surfaces.contacts, 0
    contacts.count[:] = 0
    for k in range(n_near.shape[0]):
        i, key = outer.owner[k], outer.partner[k]
        n_near[k] = count_near(i, key, grains, surfaces, rigid, images, lists.within[i] + cutoff, near, m)
        if n_near[k] > 0:
            w = surface_of(rigid, key)
            contacts.count[part_number(i, w, surfaces, slab_of)] += 1
            m += n_near[k] if surfaces.kind[w] == MESH else 0
    return has_space(near, m)


@jit
def place_contacts(surfaces, rigid, neighbours, slab_of, near, n_near):
    """Fill the contacts' numbers in every part, after `count_contacts`. Returns the number of entries, gaps included."""
    outer, contacts = neighbours.outer, neighbours.contacts
    begin, count = contacts.begin, contacts.count
    total, m = 0, 0
    for part in range(count.shape[0]):
        begin[part] = total
        total += (count[part] + LINE - 1) // LINE * LINE
    count[:] = 0
    for k in range(n_near.shape[0]):
        if n_near[k] > 0:
            i, key = outer.owner[k], outer.partner[k]
            w = surface_of(rigid, key)
            part = part_number(i, w, surfaces, slab_of)
            q = begin[part] + count[part]
            contacts.first[q], contacts.second[q], contacts.slot[q] = i, key, k
            count[part] += 1
            if surfaces.kind[w] == MESH:
                note_triangles(near, q, m, n_near[k])
                m += n_near[k]
    return total


@jit
def load_part(part, state, surfaces, rigid, contacts, raw, model):
    """Store the pairs of one part of the contacts in raw (blocks, rows)."""
    grains = state.grains
    for q in range(contacts.begin[part], contacts.begin[part] + contacts.count[part]):
        i, w = contacts.first[q], surface_of(rigid, contacts.second[q])
        pair = model.pair_table[state.material[i] * model.n_materials + surfaces.material[w]]
        radii = (grains.place[PLACE * i + RADIUS], 0.0)
        load_pair(raw[q // BLOCK], q % BLOCK, pair, radii, grains.remainder[MOTION * i + INVERSE_MASS], model.laws)
