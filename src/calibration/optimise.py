"""Step 4: the grain parameters whose virtual soil comes nearest to a real one.

Objectives (Equation 4), x = (r in um, mu_s, mu_r):
    phi1 = (A - A0)/A0,  phi2 = (c - c0)/c0,  phi3 = (phi - phi0)/phi0,  phi4 = 10 (pi/2 - arctan(r - 5))
The paper writes absolute values; the sign drops out of the cost and of the Gauss-Newton step. phi4 prefers large grains.

Two optimisers run from the same low-discrepancy starts: the paper's Gauss-Newton, and bounded, scaled, damped least squares, which
cannot run away. A global check (the cheapest of very many points, refined) looks for minima that were missed. All distinct minima
inside the simulated design are kept, and the cheapest is reported: "converged" if Gauss-Newton found it too, "bounded" if only a
bounded search did (at an edge of the design, or where Gauss-Newton runs away).
"""

from dataclasses import dataclass

import numpy as np
import pandas as pd
from scipy.optimize import least_squares
from scipy.stats import qmc

from calibration.errors import demand
from calibration.gauss_newton import Descent, gauss_newton, jacobian
from calibration.surrogate import RESPONSES, Surrogate

OBJECTIVES = ("angle_of_repose", "cohesion", "friction_angle", "radius")
#: The optimiser sees radii in um, as the paper does; its |dx| and phi4 depend on it.
UNITS = {"radius_m": 1e-6}
#: Two minima closer than this fraction of the design's extent are one.
SAME = 1e-3
#: Seed of the scrambled starts: the same starts in every run.
SOBOL_SEED = 2011
#: The global check costs so many low-discrepancy points and refines the cheapest. Differential evolution is no check here: the
#: valleys are thin (a cohesion of tens of Pa out of thousands), and it settles in the first that it meets.
SCREENED, REFINED = 2**16, 64


def unit_of(variables) -> np.ndarray:
    """SI value of one optimiser unit, for each variable."""
    return np.array([UNITS.get(name, 1.0) for name in variables])


def objectives(surrogates: dict[str, Surrogate], targets: dict[str, float], variables):
    """The function x -> (phi1, phi2, phi3, phi4); without a radius among the variables there is no phi4.

    x (n,) gives (4,), or x (n, m) gives (4, m).
    """
    units = unit_of(variables)

    def phi(x):
        values = dict(zip(variables, (np.asarray(x, float).T * units).T, strict=True))
        with np.errstate(all="ignore"):
            relative = [(surrogates[name].predict(values) - targets[name]) / targets[name] for name in OBJECTIVES[:3]]
        if "radius_m" in variables:
            relative.append(10.0 * (np.pi / 2 - np.arctan(x[list(variables).index("radius_m")] - 5.0)))
        return np.array(relative)

    return phi


def starts(low: np.ndarray, high: np.ndarray, n: int) -> np.ndarray:
    """N low-discrepancy initial guesses (n, k) inside the bounds."""
    sampler = qmc.Sobol(len(low), seed=SOBOL_SEED)
    return qmc.scale(sampler.random_base2(int(np.ceil(np.log2(max(n, 2)))))[:n], low, high)


@dataclass(frozen=True)
class Minimum:
    """A local minimum in optimiser units: x (n,), cost, who found it, variables at a bound of the design, conditioning.

    condition_number is that of the weighted Jacobian, each variable scaled by its extent in the design: large means that some
    combination of the variables is hardly determined.
    """

    x: np.ndarray
    cost: float
    found_by: tuple[str, ...]
    at_bound: tuple[str, ...]
    condition_number: float


@dataclass(frozen=True)
class Search:
    """All that one search found: distinct minima in order of cost, the Gauss-Newton descents, their starts, the global check."""

    minima: list[Minimum]
    descents: list[Descent]
    guesses: np.ndarray
    global_cost: float


def search(phi, weights, bounds: np.ndarray, variables, options: dict) -> Search:
    """Find the minima of 1/2 phi^T W phi between bounds (2, n); options : tolerance, max_iterations, n_starts."""
    low, high = bounds
    root = np.sqrt(weights)
    guesses = starts(low, high, options["n_starts"])
    descents = [gauss_newton(phi, guess, weights, options["tolerance"], options["max_iterations"]) for guess in guesses]
    candidates = [(d.cost, d.x, "gauss_newton") for d in descents if d.converged and ((d.x >= low) & (d.x <= high)).all()]
    for guess in guesses:
        found = least_squares(lambda x: root * phi(x), guess, bounds=bounds, x_scale=high - low)
        candidates.append((float(found.cost), found.x, "bounded_least_squares"))
    crowd = starts(low, high, SCREENED)
    cheapest = np.argsort(weights @ phi(crowd.T) ** 2)[:REFINED]
    refined = [least_squares(lambda x: root * phi(x), x, bounds=bounds, x_scale=high - low) for x in crowd[cheapest]]
    candidates += [(float(found.cost), found.x, "screened_start") for found in refined]
    minima = []
    for cost, x, finders in distinct(candidates, high - low):
        singular = np.linalg.svd(root[:, None] * jacobian(phi, x) * (high - low), compute_uv=False)
        edge = [
            name for name, value, a, b in zip(variables, x, low, high, strict=True) if min(value - a, b - value) < SAME * (b - a)
        ]
        minima.append(Minimum(x, cost, finders, tuple(edge), float(singular[0] / singular[-1])))
    return Search(minima, descents, guesses, min(float(found.cost) for found in refined))


