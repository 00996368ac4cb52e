"""Base of all walls: name, material, motion; and the geometry record that kernels read.

A grain sees a wall through the separation: the vector from the wall's nearest point to the grain's centre. Edges and corners need
no special case, because the nearest point is clamped to the wall.
"""

import math
from dataclasses import dataclass, replace

import numpy as np

from dem.jit import lean_jit
from dem.layout import BLOCK as B
from dem.layout import GAP, SEPARATION
from dem.material import require, require_vector

#: Stands for "without end" in wall coordinates (m); finite, because kernels may assume that no value is infinite.
ENDLESS_M = 1e6

#: A shape's geometry record: two points (x, y, z each) that move with its body, and a size.
FIRST, SECOND, SIZE, RECORD = 0, 3, 6, 7


@dataclass(frozen=True, kw_only=True)
class Drive:
    """Force control of a wall along one axis (0, 1, 2): m dv/dt = F_grains + F_applied - c v.

    Attributes: applied_force_n (sign along the axis), mass_kg of the wall, damping_kg_s (viscous, c).
    """

    axis: int
    applied_force_n: float
    mass_kg: float
    damping_kg_s: float = 0.0

    def __post_init__(self):
        require(self.axis in (0, 1, 2), "Drive.axis", self.axis, "0 (x), 1 (y), 2 (z)")
        require(math.isfinite(self.applied_force_n), "Drive.applied_force_n", self.applied_force_n, "a finite number")
        require(0 < self.mass_kg < math.inf, "Drive.mass_kg", self.mass_kg, "a positive number")
        require(0 <= self.damping_kg_s < math.inf, "Drive.damping_kg_s", self.damping_kg_s, "zero or positive")


@dataclass(frozen=True, kw_only=True)
class TurnDrive:
    """Torque control of a body about a fixed axis: I dw/dt = T_grains + T_applied - c w.

    Attributes: axis (3,) of any length, applied_torque_n_m about it, inertia_kg_m2 about it, damping_n_m_s (viscous, c).
    """

    axis: tuple[float, float, float]
    applied_torque_n_m: float
    inertia_kg_m2: float
    damping_n_m_s: float = 0.0

    def __post_init__(self):
        require_vector(self.axis, 3, "TurnDrive.axis")
        require(any(self.axis), "TurnDrive.axis", self.axis, "a direction")
        require(math.isfinite(self.applied_torque_n_m), "TurnDrive.applied_torque_n_m", self.applied_torque_n_m, "a finite number")
        require(0 < self.inertia_kg_m2 < math.inf, "TurnDrive.inertia_kg_m2", self.inertia_kg_m2, "a positive number")
        require(0 <= self.damping_n_m_s < math.inf, "TurnDrive.damping_n_m_s", self.damping_n_m_s, "zero or positive")


@dataclass(frozen=True, kw_only=True)
class FreeTurn:
    """Free rotation of a mesh about its origin, which is its centre of mass.

    Attributes: moments_kg_m2 (3,), principal moments about the axes of the mesh; applied_torque_n_m (3,), in space.
    """

    moments_kg_m2: tuple[float, float, float]
    applied_torque_n_m: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def __post_init__(self):
        require_vector(self.moments_kg_m2, 3, "FreeTurn.moments_kg_m2")
        require_vector(self.applied_torque_n_m, 3, "FreeTurn.applied_torque_n_m")
        a, b, c = sorted(self.moments_kg_m2)
        allowed = "positive numbers, none above the sum of the others"
        require(a > 0 and c <= (a + b) * (1 + 1e-9), "FreeTurn.moments_kg_m2", self.moments_kg_m2, allowed)


@dataclass(frozen=True, kw_only=True)
class Motion:
    """Motion of a body: each axis of translation, and the rotation, is fixed (velocity zero), prescribed or driven.

    Attributes
    ----------
    velocity_m_s, angular_velocity_rad_s : (3,), prescribed, or at the start where driven.
    drives : forces along single axes. turn : drives the rotation (about one axis, or free).
    pivot_m : (3,) point about which a box or a tube turns, by default its centre; meshes turn about their origin.
    """

    velocity_m_s: tuple[float, float, float] = (0.0, 0.0, 0.0)
    drives: tuple[Drive, ...] = ()
    angular_velocity_rad_s: tuple[float, float, float] = (0.0, 0.0, 0.0)
    turn: TurnDrive | FreeTurn | None = None
    pivot_m: tuple[float, float, float] | None = None


