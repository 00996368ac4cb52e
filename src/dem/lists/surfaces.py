"""Grains near surfaces: outer list and contacts, as for pairs."""

from dem.bodies import separation
from dem.jit import inline_jit, jit, lean_jit, strict_jit
from dem.layout import BLOCK, INVERSE_MASS, MOTION, PLACE, RADIUS, GrainArrays
from dem.lists.blocks import LINE, finish_block, load_pair, raw_blocks
from dem.lists.history import load_history
from dem.lists.slabs import slab_numbers
from dem.meshes.contacts import list_near, list_patches, triangles_near
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
def is_near(i, key, grains, surfaces, rigid, images, cutoff):
    """True if grain i is within a cutoff of a surface or a patch."""
    if rigid is None:
        return is_near_shape(i, key, grains, surfaces, cutoff)
    else:  # noqa: RET505  # see `list_surface`
        return is_near_any(i, key, grains, surfaces, rigid, images, cutoff)


@lean_jit
def is_near_shape(i, w, grains, surfaces, cutoff):
    """As `is_near`, for a surface that is no mesh."""
    x, y, z = separation(grains.place, PLACE * i, surfaces, w)
    return x * x + y * y + z * z < cutoff * cutoff


@lean_jit
def is_near_any(i, key, grains, surfaces, rigid, images, cutoff):
    """As `is_near`, where there may be meshes."""
    w = rigid.triangles.surface[key]
    if surfaces.kind[w] == MESH:
        none = rigid.grid.listed[:0]
        return triangles_near(i, key, rigid, surfaces.body[w], grains, images, cutoff, none, 0) > 0
    return is_near_shape(i, w, grains, surfaces, cutoff)


@jit
def prune_surfaces(state, surfaces, rigid, lists, cutoff, model, near):
    """Copy every outer entry closer than within[i] + cutoff into contact blocks, slab by slab and there surface by surface.

    Grains count where they got their inner allowances. near : working memory for meshes. Returns what
    `dem.meshes.contacts.list_near` returns.
    """
    outer, contacts = lists.surfaces.outer, lists.surfaces.contacts
    slab_of = slab_numbers(lists.pairs.outer)
    grains = GrainArrays(lists.place, state.grains.motion, state.grains.remainder)
    total = place_contacts(grains, surfaces, rigid, model.access.images, lists, slab_of, cutoff)
    n_blocks = (total + BLOCK - 1) // BLOCK
    raw = raw_blocks(n_blocks, contacts.constants, model.laws)
    for part in range(contacts.count.shape[0]):
        load_part(part, state, surfaces, rigid, contacts, raw, model)
        load_history(part, contacts, outer.history)
    for k in range(n_blocks):
        finish_block(raw[k], contacts.constants[k], min(BLOCK, total - k * BLOCK), model.laws)
    return list_near(rigid, surfaces, grains, model.access.images, lists.within, cutoff, contacts, near)


@jit
def place_contacts(grains, surfaces, rigid, images, lists, slab_of, cutoff):
    """Fill the contacts' numbers in every part: first count, then place them. Returns the number of entries, gaps included.

    slab_of : see `dem.lists.slabs.slab_numbers`.
    """
    outer, contacts = lists.surfaces.outer, lists.surfaces.contacts
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
            i, key = outer.owner[k], outer.partner[k]
            if is_near(i, key, grains, surfaces, rigid, images, lists.within[i] + cutoff):
                w = surface_of(rigid, key)
                part = w + n_surfaces * slab_of[i] if slab_of.shape[0] else w
                if step == 1:
                    m = begin[part] + count[part]
                    contacts.first[m] = i
                    contacts.second[m] = key
                    contacts.slot[m] = k
                count[part] += 1
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
