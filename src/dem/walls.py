"""Rigid geometry: axis-aligned boxes (degenerate ones are rectangles) and open upright tubes, moving without turning.

A wall is seen by a grain through one number triple: the separation from the wall's nearest point to the grain's centre. Edges
and corners need no special case, because the nearest point is clamped to the wall.

A wall moves with a prescribed velocity or, along one axis, under a constant force (a lid): m dv/dt = F_grains + F_applied - c v.
"""

import math
from dataclasses import dataclass, field, replace
from typing import NamedTuple, cast

import numpy as np

from dem.jit import inline_jit, lean_jit
from dem.layout import BLOCK as B
from dem.layout import FORCE

BOX, TUBE = 0, 1

#: Stands for "without end" in wall coordinates (m); finite, because kernels may assume that no value is infinite.
ENDLESS_M = 1e6


@dataclass(frozen=True, kw_only=True)
class Drive:
    """Force control of a wall along one axis (0, 1, 2).

    Attributes: applied_force_n (sign along the axis), mass_kg of the wall, damping_kg_s (viscous, to still the wall).
    """

    axis: int
    applied_force_n: float
    mass_kg: float
    damping_kg_s: float = 0.0

    def __post_init__(self):
        if self.axis not in (0, 1, 2):
            raise ValueError(f"Drive.axis is {self.axis}; allowed: 0 (x), 1 (y), 2 (z).")
        if not self.mass_kg > 0:
            raise ValueError(f"Drive.mass_kg is {self.mass_kg}; it must be positive.")
        if not self.damping_kg_s >= 0:
            raise ValueError(f"Drive.damping_kg_s is {self.damping_kg_s}; it must not be negative.")


@dataclass(frozen=True, kw_only=True)
class Wall:
    """What all walls share: a name, a material, a velocity (m/s) and possibly a drive."""

    name: str
    material: str
    velocity_m_s: tuple[float, float, float] = (0.0, 0.0, 0.0)
    drive: Drive | None = None


@dataclass(frozen=True, kw_only=True)
class Box(Wall):
    """Axis-aligned box from low_m to high_m (x, y, z); equal values along an axis make it a rectangle."""

    low_m: tuple[float, float, float]
    high_m: tuple[float, float, float]

    def __post_init__(self):
        if not all(low <= high for low, high in zip(self.low_m, self.high_m, strict=True)):
            raise ValueError(f"Box {self.name!r}: low_m {self.low_m} must not exceed high_m {self.high_m}.")


@dataclass(frozen=True, kw_only=True)
class Tube(Wall):
    """Upright open tube without thickness: axis at centre_m (x, y), from bottom_m to top_m."""

    radius_m: float
    bottom_m: float
    top_m: float
    centre_m: tuple[float, float] = field(default=(0.0, 0.0))

    def __post_init__(self):
        if not self.radius_m > 0:
            raise ValueError(f"Tube {self.name!r}: radius_m is {self.radius_m}; it must be positive.")
        if not self.bottom_m <= self.top_m:
            raise ValueError(f"Tube {self.name!r}: bottom_m {self.bottom_m} must not exceed top_m {self.top_m}.")


class WallArrays(NamedTuple):
    """What kernels read of all walls. geometry: box low (0-2) and high (3-5); tube centre x, y, bottom, -, -, top, radius (6)."""

    kind: np.ndarray
    geometry: np.ndarray
    velocity: np.ndarray
    material: np.ndarray
    force: np.ndarray
    drive_axis: np.ndarray
    drive: np.ndarray


def to_arrays(walls: list[Wall], material_index: dict[str, int]) -> WallArrays:
    """Arrays for the kernels; forces start at zero."""
    n = len(walls)
    arrays = WallArrays(
        kind=np.zeros(n, np.int64),
        geometry=np.zeros((n, 7)),
        velocity=np.zeros((n, 3)),
        material=np.zeros(n, np.int64),
        force=np.zeros((n, 3)),
        drive_axis=np.full(n, -1, np.int64),
        drive=np.zeros((n, 3)),
    )
    for w, wall in enumerate(walls):
        if isinstance(wall, Box):
            arrays.kind[w] = BOX
            arrays.geometry[w, :6] = (*wall.low_m, *wall.high_m)
        elif isinstance(wall, Tube):
            arrays.kind[w] = TUBE
            arrays.geometry[w] = (*wall.centre_m, wall.bottom_m, 0.0, 0.0, wall.top_m, wall.radius_m)
        arrays.velocity[w] = wall.velocity_m_s
        arrays.material[w] = material_index[wall.material]
        if wall.drive is not None:
            arrays.drive_axis[w] = wall.drive.axis
            arrays.drive[w] = (wall.drive.applied_force_n, wall.drive.mass_kg, wall.drive.damping_kg_s)
    np.clip(arrays.geometry, -ENDLESS_M, ENDLESS_M, out=arrays.geometry)
    return arrays


def from_arrays(wall: Wall, arrays: WallArrays, w: int) -> Wall:
    """The wall as it stands now (moved by the simulation)."""
    g, velocity = arrays.geometry[w].tolist(), tuple(arrays.velocity[w].tolist())
    if isinstance(wall, Box):
        return replace(wall, low_m=tuple(g[:3]), high_m=tuple(g[3:6]), velocity_m_s=velocity)
    return replace(cast(Tube, wall), centre_m=(g[0], g[1]), bottom_m=g[2], top_m=g[5], velocity_m_s=velocity)


