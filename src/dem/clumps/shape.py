"""Prototypes of clumps: rigid unions of spheres, in units of the radius of the sphere of equal volume.

Presets have equal spheres of radius r with centres r apart (a dimer is 1.5 times as long as wide): `sphere`, `dimer` (along x),
`trimer` (triangle in the x-y plane), `tetra` (tetrahedron). Files hold a line `x y z r` per sphere, in any unit.
"""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from dem.clumps.union import ERROR, solid_of
from dem.html import Rich
from dem.material import require

#: Largest over smallest radius of the spheres of one clump: the neighbour search follows the largest, the time step the smallest.
WIDEST_RATIO = 20.0

#: Rounding of coordinates, in radii, for which touching spheres still count as connected, and equal spheres as contained.
SLACK_RATIO = 1e-6

#: Name of a preset -> centres of its spheres of radius 1.
PRESETS: dict[str, list[tuple[float, float, float]]] = {
    "sphere": [(0.0, 0.0, 0.0)],
    "dimer": [(-0.5, 0.0, 0.0), (0.5, 0.0, 0.0)],
    "trimer": [
        (math.cos(a) / math.sqrt(3.0), math.sin(a) / math.sqrt(3.0), 0.0) for a in (0.0, 2.0 * math.pi / 3.0, 4.0 * math.pi / 3.0)
    ],
    "tetra": [
        (x / math.sqrt(8.0), y / math.sqrt(8.0), z / math.sqrt(8.0))
        for x, y, z in ((1, 1, 1), (1, -1, -1), (-1, 1, -1), (-1, -1, 1))
    ],
}


@dataclass(frozen=True)
class Clump(Rich):
    """Shape of a rigid union of spheres. Make one by `preset`, `dimer`, `read` or `of_spheres`.

    Attributes
    ----------
    name : preset, or file. spheres : (x, y, z, radius) of each, in radii R of the sphere of equal volume, in the frame of the
    principal axes about the centre of mass. moments : principal moments of inertia over m R^2.
    """

    name: str
    spheres: tuple[tuple[float, float, float, float], ...]
    moments: tuple[float, float, float]

    @classmethod
    def preset(cls, name: str) -> "Clump":
        """The preset of that name; ValueError if there is none."""
        require(name in PRESETS, "preset of a clump", repr(name), f"one of {list(PRESETS)}")
        return cls.of_spheres([(*centre, 1.0) for centre in PRESETS[name]], name=name)

    @classmethod
    def dimer(cls, aspect_ratio: float) -> "Clump":
        """Two equal spheres, by length over width: above 1, at most 2 (they touch); the preset has 1.5. ValueError beyond."""
        allowed = "above 1 (a sphere), at most 2 (touching spheres)"
        require(1.0 < aspect_ratio <= 2.0, "aspect ratio of a dimer", aspect_ratio, allowed)
        half = aspect_ratio - 1.0
        return cls.of_spheres([(-half, 0.0, 0.0, 1.0), (half, 0.0, 0.0, 1.0)], name=f"dimer of aspect ratio {aspect_ratio:g}")

    @classmethod
    def read(cls, path: str | Path) -> "Clump":
        """Clump of a text file with a line `x y z r` per sphere; separated by blanks or commas, behind # comments.

        Raises
        ------
        ValueError : a line does not have four numbers, or the spheres make no clump (see `of_spheres`). OSError : no such file.
        """
        spheres = []
        for number, line in enumerate(Path(path).read_text(encoding="utf-8-sig").splitlines(), start=1):
            words = line.partition("#")[0].replace(",", " ").replace(";", " ").split()
            if words:
                spheres.append(numbers_of(words, f"{path}, line {number}"))
        return cls.of_spheres(spheres, name=str(path))

    @classmethod
    def of_spheres(cls, spheres: Iterable[Sequence[float]], name: str = "spheres") -> "Clump":
        """Clump of spheres (x, y, z, radius) in any unit of length.

        The principal axes are those given if they are principal axes of inertia, else ordered by ascending moment.

        Raises
        ------
        ValueError : no sphere, values that are no finite numbers, a radius that is not positive, spheres that do not hang together,
            one that lies inside another, or radii more than WIDEST_RATIO apart; the message names the clump and its spheres from 1.
        """
        rows = [tuple(sphere) for sphere in spheres]
        require(
            all(len(row) == 4 for row in rows) and len(rows) > 0,
            f"clump {name!r}",
            f"{len(rows)} spheres",
            "at least one, as x, y, z, r",
        )
        table = np.array(rows, float)
        check(table, name)
        solid = solid_of(table[:, :3], table[:, 3])
        unit = (0.75 * solid.volume / math.pi) ** (1.0 / 3.0)
        axes, moments = principal_axes(solid.inertia / (solid.volume * unit**2))
        places = np.column_stack([(table[:, :3] - solid.centre) @ axes, table[:, 3]]) / unit
        return cls(name, tuple(tuple(row) for row in places.tolist()), tuple(moments.tolist()))

    @property
    def shapes(self) -> tuple["Clump", ...]:
        """The shapes that grains have, as those of a `dem.Mix`: this one."""
        return (self,)

    @property
    def n_spheres(self) -> int:
        """Number of spheres."""
        return len(self.spheres)

    @property
    def bounding_ratio(self) -> float:
        """Radius of the sphere about the centre of mass that holds the clump, over that of the sphere of equal volume."""
        return max(math.hypot(x, y, z) + r for x, y, z, r in self.spheres)

    @property
    def smallest_ratio(self) -> float:
        """Radius of the smallest sphere over that of the sphere of equal volume."""
        return min(r for *_, r in self.spheres)

    @property
    def mean_ratio(self) -> float:
        """Mean radius of the spheres over that of the sphere of equal volume."""
        return float(np.mean([r for *_, r in self.spheres]))

    def draw(self, n: int, _rng: np.random.Generator) -> np.ndarray:
        """Kinds of n grains (n,), as those of a `dem.Mix`: all 0."""
        return np.zeros(n, np.int64)


