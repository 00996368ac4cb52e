"""Uncertainty of the calibration: the parameters that are consistent with a soil, given all known errors.

    log L(x) = -1/2 sum_j v_j [ (y_j(x) - t_j)^2 / (s_j^2 + e_j(x)^2) + ln(s_j^2 + e_j(x)^2) ]

j runs over the responses with a weight. t_j and s_j are a target and its standard uncertainty, y_j(x) and e_j(x) the surrogate and
its standard error (which includes the scatter over seeds and the fit). v_j are the case's weights over their mean: a target of a
tenth of the weight counts like one of sqrt(10) times the uncertainty. The prior is uniform in the coordinates of the design's box
(see `calibration.space`). The preference for large grains concerns cost, not knowledge, and does not enter.

An unreachable target would dominate the likelihood: every point misses it by many s_j, and tiny differences would decide. Its
distance to the nearest reachable value is therefore added to s_j (in squares), as a discrepancy of the model (Kennedy & O'Hagan
2001): then it counts for little more than a direction.
"""

from dataclasses import dataclass, field

import numpy as np
import pandas as pd

from virtual_soil.calibration.noise import target_uncertainty
from virtual_soil.calibration.optimise import targets_of, weighted, weights_of
from virtual_soil.calibration.response import Responses
from virtual_soil.calibration.space import REACH, Space

#: Number of low-discrepancy points that find the regions of high probability, where the sampler's walkers start.
CROWD = 2**14
WALKERS, BURN_IN, STEPS = 48, 200, 600
SEED = 2011
#: Bounds of the intervals: 95 %.
LEVELS = (0.025, 0.975)


@dataclass(frozen=True)
class Likelihood:
    """log L of one case; callable on coordinates (m, n) -> (m,).

    By response: surrogates, the targets that the soil has, their standard uncertainties, the case's weights over their mean, and
    the discrepancies of unreachable targets. Responses without a weight are predicted and do not count.
    """

    responses: Responses
    surrogates: dict
    space: Space
    targets: dict[str, float]
    uncertainties: dict[str, float]
    weights: dict[str, float]
    discrepancies: dict[str, float] = field(default_factory=dict)

    def __call__(self, unit: np.ndarray) -> np.ndarray:
        """Log likelihood at coordinates (m, n); minus infinity outside the unit cube."""
        unit = np.atleast_2d(unit)
        inside = ((unit >= 0) & (unit <= 1)).all(axis=1)
        result = np.full(len(unit), -np.inf)
        if inside.any():
            values = self.space.values(unit[inside])
            result[inside] = sum(weight * self.term(name, values) for name, weight in self.weights.items())
        return result

    def term(self, name: str, values) -> np.ndarray:
        """Contribution of one response, unweighted."""
        mean, error = self.surrogates[name].predict_with_error(values)
        return log_density(mean, error, self.targets[name], self.tolerance(name))

    def tolerance(self, name: str) -> float:
        """Standard deviation within which a target is to be met: its uncertainty and its discrepancy."""
        return float(np.hypot(self.uncertainties[name], self.discrepancies.get(name, 0.0)))

    def deviations(self, values) -> dict[str, float]:
        """Distance of every prediction at one point from its target, in standard deviations of target and surrogate together."""
        result = {}
        for name in self.weights:
            mean, error = self.surrogates[name].predict_with_error(values)
            result[name] = abs(float(mean) - self.targets[name]) / float(np.hypot(self.uncertainties[name], float(error)))
        return result


def log_density(mean, error, target: float, tolerance: float):
    """Log density of a target with a standard deviation, given a prediction with its standard error (any shape)."""
    variance = tolerance**2 + error**2
    return -0.5 * ((mean - target) ** 2 / variance + np.log(variance))


