"""Step 3: known points of a response, both kinds of surrogate fitted to them, and the choice between the two.

The paper's polynomials are the reference; a Gaussian process is the alternative. `model` in a study's configuration names one, or
"best": the one with the smaller error at points left out, each in units of its noise.
"""

import json
from dataclasses import asdict, replace

import numpy as np
import pandas as pd

from virtual_soil.calibration.errors import CalibrationError, demand
from virtual_soil.calibration.gaussian_process import GaussianProcess, fit_process, left_out
from virtual_soil.calibration.noise import censoring, known_scatter, line_errors, scatter_at
from virtual_soil.calibration.response import Response, Responses
from virtual_soil.calibration.space import Space, space_of
from virtual_soil.calibration.surrogate import Factor, Surrogate, fit_surrogate, on_grid, on_sweep


def known_points(response: Response, tables: dict, design: dict, material: dict) -> pd.DataFrame:
    """Simulated points of a response: one row each with its variables, the response, `noise` and `point_id`.

    All points of the campaign's fidelity with the base material's other properties count, except hidden twins. `noise` is the
    standard error. Where rows are runs, it is the scatter of the repeated points around (`noise.scatter_at`) over the root of the
    point's number of seeds, and what a run of which only a bound is known leaves open. Where rows are regressions, it is their own,
    with the scatter moderated by that of all regressions.
    """
    source, column = tables[response.table], response.column
    fixed = [name for name in material if name not in design["variables"]]
    usable = (source["fidelity"] == "campaign") & source[column].notna() & (source["purposes"] != "twin")
    for name in fixed:
        usable &= np.isclose(source[name].astype(float), material[name])
    groups = source[usable].groupby("point_id", sort=False)
    points = groups[[*design["variables"], column]].mean().reset_index()
    demand(len(points) > 0, f"{response.name}: points with a result", 0, "at least one; see the failed runs' reasons")
    scatter = known_scatter(response, source)
    if response.error_column is None:
        demand(bool(np.isfinite(scatter)), f"{response.name}: points with several seeds", 0, "at least one, to know the scatter")
        local = scatter_at(response, source, space_of(design), points)
        open_ = np.array([censoring(response, rows) for _, rows in groups])
        points["noise"] = np.hypot(local / np.sqrt(groups.size().to_numpy()), open_)
    else:
        errors = line_errors(source, response.error_column, scatter)
        points["noise"] = source[usable].assign(noise=errors[usable]).groupby("point_id", sort=False)["noise"].mean().to_numpy()
    return points


def fit_all(responses: Responses, tables: dict, design: dict, material: dict, forms: dict):
    """Both surrogates of all responses.

    Returns ({response: {"quadratic": Surrogate, "gaussian_process": GaussianProcess}}, residual table); see `fit_both`.
    tables : by name, those of the responses. forms : the `surrogate` part of a configuration, by response.
    """
    models, residuals = {}, []
    for name, response in responses.items():
        points = known_points(response, tables, design, material)
        models[name], table = fit_both(response, points, design, material, forms[name])
        residuals.append(table)
    return models, pd.concat(residuals, ignore_index=True).assign(**design.get("fixed", {}))


def fit_both(response: Response, points: pd.DataFrame, design: dict, material: dict, form: dict):
    """Both surrogates of one response and the table of their residuals, in the fit and left out.

    The paper's f g needs a grid: a design without one has the Gaussian process alone.
    """
    column, gridded = response.column, bool(design["grid"])
    process = fit_process(
        response.name, response.unit, space_of(design), points[design["variables"]], points[column], points["noise"]
    )
    errors_of_process = points[column].to_numpy() - left_out(process)[0]
    in_grid = on_grid(points, design, material) if gridded else np.zeros(len(points), bool)
    # scores are compared at the points that both are fitted to
    shared = in_grid | on_sweep(points, design) if gridded else np.ones(len(points), bool)
    score = float(np.sqrt(((errors_of_process / points["noise"].to_numpy())[shared] ** 2).mean()))
    process = replace(process, cv_score=score)
    of_process = residuals_of(process, points, errors_of_process, column, design, in_grid)
    if not gridded:
        return {"gaussian_process": process}, of_process
    of_design = points[shared]
    polynomial = fit_surrogate(response, of_design, design, material, form)
    errors = polynomial_left_out(response, of_design, design, material, form)
    polynomial = with_errors(polynomial, errors, of_design["noise"].to_numpy())
    of_polynomial = residuals_of(polynomial, of_design, errors, column, design, in_grid[shared])
    return {"quadratic": polynomial, "gaussian_process": process}, pd.concat([of_polynomial, of_process])


