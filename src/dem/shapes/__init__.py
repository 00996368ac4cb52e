"""Shapes of walls: the only list of them, and the functions that choose among them.

A shape is a module with SHAPE (its dataclass, with a `centre` if it may turn), `record`, `placed`, `distance` and the kernels
`separation` and `separate`. To add one, write the module and enter it in SHAPES, KINDS and the two kernels below. The kernels of
meshes are in `dem.meshes.contacts`.
"""

import numpy as np

from dem.jit import lean_jit
from dem.shapes import box, mesh, tube
from dem.shapes.box import Box
from dem.shapes.mesh import Mesh
from dem.shapes.tube import Tube
from dem.shapes.wall import ENDLESS_M, RECORD, Body, Drive, FreeTurn, Motion, TurnDrive, Wall

__all__ = [
    "ENDLESS_M",
    "KINDS",
    "RECORD",
    "SHAPES",
    "Body",
    "Box",
    "Drive",
    "FreeTurn",
    "Mesh",
    "Motion",
    "Tube",
    "TurnDrive",
    "Wall",
    "distance",
    "may_turn",
    "record",
    "separate",
    "separation",
]

#: A shape's kind is its position here.
SHAPES = (box, tube, mesh)
KINDS = BOX, TUBE, MESH = tuple(range(len(SHAPES)))


def kind(wall: Wall) -> int:
    """Kind of a wall's shape."""
    return [module.SHAPE for module in SHAPES].index(type(wall))


def may_turn(wall: Wall) -> bool:
    """True if kernels must know the wall's pose: it turns, or it is a mesh."""
    return wall.turns or isinstance(wall, Mesh)


def by_name(name: str) -> type:
    """Dataclass of a shape by its name."""
    return {module.SHAPE.__name__: module.SHAPE for module in SHAPES}[name]


def record(wall: Wall) -> tuple[float, ...]:
    """A wall's geometry record (RECORD,), see `dem.shapes.wall`."""
    return SHAPES[kind(wall)].record(wall)


def placed(wall: Wall, values: list[float]) -> Wall:
    """The wall with the geometry of a record."""
    return SHAPES[kind(wall)].placed(wall, values)


def distance(wall: Wall, positions: np.ndarray) -> np.ndarray:
    """Distances in m (n,) of positions (n, 3) from the nearest point of a wall."""
    return SHAPES[kind(wall)].distance(wall, positions)


@lean_jit
def separation(kind, x, y, z, g):
    """Vector in m from the nearest point of a shape of record g to the point (x, y, z)."""
    if kind == BOX:
        return box.separation(x, y, z, g)
    return tube.separation(x, y, z, g)


@lean_jit
def separate(kind, g, places, n, b):
    """Write separations of n grains from the nearest points of a shape of record g, and r^2 - d^2, into the work buffer b.

    places : see `dem.step.gather.gather_at_surface`. NOTE: the shapes' loops take and give numbers only; a function that returns a
    tuple keeps them from being vectorised, which takes four times as long.
    """
    if kind == BOX:
        box.separate(g, places, n, b)
    else:
        tube.separate(g, places, n, b)
