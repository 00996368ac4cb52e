"""Refinement: where to simulate next, so that the surrogates are right where the optimum lies.

Of every case that is not settled the optimum comes first, then the other distinct minima, cheapest first: between them the optimum
will jump when the surrogates change. Further points are those where the surrogates know least of what the soil's targets make
probable: the greatest product of a point's probability and the variance of its predictions in units of the targets' uncertainties.
After each choice the surrogates believe their own prediction there, so that the next one goes elsewhere.
"""

from dataclasses import replace

import pandas as pd

from virtual_soil.calibration.surrogate import RESPONSES
from virtual_soil.calibration.uncertainty import Likelihood, probabilities

#: Low-discrepancy points among which the next one is looked for.
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
        points.append({name: float(column[best]) for name, column in values.items()})
        likelihood = believing(likelihood, points[-1])
    return points


def ignorance(likelihood: Likelihood, values):
    """Variances of the predictions in units of the targets' uncertainties, summed over the responses with the case's weights."""
    errors = {name: likelihood.surrogates[name].predict_with_error(values)[1] for name in RESPONSES}
    return sum(likelihood.weights[name] * (errors[name] / likelihood.tolerance(name)) ** 2 for name in RESPONSES)


def believing(likelihood: Likelihood, values: dict[str, float]) -> Likelihood:
    """The likelihood with surrogates that take their own prediction at one point for simulated."""
    surrogates = {name: model.believing(values) for name, model in likelihood.surrogates.items()}
    return replace(likelihood, surrogates=surrogates)


def settled(comparison: pd.DataFrame, tolerance: float) -> set[str]:
    """Cases whose optimum was simulated and found as predicted.

    Every response within `tolerance` of its target from the prediction, or within two standard errors of the simulated mean: nearer
    no simulation can tell. A response without a simulated value does not settle.
    """
    allowed = (tolerance * comparison["target"]).clip(lower=2.0 * comparison["simulated_se"])
    fits = (comparison["simulated"] - comparison["predicted"]).abs() <= allowed
    return {case for case, ok in fits.groupby(comparison["case"]) if ok.all()}
