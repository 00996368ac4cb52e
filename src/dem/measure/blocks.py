"""Means of correlated series, with standard errors from the means of blocks."""

import math

import numpy as np

#: Blocks of equal length into which a series is divided; each must be longer than what it fluctuates over.
N_BLOCKS = 5


def block_means(values, n_blocks: int = N_BLOCKS) -> np.ndarray:
    """Means (n_blocks, ...) of blocks of equal length of values (n, ...); what is left over at the beginning is not used.

    Raises ValueError with fewer values than blocks.
    """
    values = np.asarray(values, float)
    length = len(values) // n_blocks
    if length == 0:
        raise ValueError(f"number of samples is {len(values)}; allowed: at least {n_blocks}, one for each block.")
    return values[len(values) - length * n_blocks :].reshape(n_blocks, length, *values.shape[1:]).mean(axis=1)


def mean_and_error(values, n_blocks: int = N_BLOCKS) -> tuple[float, float]:
    """Mean of values (n,), and its standard error."""
    means = block_means(values, n_blocks)
    return float(means.mean()), float(means.std(ddof=1) / math.sqrt(n_blocks))


def ratio_and_error(numerator, denominator, n_blocks: int = N_BLOCKS) -> tuple[float, float]:
    """Ratio of the means of two series (n,), and its standard error to first order; nan where the denominator's mean is 0."""
    upper, lower = block_means(numerator, n_blocks), block_means(denominator, n_blocks)
    scale = float(lower.mean())
    if scale == 0.0:
        return math.nan, math.nan
    ratio = float(upper.mean()) / scale
    return ratio, float((upper - ratio * lower).std(ddof=1) / math.sqrt(n_blocks) / abs(scale))
