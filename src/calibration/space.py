"""The box of the design variables: from SI values to the unit cube and back, low-discrepancy points in it, the hull of points.

Swept variables (the grain radius) are positive scales that span decades: their coordinate is the logarithm.
"""

import itertools
from dataclasses import dataclass

import numpy as np
from scipy.optimize import linprog
from scipy.stats import qmc

#: Low-discrepancy points over which the range of a response is looked for.
REACH = 2**13
#: Seed of all scrambled low-discrepancy points: the same points in every run.
SOBOL_SEED = 2011


@dataclass(frozen=True)
class Space:
    """Variables with their simulated ranges; those in `logarithmic` have a logarithmic coordinate."""

    variables: tuple[str, ...]
    ranges: dict[str, tuple[float, float]]
    logarithmic: frozenset[str] = frozenset()

    def unit(self, values) -> np.ndarray:
        """Coordinates (m, n) in the unit cube; values maps each variable to a number or to arrays of one shape."""
        columns = []
        for name in self.variables:
            low, high = self.ranges[name]
            x = np.asarray(values[name], float).ravel()
            columns.append(np.log(x / low) / np.log(high / low) if name in self.logarithmic else (x - low) / (high - low))
        return np.column_stack(columns)

    def values(self, unit: np.ndarray) -> dict[str, np.ndarray]:
        """Values in SI units, each (m,), of coordinates (m, n)."""
        result = {}
        for name, u in zip(self.variables, np.asarray(unit, float).T, strict=True):
            low, high = self.ranges[name]
            result[name] = low * (high / low) ** u if name in self.logarithmic else low + u * (high - low)
        return result

    def crowd(self, n: int) -> np.ndarray:
        """N low-discrepancy points (n, k) in the unit cube; n a power of two."""
        return qmc.Sobol(len(self.variables), seed=SOBOL_SEED).random_base2(int(np.log2(n)))

    def everywhere(self, n: int) -> np.ndarray:
        """Low-discrepancy points and all corners of the unit cube."""
        return np.vstack([self.crowd(n), list(itertools.product([0.0, 1.0], repeat=len(self.variables)))])


def inside_hull(points: np.ndarray, x: np.ndarray) -> bool:
    """Whether x (n,) is a convex combination of points (m, n): whether a prediction there interpolates."""
    equations = np.vstack([np.asarray(points, float).T, np.ones(len(points))])
    found = linprog(np.zeros(len(points)), A_eq=equations, b_eq=np.append(x, 1.0), bounds=(0, None), method="highs")
    return bool(found.status == 0)
