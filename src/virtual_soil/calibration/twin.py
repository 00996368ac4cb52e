"""Synthetic twins: soils whose grain parameters are known, because they are simulated; the calibration is to find them again."""

import numpy as np
import pandas as pd

from virtual_soil.calibration.errors import demand
from virtual_soil.calibration.models import ERRORS
from virtual_soil.calibration.noise import line_errors, pooled_line_scatter, pooled_scatter
from virtual_soil.calibration.points import point_at, point_id
from virtual_soil.calibration.space import Space
from virtual_soil.calibration.surrogate import RESPONSES
from virtual_soil.calibration.uncertainty import LEVELS, Likelihood, credible_level, probabilities

#: Mass of the region in which the truth should lie.
REGION = LEVELS[1] - LEVELS[0]
CROWD = 2**13


def twin_soil(name: str, twin: dict, repose: pd.DataFrame, strength: pd.DataFrame, design: dict, material: dict) -> pd.DataFrame:
    """Rows of the soil table for one twin: what its simulations measure, with their standard errors.

    A cohesion below zero stays: it is the regression's noise, and to clip it would be a bias where many lines are compared.
    Raises CalibrationError when its simulations failed.
    """
    point = point_id(point_at(material, {key: twin[key] for key in design["variables"]}))
    lines = pooled_line_scatter(strength[strength["fidelity"] == "campaign"])
    scatter = pooled_scatter(repose[repose["angle_of_repose_deg"].notna()], "angle_of_repose_deg")
    heaps = repose.loc[(repose["point_id"] == point) & repose["seed"].isin(twin["repose_seeds"]), "angle_of_repose_deg"].dropna()
    line = strength[(strength["point_id"] == point) & (strength["fidelity"] == "campaign")]
    demand(
        len(heaps) > 0 and len(line) > 0, f"simulations of twin {name} that ended well", 0, "at least a heap and a strength line"
    )
    rows = []
    for response, (column, unit) in RESPONSES.items():
        if response in ERRORS:
            value, error = float(line[column].iloc[0]), float(line_errors(line, ERRORS[response], lines)[0])
        else:
            value, error = float(heaps.mean()), scatter / np.sqrt(len(heaps))
        rows.append(
            {
                "soil": name,
                "property": response,
                "value": value,
                "standard_uncertainty": error,
                "source": "synthetic twin",
                "method": f"simulated, {len(twin['repose_seeds'])} heaps, {len(twin['shear_seeds'])} specimens",
                "unit": unit,
            }
        )
    return pd.DataFrame(rows)


def twin_table(twins: dict, cases: list[dict], calibration: pd.DataFrame, posterior: pd.DataFrame, likelihoods: dict, space: Space):
    """One row per case on a twin and variable: truth, optimum, 95 % interval, and how probable a region must be to hold the truth.

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


def coverage_table(models: dict, space: Space) -> pd.DataFrame:
    """Every simulated point as a twin of its own: its responses are the targets, the surrogates do not know the point.

    One row per point that all three responses have: its variables, the credible level of the truth, and whether the 95 % region
    holds it. The hyperparameters are those of the fit to all points. Needs surrogates that can leave a point out.
    """
    unit = space.crowd(CROWD)
    keys = [{point: k for k, point in enumerate(models[name].points)} for name in RESPONSES]
    rows = []
    for point in sorted(set.intersection(*map(set, keys))):
        index = dict(zip(RESPONSES, (key[point] for key in keys), strict=True))
        left = {name: models[name].without(k) for name, k in index.items()}
        targets = {name: models[name].observed[k] for name, k in index.items()}
        noise = {name: models[name].noise[k] for name, k in index.items()}
        likelihood = Likelihood(left, space, targets, noise, dict.fromkeys(RESPONSES, 1.0))
        logs = likelihood(unit)
        truth = dict(zip(space.variables, point, strict=True))
        level = credible_level(logs, probabilities(logs), float(likelihood(np.clip(space.unit(truth), 0.0, 1.0))[0]))
        rows.append({**truth, "credible_level": level, "inside_95": bool(level <= REGION)})
    return pd.DataFrame(rows)
