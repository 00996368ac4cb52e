"""Step 4: the grain parameters whose virtual soil comes nearest to a real one.

Objectives (Equation 4), x = (r in um, mu_s, mu_r):
    phi1 = (A - A0)/A0,  phi2 = (c - c0)/c0,  phi3 = (phi - phi0)/phi0,  phi4 = 10 (pi/2 - arctan(r - 5))
The paper writes absolute values; the sign drops out of the cost and of the Gauss-Newton step. phi4 prefers large grains.

Two optimisers run from the same low-discrepancy starts: the paper's Gauss-Newton, and bounded, scaled, damped least squares, which
cannot run away. A global check (the cheapest of very many points, refined) looks for minima that were missed. All distinct minima
inside the simulated design are kept, and the cheapest is reported: "converged" if Gauss-Newton found it too, "bounded" if only a
bounded search did (at an edge of the design, or where Gauss-Newton runs away).
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pandas as pd
from scipy.optimize import least_squares
from scipy.stats import qmc

from virtual_soil.calibration.errors import demand
from virtual_soil.calibration.gauss_newton import Descent, gauss_newton, jacobian
from virtual_soil.calibration.space import REACH, SOBOL_SEED, Space
from virtual_soil.calibration.surrogate import RESPONSES, Surrogate

OBJECTIVES = ("angle_of_repose", "cohesion", "friction_angle", "radius")
#: The optimiser sees radii in um, as the paper does; its |dx| and phi4 depend on it.
UNITS = {"radius_m": 1e-6}
#: Errors of a smaller cohesion are relative to this: dry sand has none, and shear tests do not tell a few Pa from zero.
LEAST_COHESION_PA = 10.0
#: Two minima closer than this fraction of the design's extent are one.
SAME = 1e-3
#: Where on the line between two minima a barrier is looked for, and how much higher it must be, relative to the cost.
LINE, BARRIER = np.linspace(0.0, 1.0, 33)[1:-1], 1e-6
#: Distinct ends are followed to their minimum by a slower method that takes small steps along flat valleys.
POLISH = {"method": "trf", "xtol": 1e-12, "ftol": 1e-12, "gtol": 1e-12, "max_nfev": 2000}
#: The global check costs so many low-discrepancy points and refines the cheapest. Differential evolution is no check here: the
#: valleys are thin (a cohesion of tens of Pa out of thousands), and it settles in the first that it meets.
SCREENED, REFINED = 2**16, 64


def unit_of(variables) -> np.ndarray:
    """SI value of one optimiser unit, for each variable."""
    return np.array([UNITS.get(name, 1.0) for name in variables])


def objectives(surrogates: dict[str, Surrogate], targets: dict[str, float], variables, aims: dict[str, float] | None = None):
    """The function x -> (phi1, phi2, phi3, phi4); without a radius among the variables there is no phi4.

    x (n,) gives (4,), or x (n, m) gives (4, m). aims: values to come to in place of the targets, which the errors stay relative to.
    """
    units = unit_of(variables)
    aims = targets if aims is None else aims

    def phi(x):
        values = dict(zip(variables, (np.asarray(x, float).T * units).T, strict=True))
        with np.errstate(all="ignore"):
            relative = [(surrogates[name].predict(values) - aims[name]) / scale_of(name, targets[name]) for name in OBJECTIVES[:3]]
        if "radius_m" in variables:
            relative.append(10.0 * (np.pi / 2 - np.arctan(x[list(variables).index("radius_m")] - 5.0)))
        return np.array(relative)

    return phi


def scale_of(response: str, target: float) -> float:
    """What a response's error is relative to: its target, as in the paper; of soils with hardly any cohesion a least one."""
    return max(target, LEAST_COHESION_PA) if response == "cohesion" else target


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
    inside = [d for d in descents if d.converged and ((d.x >= low) & (d.x <= high)).all()]
    crowd = starts(low, high, SCREENED)
    cheapest = crowd[np.argsort(weights @ phi(crowd.T) ** 2)[:REFINED]]
    screened = [bounded(phi, root, bounds, x) for x in cheapest]
    candidates: list[tuple[float, np.ndarray, tuple[str, ...]]] = [(d.cost, d.x, ("gauss_newton",)) for d in inside]
    candidates += [(*bounded(phi, root, bounds, guess), ("bounded_least_squares",)) for guess in guesses]
    candidates += [(*found, ("screened_start",)) for found in screened]
    for polish in (True, False):
        candidates = distinct(candidates, high - low, lambda x: 0.5 * weights @ phi(x) ** 2)
        if polish:
            candidates = [(*bounded(phi, root, bounds, x, POLISH), finders) for _, x, finders in candidates]
    minima = [minimum(phi, root, bounds, variables, *candidate) for candidate in candidates]
    return Search(minima, descents, guesses, min(cost for cost, _ in screened))


