"""Contacts with meshes: which patches a grain is near, their nearest points, and which of them act.

A grain touches a patch at the patch's point nearest to its centre. Between patches of one body, a contact is dropped if its nearest
point lies on a crease or corner shared with a patch that is nearer, or as near and of lower number. So at a convex crease one patch
acts, at a concave one both. The history of a dropped contact passes to the patch that acts instead of it.

The rule is that of face, edge and vertex (Hu et al. 2013, Int. J. Numer. Meth. Eng. 94, 787; Santasusana et al. 2016, Comput. Part.
Mech. 3, 407), decided by topology instead of tolerances.
"""

from typing import NamedTuple

import numpy as np

from dem.jit import apart_jit, inline_jit, lean_jit
from dem.layout import BLOCK as B
from dem.layout import PLACE
from dem.meshes.search import cell_of
from dem.meshes.triangles import is_farther, nearest_from, over_face
from dem.poses import from_pivot, to_body, to_space
from dem.shapes import MESH, separate
from dem.shapes.wall import store

#: What `find_behind` returns, or `dem.lists.surfaces.prune_surfaces`.
LISTED, TOO_MANY, GRAIN_BEHIND = range(3)

#: A dropped contact is moved to this distance, in radii of the grain, where nothing touches.
DROPPED = 2.0


class Near(NamedTuple):
    """Of every contact (capacity,): its triangles, `triangle` from begin to end; the nearest of them and where its point lies.

    separation (capacity, 3) in m, square (capacity,) of its length, heir (capacity,): contact that acts instead of it, or -1.
    behind (1,): grain found behind the surface of a solid.
    """

    triangle: np.ndarray
    begin: np.ndarray
    end: np.ndarray
    closest: np.ndarray
    where: np.ndarray
    separation: np.ndarray
    square: np.ndarray
    heir: np.ndarray
    behind: np.ndarray


def new_near(capacity: int, n_triangles: int) -> Near:
    """Working memory for a number of contacts, and of triangles of all contacts."""
    ints = [np.zeros(capacity, np.int64) for _ in range(5)]
    begin, end, closest, where, heir = ints
    near = np.zeros((capacity, 3)), np.zeros(capacity)
    return Near(np.zeros(n_triangles, np.int64), begin, end, closest, where, *near, heir, np.full(1, -1))


@inline_jit
def in_frame(rigid, body, place, i, images):
    """Place in the frame of a body, or of its nearest image, of the grain whose record starts at i."""
    x, y, z = from_pivot(rigid.poses, body, place[i], place[i + 1], place[i + 2], images)
    return to_body(rigid.poses.rotation[body], x, y, z)


@lean_jit
def list_patches(i, w, rigid, body, grains, images, cutoff, outer, m):
    """Append the patches of mesh w within a cutoff of grain i to an outer list of m entries, in ascending order.

    Returns the new number of entries, or -1 if the list is too short.
    """
    grid, triangles, begin = rigid.grid, rigid.triangles, m
    x, y, z = in_frame(rigid, body, grains.place, PLACE * i, images)
    cell = cell_of(grid, w, x, y, z)
    if cell < 0:
        return m
    for k in range(grid.start[cell], grid.start[cell + 1]):
        t = grid.listed[k]
        if m > begin and outer.partner[m - 1] == triangles.patch[t]:
            continue
        if is_within(triangles.values[t], triangles.feature[t], x, y, z, cutoff * cutoff):
            m = insert(i, triangles.patch[t], begin, m, outer)
            if m < 0:
                return -1
    return m


@inline_jit
def insert(i, key, begin, m, outer):
    """Insert an entry (i, key) into the ascending entries of grain i from begin to m, unless it is there; as `list_patches`."""
    q = m
    while q > begin and outer.partner[q - 1] >= key:
        q -= 1
    if q < m and outer.partner[q] == key:
        return m
    if m == outer.partner.shape[0]:
        return -1
    for p in range(m, q, -1):
        outer.partner[p] = outer.partner[p - 1]
    outer.partner[q], outer.owner[m] = key, i
    return m + 1