@dataclass(frozen=True, kw_only=True)
class Wall:
    """A body of one shape: a name, a material, and its motion.

    Attributes: velocity_m_s (prescribed), drive (force along an axis), and the further attributes of `Motion`. As the shape of a
    `Body`, a wall needs neither name nor material.
    """

    name: str = ""
    material: str = ""
    velocity_m_s: tuple[float, float, float] = (0.0, 0.0, 0.0)
    drive: Drive | tuple[Drive, ...] | None = None
    angular_velocity_rad_s: tuple[float, float, float] = (0.0, 0.0, 0.0)
    turn: TurnDrive | FreeTurn | None = None
    pivot_m: tuple[float, float, float] | None = None

    def __post_init__(self):
        require_vector(self.velocity_m_s, 3, f"velocity_m_s of wall {self.name!r}")
        require_vector(self.angular_velocity_rad_s, 3, f"angular_velocity_rad_s of wall {self.name!r}")
        if self.pivot_m is not None:
            require_vector(self.pivot_m, 3, f"pivot_m of wall {self.name!r}")
        axes = [drive.axis for drive in self.drives]
        require(len(set(axes)) == len(axes), f"axes of the drives of wall {self.name!r}", axes, "different ones")
        if isinstance(self.turn, TurnDrive) and any(self.angular_velocity_rad_s):
            across = math.hypot(*np.cross(self.turn.axis, self.angular_velocity_rad_s))
            along = f"a multiple of the drive's axis {self.turn.axis}"
            size = math.hypot(*self.turn.axis) * math.hypot(*self.angular_velocity_rad_s)
            require(across <= 1e-9 * size, f"angular_velocity_rad_s of wall {self.name!r}", self.angular_velocity_rad_s, along)

    @property
    def drives(self) -> tuple[Drive, ...]:
        """All drives along axes."""
        return self.drive if isinstance(self.drive, tuple) else () if self.drive is None else (self.drive,)

    @property
    def turns(self) -> bool:
        """True if the wall turns, or may."""
        return self.turn is not None or any(self.angular_velocity_rad_s)

    @property
    def axes_of_turn(self) -> list[tuple[float, float, float]]:
        """Axes about which the wall turns, of any length; the three of space if it turns freely."""
        if isinstance(self.turn, FreeTurn):
            return [(1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)]
        axes = [self.angular_velocity_rad_s] + ([self.turn.axis] if self.turn else [])
        return [axis for axis in axes if any(axis)]

    @property
    def turned(self) -> tuple[float, float, float, float]:
        """Quaternion (w, x, y, z) of the wall's frame; boxes and tubes keep theirs, since they only rub."""
        return (1.0, 0.0, 0.0, 0.0)

    @property
    def turning_radius_m(self) -> float:
        """Distance of the farthest point that turns from the pivot; 0 if the shape stays as it is."""
        return 0.0

    @property
    def centre(self) -> tuple[float, float, float]:
        """Centre of the shape in m, 0 along axes without end."""
        raise NotImplementedError

    @property
    def pivot(self) -> tuple[float, float, float]:
        """Point about which the wall turns."""
        return self.centre if self.pivot_m is None else self.pivot_m


@dataclass(frozen=True, kw_only=True)
class Body:
    """A rigid body: a shape (`Box`, `Tube` or `Mesh` without name and material), a material, and its motion.

    The same as a wall with these attributes; `Simulation.add_wall` takes both.
    """

    name: str
    material: str
    shape: Wall
    motion: Motion = Motion()

    def as_wall(self) -> Wall:
        """The shape with this name, material and motion."""
        motion = self.motion
        return replace(
            self.shape,
            name=self.name,
            material=self.material,
            velocity_m_s=motion.velocity_m_s,
            drive=motion.drives or None,
            angular_velocity_rad_s=motion.angular_velocity_rad_s,
            turn=motion.turn,
            pivot_m=motion.pivot_m,
        )


@lean_jit
def beyond(x, low, high):
    """Signed distance of x above `high`, or below `low` (negative); 0 between."""
    return x - min(max(x, low), high)


@lean_jit
def store(x, y, z, r, q, b):
    """Write one separation and r^2 - d^2 into the work buffer."""
    b[SEPARATION * B + q] = x
    b[(SEPARATION + 1) * B + q] = y
    b[(SEPARATION + 2) * B + q] = z
    b[GAP * B + q] = r * r - (x * x + y * y + z * z)