def distance_to(wall: Wall, positions: np.ndarray) -> np.ndarray:
    """Distances in m (n,) of positions (n, 3) from the nearest point of a wall."""
    if isinstance(wall, Box):
        return np.linalg.norm(positions - np.clip(positions, wall.low_m, wall.high_m), axis=1)
    tube = cast(Tube, wall)
    outwards = np.hypot(positions[:, 0] - tube.centre_m[0], positions[:, 1] - tube.centre_m[1]) - tube.radius_m
    return np.hypot(outwards, positions[:, 2] - np.clip(positions[:, 2], tube.bottom_m, tube.top_m))


@lean_jit
def beyond(x, low, high):
    """How far x lies above `high`, or below `low` (negative); 0 between."""
    return x - min(max(x, low), high)


@lean_jit
def outwards(x, y, radius):
    """Share of (x, y), seen from a tube's axis, that lies beyond its radius; negative inside."""
    return 1.0 - radius / math.sqrt(x * x + y * y + 1e-30)


@lean_jit
def wall_separation(place, o, walls, w):
    """Vector in m from the nearest point of wall w to the centre of the grain whose place record starts at o."""
    x, y, z, g = place[o], place[o + 1], place[o + 2], walls.geometry[w]
    if walls.kind[w] == BOX:
        return beyond(x, g[0], g[3]), beyond(y, g[1], g[4]), beyond(z, g[2], g[5])
    x -= g[0]
    y -= g[1]
    share = outwards(x, y, g[6])
    return share * x, share * y, beyond(z, g[2], g[5])


@lean_jit
def separate(kind, geometry, places, n, b):
    """Separations of n grains (see `dem.step.gather.gather_at_wall`) from the nearest points of a wall, and r^2 - d^2.

    Numbers throughout: a function that takes or gives a tuple keeps these loops from being vectorised, which takes four times as
    long.
    """
    # read before the loops, they cannot change in them
    x0, y0, z0, x1, y1, z1, radius = geometry[0], geometry[1], geometry[2], geometry[3], geometry[4], geometry[5], geometry[6]
    if kind == BOX:
        for q in range(n):
            x, y, z = beyond(places[q], x0, x1), beyond(places[B + q], y0, y1), beyond(places[2 * B + q], z0, z1)
            store(x, y, z, places[3 * B + q], q, b)
    else:
        for q in range(n):
            x, y, z = places[q] - x0, places[B + q] - y0, beyond(places[2 * B + q], z0, z1)
            share = outwards(x, y, radius)
            store(share * x, share * y, z, places[3 * B + q], q, b)


@lean_jit
def store(x, y, z, r, q, b):
    """Put one separation and r^2 - d^2 into the work buffer."""
    b[q] = x
    b[B + q] = y
    b[2 * B + q] = z
    b[3 * B + q] = r * r - (x * x + y * y + z * z)


@inline_jit
def push(force, n, b):
    """Add the reactions of n contacts to the force (3,) on their wall."""
    x, y, z = 0.0, 0.0, 0.0
    for q in range(n):
        x += b[FORCE * B + q]
        y += b[(FORCE + 1) * B + q]
        z += b[(FORCE + 2) * B + q]
    force[0] -= x
    force[1] -= y
    force[2] -= z


@lean_jit
def later(walls, dt, geometry):
    """Fill geometry (steps, walls, 7) with where walls of constant velocity stand now and after each of the steps to come."""
    for k in range(geometry.shape[0]):
        for w in range(walls.kind.shape[0]):
            for t in range(7):
                geometry[k, w, t] = walls.geometry[w, t] if k == 0 else geometry[k - 1, w, t]
            for t in range(3 if k else 0):
                geometry[k, w, t] += walls.velocity[w, t] * dt
                geometry[k, w, 3 + t] += walls.velocity[w, t] * dt


@lean_jit
def fastest_wall(walls):
    """Speed of the fastest wall in m/s."""
    fastest = 0.0
    for w in range(walls.kind.shape[0]):
        v = walls.velocity[w]
        fastest = max(fastest, v[0] * v[0] + v[1] * v[1] + v[2] * v[2])
    return math.sqrt(fastest)


@lean_jit
def move_walls(walls, dt):
    """Drive and displace every wall by one step; returns the largest wall speed. `walls.force` must hold this step's forces."""
    for w in range(walls.kind.shape[0]):
        axis = walls.drive_axis[w]
        if axis >= 0:
            applied, mass, damping = walls.drive[w, 0], walls.drive[w, 1], walls.drive[w, 2]
            v = walls.velocity[w, axis]
            walls.velocity[w, axis] = (v + dt * (walls.force[w, axis] + applied) / mass) / (1.0 + dt * damping / mass)
        for t in range(3):
            walls.geometry[w, t] += walls.velocity[w, t] * dt
            walls.geometry[w, 3 + t] += walls.velocity[w, t] * dt
    return fastest_wall(walls)
