"""Triangles as the kernels read them, and the nearest point of a triangle.

The distance to a patch must never exceed that to a crease of it, or a grain at the crease could touch both patches, or neither.
So edges have one direction and one arithmetic for all their triangles, corners are exact, and where a crease is as near as the face
it wins. No reordered sums here.
"""

import math
from typing import NamedTuple

import numpy as np

from dem.jit import exact_jit, strict_inline_jit, strict_jit
from dem.meshes.topology import Topology, pseudo_normals, topology_of

#: Columns of a triangle: first corner, normal; then per edge: start, direction, end, inverse square of its length, direction into
#: the face, how far beyond the edge the face still counts, and the corners' numbers at start and end.
CORNER, NORMAL, EDGES = 0, 3, 6
START, ALONG, END, INVERSE, INWARDS, SLACK, FROM, TO, EDGE = 0, 3, 6, 9, 10, 13, 14, 15, 16
COLUMNS = EDGES + 3 * EDGE

#: Smooth seams: share of an edge's length by which faces overlap, so that a seam's rounding does not show.
SEAM = 1e-9

#: Where rounding does not matter: a point farther inside all edges than this share of its height is nearest to the face; a square
#: that is larger by this share is larger.
FAR_INSIDE, ROUNDING = 1e-4, 1e-9

#: Where a nearest point lies: in the face, on edge k (ON_EDGE + k), in corner k.
IN_FACE, ON_EDGE, IN_CORNER = 0, 1, 4


class Triangles(NamedTuple):
    """All triangles of a scene, in the frames of their bodies.

    corners (m, 3, 3) in m, values (m, COLUMNS). patch (m,): number among all keys; a surface that is no mesh has one key.
    feature (m, 6): number of the crease or the corner at each edge and vertex, -1 where the surface is smooth.
    pseudo (m, 7, 3): see `pseudo_normals`. begin (f + 1,), around: patches at every crease and corner.
    first_key (surfaces + 1,), surface (keys,): of each other. solid (surfaces,): 1 if no grain may be behind a surface.
    """

    corners: np.ndarray
    values: np.ndarray
    patch: np.ndarray
    feature: np.ndarray
    pseudo: np.ndarray
    begin: np.ndarray
    around: np.ndarray
    first_key: np.ndarray
    surface: np.ndarray
    solid: np.ndarray


class Part(NamedTuple):
    """Triangles of one surface; numbers of patches and features start at zero. Fields as in `Triangles`."""

    corners: np.ndarray
    values: np.ndarray
    patch: np.ndarray
    feature: np.ndarray
    pseudo: np.ndarray
    features: list
    n_patches: int
    solid: bool


def part_of(vertices: np.ndarray, triangles: np.ndarray, crease_angle_deg: float, solid: bool) -> Part:
    """The triangles of one surface with welded vertices."""
    topology = topology_of(vertices, triangles, crease_angle_deg)
    feature, features = features_of(vertices, triangles, topology)
    smooth = feature[:, :3] < 0
    values = columns(vertices, triangles, topology, smooth)
    pseudo = pseudo_normals(vertices, triangles, topology)
    n_patches = int(topology.patch.max(initial=-1)) + 1
    return Part(vertices[triangles], values, topology.patch.astype(np.int64), feature, pseudo, features, n_patches, solid)


def features_of(vertices, triangles, topology: Topology) -> tuple[np.ndarray, list]:
    """Number of crease or corner at every edge and vertex of the triangles (m, 6), and the patches at each of them."""
    of_edges: list[set] = [set() for _ in topology.edges]
    of_vertices: list[set] = [set() for _ in vertices]
    for t, patch in enumerate(topology.patch.tolist()):
        for k in range(3):
            of_edges[topology.edge_of[t, k]].add(patch)
            of_vertices[triangles[t, k]].add(patch)
    features: list[list[int]] = []
    numbers = []
    for group in (of_edges, of_vertices):
        numbers.append(np.full(len(group), -1))
        for k, patches in enumerate(group):
            if len(patches) > 1:
                numbers[-1][k] = len(features)
                features.append(sorted(patches))
    return np.concatenate([numbers[0][topology.edge_of], numbers[1][triangles]], axis=1), features


def columns(vertices, triangles, topology: Topology, smooth: np.ndarray) -> np.ndarray:
    """Columns of the triangles (m, COLUMNS)."""
    values = np.zeros((len(triangles), COLUMNS))
    values[:, CORNER : CORNER + 3] = vertices[triangles[:, 0]]
    values[:, NORMAL : NORMAL + 3] = topology.normals
    for k in range(3):
        o = EDGES + k * EDGE
        one, other = (vertices[topology.edges[topology.edge_of[:, k], t]] for t in range(2))
        along = other - one
        inwards = np.cross(topology.normals, vertices[triangles[:, (k + 1) % 3]] - vertices[triangles[:, k]])
        length = np.linalg.norm(along, axis=1)
        values[:, o + START : o + START + 3], values[:, o + ALONG : o + ALONG + 3] = one, along
        values[:, o + END : o + END + 3], values[:, o + INVERSE] = other, 1.0 / length**2
        values[:, o + INWARDS : o + INWARDS + 3] = inwards / length[:, None]
        values[:, o + SLACK] = np.where(smooth[:, k], -SEAM * length, 0.0)
        forwards = triangles[:, k] < triangles[:, (k + 1) % 3]
        values[:, o + FROM], values[:, o + TO] = np.where(forwards, k, (k + 1) % 3), np.where(forwards, (k + 1) % 3, k)
    return values


