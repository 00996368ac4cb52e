"""Refinement: the points to simulate next, so that the surrogates are right near the optimum.

For each unsettled case the optimum comes first, then the other distinct minima, cheapest first: a small change of the surrogates
may make any of them the optimum. Further points maximise the product of their probability, given the soil's targets, and the
variance of their predictions in units of the targets' uncertainties. After each choice the surrogates take their own prediction
there for simulated, so that the next choice is elsewhere.
"""

from dataclasses import replace

import numpy as np
import pandas as pd

from virtual_soil.calibration.uncertainty import Likelihood, probabilities
from virtual_soil.calibration.verify import UNASKED

#: Number of low-discrepancy points among which the next one is chosen.
CANDIDATES = 2**13


def propose(minima: list[dict[str, float]], likelihood: Likelihood, n: int) -> list[dict[str, float]]:
    """N points of one case; minima: its distinct minima, the optimum first. Values of the design variables."""
    points = minima[:n]
    for point in points:
        likelihood = believing(likelihood, point)
    while len(points) < n:
        unit = likelihood.space.crowd(CANDIDATES)
        values = likelihood.space.values(unit)
        gain = probabilities(likelihood(unit)) * ignorance(likelihood, values)
        best = int(gain.argmax())
        points.append({name: float(values[name][best]) for name in likelihood.space.variables})
        likelihood = believing(likelihood, points[-1])
    return points


def ignorance(likelihood: Likelihood, values):
    """Variances of the predictions in units of the targets' uncertainties, summed over the responses with the case's weights."""
    errors = {name: likelihood.surrogates[name].predict_with_error(values)[1] for name in likelihood.weights}
    return sum(weight * (errors[name] / likelihood.tolerance(name)) ** 2 for name, weight in likelihood.weights.items())


def believing(likelihood: Likelihood, values: dict[str, float]) -> Likelihood:
    """The likelihood with surrogates that take their own prediction at one point for simulated."""
    surrogates = {name: model.believing(values) for name, model in likelihood.surrogates.items()}
    return replace(likelihood, surrogates=surrogates)


def settled(comparison: pd.DataFrame, tolerance: float) -> set[str]:
    """Cases whose optimum was simulated and found as predicted.

    Every simulated response with a weight is within `tolerance` times its target of the prediction, or within the target's own
    uncertainty. The simulations' noise is no excuse: the optimum that follows from noisy ones may be far away. A response without
    a simulated value does not settle.
    """
    comparison = comparison[comparison["match"] != UNASKED]
    allowed = np.maximum(tolerance * comparison["target"], comparison["target_se"])
    fits = (comparison["simulated"] - comparison["predicted"]).abs() <= allowed
    return {case for case, ok in fits.groupby(comparison["case"]) if ok.all()}
