"""Surrogates, likelihoods and tables from the input and parameters of a rule, for the inference scripts."""

from collections.abc import Callable
from pathlib import Path

import pandas as pd

from virtual_soil.calibration.models import from_json
from virtual_soil.calibration.optimise import combined_scale, relative_scale
from virtual_soil.calibration.space import space_of
from virtual_soil.calibration.uncertainty import likelihood_of
from virtual_soil.campaign.experiments.registry import responses_of
from virtual_soil.campaign.tables import ADVICE, UNREADABLE, TableError, one_line, read_all, read_table


def read_models(path: str, model: str = "chosen") -> dict:
    """Read the surrogates by response from the output of rule fit_surrogates; `model` as in `calibration.from_json`.

    Raises TableError, naming the file, for any other content.
    """
    try:
        return from_json(Path(path).read_text(encoding="utf-8"), model)
    except (*UNREADABLE, AttributeError) as error:
        raise TableError(f"{path}: not the surrogates of a study ({one_line(error)}). {ADVICE}") from error


def read_tables(paths) -> dict[str, pd.DataFrame]:
    """Tables by the name of their files; several files of one name, those of several rounds, make one table."""
    found: dict[str, list[str]] = {}
    for path in paths:
        found.setdefault(Path(path).stem, []).append(path)
    return {name: read_all(files, name) for name, files in found.items()}


def likelihoods_of(files, params) -> dict:
    """Return case name -> likelihood."""
    models, soils, responses = read_models(files.surrogates), read_table(files.soils, "soil"), responses_of(params.experiments)
    space, ratio = space_of(params.design), params.uncertainty["target_uncertainty_ratio"]
    return {case["case"]: likelihood_of(case, responses, models, soils, space, ratio) for case in params.optimise["cases"]}


def scale_of(errors: str, ratio: float, floors: dict[str, float]) -> Callable:
    """Return the scale of the objectives that the setting `optimise.errors` names; ratio, floors : see `combined_scale`."""
    return {"relative": relative_scale, "combined": combined_scale(ratio, floors)}[errors]


def optima(table, variables) -> dict[str, dict[str, float]]:
    """Return case name -> values of the design variables at its optimum."""
    return {row["case"]: {name: float(row[name]) for name in variables} for _, row in table.iterrows()}