@lean_jit
def triangles_near(i, key, rigid, body, grains, images, cutoff, listed, m):
    """Number of triangles of a patch within a cutoff of grain i; they are entered in `listed` from m on, as far as it goes."""
    grid, triangles, n, most = rigid.grid, rigid.triangles, 0, cutoff * cutoff
    x, y, z = in_frame(rigid, body, grains.place, PLACE * i, images)
    cell = cell_of(grid, triangles.surface[key], x, y, z)
    if cell >= 0:
        for k in range(grid.start[cell], grid.start[cell + 1]):
            t = grid.listed[k]
            if triangles.patch[t] == key and is_within(triangles.values[t], triangles.feature[t], x, y, z, most):
                if m + n < listed.shape[0]:
                    listed[m + n] = t
                n += 1
    return n


@inline_jit
def is_within(v, feature, x, y, z, square):
    """True if the square of a triangle's distance from a point is below `square` (m^2)."""
    height, within, inside = over_face(v, x, y, z)
    if is_farther(height, within, inside, square):
        return False
    _, _, _, d2, _ = nearest_from(v, feature, x, y, z, height, within, inside)
    return d2 < square


@inline_jit
def has_space(near, m):
    """True if there is space for m triangles near all grains. near : None, or `Near`."""
    if near is None:
        return True
    else:  # noqa: RET505  # numba prunes the branch of a missing type only in this form
        return m <= near.triangle.shape[0]


@inline_jit
def note_triangles(near, q, m, n):
    """Note that the n triangles from m on are those of contact q with a mesh."""
    if near is not None:
        near.begin[q], near.end[q], near.closest[q] = m, m + n, near.triangle[m]


@inline_jit
def find_behind(rigid, surfaces, grains, images, contacts, near):
    """Return LISTED, or GRAIN_BEHIND if a grain's centre is behind a solid's surface. rigid : None, or `dem.poses.Rigid`."""
    if rigid is None:
        return LISTED
    else:  # noqa: RET505  # see `has_space`
        return find_behind_any(rigid, surfaces, grains, images, contacts, near)


@lean_jit
def find_behind_any(rigid, surfaces, grains, images, contacts, near):
    """As `find_behind`."""
    n_surfaces = surfaces.kind.shape[0]
    for part in range(contacts.count.shape[0]):
        w = part % n_surfaces
        if surfaces.kind[w] == MESH and rigid.triangles.solid[w] > 0:
            locate_part(part, w, rigid, surfaces.body[w], grains, contacts, near, images)
            if finds_behind(part, rigid, surfaces.body[w], contacts, near):
                return GRAIN_BEHIND
    return LISTED


@lean_jit
def finds_behind(part, rigid, body, contacts, near):
    """True if a grain of a part is behind the nearest of its points, which `near.behind` then tells."""
    q, end = contacts.begin[part], contacts.begin[part] + contacts.count[part]
    while q < end:
        best, i = q, contacts.first[q]
        while q < end and contacts.first[q] == i:
            if near.square[q] < near.square[best]:
                best = q
            q += 1
        normal = rigid.triangles.pseudo[near.closest[best], near.where[best]]
        nx, ny, nz = to_space(rigid.poses.rotation[body], normal[0], normal[1], normal[2])
        if near.separation[best, 0] * nx + near.separation[best, 1] * ny + near.separation[best, 2] * nz < 0.0:
            near.behind[0] = i
            return True
    return False


@apart_jit
def locate_part(part, w, rigid, body, grains, contacts, near, images):
    """Find the nearest points of all contacts of a part with mesh w, and the heirs of those that are dropped."""
    q, end = contacts.begin[part], contacts.begin[part] + contacts.count[part]
    while q < end:
        first, i = q, contacts.first[q]
        x, y, z = in_frame(rigid, body, grains.place, PLACE * i, images)
        while q < end and contacts.first[q] == i:
            locate(q, rigid, body, near, x, y, z)
            q += 1
        for p in range(first, q if q - first > 1 else first):
            near.heir[p] = heir_of(p, first, q, rigid.triangles, contacts, near)