def distinct(
    candidates: list[tuple[float, np.ndarray, str]], extent: np.ndarray
) -> list[tuple[float, np.ndarray, tuple[str, ...]]]:
    """Minima in order of cost, duplicates merged; each with all who found it."""
    found: list[tuple[float, np.ndarray, list[str]]] = []
    for cost, x, finder in sorted(candidates, key=lambda candidate: candidate[0]):
        same = [entry for entry in found if np.abs((x - entry[1]) / extent).max() <= SAME]
        if not same:
            found.append((cost, x, [finder]))
        elif finder not in same[0][2]:
            same[0][2].append(finder)
    return [(cost, x, tuple(finders)) for cost, x, finders in found]


def calibrate_case(surrogates, targets, weights, options, variables):
    """Optimise one case.

    Parameters
    ----------
    targets : response -> value in its unit. weights : (4,), in the order of OBJECTIVES.
    options : tolerance, max_iterations, n_starts.

    Returns
    -------
    (result row as a dict, the Gauss-Newton descent that leads to it or that began nearest to it, the whole Search)
    """
    weights = checked_weights(weights)
    if "radius_m" not in variables:
        weights = weights[:3]
    units = unit_of(variables)
    bounds = np.array([surrogates["cohesion"].ranges[name] for name in variables]).T / units
    low, high = bounds
    found = search(objectives(surrogates, targets, variables), weights, bounds, variables, options)
    optimum = found.minima[0]
    inside = [d for d in found.descents if d.converged and np.abs((d.x - optimum.x) / (high - low)).max() <= SAME]
    shown = min(inside, key=lambda d: d.iterations) if inside else nearest(found.descents, found.guesses, optimum.x, high - low)
    row = {
        **dict(zip(variables, (optimum.x * units).tolist(), strict=True)),
        "cost": optimum.cost,
        "iterations": shown.iterations,
        "n_starts": len(found.guesses),
        "n_converged": sum(d.converged for d in found.descents),
        "n_distinct": len(found.minima),
        "global_cost": found.global_cost,
        "condition_number": optimum.condition_number,
        "status": "converged" if inside else "bounded",
        "reason": ""
        if inside
        else f"a bounded search found it, Gauss-Newton from no start; from the nearest start: {shown.reason}",
        "at_bound": ",".join(optimum.at_bound),
        "inside_design": bool(((optimum.x >= low) & (optimum.x <= high)).all()),
    }
    return row, shown, found


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


def calibrate(surrogates, soils: pd.DataFrame, options: dict, variables, source: str) -> tuple[pd.DataFrame, ...]:
    """Optimise every case of options["cases"] on one set of surrogates; `source` ("ours", "published") labels the rows.

    Returns (one row per case with optimum, predictions, targets and status; history of the Gauss-Newton run of each; one row per
    distinct minimum of each).
    """
    rows, history, minima = [], [], []
    units = unit_of(variables)
    for case in options["cases"]:
        targets = targets_of(soils, case["soil"])
        row, descent, found = calibrate_case(surrogates, targets, case["weights"], options, variables)
        labels = {"case": case["case"], "soil": case["soil"], "surrogate": source}
        label_weights = {f"weight_{name}": weight for name, weight in zip(OBJECTIVES, case["weights"], strict=True)}
        wanted = {f"target_{column}": targets[name] for name, (column, _) in RESPONSES.items()}
        rows.append({**labels, **label_weights, **row, **predicted(surrogates, row), **wanted})
        for k, (x, cost, step) in enumerate(descent.history):
            where = dict(zip(variables, (x * units).tolist(), strict=True))
            history.append({"case": case["case"], "surrogate": source, "iteration": k, **where, "cost": cost, "step_norm": step})
        for rank, minimum in enumerate(found.minima, 1):
            where = dict(zip(variables, (minimum.x * units).tolist(), strict=True))
            minima.append(
                {
                    **labels,
                    "rank": rank,
                    **where,
                    "cost": minimum.cost,
                    **predicted(surrogates, where),
                    "at_bound": ",".join(minimum.at_bound),
                    "condition_number": minimum.condition_number,
                    "found_by": ",".join(minimum.found_by),
                }
            )
    return pd.DataFrame(rows), pd.DataFrame(history), pd.DataFrame(minima)


def predicted(surrogates, where: dict) -> dict[str, float]:
    """Value of every response's column at a point."""
    return {column: float(surrogates[name].predict(where)) for name, (column, _) in RESPONSES.items()}
