"""Topology of a surface of triangles: edges, creases, and the smooth patches between creases.

A crease is an edge whose faces differ by more than an angle, that has one face only (open), or more than two. A patch is what
creases leave connected. A corner is a vertex of several patches.
"""

from typing import NamedTuple

import numpy as np


class Topology(NamedTuple):
    """Edges and patches of m triangles.

    edges (e, 2): vertices, the lower number first. edge_of (m, 3): edge from corner k to corner k + 1. n_faces (e,).
    normals (m, 3), of length 1. angle (e,): between the faces of an edge in rad, pi where there are not two. patch (m,).
    """

    edges: np.ndarray
    edge_of: np.ndarray
    n_faces: np.ndarray
    normals: np.ndarray
    angle: np.ndarray
    patch: np.ndarray


def welded(vertices: np.ndarray, triangles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The same surface with vertices of equal coordinates joined, in the order of their first use; unused ones are left out."""
    used = vertices[triangles.ravel()] + 0.0  # -0.0 and 0.0 are one place
    _, first, number = np.unique(used, axis=0, return_index=True, return_inverse=True)
    order = np.argsort(first)
    rank = np.empty_like(order)
    rank[order] = np.arange(len(order))
    return used[first[order]], rank[number.ravel()].reshape(-1, 3)


def doubled_areas(vertices: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Normals (m, 3) whose lengths are twice the triangles' areas."""
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    return np.cross(b - a, c - a)


def topology_of(vertices: np.ndarray, triangles: np.ndarray, crease_angle_deg: float) -> Topology:
    """Edges, creases and patches of a surface with welded vertices."""
    from scipy.sparse import coo_matrix  # imported here: scipy takes a quarter of the start-up
    from scipy.sparse.csgraph import connected_components

    normals = doubled_areas(vertices, triangles)
    normals = normals / np.linalg.norm(normals, axis=1)[:, None]
    sides = np.sort(np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=-1).reshape(-1, 2), axis=1)
    edges, edge_of, n_faces = np.unique(sides, axis=0, return_inverse=True, return_counts=True)
    edge_of = edge_of.reshape(-1, 3)
    face = np.repeat(np.arange(len(triangles)), 3)[np.argsort(edge_of.ravel(), kind="stable")]
    begin = np.cumsum(n_faces) - n_faces
    angle = np.full(len(edges), np.pi)
    double = n_faces == 2
    one, other = face[begin[double]], face[begin[double] + 1]
    across = np.linalg.norm(np.cross(normals[one], normals[other]), axis=1)
    angle[double] = np.arctan2(across, (normals[one] * normals[other]).sum(axis=1))
    smooth = angle[double] <= np.deg2rad(crease_angle_deg)
    links = (np.ones(smooth.sum()), (one[smooth], other[smooth]))
    _, patch = connected_components(coo_matrix(links, shape=(len(triangles), len(triangles))), directed=False)
    return Topology(edges, edge_of, n_faces, normals, angle, patch)


def is_closed(topology: Topology, triangles: np.ndarray) -> bool:
    """True if every edge has two faces of consistent winding: the surface has an inside."""
    return bool((topology.n_faces == 2).all()) and has_consistent_winding(topology, triangles)


def has_consistent_winding(topology: Topology, triangles: np.ndarray) -> bool:
    """True if the two faces of each edge run through it in opposite directions."""
    forwards = np.where(triangles < np.roll(triangles, -1, axis=1), 1, -1)
    balance = np.bincount(topology.edge_of.ravel(), weights=forwards.ravel(), minlength=len(topology.edges))
    return bool((balance[topology.n_faces == 2] == 0).all())


def volume(vertices: np.ndarray, triangles: np.ndarray) -> float:
    """Volume within a closed surface in m3; negative where the normals point inwards."""
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    return float((a * np.cross(b, c)).sum() / 6.0)


def pseudo_normals(vertices: np.ndarray, triangles: np.ndarray, topology: Topology) -> np.ndarray:
    """Normals of a face, its edges and its corners (m, 7, 3), whose signs tell inside from outside.

    Edges take the sum of their faces' normals, corners that weighted by the faces' angles (Baerentzen & Aanaes 2005, IEEE Trans.
    Vis. Comput. Graph. 11, 243).
    """
    of_edges = np.zeros((len(topology.edges), 3))
    np.add.at(of_edges, topology.edge_of.ravel(), np.repeat(topology.normals, 3, axis=0))
    of_vertices = np.zeros_like(vertices)
    for k in range(3):
        a, b, c = (vertices[triangles[:, (k + t) % 3]] for t in range(3))
        u, v = b - a, c - a
        angle = np.arctan2(np.linalg.norm(np.cross(u, v), axis=1), (u * v).sum(axis=1))
        np.add.at(of_vertices, triangles[:, k], angle[:, None] * topology.normals)
    return np.concatenate([topology.normals[:, None], of_edges[topology.edge_of], of_vertices[triangles]], axis=1)
