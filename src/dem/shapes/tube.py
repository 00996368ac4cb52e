"""Upright open tube without thickness. Geometry record: axis (x, y) and bottom, then -, -, top, then radius."""

import math
from dataclasses import dataclass, field, replace

import numpy as np

from dem.jit import lean_jit
from dem.layout import BLOCK as B
from dem.material import require, require_vector
from dem.shapes.wall import SIZE, Wall, beyond, store


@dataclass(frozen=True, kw_only=True)
class Tube(Wall):
    """Upright open tube without thickness: axis at centre_m (x, y), from bottom_m to top_m."""

    radius_m: float
    bottom_m: float
    top_m: float
    centre_m: tuple[float, float] = field(default=(0.0, 0.0))

    def __post_init__(self):
        super().__post_init__()
        require_vector(self.centre_m, 2, f"centre_m of wall {self.name!r}")
        require(0 < self.radius_m < math.inf, f"radius_m of wall {self.name!r}", self.radius_m, "a positive number")
        if not self.bottom_m <= self.top_m:
            raise ValueError(f"Tube {self.name!r}: bottom_m {self.bottom_m} must not exceed top_m {self.top_m}.")
        for axis in self.axes_of_turn:
            require(not any(axis[:2]), f"axis of turning of wall {self.name!r}", axis, "z, the axis of the tube")
        if self.turns and self.pivot_m is not None:
            require(self.pivot_m[:2] == tuple(self.centre_m), f"pivot_m of wall {self.name!r}", self.pivot_m, "on the tube's axis")

    @property
    def centre(self) -> tuple[float, float, float]:
        """Centre in m, at height 0 if an end is at infinity."""
        height = 0.5 * (self.bottom_m + self.top_m)
        return (*self.centre_m, height if math.isfinite(height) else 0.0)


SHAPE = Tube


def record(tube: Tube) -> tuple[float, ...]:
    """Geometry record."""
    return (*tube.centre_m, tube.bottom_m, 0.0, 0.0, tube.top_m, tube.radius_m)


def placed(tube: Tube, values: list[float]) -> Tube:
    """The tube with the geometry of a record."""
    return replace(tube, centre_m=(values[0], values[1]), bottom_m=values[2], top_m=values[5])


def distance(tube: Tube, positions: np.ndarray) -> np.ndarray:
    """Distances in m (n,) of positions (n, 3) from the nearest point of the tube."""
    outwards = np.hypot(positions[:, 0] - tube.centre_m[0], positions[:, 1] - tube.centre_m[1]) - tube.radius_m
    return np.hypot(outwards, positions[:, 2] - np.clip(positions[:, 2], tube.bottom_m, tube.top_m))


@lean_jit
def outwards(x, y, radius):
    """Share of (x, y), relative to the tube's axis, that lies beyond its radius; negative inside."""
    return 1.0 - radius / math.sqrt(x * x + y * y + 1e-30)


@lean_jit
def separation(x, y, z, g):
    """Vector in m from the nearest point of the tube of record g."""
    x -= g[0]
    y -= g[1]
    share = outwards(x, y, g[SIZE])
    return share * x, share * y, beyond(z, g[2], g[5])


@lean_jit
def separate(g, places, n, b):
    """As `dem.shapes.separate`, for a tube."""
    x0, y0, z0, z1, radius = g[0], g[1], g[2], g[5], g[SIZE]  # read before the loop, which cannot change them
    for q in range(n):
        x, y, z = places[q] - x0, places[B + q] - y0, beyond(places[2 * B + q], z0, z1)
        share = outwards(x, y, radius)
        store(share * x, share * y, z, places[3 * B + q], q, b)
