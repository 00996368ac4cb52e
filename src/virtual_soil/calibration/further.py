"""What one more measurement is expected to leave of an uncertainty: samples of the posterior, reweighted.

Limits: a normal error of the measurement; quantities and responses are known only by their surrogates, whose errors the samples of
the responses include.
"""

import math

import numpy as np

#: Standard uncertainty of a further measurement over its value, unless half of what matters is more: that of careful laboratories.
FURTHER_RATIO = 0.02
#: A measurement that halves an uncertainty is sought down to this share of its own deviation over the posterior, in so many steps.
SHARPEST, HALVINGS = 0.02, 10
SEED = 2011


def further_error(values, ratio: float, consequence: float) -> float:
    """Standard uncertainty that a further measurement of a response is given: a share of its mean, in the response's unit.

    Not below half the smallest difference of consequence: the mean may be near 0. values : over the posterior.
    """
    return max(ratio * abs(float(np.mean(values))), 0.5 * consequence)


def left_over(quantity, further, further_se: float) -> float:
    """Share of a quantity's standard deviation that a further measurement is expected to leave.

    With weights w_ij of sample j if the measurement of sample i, y_i + s e, is what is read:

        w_ij ~ exp(-(y_i + s e - y_j)^2 / (2 s^2)),   share^2 = E_i[Var_w(x)] / Var(x)

    quantity x, further y : (m,) both over the posterior. further_se : standard uncertainty s of the measurement, above 0, in the
    unit of y. 1 if x does not vary. For normal x and y of correlation r: share^2 = 1 - r^2 Var(y) / (Var(y) + s^2).
    """
    x, y = (np.asarray(values, float) - np.mean(values) for values in (quantity, further))
    if not x.var() > 0.0:
        return 1.0
    read = y + further_se * np.random.default_rng(SEED).standard_normal(len(y))
    logs = -0.5 * ((read[:, None] - y[None, :]) / further_se) ** 2
    weights = np.exp(logs - logs.max(axis=1, keepdims=True))
    weights /= weights.sum(axis=1, keepdims=True)
    variances = weights @ x**2 - (weights @ x) ** 2
    # few samples agree with a reading: their variance is too small by the sum of the squared weights
    whole = 1.0 - (weights**2).sum(axis=1)
    return float(np.sqrt(min(variances.sum() / (whole.sum() * x.var(ddof=1)), 1.0)))


def halving_error(quantity, further, model_error: float = 0.0) -> float:
    """Largest standard uncertainty of a further measurement that is expected to leave half of a quantity's standard deviation.

    quantity, further : as of `left_over`. model_error : standard error of what predicts `further`, if the samples lack it. NaN if
    not even the sharpest measurement halves it.
    """
    sd = float(np.std(further))
    low, high = np.log(SHARPEST), np.log(10.0)
    if not sd > 0.0 or left_over(quantity, further, sd * np.exp(low)) > 0.5:
        return math.nan
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if left_over(quantity, further, sd * np.exp(middle)) <= 0.5 else (low, middle)
    of_measurement = (sd * np.exp(low)) ** 2 - model_error**2
    return float(np.sqrt(of_measurement)) if of_measurement > 0.0 else math.nan
