"""The real soils: their targets, and whether the design reaches them."""

from collections.abc import Mapping

import numpy as np
import pandas as pd

from virtual_soil.report import experiments
from virtual_soil.report.items import Entry, Item
from virtual_soil.report.laboratory import draw_tests
from virtual_soil.report.quantities import symbol
from virtual_soil.report.study import Study
from virtual_soil.report.text import number, spoken, with_error

NAME, TITLE, HEADING = "soils", "1. Real soils", "1. The real soils"
LINKS = {"soils": "1. Soils"}
FIGURES = {"laboratory": Entry("Shear tests of the laboratory, and the readings that count")}
TABLES = {"soils": "Table 1: targets", "reachability": "Targets within reach"}


def figures(study: Study) -> dict[str, Item]:
    """The laboratory's shear tests, if soils have any."""
    if not study.laboratory:
        return {}
    readings = [tests.readings.assign(soil=soil) for soil, tests in study.laboratory.items()]
    alt = f"Shear stress over displacement of the laboratory's tests of {', '.join(study.laboratory)}, and their strength lines"
    return {"laboratory": Item(draw_tests(study.laboratory), pd.concat(readings), alt)}


def tables(study: Study) -> dict[str, pd.DataFrame]:
    """Targets and ranges."""
    return {
        "soils": soil_table(study.tables["soil"][study.tables["soil"]["property"].isin(study.responses)]),
        "reachability": reachability_table(study.tables["reachability"]),
    }


def words(study: Study) -> dict:
    """Remarks on targets out of reach."""
    return {"remarks": reach_remarks(study.tables["reachability"]) + experiments.remarks(NAME, study)}


def soil_table(soils: pd.DataFrame) -> pd.DataFrame:
    """Table 1."""
    values = zip(soils["value"], soils["standard_uncertainty"], soils["unit"], strict=True)
    return pd.DataFrame(
        {
            "soil": soils["soil"],
            "property": soils["property"].map(spoken),
            "value": [f"{with_error(value, error)} {unit}" for value, error, unit in values],
            "method": soils["method"],
            "source": soils["source"],
        }
    )


def reachability_table(table: pd.DataFrame) -> pd.DataFrame:
    """Targets and the ranges of simulations and surrogates."""
    return pd.DataFrame(
        {
            "soil": table["soil"],
            "property": table["response"].map(spoken),
            "target": [number(v) for v in table["target"]],
            "simulated": ranges(table, "simulated"),
            "surrogate over the design": ranges(table, "predicted"),
            "reachable": np.where(table["reachable"], "yes", "no"),
        }
    )


def ranges(table: pd.DataFrame, kind: str) -> list[str]:
    """Lowest to highest value."""
    return [f"{number(a)} to {number(b)}" for a, b in zip(table[f"lowest_{kind}"], table[f"highest_{kind}"], strict=True)]


def reach_remarks(table: pd.DataFrame) -> list[str]:
    """One sentence per target out of reach."""
    return [reach_remark(row) for _, row in table[~table["reachable"]].iterrows()]


def reach_remark(row: Mapping) -> str:
    """The range of the design and the nearest reachable value."""
    return (
        f"The {spoken(row['response'])} of {row['soil']}, {row['target']:g}, is out of reach: the design gives "
        f"{number(row['lowest_predicted'])} to {number(row['highest_predicted'])}. Nearest: {number(row['nearest_reachable'])}; "
        f"beyond it the response would go on with {signed_symbols(row['grows_with'])}."
    )


def signed_symbols(changes: str) -> str:
    """Signed names of variables as signed symbols."""
    return ", ".join(change[0] + symbol(change[1:]) for change in changes.split(", ") if change)
