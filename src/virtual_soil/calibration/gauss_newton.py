"""Step 4: the paper's optimiser, undamped weighted Gauss-Newton (Angeles 2008), faithful down to its habits.

    x <- x + dx,   dx = -(J^T W J)^-1 J^T W phi,   until |dx| <= epsilon

It has no bounds and no line search: from many starts it creeps, cycles or runs away, and then says so.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

#: Half width of the central differences that make the Jacobian, relative to 1 + |x|.
DIFFERENCE = 1e-6


@dataclass(frozen=True)
class Descent:
    """Result of one run: final x (n,) and cost, True if converged, the reason why it stopped, the history of (x, cost, |dx|)."""

    x: np.ndarray
    cost: float
    converged: bool
    reason: str
    history: list[tuple[np.ndarray, float, float]]

    @property
    def iterations(self) -> int:
        """Number of increments made."""
        return len(self.history) - 1


def jacobian(residuals: Callable, x: np.ndarray) -> np.ndarray:
    """Derivatives of residuals by x (n,), shape (m, n), by central differences in one call: residuals maps (n, 2n) to (m, 2n)."""
    n = len(x)
    h = DIFFERENCE * (1.0 + np.abs(x))
    beside = x[:, None] + np.hstack([np.diag(h), -np.diag(h)])
    values = residuals(beside)
    return (values[:, :n] - values[:, n:]) / (2.0 * h)


def gauss_newton(residuals: Callable, start: np.ndarray, weights: np.ndarray, tolerance: float, max_iterations: int) -> Descent:
    """Minimise 1/2 phi^T W phi from one start.

    residuals : x (n,) -> phi (m,), or (n, k) -> (m, k). weights : the diagonal of W (m,). Never raises for a run that goes
    astray; the result says so.
    """
    x = np.asarray(start, float)
    phi = residuals(x)
    cost = 0.5 * float(weights @ phi**2)
    history = [(x, cost, float("nan"))]
    for _ in range(max_iterations):
        J = jacobian(residuals, x)
        normal = J.T @ (weights[:, None] * J)
        if not np.isfinite(normal).all() or np.linalg.cond(normal) > 1e15:
            return Descent(x, cost, False, "the Jacobian became singular or infinite", history)
        dx = -np.linalg.solve(normal, J.T @ (weights * phi))
        x = x + dx
        with np.errstate(all="ignore"):
            phi = residuals(x)
        cost = 0.5 * float(weights @ phi**2)
        step = float(np.linalg.norm(dx))
        history.append((x, cost, step))
        if not np.isfinite(cost):
            return Descent(x, cost, False, "it left the surrogates' domain", history)
        if step <= tolerance:
            return Descent(x, cost, True, f"|dx| <= {tolerance:g}", history)
    return Descent(x, cost, False, f"not converged after {max_iterations} iterations", history)
