"""What is refused of a surface, each fault in one line."""

import numpy as np

from dem.material import require
from dem.meshes.topology import doubled_areas, has_consistent_winding, topology_of, welded

#: A triangle is flat if its height is below this share of its longest edge.
FLAT = 1e-9

#: Largest size of a mesh in radii of the smallest grain, and smallest thickness of its walls.
LARGEST_RATIO, THINNEST_RATIO = 1000.0, 0.1


def check_surface(vertices: np.ndarray, triangles: np.ndarray, source: str) -> None:
    """Refuse a surface that no grain could touch sensibly."""
    require(vertices.ndim == 2 and vertices.shape[1:] == (3,), f"shape of the vertices of {source}", vertices.shape, "(n, 3)")
    require(triangles.ndim == 2 and triangles.shape[1:] == (3,), f"shape of the triangles of {source}", triangles.shape, "(m, 3)")
    require(len(triangles) > 0, f"number of triangles of {source}", 0, "at least one")
    require(bool(np.isfinite(vertices).all()), f"vertices of {source}", "not finite", "finite numbers")
    known = bool(((triangles >= 0) & (triangles < len(vertices))).all())
    require(known, f"vertex numbers of {source}", f"{triangles.min()} to {triangles.max()}", f"0 to {len(vertices) - 1}")
    vertices, triangles = welded(vertices, triangles)
    flat = flat_triangles(vertices, triangles)
    require(not len(flat), f"triangles without area in {source}", f"{len(flat)} (first: number {first(flat)})", "none")
    _, number, counts = np.unique(np.sort(triangles, axis=1), axis=0, return_index=True, return_counts=True)
    double = number[counts > 1]
    require(not len(double), f"duplicate triangles in {source}", f"{len(double)} (first: number {first(double)})", "none")
    topology = topology_of(vertices, triangles, 180.0)
    many = np.flatnonzero(topology.n_faces > 2)
    at = vertices[topology.edges[many[:1]]].mean(axis=1).round(6).tolist()
    require(not len(many), f"edges with more than two faces in {source}", f"{len(many)} (first: near {at} m)", "none")
    turned = "the same for all faces: repair it in the program that made the mesh"
    require(has_consistent_winding(topology, triangles), f"winding of the triangles of {source}", "not consistent", turned)


def first(numbers: np.ndarray) -> int | None:
    """Smallest of some numbers."""
    return int(numbers.min()) if len(numbers) else None


def flat_triangles(vertices: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Numbers of the triangles without area."""
    corners = vertices[triangles]
    longest = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
    return np.flatnonzero(np.linalg.norm(doubled_areas(vertices, triangles), axis=1) <= FLAT * longest**2)


def check_beside_grains(vertices: np.ndarray, triangles: np.ndarray, solid: bool, radius_m: float, source: str) -> None:
    """Refuse a mesh whose size or walls make no sense beside grains of a radius."""
    extent = np.ptp(vertices, axis=0)
    size = f"{extent.max():.3g} m, {extent.max() / radius_m:.3g} radii of the smallest grain"
    sensible = radius_m <= extent.max() <= LARGEST_RATIO * radius_m
    require(bool(sensible), f"size of {source}", size, f"1 to {LARGEST_RATIO:g} radii; is its unit right?")
    if solid:
        thickness, number = thinnest_wall(vertices, triangles, THINNEST_RATIO * radius_m)
        at = f"{thickness:.3g} m behind triangle {number}"
        allowed = f"at least {THINNEST_RATIO} radii of the smallest grain, or grains could reach the other side"
        require(number < 0, f"thickness of {source}", at, allowed)


def thinnest_wall(vertices: np.ndarray, triangles: np.ndarray, limit: float) -> tuple[float, int]:
    """Smallest thickness in m below a limit, and the triangle above it, or -1; from the centre of each triangle, inwards.

    Faces that share a vertex form an edge and no wall.
    """
    corners = vertices[triangles]
    normals = doubled_areas(vertices, triangles)
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    centres = corners.mean(axis=1)
    radii = np.linalg.norm(corners - centres[:, None], axis=2).max(axis=1)
    thinnest, above = limit, -1
    for t in range(len(triangles)):
        near = np.flatnonzero(np.abs(centres - centres[t]).max(axis=1) < radii + limit)
        near = near[~np.isin(triangles[near], triangles[t]).any(axis=1) & (normals[near] @ normals[t] < 0)]
        depth = depths(centres[t], -normals[t], corners[near], normals[near])
        if len(depth) and depth.min() < thinnest:
            thinnest, above = float(depth.min()), t
    return thinnest, above


def depths(origin, direction, corners, normals) -> np.ndarray:
    """Distances from a point along a direction to the triangles that it meets (Moller & Trumbore 1997, J. Graph. Tools 2, 21)."""
    u, v, w = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0], origin - corners[:, 0]
    across, turned = np.cross(direction, v), np.cross(w, u)
    scale = (u * across).sum(axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        a, b, depth = (w * across).sum(axis=1) / scale, turned @ direction / scale, (v * turned).sum(axis=1) / scale
        return depth[(a >= 0) & (b >= 0) & (a + b <= 1) & (depth > 0)]
