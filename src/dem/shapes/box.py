"""Axis-aligned box; a degenerate one is a rectangle."""

import math
from dataclasses import dataclass, replace

import numpy as np

from dem.jit import lean_jit
from dem.layout import BLOCK as B
from dem.material import require, require_vector
from dem.shapes.wall import Wall, beyond, store


@dataclass(frozen=True, kw_only=True)
class Box(Wall):
    """Axis-aligned box from low_m to high_m (x, y, z); equal values along an axis make it a rectangle."""

    low_m: tuple[float, float, float]
    high_m: tuple[float, float, float]

    def __post_init__(self):
        super().__post_init__()
        for name, corner in (("low_m", self.low_m), ("high_m", self.high_m)):
            require_vector(corner, 3, f"{name} of wall {self.name!r}", endless=True)
        if not all(low <= high for low, high in zip(self.low_m, self.high_m, strict=True)):
            raise ValueError(f"Box {self.name!r}: low_m {self.low_m} must not exceed high_m {self.high_m}.")
        for axis in self.axes_of_turn:
            along = [k for k in range(3) if axis[k]]
            allowed = (
                "along the normal of a rectangle, or of a box without end along the other axes: other boxes would change shape"
            )
            require(len(along) == 1 and self.is_round(along[0]), f"axis of turning of wall {self.name!r}", axis, allowed)

    def is_round(self, axis: int) -> bool:
        """True if grains inside the outline cannot tell that the box turns about an axis."""
        endless = [math.isinf(self.low_m[k]) and math.isinf(self.high_m[k]) for k in range(3) if k != axis]
        return self.low_m[axis] == self.high_m[axis] or all(endless)

    @property
    def centre(self) -> tuple[float, float, float]:
        """Centre in m, 0 along axes without end."""
        sums = (low + high for low, high in zip(self.low_m, self.high_m, strict=True))
        x, y, z = (0.5 * total if math.isfinite(total) else 0.0 for total in sums)
        return x, y, z


SHAPE = Box


def record(box: Box) -> tuple[float, ...]:
    """Geometry record: low corner, high corner."""
    return (*box.low_m, *box.high_m, 0.0)


def placed(box: Box, values: list[float]) -> Box:
    """The box with the geometry of a record."""
    x0, y0, z0, x1, y1, z1 = values[:6]
    return replace(box, low_m=(x0, y0, z0), high_m=(x1, y1, z1))


def distance(box: Box, positions: np.ndarray) -> np.ndarray:
    """Distances in m (n,) of positions (n, 3) from the nearest point of the box."""
    return np.linalg.norm(positions - np.clip(positions, box.low_m, box.high_m), axis=1)


@lean_jit
def separation(x, y, z, g):
    """Vector in m from the nearest point of the box of record g."""
    return beyond(x, g[0], g[3]), beyond(y, g[1], g[4]), beyond(z, g[2], g[5])


@lean_jit
def separate(g, places, n, b):
    """As `dem.shapes.separate`, for a box."""
    x0, y0, z0, x1, y1, z1 = g[0], g[1], g[2], g[3], g[4], g[5]  # read before the loop, which cannot change them
    for q in range(n):
        x, y, z = beyond(places[q], x0, x1), beyond(places[B + q], y0, y1), beyond(places[2 * B + q], z0, z1)
        store(x, y, z, places[3 * B + q], q, b)