@inline_jit
def locate(q, rigid, body, near, x, y, z):
    """Find the nearest point of contact q's patch to (x, y, z) in the body's frame.

    Most triangles are farther than the one that was nearest before. Which of them is does not change the result.
    """
    values, feature, before = rigid.triangles.values, rigid.triangles.feature, near.closest[q]
    height, within, inside = over_face(values[before], x, y, z)
    bx, by, bz, most, at = nearest_from(values[before], feature[before], x, y, z, height, within, inside)
    sx, sy, sz, square = 0.0, 0.0, 0.0, 1e300
    for k in range(near.begin[q], near.end[q]):
        t = near.triangle[k]
        px, py, pz, p2, where = bx, by, bz, most, at
        if t != before:
            height, within, inside = over_face(values[t], x, y, z)
            if is_farther(height, within, inside, most):
                continue
            px, py, pz, p2, where = nearest_from(values[t], feature[t], x, y, z, height, within, inside)
        if p2 < square:
            sx, sy, sz, square = px, py, pz, p2
            near.closest[q], near.where[q] = t, where
    near.separation[q, 0], near.separation[q, 1], near.separation[q, 2] = to_space(rigid.poses.rotation[body], sx, sy, sz)
    near.square[q], near.heir[q] = square, -1


@inline_jit
def heir_of(p, first, end, triangles, contacts, near):
    """Contact of the same grain, among those from first to end, because of which contact p is dropped, or -1."""
    if near.where[p] == 0:
        return -1
    feature = triangles.feature[near.closest[p], near.where[p] - 1]
    if feature >= 0:
        for k in range(triangles.begin[feature], triangles.begin[feature + 1]):
            for q in range(first, end):
                if q != p and contacts.second[q] == triangles.around[k]:
                    if near.square[q] < near.square[p] or (near.square[q] == near.square[p] and q < p):
                        return q
    return -1


@inline_jit
def locate_contacts(rigid, part, w, surfaces, grains, contacts, near, images):
    """Before the loads of a part: nearest points of its contacts, if surface w is a mesh, and history passed on to heirs."""
    if rigid is not None:
        if surfaces.kind[w] == MESH:
            locate_part(part, w, rigid, surfaces.body[w], grains, contacts, near, images)
            pass_on(part, contacts, near)


@lean_jit
def pass_on(part, contacts, near):
    """Move the history of every dropped contact to the one that acts instead, unless that has a history of its own."""
    for q in range(contacts.begin[part], contacts.begin[part] + contacts.count[part]):
        heir = near.heir[q]
        if heir < 0:
            continue
        while near.heir[heir] >= 0:
            heir = near.heir[heir]
        old, new = contacts.history[q // B], contacts.history[heir // B]
        rows, is_empty = contacts.history.shape[1] // B, True
        for t in range(rows):
            is_empty &= new[t * B + heir % B] == 0.0
        for t in range(rows):
            if is_empty:
                new[t * B + heir % B] = old[t * B + q % B]
            old[t * B + q % B] = 0.0


@inline_jit
def separate_all(rigid, near, k, surfaces, w, geometry, places, n, b):
    """Write separations of the n contacts from number k on, all with surface w, and r^2 - d^2, into the work buffer b."""
    if rigid is None:
        separate(surfaces.kind[w], geometry, places, n, b)
    else:
        separate_any(near, k, surfaces.kind[w], geometry, places, n, b)


@lean_jit
def separate_any(near, k, kind, geometry, places, n, b):
    """As `separate_all`, where there may be meshes."""
    if kind == MESH:
        separate_mesh(near, k, places, n, b)
    else:
        separate(kind, geometry, places, n, b)


@lean_jit
def separate_mesh(near, k, places, n, b):
    """As `separate_all`, for a mesh."""
    for q in range(n):
        x, y, z = near.separation[k + q, 0], near.separation[k + q, 1], near.separation[k + q, 2]
        if near.heir[k + q] >= 0:
            far = DROPPED * places[3 * B + q] / np.sqrt(x * x + y * y + z * z)
            x, y, z = far * x, far * y, far * z
        store(x, y, z, places[3 * B + q], q, b)
