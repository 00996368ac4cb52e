"""Mixes of clumps: several shapes, each with its share of the number of grains.

A clump of a single sphere is a grain like the others: its motion is that of a free sphere (`dem.clumps.motion`).
"""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from dem.clumps.shape import WIDEST_RATIO, Clump
from dem.html import Rich
from dem.material import require


@dataclass(frozen=True)
class Mix(Rich):
    """Grains of several shapes, all of them with the distribution of radii of equal volume that they are given.

    Attributes
    ----------
    shapes : prototypes, `Clump.preset("sphere")` for spheres. shares : of each in the number of grains, in any unit.

    Raises
    ------
    ValueError : no shape, a share that is not positive, or spheres whose radii are more than WIDEST_RATIO apart.
    """

    shapes: tuple[Clump, ...]
    shares: tuple[float, ...]

    def __post_init__(self):
        object.__setattr__(self, "shapes", tuple(self.shapes))
        object.__setattr__(self, "shares", tuple(float(share) for share in self.shares))
        require(len(self.shapes) > 0, "shapes of a mix", [], "at least one")
        n_shares = f"{len(self.shapes)}, one for each shape"
        require(len(self.shares) == len(self.shapes), "number of shares of a mix", len(self.shares), n_shares)
        require(all(0.0 < share < math.inf for share in self.shares), "shares of a mix", list(self.shares), "positive numbers")
        radii = [r for shape in self.shapes for *_, r in shape.spheres]
        widest = max(radii) / min(radii)
        require(widest <= WIDEST_RATIO, "largest over smallest radius of a mix", f"{widest:.3g}", f"at most {WIDEST_RATIO:g}")

    @property
    def name(self) -> str:
        """The shapes with their shares."""
        return name_of([shape.name for shape in self.shapes], self.fractions)

    @property
    def fractions(self) -> np.ndarray:
        """Shares of sum 1 (k,)."""
        return np.array(self.shares) / sum(self.shares)

    @property
    def n_spheres(self) -> float:
        """Mean number of spheres of a grain."""
        return float(self.fractions @ [shape.n_spheres for shape in self.shapes])

    @property
    def bounding_ratio(self) -> float:
        """The largest of the shapes, see `Clump.bounding_ratio`."""
        return max(shape.bounding_ratio for shape in self.shapes)

    @property
    def smallest_ratio(self) -> float:
        """The smallest of the shapes, see `Clump.smallest_ratio`."""
        return min(shape.smallest_ratio for shape in self.shapes)

    @property
    def mean_ratio(self) -> float:
        """Mean radius of all spheres, over that of the sphere of equal volume."""
        return float(self.fractions @ [shape.n_spheres * shape.mean_ratio for shape in self.shapes]) / self.n_spheres

    def draw(self, n: int, rng: np.random.Generator) -> np.ndarray:
        """Kinds of n grains (n,), indices of their shapes, in random order."""
        ends = np.rint(n * np.cumsum(self.fractions)).astype(int)  # exact shares, as for classes of radii (`dem.factory`)
        return rng.permutation(np.repeat(np.arange(len(self.shapes)), np.diff(ends, prepend=0)))


def name_of(names: Sequence[str], fractions: Iterable[float]) -> str:
    """Name of a mix of shapes of these names."""
    return "mix by number: " + ", ".join(f"{share:.3g} {name}" for share, name in zip(fractions, names, strict=True))


#: Shape of all grains, or of each kind.
Shape = Clump | Mix


def shape_of(values: dict) -> Shape:
    """The shape of its fields as JSON holds them (`dataclasses.asdict`)."""
    if "shapes" in values:
        return Mix(tuple(clump_of(shape) for shape in values["shapes"]), tuple(values["shares"]))
    return clump_of(values)


def clump_of(values: dict) -> Clump:
    """The clump of its fields as JSON holds them."""
    return Clump(values["name"], tuple(map(tuple, values["spheres"])), tuple(values["moments"]))
