"""Which contacts spheres have with a mesh: 1e5 spheres at random places, half of them near creases, against brute force.

Brute force knows neither creases nor lists. It takes the nearest point of every patch among all its triangles, and drops that of
patch P if another patch Q passes through the point and is nearer to the centre, or as near and of lower number.
Every sphere starts at rest and makes one step, so its velocity tells the sum of its contacts' forces.
"""

import math
from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

import dem
from dem import solids
from virtual_soil.verification import closed_forms
from virtual_soil.verification.bodies_scene import GROUP
from virtual_soil.verification.check import Check
from virtual_soil.verification.rest import RADIUS_M, TIME_STEP_S
from virtual_soil.verification.scene import SOFT, mass_kg, scene

#: Spheres per shape, and such between the faces of the concave edge.
N_SPHERES, N_BETWEEN = 25_000, 1_000

#: Distance of the spheres from the surface, least allowed distance, and distance within which points count as one, in radii. No
#: point farther than FAR radii matters.
DISTANCE, LEAST_DISTANCE, SAME, FAR = 0.98, 0.955, 1e-9, 6.0

#: Outline of a prism with one concave edge, in radii.
OUTLINE = [(0, 0), (250, 0), (250, 100), (100, 100), (100, 250), (0, 250)]


class Nearest(NamedTuple):
    """Nearest points (n, patches, 3) of every patch to n centres, and their distances (n, patches)."""

    points: np.ndarray
    distances: np.ndarray


def shapes() -> dict[str, dem.Mesh]:
    """Closed shapes of flat and curved patches."""
    r = RADIUS_M
    return {
        "box of 192 triangles": divided(divided(solids.box((250 * r, 200 * r, 150 * r)))),
        "disc of 107 sides": solids.cylinder(120 * r, 50 * r, 107),
        "prism with a concave edge": solids.prism(np.array(OUTLINE) * r, 150 * r),
        "cone of 64 sides": solids.cone(120 * r, 200 * r, 64),
    }


def divided(mesh: dem.Mesh) -> dem.Mesh:
    """The same surface with every triangle cut into four."""
    corners = mesh.vertices_m[mesh.triangles]
    middle = 0.5 * (corners + np.roll(corners, -1, axis=1))
    a, b, c = (corners[:, k] for k in range(3))
    ab, bc, ca = (middle[:, k] for k in range(3))
    parts = np.concatenate([np.stack(part, axis=1) for part in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))])
    return dem.Mesh(vertices_m=parts.reshape(-1, 3), triangles=np.arange(3 * len(parts)).reshape(-1, 3), source=mesh.source)


def patches_of(mesh: dem.Mesh) -> list[np.ndarray]:
    """Corners (m, 3, 3) of the triangles of each patch: triangles of nearly equal normals that share a vertex."""
    corners = mesh.vertices_m[mesh.triangles]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    patch = np.full(len(corners), -1)
    for seed in range(len(corners)):
        if patch[seed] >= 0:
            continue
        todo, patch[seed] = [seed], seed
        while todo:
            t = todo.pop()
            shared = (np.isin(mesh.triangles, mesh.triangles[t]).sum(axis=1) == 2) & (patch < 0)
            joined = np.flatnonzero(shared & (normals @ normals[t] > math.cos(math.radians(30.0))))
            patch[joined] = seed
            todo += joined.tolist()
    return [corners[patch == seed] for seed in np.unique(patch)]


