"""Step 4: the grain parameters whose virtual soil comes nearest to a real one.

Objectives (Equation 4), x: the variables in optimiser units, radii in um:
    phi_j = (y_j(x) - t_j) / s_j                           of every response with a weight, t_j its target
    phi_large_grains, see `calibration.paper.objective`    if it has a weight and the radius is among the variables
The cost is half the sum of their squares, each with its weight; terms are in the order of their names. The paper writes absolute
values; the sign drops out of the cost and of the Gauss-Newton step. The scale s_j is the target itself, as in the paper, or the
combined standard uncertainty of target and surrogate, see `relative_scale` and `combined_scale`.

Two optimisers run from the same low-discrepancy starts: the paper's Gauss-Newton, and bounded, scaled, damped least squares, which
cannot run away. A global check (the cheapest of very many points, refined) looks for minima that were missed. All distinct minima
inside the simulated design are kept, and the cheapest is reported: "converged" if Gauss-Newton found it too, "bounded" if only a
bounded search did (at an edge of the design, or where Gauss-Newton runs away).
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
import pandas as pd
import scipy

from virtual_soil.calibration.errors import demand
from virtual_soil.calibration.gauss_newton import Descent, gauss_newton, jacobian
from virtual_soil.calibration.noise import target_uncertainty
from virtual_soil.calibration.paper.objective import large_grains
from virtual_soil.calibration.response import Response, Responses
from virtual_soil.calibration.space import REACH, SOBOL_SEED, Space
from virtual_soil.calibration.surrogate import Surrogate

#: Term of the cost that prefers large grains; it has a weight like a response. Without RADIUS among the variables it has no effect.
LARGE_GRAINS, RADIUS = "large_grains", "radius_m"
#: The optimiser's radii are in um, as in the paper; its |dx| and the large-grain objective depend on it.
UNITS = {RADIUS: 1e-6}
#: Two minima closer than this fraction of the design's extent are one.
SAME = 1e-3
#: Positions on the line between two minima where a barrier is sought, and its least height relative to the cost.
LINE, BARRIER = np.linspace(0.0, 1.0, 33)[1:-1], 1e-6
#: Distinct ends are followed to their minimum by a slower method that takes small steps along flat valleys.
POLISH = {"method": "trf", "xtol": 1e-12, "ftol": 1e-12, "gtol": 1e-12, "max_nfev": 2000}
#: The global check: number of low-discrepancy points whose cost is computed, and number of the cheapest that are refined.
#: Differential evolution is no check here: the valleys are thin (a target may be 1 % of a response's range), and it settles in the
#: first that it meets.
SCREENED, REFINED = 2**16, 64


def unit_of(variables) -> np.ndarray:
    """SI value of one optimiser unit, for each variable."""
    return np.array([UNITS.get(name, 1.0) for name in variables])


def terms(responses: Responses) -> list[str]:
    """Names of the objectives, in their order: the responses and the preference for large grains."""
    return sorted([*responses, LARGE_GRAINS])


def weights_of(case: dict, responses: Responses) -> dict[str, float]:
    """Weights of a case by objective, in the order of `terms`; 0 for an objective that the case leaves out.

    Raises CalibrationError unless each is named like an objective, none is below zero, and at least one response has one above.
    """
    given, names = case["weights"], terms(responses)
    named = isinstance(given, Mapping) and set(given) <= set(names) and all(weight >= 0 for weight in given.values())
    form = ", ".join(f"{name}: {1 / len(names):.3g}" for name in names)
    demand(
        named and any(given.get(name, 0) > 0 for name in responses),
        f"optimise.cases: weights of {case['case']}",
        dict(given) if isinstance(given, Mapping) else given,
        f"some of {{{form}}}, none below zero, and at least one response above",
    )
    return {name: float(given.get(name, 0)) for name in names}


def weighted(case: dict, responses: Responses) -> Responses:
    """The responses whose targets a case is to meet: those with a weight."""
    weights = weights_of(case, responses)
    return {name: response for name, response in responses.items() if weights[name]}


def cases_about(responses: Responses, cases: list[dict]) -> list[dict]:
    """The cases with the weights of these responses only, for surrogates that know no others; cases without any are left out."""
    names = terms(responses)
    fewer = [{**case, "weights": {name: case["weights"].get(name, 0) for name in names}} for case in cases]
    return [case for case in fewer if any(case["weights"][name] for name in responses)]


def present(weights: Mapping[str, float], variables) -> list[str]:
    """The objectives of a case, in the order of `terms`; without a radius among the variables none prefers large grains."""
    return [name for name, weight in weights.items() if weight and (name != LARGE_GRAINS or RADIUS in variables)]


def objectives(
    names: list[str], surrogates: dict[str, Surrogate], scales: dict[str, float], variables, aims: dict[str, float]
) -> Callable:
    """The function x -> phi of the objectives `names`: x (n,) gives (k,), or x (n, m) gives (k, m).

    aims, scales : by response, the value to come to, and what its error is relative to.
    """
    units = unit_of(variables)

    def phi(x):
        values = dict(zip(variables, (np.asarray(x, float).T * units).T, strict=True))
        result = []
        for name in names:
            if name == LARGE_GRAINS:
                result.append(large_grains(x[list(variables).index(RADIUS)]))
                continue
            with np.errstate(all="ignore"):
                result.append((surrogates[name].predict(values) - aims[name]) / scales[name])
        return np.array(result)

    return phi


def relative_scale(response: Response, target: pd.Series, surrogate) -> float:
    """Scale of a relative error: the target, as in the paper, but at least the response's smallest scale.

    target : row of the soil table. surrogate : unused, see `combined_scale`.
    """
    return max(float(target["value"]), response.smallest_scale)


def combined_scale(ratio: float, floors: Mapping[str, float]) -> Callable:
    """Scale of an error in units of what is known: combined standard uncertainty of target and surrogate.

    The surrogate's is its error at left-out points, which includes the scatter of the tests. It is one number for the whole design:
    with the error at x the search would end where the surrogate is worst. ratio : relative uncertainty of a target that states
    none. floors : response -> least scale, below which its test resolves nothing.
    """

    def scale(response: Response, target: pd.Series, surrogate) -> float:
        known = float(np.hypot(target_uncertainty(target, ratio), surrogate.cv_rmse))
        return max(known, floors.get(response.name, 0.0))

    return scale


def starts(low: np.ndarray, high: np.ndarray, n: int) -> np.ndarray:
    """N low-discrepancy initial guesses (n, k) inside the bounds."""
    sampler = scipy.stats.qmc.Sobol(len(low), seed=SOBOL_SEED)
    return scipy.stats.qmc.scale(sampler.random_base2(int(np.ceil(np.log2(max(n, 2)))))[:n], low, high)


@dataclass(frozen=True)
class Minimum:
    """A local minimum in optimiser units: x (n,), cost, searches that found it, variables at a bound of the design, conditioning.

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
    """Result of one search: distinct minima in order of cost, the Gauss-Newton descents, their starts, the global check's cost."""

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
    """Cost and end point of bounded, damped least squares from one start; dogbox is the quickest at the edges of a box."""
    result = scipy.optimize.least_squares(
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
    """Candidates (cost, x, finders) that a barrier separates from all cheaper ones, in order of cost, finders merged.

    Searches end where the valley's floor hardly falls any more. Two such ends are one minimum if the cost on the straight line
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


def calibrate_case(surrogates, targets, scales, weights: dict[str, float], options, variables):
    """Optimise one case.

    Parameters
    ----------
    targets : response -> value in its unit, of all responses with a weight. scales : response -> what its error is relative to.
    weights : of every objective, see `weights_of`.
    options : tolerance, max_iterations, n_starts, unreachable ("as_given", or "nearest": aim at the nearest value within reach).

    Returns
    -------
    (result row as a dict, the Gauss-Newton descent that leads to it or that began nearest to it, the whole Search)
    """
    names = present(weights, variables)
    diagonal = np.array([weights[name] for name in names])
    units = unit_of(variables)
    bounds = np.array([next(iter(surrogates.values())).ranges[name] for name in variables]).T / units
    low, high = bounds
    aims = (
        targets if options["unreachable"] == "as_given" else within_reach(surrogates, targets, low * units, high * units, variables)
    )
    found = search(objectives(names, surrogates, scales, variables, aims), diagonal, bounds, variables, options)
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

    Aimed at as given, a distant target would pull linearly: a little less of its error would outweigh much of all others.
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


def targets_of(responses: Responses, soils: pd.DataFrame, case: dict) -> dict[str, float]:
    """Target of each response that a case's soil has in the soil table; only that of a signed response may be zero or below.

    Raises CalibrationError for an unknown soil, an impossible target, and a weight without a target.
    """
    soil, wanted = case["soil"], weighted(case, responses)
    rows = soils[soils["soil"] == soil].set_index("property")["value"].to_dict()
    demand(len(rows) > 0, "soil of a case", soil, f"one of {sorted(soils['soil'].unique())}")
    demand(set(wanted) <= set(rows), f"targets of {soil}", sorted(rows), f"all responses with a weight: {sorted(wanted)}")
    for name, response in responses.items():
        demand(rows.get(name, 1.0) > 0 or response.signed, f"target {name} of {soil}", rows.get(name), "above zero")
    return {name: rows[name] for name in responses if name in rows}


def calibrate(
    responses: Responses, surrogates, soils: pd.DataFrame, options: dict, variables, source: str, scale: Callable = relative_scale
) -> tuple[pd.DataFrame, ...]:
    """Optimise every case of options["cases"] on one set of surrogates; `source` ("ours", "published") labels the rows.

    scale(response, row of the soil table, surrogate) : what a response's error is relative to.

    Returns (one row per case with optimum, predictions, targets and status; history of the Gauss-Newton run of each; one row per
    distinct minimum of each).
    """
    rows, history, minima = [], [], []
    units = unit_of(variables)
    for case in options["cases"]:
        targets, weights = targets_of(responses, soils, case), weights_of(case, responses)
        aimed = {name: targets[name] for name in weighted(case, responses)}
        known = soils[soils["soil"] == case["soil"]].set_index("property")
        scales = {name: scale(responses[name], known.loc[name], surrogates[name]) for name in aimed}
        row, descent, found = calibrate_case(surrogates, aimed, scales, weights, options, variables)
        labels = {"case": case["case"], "soil": case["soil"], "surrogate": source}
        label_weights = {f"weight_{name}": weight for name, weight in weights.items()}
        wanted = {f"target_{response.column}": targets.get(name, np.nan) for name, response in responses.items()}
        rows.append({**labels, **label_weights, **row, **predicted(responses, surrogates, row), **wanted})
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
                    **predicted(responses, surrogates, where),
                    "at_bound": ",".join(minimum.at_bound),
                    "condition_number": minimum.condition_number,
                    "found_by": ",".join(minimum.found_by),
                }
            )
    return pd.DataFrame(rows), pd.DataFrame(history), pd.DataFrame(minima)


def predicted(responses: Responses, surrogates, where: dict) -> dict[str, float]:
    """Value of every response's column at a point."""
    return {response.column: float(surrogates[name].predict(where)) for name, response in responses.items()}
