"""Synthetic twins: simulated soils, whose grain parameters are known and which the calibration must find again."""

import numpy as np
import pandas as pd

from virtual_soil.calibration.errors import demand
from virtual_soil.calibration.noise import error_of_mean, scatter_at
from virtual_soil.calibration.points import point_at, point_id
from virtual_soil.calibration.response import Response, Responses
from virtual_soil.calibration.space import Space, space_of
from virtual_soil.calibration.uncertainty import LEVELS, SEED, Likelihood, credible_level, log_density, probabilities

#: Mass of the region in which the truth should lie.
REGION = LEVELS[1] - LEVELS[0]
CROWD, FINE_CROWD = 2**13, 2**16
#: Number of soils that are made up to count how often the regions hold the truth.
N_MADE_UP = 500


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
        scatter = float(scatter_at(response, table, space_of(design), twin)[0])
        demand(len(found) > 0, f"simulations of twin {name} with a result for {response.name}", 0, "at least one that ended well")
        rows.append(
            {
                "soil": name,
                "property": response.name,
                "value": float(found[response.column].mean()),
                "standard_uncertainty": error_of_mean(response, found, scatter, len(found)),
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


def coverage_table(
    responses: Responses, processes: dict, models: dict, space: Space, twins: dict, soils: pd.DataFrame
) -> pd.DataFrame:
    """Credible levels of the true parameters of soils that are known: uniform between 0 and 1 if the stated regions are right.

    One row per soil: `kind`, its variables, the credible level, and True if the 95 % region holds the truth. Kinds: "left out", the
    simulated points (see `left_out_points`); "made up", soils drawn on the surrogates (see `made_up_twins`), whose targets scatter
    as the median point of each response does; "simulated", the hidden twins, by their simulations.

    processes : Gaussian processes, which can leave a point out. models : the surrogates that the study uses. twins : name -> values
    of the design variables. soils : table of targets, the twins' among them.
    """
    noise = {name: float(np.median(processes[name].noise)) for name in responses}
    parts = {
        "left out": left_out_points(responses, processes, space),
        "made up": made_up_twins(responses, models, space, noise, N_MADE_UP, SEED),
        "simulated": simulated_twins(responses, models, space, twins, soils),
    }
    table = pd.concat([part.assign(kind=kind) for kind, part in parts.items() if len(part)], ignore_index=True)
    return table.assign(inside_95=table["credible_level"] <= REGION)


def left_out_points(responses: Responses, models: dict, space: Space) -> pd.DataFrame:
    """Every simulated point as a twin: its responses are the targets, and the surrogates are fitted without the point.

    One row per point that has all responses: its variables and the credible level of the truth. The hyperparameters are those of
    the fit to all points.
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
        rows.append({**truth, **space.fixed, "credible_level": level})
    return pd.DataFrame(rows)


def simulated_twins(responses: Responses, models: dict, space: Space, twins: dict, soils: pd.DataFrame) -> pd.DataFrame:
    """Variables and credible level of every hidden twin; all responses are its targets, with the errors of its simulations."""
    unit, rows = space.crowd(FINE_CROWD), []
    for name, twin in twins.items():
        truth = {variable: float(twin[variable]) for variable in space.variables}
        own = soils[soils["soil"] == name].set_index("property")
        targets = {response: float(own.loc[response, "value"]) for response in responses}
        errors = {response: float(own.loc[response, "standard_uncertainty"]) for response in responses}
        likelihood = Likelihood(responses, models, space, targets, errors, dict.fromkeys(responses, 1.0))
        logs = likelihood(unit)
        rows.append(
            {
                **truth,
                **space.fixed,
                "credible_level": credible_level(logs, probabilities(logs), float(likelihood(space.unit(truth))[0])),
            }
        )
    return pd.DataFrame(rows)


def made_up_twins(responses: Responses, models: dict, space: Space, noise: dict[str, float], n: int, seed: int) -> pd.DataFrame:
    """Variables and credible level of n soils made up on surrogates.

    Parameters of every soil are drawn from the prior, its true responses within the surrogates' errors there, and its targets
    within `noise`, the standard error of each response's measurement, around them.
    """
    random, unit = np.random.default_rng(seed), space.crowd(FINE_CROWD)
    known = {name: models[name].predict_with_error(space.values(unit)) for name in responses}
    rows = []
    for truth in random.random((n, len(space.variables))):
        values, logs, at = space.values(truth[None]), np.zeros(len(unit)), 0.0
        for name in responses:
            mean, error = (float(number[0]) for number in models[name].predict_with_error(values))
            target = mean + np.hypot(error, noise[name]) * random.standard_normal()
            everywhere, errors = known[name]
            logs += log_density(everywhere, errors, target, noise[name])
            at += float(log_density(mean, error, target, noise[name]))
        level = credible_level(logs, probabilities(logs), at)
        rows.append({**{name: float(value[0]) for name, value in values.items()}, "credible_level": level})
    return pd.DataFrame(rows)
