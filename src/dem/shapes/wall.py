"""Base of all walls: name, material, motion; and the geometry record that kernels read.

A grain sees a wall through the separation: the vector from the wall's nearest point to the grain's centre. Edges and corners need
no special case, because the nearest point is clamped to the wall.
"""

import math
from dataclasses import dataclass

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
class Wall:
    """A body of one shape: a name, a material, a prescribed velocity (m/s) and possibly a drive along one axis."""

    name: str
    material: str
    velocity_m_s: tuple[float, float, float] = (0.0, 0.0, 0.0)
    drive: Drive | None = None

    def __post_init__(self):
        require_vector(self.velocity_m_s, 3, f"velocity_m_s of wall {self.name!r}")


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
