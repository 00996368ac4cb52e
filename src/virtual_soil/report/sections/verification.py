"""The verification: predicted and simulated properties at the optima, and the gaps of the refinement rounds."""

import pandas as pd

from virtual_soil.report.items import Entry, Item
from virtual_soil.report.quantities import VARIABLES, variables_in_words
from virtual_soil.report.study import Study
from virtual_soil.report.text import number, spoken, with_error

NAME, TITLE, HEADING = "verification", "6. Simulating the answer", "6. Simulating the answer"
LINKS = {"verification": "6. Simulating the answer"}
FIGURES: dict[str, Entry] = {}
TABLES = {"verification": "Optima simulated"}


def figures(_study: Study) -> dict[str, Item]:
    """No figures."""
    return {}


def tables(study: Study) -> dict[str, pd.DataFrame]:
    """Predicted and simulated properties."""
    return {"verification": verification_table(study.tables["verification"])}


def words(study: Study) -> dict:
    """Gaps of the refinement rounds, if there are any."""
    return {"gaps": gap_table(study.rounds, study.tables["verification"]) if study.rounds else None}


def verification_table(verification: pd.DataFrame) -> pd.DataFrame:
    """Predicted and simulated properties at every optimum."""

    def with_errors(name: str) -> list[str]:
        return [with_error(v, e) for v, e in zip(verification[name], verification[f"{name}_se"], strict=True)]

    return pd.DataFrame(
        {
            "case": verification["case"],
            "property": [f"{spoken(r)} ({u})" for r, u in zip(verification["response"], verification["unit"], strict=True)],
            "target": [number(v) for v in verification["target"]],
            "predicted": with_errors("predicted"),
            "simulated": with_errors("simulated"),
            "scatter over seeds": [number(v) for v in verification["simulated_sd"]],
            "seeds": verification["n_seeds"],
            "gap": with_errors("gap"),
            "prediction": verification["prediction"],
            "simulated − target": with_errors("difference"),
            "target met": verification["match"],
        }
    )


def gap_table(rounds: list[pd.DataFrame], verification: pd.DataFrame) -> pd.DataFrame:
    """Gap between predicted and simulated at the optimum of each round; the last one is the verification's."""
    rows = []
    for k, comparison in enumerate([*rounds, verification]):
        for _, row in comparison.iterrows():
            gap = with_error(row["gap"], row["gap_se"])
            rows.append((row["case"], spoken(row["response"]), k, variables_in_words(row), number(row["predicted_se"]), gap))
    optimum = f"optimum ({', '.join(variable.symbol for variable in VARIABLES.values())})"
    columns = ["case", "property", "round", optimum, "predicted error", "simulated − predicted"]
    return pd.DataFrame(rows, columns=columns).sort_values(["case", "property", "round"], ignore_index=True)