def nearest_of(corners: np.ndarray, centres: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Nearest points (n, 3) of a triangle (3, 3) to centres (n, 3), and their distances."""
    a, b, c = corners
    u, v, normal = b - a, c - a, np.cross(b - a, c - a)
    candidates = []
    for p, q in ((a, b), (b, c), (c, a)):
        share = np.clip((centres - p) @ (q - p) / ((q - p) @ (q - p)), 0.0, 1.0)
        candidates.append(p + share[:, None] * (q - p))
    foot = centres - ((centres - a) @ normal / (normal @ normal))[:, None] * normal
    scale = normal @ normal
    s, t = np.cross(foot - a, v) @ normal / scale, np.cross(u, foot - a) @ normal / scale
    inside = (s >= 0) & (t >= 0) & (s + t <= 1)
    candidates.append(np.where(inside[:, None], foot, candidates[0]))
    points = np.array(candidates)
    distances = np.linalg.norm(points - centres, axis=2)
    best = distances.argmin(axis=0)
    return points[best, np.arange(len(centres))], distances.min(axis=0)


def nearest(patches: list[np.ndarray], centres: np.ndarray) -> Nearest:
    """Nearest points of all patches, by brute force; those farther than FAR radii need not be right."""
    points = np.zeros((len(centres), len(patches), 3))
    distances = np.full((len(centres), len(patches)), np.inf)
    for p, patch in enumerate(patches):
        for corners in patch:
            low, high = corners.min(axis=0) - FAR * RADIUS_M, corners.max(axis=0) + FAR * RADIUS_M
            near = np.flatnonzero(((centres > low) & (centres < high)).all(axis=1))
            found, apart = nearest_of(corners, centres[near])
            nearer = apart < distances[near, p]
            points[near[nearer], p], distances[near[nearer], p] = found[nearer], apart[nearer]
    return Nearest(points, distances)


def acts(patches: list[np.ndarray], found: Nearest, radius_m: float) -> np.ndarray:
    """True for contacts (n, patches) that act: within the radius, and not dropped for another patch."""
    acting, slack = found.distances < radius_m, SAME * radius_m
    for p in range(len(patches)):
        for q in range(len(patches)):
            near = np.flatnonzero(acting[:, p] & (found.distances[:, q] < radius_m)) if p != q else np.zeros(0, int)
            if not len(near):
                continue
            shared, back = (nearest([patches[b]], found.points[near, a]).distances[:, 0] < slack for a, b in ((p, q), (q, p)))
            apart = found.distances[near, q] - found.distances[near, p]
            # a point of Q inside its face is nearer than Q's edge, though the two distances may be the same number
            tie = (np.abs(apart) <= slack) & ((q < p) | ~back)
            acting[near, p] &= ~(shared & ((apart < -slack) | tie))
    return acting


def places(mesh: dem.Mesh, patches: list[np.ndarray], rng: np.random.Generator) -> np.ndarray:
    """Centres (N_SPHERES, 3) of spheres that touch the mesh from outside, half of them near a crease."""
    corners = mesh.vertices_m[mesh.triangles]
    areas = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    sides = np.stack([corners, np.roll(corners, -1, axis=1)], axis=2).reshape(-1, 2, 3)
    inner = [nearest([patch], sides.mean(axis=1)).distances[:, 0] < SAME * RADIUS_M for patch in patches]
    creases = sides[np.sum(inner, axis=0) > 1]
    n = 3 * N_SPHERES // 2
    faces = corners[rng.choice(len(corners), n, p=areas / areas.sum())]
    on_faces = np.einsum("nk,nkx->nx", rng.dirichlet((1, 1, 1), n), faces)
    lengths = np.linalg.norm(creases[:, 1] - creases[:, 0], axis=1)
    edges = creases[rng.choice(len(creases), n, p=lengths / lengths.sum())]
    on_creases = edges[:, 0] + rng.uniform(size=(n, 1)) * (edges[:, 1] - edges[:, 0])
    chosen = []
    for points in (on_faces, on_creases):
        start = points + RADIUS_M * rng.normal(size=points.shape)
        start = start[dem.shapes.distance(mesh, start) > 0.01 * RADIUS_M]
        found = nearest(patches, start)
        at = found.points[np.arange(len(start)), found.distances.argmin(axis=1)]
        away = start - at
        centres = at + DISTANCE * RADIUS_M * away / np.linalg.norm(away, axis=1)[:, None]
        touching = dem.shapes.distance(mesh, centres) > LEAST_DISTANCE * RADIUS_M  # another face of a concave edge may be nearer
        chosen.append(centres[touching][: N_SPHERES // 2])
    return np.concatenate(chosen)


def between(rng: np.random.Generator) -> np.ndarray:
    """Centres (N_BETWEEN, 3) of spheres that touch both faces of the concave edge of the prism."""
    x, y = OUTLINE[3]
    away = np.column_stack([rng.uniform(LEAST_DISTANCE, 1.0, (N_BETWEEN, 2)), rng.uniform(-70.0, 70.0, N_BETWEEN)])
    return ((x, y, 0.0) + away) * RADIUS_M


def apart(centres: np.ndarray) -> list[np.ndarray]:
    """Numbers of the centres in groups whose spheres do not touch each other."""
    groups, left = [], np.arange(len(centres))
    while len(left):
        pairs = cKDTree(centres[left]).query_pairs(2.01 * RADIUS_M, output_type="ndarray")
        blocked = np.zeros(len(left), bool)
        for i, j in pairs[np.lexsort(pairs.T[::-1])]:
            if not blocked[i]:
                blocked[j] = True
        groups.append(left[~blocked])
        left = left[blocked]
    return groups


def speeds(mesh: dem.Mesh, centres: np.ndarray) -> np.ndarray:
    """Velocities (n, 3) of spheres at these centres after one step from rest."""
    velocities = np.zeros(centres.shape)
    for group in apart(centres):
        body = dem.Body(name="mesh", material="rigid", shape=mesh)
        simulation = scene(SOFT, RADIUS_M, TIME_STEP_S, walls=[body])
        simulation.add_grains(centres[group], RADIUS_M, "grain")
        simulation.advance(1)
        velocities[group] = simulation.grains.velocities_m_s
    return velocities


def checks() -> list[Check]:
    """Compare the forces on spheres at every shape with brute force."""
    stiffness, found = closed_forms.on_wall(SOFT, RADIUS_M, 1.0).stiffness, []
    for name, mesh in shapes().items():
        patches = patches_of(mesh)
        rng = np.random.default_rng(7)
        centres = places(mesh, patches, rng)
        if "concave" in name:
            centres = np.concatenate([centres, between(rng)])
        close = nearest(patches, centres)
        acting = acts(patches, close, RADIUS_M)
        away = (centres[:, None] - close.points) / close.distances[:, :, None]
        force = np.where(acting, stiffness * np.maximum(RADIUS_M - close.distances, 0.0) ** 1.5, 0.0)
        expected = (force[:, :, None] * away).sum(axis=1) * TIME_STEP_S / mass_kg(SOFT, RADIUS_M)
        error = np.linalg.norm(speeds(mesh, centres) - expected, axis=1) / np.linalg.norm(expected, axis=1).max()
        counts = np.bincount(acting.sum(axis=1), minlength=3)
        note = f"{counts[1]} with one contact, {counts[2]} with two"
        found.append(
            Check(
                group=GROUP, case=f"{len(centres)} spheres at a {name}", unit="-", source="brute force", expected=0,
                quantity="spheres whose force differs by more than 1e-9", obtained=float((error > 1e-9).sum()), note=note,
            )
        )  # fmt: skip
    return found
