"""The box of the design variables: from SI values to the unit cube and back, low-discrepancy points in it, the hull of points.

The coordinate of a variable x with offset o is the logarithm of x + o, scaled to the box. Swept variables (the grain radius) are
scales that span decades: o = 0. Grid variables (the frictions) begin at zero, and the responses change most between zero and their
smallest level: o is that level, which spaces the paper's levels nearly evenly. Variables without an offset are linear.
A box without levels has an offset of 0 where its range begins above zero, and a tenth of its end where it begins at zero.
"""

import itertools
import math
from dataclasses import dataclass, field

import numpy as np
import scipy

#: Low-discrepancy points over which the range of a response is looked for.
REACH = 2**13
#: Offset of a range that begins at zero, over its end.
OFFSET_RATIO = 0.1
#: Corners of the box are simulated if they are at most this share of the points.
CORNER_SHARE = 0.25
#: Seed of all scrambled low-discrepancy points: the same points in every run.
SOBOL_SEED = 2011


@dataclass(frozen=True)
class Space:
    """Variables with their simulated ranges and the offsets of those with a logarithmic coordinate.

    fixed : values of properties that are no variables of this design, but stand in its tables as if they were.
    """

    variables: tuple[str, ...]
    ranges: dict[str, tuple[float, float]]
    offsets: dict[str, float] = field(default_factory=dict)
    fixed: dict[str, float] = field(default_factory=dict)

    def unit(self, values) -> np.ndarray:
        """Coordinates (m, n) in the unit cube; values maps each variable to a number or to arrays of one shape."""
        columns = []
        for name in self.variables:
            low, high, to_line, _ = self.scale(name)
            x = np.asarray(values[name], float).ravel()
            columns.append((to_line(x) - low) / (high - low))
        return np.column_stack(columns)

    def values(self, unit: np.ndarray) -> dict[str, np.ndarray]:
        """Values in SI units, each (m,), of coordinates (m, n); those that are fixed, too."""
        result = {}
        for name, u in zip(self.variables, np.asarray(unit, float).T, strict=True):
            low, high, _, from_line = self.scale(name)
            result[name] = np.clip(from_line(low + u * (high - low)), *self.ranges[name])
        return result | {name: np.full(len(np.asarray(unit)), value) for name, value in self.fixed.items()}

    def scale(self, name: str):
        """Ends of a variable's line, and the functions from its value to the line and back."""
        if name not in self.offsets:
            return *self.ranges[name], lambda x: x, lambda line: line
        offset = self.offsets[name]
        low, high = (float(np.log(end + offset)) for end in self.ranges[name])
        return low, high, lambda x: np.log(x + offset), lambda line: np.exp(line) - offset

    def crowd(self, n: int) -> np.ndarray:
        """N low-discrepancy points (n, k) in the unit cube; n a power of two."""
        return scipy.stats.qmc.Sobol(len(self.variables), seed=SOBOL_SEED).random_base2(int(np.log2(n)))

    def everywhere(self, n: int) -> np.ndarray:
        """Low-discrepancy points and all corners of the unit cube."""
        return np.vstack([self.crowd(n), list(itertools.product([0.0, 1.0], repeat=len(self.variables)))])


def offset_of(low: float, high: float) -> float | None:
    """Offset of a variable that is known by its range alone; None: linear, as below zero there is no logarithm."""
    return None if low < 0.0 else OFFSET_RATIO * high if low == 0.0 else 0.0


def filling(space: Space, n: int) -> list[dict[str, float]]:
    """N points that fill the box: its corners if they are few beside n, the others scrambled Sobol points of even density.

    Between the outermost points a surrogate interpolates; without corners much of a box of few points would lie beyond.
    """
    k = len(space.variables)
    corners = np.array(list(itertools.product([0.0, 1.0], repeat=k))) if 2**k <= CORNER_SHARE * n else np.zeros((0, k))
    inner = scipy.stats.qmc.Sobol(k, seed=SOBOL_SEED).random_base2(math.ceil(math.log2(n)))[: n - len(corners)]
    unit = np.vstack([corners, inner])
    values = space.values(unit)
    for k, name in enumerate(space.variables):  # the logarithm's rounding would leave a corner's zero at 1e-17
        low, high = space.ranges[name]
        values[name] = np.where(unit[:, k] == 0.0, low, np.where(unit[:, k] == 1.0, high, values[name]))
    return [{name: float(f"{values[name][row]:.4g}") for name in space.variables} for row in range(n)]


def space_of(design: dict) -> Space:
    """The box of the design variables; see `calibration.space` for their coordinates. design : in its normal form."""
    if "ranges" in design:
        found = {name: (float(low), float(high)) for name, (low, high) in design["ranges"].items()}
        known = {name: offset_of(low, high) for name, (low, high) in found.items()}
        logarithmic = {name: offset for name, offset in known.items() if offset is not None}
        return Space(tuple(design["variables"]), found, logarithmic, design.get("fixed", {}))
    values = {**design["grid"], **design["sweep"]}
    ranges = {name: (float(min(values[name])), float(max(values[name]))) for name in design["variables"]}
    offsets = {name: min(level for level in levels if level > 0) for name, levels in design["grid"].items()}
    return Space(tuple(design["variables"]), ranges, {**offsets, **dict.fromkeys(design["sweep"], 0.0)}, design.get("fixed", {}))


def inside_hull(points: np.ndarray, x: np.ndarray) -> bool:
    """True if x (n,) is a convex combination of points (m, n), so that a prediction there interpolates."""
    equations = np.vstack([np.asarray(points, float).T, np.ones(len(points))])
    found = scipy.optimize.linprog(np.zeros(len(points)), A_eq=equations, b_eq=np.append(x, 1.0), bounds=(0, None), method="highs")
    return bool(found.status == 0)
