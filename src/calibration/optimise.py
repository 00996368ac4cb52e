"""Step 4: the grain parameters whose virtual soil comes nearest to a real one.

Objectives (Equation 4), x = (r in um, mu_s, mu_r):
    phi1 = (A - A0)/A0,  phi2 = (c - c0)/c0,  phi3 = (phi - phi0)/phi0,  phi4 = 10 (pi/2 - arctan(r - 5))
The paper writes absolute values; the sign drops out of the cost and of the Gauss-Newton step. phi4 prefers large grains.

Two optimisers run from the same low-discrepancy starts: the paper's Gauss-Newton, and bounded least squares, which cannot run away.
The optimum reported is the cheapest minimum inside the simulated design. Its status is "converged" if Gauss-Newton found it too,
"bounded" if only the bounded search did (at an edge of the design, or where Gauss-Newton runs away).
"""

import numpy as np
import pandas as pd
from scipy.optimize import least_squares
from scipy.stats import qmc

from calibration.errors import demand
from calibration.gauss_newton import Descent, gauss_newton
from calibration.surrogate import RESPONSES, Surrogate

OBJECTIVES = ("angle_of_repose", "cohesion", "friction_angle", "radius")
#: The optimiser sees radii in um, as the paper does; its |dx| and phi4 depend on it.
UNITS = {"radius_m": 1e-6}
#: Two minima closer than this fraction of the design's extent are one.
SAME = 1e-3
#: Seed of the scrambled starts: the same starts in every run.
SOBOL_SEED = 2011


def unit_of(variables) -> np.ndarray:
    """SI value of one optimiser unit, for each variable."""
    return np.array([UNITS.get(name, 1.0) for name in variables])


def objectives(surrogates: dict[str, Surrogate], targets: dict[str, float], variables):
    """The function x -> (phi1, phi2, phi3, phi4); without a radius among the variables there is no phi4."""
    units = unit_of(variables)

    def phi(x):
        values = dict(zip(variables, x * units, strict=True))
        with np.errstate(all="ignore"):
            relative = [(float(surrogates[name].predict(values)) - targets[name]) / targets[name] for name in OBJECTIVES[:3]]
        if "radius_m" in variables:
            relative.append(10.0 * (np.pi / 2 - np.arctan(x[list(variables).index("radius_m")] - 5.0)))
        return np.array(relative)

    return phi


def starts(low: np.ndarray, high: np.ndarray, n: int) -> np.ndarray:
    """N low-discrepancy initial guesses (n, k) inside the bounds."""
    sampler = qmc.Sobol(len(low), seed=SOBOL_SEED)
    return qmc.scale(sampler.random_base2(int(np.ceil(np.log2(max(n, 2)))))[:n], low, high)


def distinct(candidates: list[tuple[float, np.ndarray]], extent: np.ndarray) -> list[tuple[float, np.ndarray]]:
    """Minima in order of cost, duplicates merged."""
    found: list[tuple[float, np.ndarray]] = []
    for cost, x in sorted(candidates, key=lambda candidate: candidate[0]):
        if all(np.abs((x - other) / extent).max() > SAME for _, other in found):
            found.append((cost, x))
    return found


def calibrate_case(surrogates, targets, weights, options, variables):
    """Optimise one case.

    Parameters
    ----------
    targets : response -> value in its unit. weights : (4,), in the order of OBJECTIVES.
    options : tolerance, max_iterations, n_starts.

    Returns
    -------
    (result row as a dict, the Gauss-Newton descent that leads to it or that began nearest to it)
    """
    weights = checked_weights(weights)
    if "radius_m" not in variables:
        weights = weights[:3]
    units = unit_of(variables)
    bounds = np.array([surrogates["cohesion"].ranges[name] for name in variables]).T / units
    low, high = bounds
    phi = objectives(surrogates, targets, variables)
    guesses = starts(low, high, options["n_starts"])
    descents = [gauss_newton(phi, guess, weights, options["tolerance"], options["max_iterations"]) for guess in guesses]
    inside = [d for d in descents if d.converged and ((d.x >= low) & (d.x <= high)).all()]
    bounded = [least_squares(lambda x: np.sqrt(weights) * phi(x), guess, bounds=bounds, x_scale=high - low) for guess in guesses]
    candidates = [(d.cost, d.x) for d in inside] + [(float(b.cost), b.x) for b in bounded]
    minima = distinct(candidates, high - low)
    cost, best = minima[0]
    hits = [d for d in inside if np.abs((d.x - best) / (high - low)).max() <= SAME]
    shown = min(hits, key=lambda d: d.iterations) if hits else nearest(descents, guesses, best, high - low)
    at_bound = [name for name, x, a, b in zip(variables, best, low, high, strict=True) if min(x - a, b - x) < SAME * (b - a)]
    row = {
        **dict(zip(variables, (best * units).tolist(), strict=True)),
        "cost": cost,
        "iterations": shown.iterations,
        "n_starts": len(guesses),
        "n_converged": sum(d.converged for d in descents),
        "n_distinct": len(minima),
        "status": "converged" if hits else "bounded",
        "reason": ""
        if hits
        else f"bounded least squares found it, Gauss-Newton from no start; from the nearest start: {shown.reason}",
        "at_bound": ",".join(at_bound),
        "inside_design": bool(((best >= low) & (best <= high)).all()),
    }
    return row, shown


def nearest(descents: list[Descent], guesses, best, extent) -> Descent:
    """The descent whose start is nearest to the optimum."""
    return descents[int(np.argmin((((guesses - best) / extent) ** 2).sum(axis=1)))]


def checked_weights(weights) -> np.ndarray:
    """Four positive weights as an array."""
    weights = np.asarray(weights, float)
    demand(
        weights.shape == (4,) and bool((weights > 0).all()),
        "weights",
        weights.tolist(),
        f"four positive numbers, for {OBJECTIVES}",
    )
    return weights


def targets_of(soils: pd.DataFrame, soil: str) -> dict[str, float]:
    """Target of each response for one soil of the soil table; zero cannot be one, since the errors are relative."""
    rows = soils[soils["soil"] == soil].set_index("property")["value"]
    demand(len(rows) > 0, "soil of a case", soil, f"one of {sorted(soils['soil'].unique())}")
    for name, value in rows.items():
        demand(value > 0, f"target {name} of {soil}", value, "above zero, because the objectives are relative errors")
    return rows.to_dict()


def calibrate(surrogates, soils: pd.DataFrame, options: dict, variables, source: str) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Optimise every case of options["cases"] on one set of surrogates; `source` ("ours", "published") labels the rows.

    Returns (one row per case with optimum, predictions, targets and status; history of the Gauss-Newton run of each).
    """
    rows, history = [], []
    for case in options["cases"]:
        targets = targets_of(soils, case["soil"])
        row, descent = calibrate_case(surrogates, targets, case["weights"], options, variables)
        labels = {"case": case["case"], "soil": case["soil"], "surrogate": source}
        labels |= {f"weight_{name}": weight for name, weight in zip(OBJECTIVES, case["weights"], strict=True)}
        predicted = {column: float(surrogates[name].predict(row)) for name, (column, _) in RESPONSES.items()}
        wanted = {f"target_{column}": targets[name] for name, (column, _) in RESPONSES.items()}
        rows.append({**labels, **row, **predicted, **wanted})
        for k, (x, cost, step) in enumerate(descent.history):
            where = dict(zip(variables, (x * unit_of(variables)).tolist(), strict=True))
            history.append({"case": case["case"], "surrogate": source, "iteration": k, **where, "cost": cost, "step_norm": step})
    return pd.DataFrame(rows), pd.DataFrame(history)