def likelihood_of(
    case: dict, responses: Responses, surrogates: dict, soils: pd.DataFrame, space: Space, ratio: float
) -> Likelihood:
    """The likelihood of a case; a target without a stated uncertainty has `ratio` times its value as one.

    Raises CalibrationError for an unknown soil and for weights that are not those of all objectives.
    """
    targets = targets_of(responses, soils, case)
    rows = soils[soils["soil"] == case["soil"]].set_index("property")
    uncertainties = {name: target_uncertainty(rows.loc[name], ratio) for name in targets}
    given = {name: weight for name, weight in weights_of(case, responses).items() if name in weighted(case, responses)}
    shares = dict(zip(given, np.array(list(given.values())) / np.mean(list(given.values())), strict=True))
    values = space.values(space.everywhere(REACH))
    out_of_reach = {name: distance_to(surrogates[name].predict(values), targets[name]) for name in given if name in surrogates}
    return Likelihood(responses, surrogates, space, targets, uncertainties, shares, out_of_reach)


def distance_to(reached: np.ndarray, target: float) -> float:
    """Distance of a target from the range of values; 0 inside."""
    return float(abs(target - np.clip(target, reached.min(), reached.max())))


def target_errors(soils: pd.DataFrame, ratio: float) -> dict[tuple[str, str], float]:
    """Standard uncertainty of every target of the soil table, by soil and response."""
    return {(row["soil"], row["property"]): target_uncertainty(row, ratio) for _, row in soils.iterrows()}


def probabilities(log_likelihood: np.ndarray) -> np.ndarray:
    """Weights (m,) that sum to one."""
    weights = np.exp(log_likelihood - log_likelihood.max())
    return weights / weights.sum()


def credible_level(samples: np.ndarray, weights: np.ndarray, at: float) -> float:
    """Probability mass of all parameters that are more probable than one whose log likelihood is `at`.

    samples (m,): log likelihoods drawn with weights (m,). A parameter set lies in the 95 % region if its level is below 0.95.
    """
    return float(weights[samples > at].sum() / weights.sum())


def sample(likelihood: Likelihood, n: int) -> tuple[np.ndarray, np.ndarray]:
    """N samples of the posterior: coordinates (n, k) and log likelihoods (n,).

    emcee's affine-invariant ensemble. Its walkers start at probable points of a low-discrepancy set, so that they find every mode
    that this set resolves. The same samples in every run.
    """
    import emcee  # imported here: with the half of scipy that it loads, it takes a quarter of a dry run's start-up

    random = np.random.default_rng(SEED)
    crowd = likelihood.space.crowd(CROWD)
    chosen = random.choice(len(crowd), WALKERS, p=probabilities(likelihood(crowd)))
    begin = np.clip(crowd[chosen] + 1e-3 * random.standard_normal((WALKERS, crowd.shape[1])), 1e-9, 1 - 1e-9)
    sampler = emcee.EnsembleSampler(WALKERS, crowd.shape[1], likelihood, vectorize=True)
    sampler.random_state = np.random.RandomState(SEED).get_state()  # noqa: NPY002 (emcee knows no other)
    sampler.run_mcmc(begin, BURN_IN + STEPS)
    chain, logs = sampler.get_chain(discard=BURN_IN, flat=True), sampler.get_log_prob(discard=BURN_IN, flat=True)
    kept = np.linspace(0, len(chain) - 1, min(n, len(chain))).astype(int)
    return chain[kept], logs[kept]


def posterior_table(case: dict, likelihood: Likelihood, unit: np.ndarray, logs: np.ndarray) -> pd.DataFrame:
    """Samples with their variables and with all responses drawn within the surrogates' errors there."""
    values = likelihood.space.values(unit)
    random = np.random.default_rng(SEED)
    columns = {"case": case["case"], "soil": case["soil"], **values}
    for name, response in likelihood.responses.items():
        mean, error = likelihood.surrogates[name].predict_with_error(values)
        columns[response.column] = mean + error * random.standard_normal(len(mean))
    return pd.DataFrame({**columns, "log_likelihood": logs})


def intervals(posterior: pd.DataFrame, columns) -> dict[str, float]:
    """Bounds of the 95 % interval of each column, as <column>_low_95 and <column>_high_95."""
    return {
        f"{column}_{side}_95": float(posterior[column].quantile(level))
        for column in columns
        for side, level in zip(("low", "high"), LEVELS, strict=True)
    }