def assembled(parts: list[Part | None]) -> Triangles:
    """Triangles of a scene; parts : of every surface, None for those that are no mesh."""
    n_keys = np.array([1 if part is None else part.n_patches for part in parts], np.int64)
    first_key = np.concatenate([[0], np.cumsum(n_keys)]).astype(np.int64)
    meshes = [(first_key[w], part) for w, part in enumerate(parts) if part is not None]
    patches = [[key + patch for patch in around] for key, part in meshes for around in part.features]
    offsets = np.cumsum([0] + [len(part.features) for _, part in meshes])
    features = [np.where(part.feature >= 0, part.feature + offset, -1) for (_, part), offset in zip(meshes, offsets, strict=False)]
    return Triangles(
        corners=np.concatenate([np.zeros((0, 3, 3)), *(part.corners for _, part in meshes)]),
        values=np.concatenate([np.zeros((0, COLUMNS)), *(part.values for _, part in meshes)]),
        patch=np.concatenate([np.zeros(0, np.int64), *(key + part.patch for key, part in meshes)]),
        feature=np.concatenate([np.zeros((0, 6), np.int64), *features]).astype(np.int64),
        pseudo=np.concatenate([np.zeros((0, 7, 3)), *(part.pseudo for _, part in meshes)]),
        begin=np.concatenate([[0], np.cumsum([len(around) for around in patches])]).astype(np.int64),
        around=np.concatenate([np.zeros(0, np.int64), *patches]).astype(np.int64),
        first_key=first_key,
        surface=np.repeat(np.arange(len(parts)), n_keys),
        solid=np.array([part is not None and part.solid for part in parts], np.int64),
    )


@exact_jit
def nearest_on_triangle(v, feature, x, y, z):
    """Vector from the nearest point of a triangle to (x, y, z) in m, its square, and where the point lies.

    v (COLUMNS,), feature (6,) : of the triangle.
    """
    height, within, inside = over_face(v, x, y, z)
    return nearest_from(v, feature, x, y, z, height, within, inside)


@strict_inline_jit
def over_face(v, x, y, z):
    """Height in m of a point over a triangle's plane, way in m to its nearest edge's line, below 0 beyond one; True if inside."""
    within, inside = np.inf, True
    for k in range(3):
        o = EDGES + k * EDGE
        px, py, pz = x - v[o + START], y - v[o + START + 1], z - v[o + START + 2]
        way = px * v[o + INWARDS] + py * v[o + INWARDS + 1] + pz * v[o + INWARDS + 2]
        inside &= way >= v[o + SLACK]
        within = min(within, way)
    height = (x - v[CORNER]) * v[NORMAL] + (y - v[CORNER + 1]) * v[NORMAL + 1] + (z - v[CORNER + 2]) * v[NORMAL + 2]
    return height, within, inside


@strict_inline_jit
def is_farther(height, within, inside, square):
    """True if a triangle is farther from a point than the root of `square` (m^2), by what `over_face` tells of the two."""
    return not inside and height * height + within * within > square * (1.0 + ROUNDING)


@strict_inline_jit
def nearest_from(v, feature, x, y, z, height, within, inside):
    """As `nearest_on_triangle`; the last three by `over_face`."""
    nx, ny, nz = v[NORMAL], v[NORMAL + 1], v[NORMAL + 2]
    if within > FAR_INSIDE * abs(height):
        return height * nx, height * ny, height * nz, height * height, IN_FACE
    sx, sy, sz, d2, where = 0.0, 0.0, 0.0, np.inf, ON_EDGE
    for k in range(3):
        o = EDGES + k * EDGE
        px, py, pz = x - v[o + START], y - v[o + START + 1], z - v[o + START + 2]
        t = (px * v[o + ALONG] + py * v[o + ALONG + 1] + pz * v[o + ALONG + 2]) * v[o + INVERSE]
        at = ON_EDGE + k
        if t >= 1.0:
            px, py, pz = x - v[o + END], y - v[o + END + 1], z - v[o + END + 2]
            at = IN_CORNER + int(v[o + TO])
        elif t > 0.0:
            px, py, pz = px - t * v[o + ALONG], py - t * v[o + ALONG + 1], pz - t * v[o + ALONG + 2]
        else:
            at = IN_CORNER + int(v[o + FROM])
        p2 = px * px + py * py + pz * pz
        if p2 < d2:
            sx, sy, sz, d2, where = px, py, pz, p2, at
    h2 = height * height
    if inside and (h2 < d2 or feature[where - 1] < 0):
        sx, sy, sz, d2, where = height * nx, height * ny, height * nz, h2, IN_FACE
    return sx, sy, sz, d2, where


@exact_jit
def signed_distance(values, feature, pseudo, solid, x, y, z):
    """Distance in m of a point from some triangles, negative behind those of a solid."""
    nearest, sign = np.inf, 1.0
    for m in range(values.shape[0]):
        sx, sy, sz, d2, where = nearest_on_triangle(values[m], feature[m], x, y, z)
        if d2 < nearest:
            nearest, sign = d2, 1.0
            if solid and sx * pseudo[m, where, 0] + sy * pseudo[m, where, 1] + sz * pseudo[m, where, 2] < 0.0:
                sign = -1.0
    return sign * math.sqrt(nearest)


@strict_jit
def signed_distances(values, feature, pseudo, solid, positions):
    """Distances in m (n,) of positions (n, 3) from some triangles, negative behind those of a solid."""
    distances = np.empty(positions.shape[0])
    for k in range(positions.shape[0]):
        x, y, z = positions[k, 0], positions[k, 1], positions[k, 2]
        distances[k] = signed_distance(values, feature, pseudo, solid, x, y, z)
    return distances
