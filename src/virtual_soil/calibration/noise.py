"""How far runs that differ only in their seed lie apart."""

import numpy as np
import pandas as pd

#: How much evidence on its own scatter a strength line borrows from all lines, in degrees of freedom: that of one line of 8 tests.
BORROWED = 6.0


def pooled_line_scatter(strength: pd.DataFrame) -> float:
    """Relative scatter of shear strengths about their lines, pooled over a table of lines."""
    freedom = strength["n_runs"] - 2
    return float(np.sqrt((freedom * strength["relative_scatter"] ** 2).sum() / freedom.sum()))


def line_errors(strength: pd.DataFrame, error: str, pooled: float) -> np.ndarray:
    """Standard errors of strength lines (n,), column `error`, each with its scatter moderated by that of all lines.

    A line of few tests can be straight by luck and would then count as certain. Its variance is averaged with the pooled one,
    weighted by degrees of freedom, which is the posterior mean of a variance whose prior is worth BORROWED of them (Smyth 2004).
    """
    freedom, own = strength["n_runs"].to_numpy() - 2.0, strength["relative_scatter"].to_numpy()
    moderated = np.sqrt((BORROWED * pooled**2 + freedom * own**2) / (BORROWED + freedom))
    return strength[error].to_numpy() * moderated / np.maximum(own, 1e-12)


def pooled_sd(groups: list[np.ndarray]) -> float:
    """Standard deviation over seeds, pooled over groups of two and more runs; NaN if there are none."""
    groups = [np.asarray(group, float) for group in groups if len(group) > 1]
    freedom = sum(len(group) - 1 for group in groups)
    return float(np.sqrt(sum(((group - group.mean()) ** 2).sum() for group in groups) / freedom)) if freedom else float("nan")


def pooled_scatter(runs: pd.DataFrame, quantity: str) -> float:
    """Standard deviation of a column over seeds, pooled over points and fidelities; NaN without repeats."""
    return pooled_sd([group.to_numpy() for _, group in runs.groupby(["point_id", "fidelity"])[quantity]])