def numbers_of(words: list[str], where: str) -> tuple[float, ...]:
    """Four numbers of a line."""
    try:
        values = tuple(float(word) for word in words)
    except ValueError:
        values = ()
    require(len(values) == 4, where, repr(" ".join(words)), "four numbers x y z r")
    return values


def check(table: np.ndarray, name: str) -> None:
    """Refuse spheres (n, 4) that make no clump."""
    centres, radii = table[:, :3], table[:, 3]
    wrong = np.flatnonzero(~(np.isfinite(table).all(axis=1) & (radii > 0.0)))
    for k in wrong[:1]:
        require(False, f"sphere {k + 1} of clump {name!r}", table[k].tolist(), "finite numbers x, y, z and a positive radius")
    ratio = radii.max() / radii.min()
    require(ratio <= WIDEST_RATIO, f"largest over smallest radius of clump {name!r}", f"{ratio:.3g}", f"at most {WIDEST_RATIO:g}")
    distance = np.linalg.norm(centres[:, None] - centres[None], axis=2)
    inside = distance + radii[:, None] <= radii[None] * (1.0 + SLACK_RATIO)
    np.fill_diagonal(inside, False)
    for i, j in np.argwhere(inside)[:1]:
        require(False, f"sphere {i + 1} of clump {name!r}", f"inside sphere {j + 1}", "spheres that add to the clump")
    touching = distance <= (radii[:, None] + radii[None]) * (1.0 + SLACK_RATIO)
    hangs = np.zeros(len(radii), bool)
    hangs[0] = True
    for _ in radii:
        hangs |= touching[hangs].any(axis=0)
    for k in np.flatnonzero(~hangs)[:1]:
        require(False, f"sphere {k + 1} of clump {name!r}", "apart from sphere 1", "spheres that hang together")


def principal_axes(inertia: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Principal axes as columns of a rotation (3, 3), and the moments about them (3,)."""
    moments, largest = np.diag(inertia), np.diag(inertia).max()
    if np.abs(inertia - np.diag(moments)).max() <= 2.0 * ERROR * largest:
        return np.eye(3), moments
    moments, axes = np.linalg.eigh(inertia)
    return axes * np.array([1.0, 1.0, np.sign(np.linalg.det(axes))]), moments
