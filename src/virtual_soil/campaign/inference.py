"""Surrogates, likelihoods and tables from a rule's input and parameters, for the inference scripts."""

from pathlib import Path

import pandas as pd

from virtual_soil.calibration import from_json, likelihood_of, space_of
from virtual_soil.calibration.mohr_coulomb import lines
from virtual_soil.campaign.experiments import RESPONSES
from virtual_soil.campaign.tables import ADVICE, UNREADABLE, TableError, one_line, read_table


def read_models(path: str, model: str = "chosen") -> dict:
    """The surrogates by response in a file that rule fit_surrogates wrote; `model` as in `calibration.from_json`.

    Raises TableError, naming the file, for anything else.
    """
    try:
        return from_json(Path(path).read_text(encoding="utf-8"), model)
    except (*UNREADABLE, AttributeError) as error:
        raise TableError(f"{path}: not the surrogates of a study ({one_line(error)}). {ADVICE}") from error


def response_tables(read, files) -> dict:
    """Tables of the responses by name; read(path or paths, name) reads one, from the rule's input of the same name."""
    return {name: read(files[name], name) for name in dict.fromkeys(response.table for response in RESPONSES.values())}


def values_by_seed(tables: dict, strength: str, normal_stress: str) -> dict[str, pd.DataFrame]:
    """Values of each response, a row for each point and seed; the shear tests of each seed make a strength line."""
    found = lines(tables["shear"], ["point_id", "seed"], strength, normal_stress)
    strength_lines = pd.DataFrame(
        [{"point_id": runs["point_id"].iloc[0], **vars(line)} for runs, line in found],
        columns=["point_id", *(response.column for response in RESPONSES.values() if response.table == "strength")],
    )
    own = {"strength": strength_lines}
    return {name: own.get(response.table, tables[response.table]) for name, response in RESPONSES.items()}


def likelihoods_of(files, params) -> dict:
    """Case name -> its likelihood."""
    models, soils = read_models(files.surrogates), read_table(files.soils, "soil")
    space, ratio = space_of(params.design), params.uncertainty["target_uncertainty_ratio"]
    return {case["case"]: likelihood_of(case, RESPONSES, models, soils, space, ratio) for case in params.optimise["cases"]}


def optima(table, variables) -> dict[str, dict[str, float]]:
    """Case name -> values of the design variables at its optimum."""
    return {row["case"]: {name: float(row[name]) for name in variables} for _, row in table.iterrows()}