def bounded(phi, root: np.ndarray, bounds: np.ndarray, start: np.ndarray, settings: dict | None = None) -> tuple[float, np.ndarray]:
    """Cost and place where bounded, damped least squares end from one start; dogbox is the quickest at the edges of a box."""
    result = least_squares(
        lambda x: root * phi(x),
        start,
        lambda x: root[:, None] * jacobian(phi, x),
        bounds=bounds,
        x_scale=bounds[1] - bounds[0],
        **(settings or {"method": "dogbox"}),
    )
    return float(result.cost), result.x


def minimum(phi, root, bounds, variables, cost: float, x: np.ndarray, finders: tuple[str, ...]) -> Minimum:
    """A minimum with its active bounds and its conditioning."""
    low, high = bounds
    singular = np.linalg.svd(root[:, None] * jacobian(phi, x) * (high - low), compute_uv=False)
    edge = [name for name, value, a, b in zip(variables, x, low, high, strict=True) if min(value - a, b - value) < SAME * (b - a)]
    return Minimum(x, cost, finders, tuple(edge), float(singular[0] / singular[-1]))


def distinct(candidates, extent: np.ndarray, cost_at: Callable) -> list[tuple[float, np.ndarray, tuple[str, ...]]]:
    """Of candidates (cost, x, finders) those that a barrier separates from all cheaper ones, in order of cost, finders merged.

    Searches end where the valley's floor hardly falls any more: two such ends are one minimum when the cost on the straight line
    between them does not rise above the higher end. cost_at maps (n, k) points to (k,) costs.
    """
    found: list[list] = []
    for cost, x, finders in sorted(candidates, key=lambda candidate: candidate[0]):
        for known in found:
            line = known[1][:, None] + (x - known[1])[:, None] * LINE
            if np.abs((x - known[1]) / extent).max() <= SAME or cost_at(line).max() <= cost * (1.0 + BARRIER):
                known[2] += [name for name in finders if name not in known[2]]
                break
        else:
            found.append([cost, x, list(finders)])
    return [(cost, x, tuple(finders)) for cost, x, finders in found]


def calibrate_case(surrogates, targets, weights, options, variables):
    """Optimise one case.

    Parameters
    ----------
    targets : response -> value in its unit. weights : (4,), in the order of OBJECTIVES.
    options : tolerance, max_iterations, n_starts, unreachable ("as_given", or "nearest": aim at the nearest value within reach).

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
    aims = (
        targets if options["unreachable"] == "as_given" else within_reach(surrogates, targets, low * units, high * units, variables)
    )
    found = search(objectives(surrogates, targets, variables, aims), weights, bounds, variables, options)
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


def within_reach(surrogates, targets: dict[str, float], low, high, variables) -> dict[str, float]:
    """The targets, those that no point between low and high (n,) reaches replaced by the nearest value that one does.

    Aimed at as given, a far target would pull linearly: a cohesion of 1 Pa more would be worth degrees of both angles.
    """
    space = Space(tuple(variables), dict(zip(variables, zip(low, high, strict=True), strict=True)))
    values = space.values(space.everywhere(REACH))
    return {name: float(np.clip(targets[name], *span(surrogates[name].predict(values)))) for name in targets}


def span(values: np.ndarray) -> tuple[float, float]:
    """Lowest and highest value."""
    return float(values.min()), float(values.max())


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
    """Target of each response for one soil of the soil table; a regression's cohesion may lie below zero."""
    rows = soils[soils["soil"] == soil].set_index("property")["value"]
    demand(len(rows) > 0, "soil of a case", soil, f"one of {sorted(soils['soil'].unique())}")
    for name, value in rows.items():
        demand(value > 0 or name == "cohesion", f"target {name} of {soil}", value, "above zero")
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
