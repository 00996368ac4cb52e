"""What several inference scripts share: surrogates and likelihoods from a rule's input and parameters."""

from pathlib import Path

from _tables import read_table
from calibration import from_json, likelihood_of, space_of


def models_of(files):
    """The chosen surrogates of a round."""
    return from_json(Path(files.surrogates).read_text(encoding="utf-8"))


def likelihoods_of(files, params) -> dict:
    """Case name -> its likelihood."""
    models, soils = models_of(files), read_table(files.soils, "soil")
    space, ratio = space_of(params.design), params.uncertainty["target_uncertainty_ratio"]
    return {case["case"]: likelihood_of(case, models, soils, space, ratio) for case in params.optimise["cases"]}


def optima(table, variables) -> dict[str, dict[str, float]]:
    """Case name -> values of the design variables at its optimum."""
    return {row["case"]: {name: float(row[name]) for name in variables} for _, row in table.iterrows()}