def with_errors(surrogate: Surrogate, errors: np.ndarray, noise: np.ndarray) -> Surrogate:
    """The polynomial with its errors at left-out points; points that the fit needs (NaN) do not count."""
    known = np.isfinite(errors)
    rmse = float(np.sqrt((errors[known] ** 2).mean())) if known.any() else float("nan")
    score = float(np.sqrt(((errors[known] / noise[known]) ** 2).mean())) if known.any() else float("nan")
    return Surrogate(**{**vars(surrogate), "cv_rmse": rmse, "cv_score": score})


def polynomial_left_out(response: Response, points: pd.DataFrame, design: dict, material: dict, form: dict) -> np.ndarray:
    """Error of the whole fit at every point that is left out of it (n,); NaN where the rest does not determine it."""
    errors = []
    for k in range(len(points)):
        row = points.iloc[k]
        try:
            without = fit_surrogate(response, points.drop(index=points.index[k]), design, material, form)
            errors.append(row[response.column] - float(without.predict({name: row[name] for name in design["variables"]})))
        except CalibrationError:
            errors.append(np.nan)
    return np.array(errors)


def residuals_of(model, points: pd.DataFrame, left_out_errors, column: str, design: dict, in_grid) -> pd.DataFrame:
    """Observed and predicted response of every point that a model is fitted to."""
    predicted = model.predict({name: points[name].to_numpy() for name in design["variables"]})
    return pd.DataFrame(
        {
            "response": model.response,
            "model": model.model,
            "point_id": points["point_id"].to_numpy(),
            **{name: points[name].to_numpy() for name in design["variables"]},
            "observed": points[column].to_numpy(),
            "noise": points["noise"].to_numpy(),
            "predicted": predicted,
            "residual": points[column].to_numpy() - predicted,
            "left_out_residual": left_out_errors,
            "set": np.where(in_grid, "f", np.where(on_sweep(points, design), "g", "other")),
        }
    )


def choose(models: dict, forms: dict) -> dict:
    """The surrogate to use for each response: the configured one, or the one that is better at left-out points."""
    chosen = {}
    for response, both in models.items():
        wanted = forms[response]["model"]
        chosen[response] = both[wanted] if wanted in both else min(both.values(), key=noise_score)
    return chosen


def noise_score(model: Surrogate | GaussianProcess) -> float:
    """Left-out error in units of the noise; infinite where it is not known."""
    return model.cv_score if np.isfinite(model.cv_score) else float("inf")


def to_json(models: dict, forms: dict) -> str:
    """Both surrogates of every response, and which is chosen, as text that `from_json` reads back."""
    chosen = choose(models, forms)
    responses = {
        response: {"chosen": chosen[response].model, **{name: asdict(model) for name, model in both.items()}}
        for response, both in models.items()
    }
    return json.dumps(responses, indent=2)


def from_json(text: str, model: str = "chosen") -> dict:
    """Surrogates by response from what `to_json` wrote: the chosen ones, or all "quadratic", or all "gaussian_process".

    A design without a grid has no quadratic ones.
    """
    result: dict[str, Surrogate | GaussianProcess] = {}
    for response, entry in json.loads(text).items():
        name = entry["chosen"] if model == "chosen" else model
        if name not in entry:
            continue
        fields = dict(entry[name])
        if name == "quadratic":
            fields["g"] = {k: Factor(f["form"], f["reference"], tuple(f["coefficients"])) for k, f in fields["g"].items()}
            fields["ranges"] = {k: tuple(limits) for k, limits in fields["ranges"].items()}
            result[response] = Surrogate(**fields)
        else:
            space = fields.pop("space")
            ranges = {k: tuple(limits) for k, limits in space["ranges"].items()}
            box = Space(tuple(space["variables"]), ranges, space["offsets"], space.get("fixed", {}))
            result[response] = GaussianProcess(**{**fields, "points": tuple(map(tuple, fields["points"]))}, space=box)
    return result
