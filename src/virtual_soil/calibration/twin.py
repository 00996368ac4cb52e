"""Synthetic twins: simulated soils, whose grain parameters are known and which the calibration must find again."""

import numpy as np
import pandas as pd

from virtual_soil.calibration.errors import demand
from virtual_soil.calibration.noise import error_of_mean, known_scatter
from virtual_soil.calibration.points import point_at, point_id
from virtual_soil.calibration.response import Response, Responses
from virtual_soil.calibration.space import Space
from virtual_soil.calibration.uncertainty import LEVELS, Likelihood, credible_level, log_density, probabilities

#: Mass of the region in which the truth should lie.
REGION = LEVELS[1] - LEVELS[0]
CROWD, FINE_CROWD = 2**13, 2**16


def twin_soil(name: str, twin: dict, responses: Responses, tables: dict, design: dict, material: dict) -> pd.DataFrame:
    """Rows of the soil table for one twin: the responses of its simulations, with their standard errors.

    twin : values of the design variables, and the seeds of each table of runs as `<table>_seeds`. A value below zero stays: it is
    a regression's noise, and clipping it would bias a comparison of many. Raises CalibrationError when its simulations failed.
    """
    point = point_id(point_at(material, {key: twin[key] for key in design["variables"]}))
    rows = []
    for response in responses.values():
        table = tables[response.table]
        found = simulated(response, table, point, twin)
        demand(len(found) > 0, f"simulations of twin {name} with a result for {response.name}", 0, "at least one that ended well")
        rows.append(
            {
                "soil": name,
                "property": response.name,
                "value": float(found[response.column].mean()),
                "standard_uncertainty": error_of_mean(response, found, known_scatter(response, table), len(found)),
                "source": "synthetic twin",
                "method": "simulated",
                "unit": response.unit,
            }
        )
    return pd.DataFrame(rows)


def simulated(response: Response, table: pd.DataFrame, point: str, twin: dict) -> pd.DataFrame:
    """Rows of a twin with a result: its runs with the twin's seeds, or its regression, which all seeds of the point enter."""
    here = table[(table["point_id"] == point) & table[response.column].notna()]
    if response.error_column is None:
        return here[here["seed"].isin(twin[f"{response.table}_seeds"])]
    return here[here["fidelity"] == "campaign"].iloc[:1]


def twin_table(twins: dict, cases: list[dict], calibration: pd.DataFrame, posterior: pd.DataFrame, likelihoods: dict, space: Space):
    """One row per case on a twin and variable: truth, optimum, 95 % interval, and level of the region that just holds the truth.

    credible_level is the posterior's mass of all parameters that are more probable than the truth; the truth is inside the 95 %
    region where it is below 0.95.
    """
    rows = []
    for case in cases:
        if case["soil"] not in twins:
            continue
        truth = {name: float(twins[case["soil"]][name]) for name in space.variables}
        samples = posterior[posterior["case"] == case["case"]]
        at = float(likelihoods[case["case"]](space.unit(truth))[0])
        level = credible_level(samples["log_likelihood"].to_numpy(), np.ones(len(samples)), at)
        optimum = calibration[calibration["case"] == case["case"]].iloc[0]
        for name in space.variables:
            low, high = (float(samples[name].quantile(q)) for q in LEVELS)
            rows.append(
                {
                    "case": case["case"],
                    "twin": case["soil"],
                    "variable": name,
                    "truth": truth[name],
                    "optimum": float(optimum[name]),
                    "low_95": low,
                    "high_95": high,
                    "credible_level": level,
                    "inside_95": bool(level <= REGION),
                }
            )
    return pd.DataFrame(rows)


def coverage_table(responses: Responses, models: dict, space: Space) -> pd.DataFrame:
    """Every simulated point as a twin: its responses are the targets, and the surrogates are fitted without the point.

    One row per point that has all responses: its variables, the credible level of the truth, and True if the 95 % region holds it.
    The hyperparameters are those of the fit to all points. Needs surrogates that can leave a point out.
    """
    unit = space.crowd(CROWD)
    keys = [{point: k for k, point in enumerate(models[name].points)} for name in responses]
    rows = []
    for point in sorted(set.intersection(*map(set, keys))):
        index = dict(zip(responses, (key[point] for key in keys), strict=True))
        left = {name: models[name].without(k) for name, k in index.items()}
        targets = {name: models[name].observed[k] for name, k in index.items()}
        noise = {name: models[name].noise[k] for name, k in index.items()}
        likelihood = Likelihood(responses, left, space, targets, noise, dict.fromkeys(responses, 1.0))
        logs = likelihood(unit)
        truth = dict(zip(space.variables, point, strict=True))
        level = credible_level(logs, probabilities(logs), float(likelihood(np.clip(space.unit(truth), 0.0, 1.0))[0]))
        rows.append({**truth, "credible_level": level, "inside_95": bool(level <= REGION)})
    return pd.DataFrame(rows)


def made_up_twins(responses: Responses, models: dict, space: Space, noise: dict[str, float], n: int, seed: int) -> np.ndarray:
    """Credible levels (n,) of the truth of n soils made up on surrogates; uniform between 0 and 1 if the regions are right.

    Parameters of every soil are drawn from the prior, its true responses within the surrogates' errors there, and its targets
    within `noise`, the standard error of each response's measurement, around them.
    """
    random, unit = np.random.default_rng(seed), space.crowd(FINE_CROWD)
    known = {name: models[name].predict_with_error(space.values(unit)) for name in responses}
    levels = []
    for truth in random.random((n, len(space.variables))):
        values, logs, at = space.values(truth[None]), np.zeros(len(unit)), 0.0
        for name in responses:
            mean, error = (float(number[0]) for number in models[name].predict_with_error(values))
            target = mean + np.hypot(error, noise[name]) * random.standard_normal()
            everywhere, errors = known[name]
            logs += log_density(everywhere, errors, target, noise[name])
            at += float(log_density(mean, error, target, noise[name]))
        levels.append(credible_level(logs, probabilities(logs), at))
    return np.array(levels)