def equivalents(posterior: pd.DataFrame, likelihood: Likelihood, n: int, processes: dict) -> pd.DataFrame:
    """N parameter sets of one case that serve as well as the best: members of the 95 % region, as far apart as possible.

    The most probable one is first; each next is the farthest from all before it. Every other meets each target as well as the
    first is known to (see `serves`), and the simulated points of all processes (by response) surround it: a set whose prediction
    is uncertain is consistent with anything, and serves nobody. There may be fewer than n. Responses are the predictions.
    `extrapolated`: True if the first is not surrounded.
    """
    space = likelihood.space
    region = posterior[posterior["log_likelihood"] >= posterior["log_likelihood"].quantile(0.05)].reset_index(drop=True)
    first = int(region["log_likelihood"].argmax())
    sets = region[list(space.variables)].to_dict("records")
    surrounded = np.array([all(process.surrounds(values) for process in processes.values()) for values in sets])
    kept = serves(likelihood, region, first) & surrounded
    kept[first] = True
    order, places = [first], np.flatnonzero(kept)
    unit = space.unit({name: region[name].to_numpy() for name in space.variables})
    distance = np.where(kept, np.linalg.norm(unit - unit[first], axis=1), 0.0)
    while len(order) < min(n, len(places)) and distance.max() > 0:
        order.append(int(distance.argmax()))
        distance = np.minimum(distance, np.linalg.norm(unit - unit[order[-1]], axis=1))
    table = region.iloc[order].reset_index(drop=True)
    for name, response in likelihood.responses.items():
        table[response.column] = likelihood.surrogates[name].predict({key: table[key].to_numpy() for key in space.variables})
    table.insert(2, "rank", np.arange(1, len(table) + 1))
    table["extrapolated"] = ~surrounded[order]
    return table


def serves(likelihood: Likelihood, region: pd.DataFrame, first: int) -> np.ndarray:
    """Mask (m,) of the sets whose predictions are as near to all targets as the first's is known to be.

    The distance allowed is the standard deviation of the target and of the first's prediction together, or the first's own
    distance if that is larger.
    """
    values = {name: region[name].to_numpy() for name in likelihood.space.variables}
    mask = np.ones(len(region), bool)
    for name in likelihood.weights:
        mean, error = likelihood.surrogates[name].predict_with_error(values)
        distance = np.abs(mean - likelihood.targets[name])
        mask &= distance <= max(float(np.hypot(likelihood.tolerance(name), error[first])), float(distance[first]))
    return mask


def identifiability(case: dict, likelihood: Likelihood, at: dict[str, float]) -> pd.DataFrame:
    """Combinations of the variables that the tests determine at a point: singular vectors of the responses' derivatives.

    Derivatives are in standard deviations (target and surrogate together) per extent of the design. One row per direction, best
    determined first: `standard_deviation` is 1/singular value, in extents; beyond that of a uniform distribution, 1/sqrt(12), the
    tests say nothing about it (`determined` is False).
    """
    unit, h = likelihood.space.unit(at)[0], 1e-3
    rows = []
    for name in likelihood.weights:
        _, error = likelihood.surrogates[name].predict_with_error(at)
        deviation = np.hypot(likelihood.tolerance(name), float(error))
        slopes = []
        for k in range(len(unit)):
            ends = np.clip(unit[k] + np.array([-h, h]), 0.0, 1.0)
            pair = np.tile(unit, (2, 1))
            pair[:, k] = ends
            low, high = likelihood.surrogates[name].predict(likelihood.space.values(pair))
            slopes.append((high - low) / (ends[1] - ends[0]) / deviation)
        rows.append(np.sqrt(likelihood.weights[name]) * np.array(slopes))
    _, singular, directions = np.linalg.svd(np.array(rows))
    singular = np.append(singular, np.zeros(len(unit) - len(singular)))
    return pd.DataFrame(
        [
            {
                "case": case["case"],
                "direction": k + 1,
                "singular_value": float(value),
                "standard_deviation": float(1.0 / value) if value > 0 else float("inf"),
                "determined": bool(value > np.sqrt(12.0)),
                **{f"component_{name}": float(d) for name, d in zip(likelihood.space.variables, direction, strict=True)},
                **{f"component_{name}": 0.0 for name in likelihood.space.fixed},
            }
            for k, (value, direction) in enumerate(zip(singular, directions, strict=True))
        ]
    )
