"""Axis-aligned box; a degenerate one is a rectangle."""

from dataclasses import dataclass, replace

import numpy as np

from dem.jit import lean_jit
from dem.layout import BLOCK as B
from dem.material import require_vector
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
