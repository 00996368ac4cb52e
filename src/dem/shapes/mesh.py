"""Surface of triangles that moves and turns. Geometry record: the origin of its frame, twice.

Kernels find its nearest points in `dem.meshes.contacts`, not by a function of the record.
"""

import logging
from copy import copy
from dataclasses import dataclass, field

import numpy as np

from dem.clumps.records import rotation_of, unit_quaternions
from dem.material import require, require_vector
from dem.meshes import faults
from dem.meshes.topology import is_closed, topology_of, volume, welded
from dem.meshes.triangles import Part, part_of, signed_distances
from dem.shapes.wall import Wall

LOG = logging.getLogger(__name__)


@dataclass(frozen=True, kw_only=True)
class Mesh(Wall):
    """Surface of triangles, open or closed, with its own frame; see `read_mesh`, and `dem.solids` for parametric shapes.

    Attributes
    ----------
    vertices_m : (n, 3) in the frame of the mesh. triangles : (m, 3), numbers of vertices, counter-clockwise seen from outside.
    position_m : (3,) of the frame's origin, about which the mesh turns. orientation : (4,) quaternion (w, x, y, z) of the frame.
    crease_angle_deg : faces that differ by more meet in a crease. A grain touches each smooth patch between creases at one point.
    solid : True if no grain may be behind the surface (the mesh must be closed then), by default if it is closed.
    source : file or maker, for messages.
    """

    vertices_m: np.ndarray = field(compare=False, repr=False)
    triangles: np.ndarray = field(compare=False, repr=False)
    position_m: tuple[float, float, float] = (0.0, 0.0, 0.0)
    orientation: tuple[float, float, float, float] = (1.0, 0.0, 0.0, 0.0)
    crease_angle_deg: float = 30.0
    solid: bool | None = None
    source: str = "mesh"

    def __post_init__(self):
        super().__post_init__()
        require_vector(self.position_m, 3, f"position_m of wall {self.name!r}")
        require(self.pivot_m is None, f"pivot_m of wall {self.name!r}", self.pivot_m, "none: a mesh turns about its origin")
        require(0 < self.crease_angle_deg < 180, "crease_angle_deg", self.crease_angle_deg, "between 0 and 180")
        vertices, triangles = np.asarray(self.vertices_m, float), np.asarray(self.triangles, np.int64)
        faults.check_surface(vertices, triangles, self.source)
        vertices, triangles = welded(vertices, triangles)
        quaternion = unit_quaternions(self.orientation, 1)[0]
        keeps = np.allclose(quaternion, self.orientation, rtol=0.0, atol=1e-15)
        for name, value in (("vertices_m", vertices), ("triangles", triangles)):
            object.__setattr__(self, name, value)
        object.__setattr__(self, "orientation", tuple(self.orientation if keeps else quaternion.tolist()))
        object.__setattr__(self, "solid", self._solid())

    def _solid(self) -> bool:
        """`solid`, decided; refuses what contradicts it."""
        closed = is_closed(topology_of(self.vertices_m, self.triangles, self.crease_angle_deg), self.triangles)
        if not self.solid:
            return closed if self.solid is None and volume(self.vertices_m, self.triangles) > 0 else False
        require(closed, f"solid of {self.source}", True, "False, since the surface is open")
        inwards = "False, or normals that point outwards: reverse the winding"
        require(volume(self.vertices_m, self.triangles) > 0, f"solid of {self.source}", True, inwards)
        return True

    @property
    def centre(self) -> tuple[float, float, float]:
        """Origin of the frame."""
        return self.position_m

    @property
    def turned(self) -> tuple[float, float, float, float]:
        """Orientation."""
        return self.orientation

    @property
    def turning_radius_m(self) -> float:
        """Distance of the farthest vertex from the origin of the frame."""
        return float(np.linalg.norm(self.vertices_m, axis=1).max())

    def extent(self, axis: int, turns: bool) -> tuple[float, float]:
        """Lowest and highest place along an axis of space from the origin in m; turns: whatever the orientation."""
        if turns:
            return -self.turning_radius_m, self.turning_radius_m
        along = (self.corners_m - self.position_m)[..., axis]
        return float(along.min()), float(along.max())

    @property
    def corners_m(self) -> np.ndarray:
        """Corners of the triangles in space where they are now, (m, 3, 3)."""
        turn = rotation_of(np.array([self.orientation]))[0]
        return (self.vertices_m @ turn.T + self.position_m)[self.triangles]


SHAPE = Mesh


def record(mesh: Mesh) -> tuple[float, ...]:
    """Geometry record."""
    return (*mesh.position_m, *mesh.position_m, 0.0)


def placed(mesh: Mesh, values: list[float]) -> Mesh:
    """The mesh with the origin of a record; the surface was checked when it was made, which takes milliseconds."""
    moved = copy(mesh)
    object.__setattr__(moved, "position_m", (values[0], values[1], values[2]))
    return moved


def part(mesh: Mesh) -> Part:
    """The triangles for the kernels."""
    return part_of(mesh.vertices_m, mesh.triangles, mesh.crease_angle_deg, bool(mesh.solid))


def distance(mesh: Mesh, positions: np.ndarray) -> np.ndarray:
    """Distances in m (n,) of positions (n, 3) from the nearest point of the mesh, negative behind a solid's surface."""
    own, local = part(mesh), (positions - mesh.position_m) @ rotation_of(np.array([mesh.orientation]))[0]
    return signed_distances(own.values, own.feature, own.pseudo, own.solid, local)


def check_beside_grains(mesh: Mesh, radius_m: float) -> None:
    """Refuse a mesh whose size or walls make no sense beside grains of the smallest radius."""
    faults.check_beside_grains(mesh.vertices_m, mesh.triangles, bool(mesh.solid), radius_m, mesh.source)
    corners = mesh.vertices_m[mesh.triangles]
    topology = topology_of(mesh.vertices_m, mesh.triangles, mesh.crease_angle_deg)
    sizes = np.array([np.ptp(corners[topology.patch == p], axis=(0, 1)).max() for p in range(topology.patch.max() + 1)])
    extent = " x ".join(f"{length / (2.0 * radius_m):.3g}" for length in np.ptp(corners, axis=(0, 1)))
    LOG.info("%s: %d triangles, %d patches, %s grain diameters", mesh.source, len(corners), len(sizes), extent)
    if (sizes < 2.0 * radius_m).any():
        LOG.warning("%s: %d patches are smaller than a grain", mesh.source, (sizes < 2.0 * radius_m).sum())
