"""The optimisation: optima on all surrogates beside the paper's, distinct minima, and iterations."""

from collections.abc import Mapping

import pandas as pd
from matplotlib.figure import Figure

from virtual_soil.calibration import paper
from virtual_soil.calibration.response import Responses
from virtual_soil.report.items import Entry, Item
from virtual_soil.report.plots import COLOURS, canvas
from virtual_soil.report.quantities import header, shown_in, variable_cells
from virtual_soil.report.study import Study
from virtual_soil.report.text import number, spoken

NAME, TITLE, HEADING = "optimisation", "4. Optimisation", "4. Optimisation"
LINKS = {"optimisation": "4. Optimisation"}
FIGURES = {"iterations": Entry("Iterations")}
TABLES = {"optimisation": "Optima beside the paper's", "minima": "Distinct minima"}

#: Surrogates that an optimum was found on.
SOURCES = {"ours": "ours", "polynomial": "f·g on our simulations", "published": "published f·g"}
LINE_STYLES = {"ours": "-", "polynomial": "-.", "published": "--"}
#: Decimals of a response in the table of optima, by its unit.
DIGITS = {"Pa": 0, "deg": 1}
STATUS = {True: "converged", False: "not converged", None: "–"}


def figures(study: Study) -> dict[str, Item]:
    """Cost over iterations."""
    table = study.tables["iterations"]
    return {"iterations": Item(iterations(table), table, "Cost over iterations")}


def tables(study: Study) -> dict[str, pd.DataFrame]:
    """Optima and minima."""
    return {
        "optimisation": optimisation_table(study),
        "minima": minima_table(study.tables["minima"], study.responses),
    }


def words(_study: Study) -> dict:
    """No further text."""
    return {}


def iterations(history: pd.DataFrame) -> Figure:
    """Cost over Gauss-Newton iterations for every case and every kind of surrogate."""
    figure, (axes,) = canvas()
    for k, ((case, source), run) in enumerate(history.groupby(["case", "surrogate"], sort=False)):
        style = {"color": COLOURS[k % len(COLOURS)], "label": f"{case} ({source})"}
        axes.semilogy(run["iteration"], run["cost"], LINE_STYLES[source], **style)
    axes.set_xlabel("Gauss–Newton iteration")
    axes.set_ylabel("cost")
    axes.legend(fontsize="small")
    return figure


def optimisation_table(study: Study) -> pd.DataFrame:
    """All optima, and those that the paper prints where the study is the paper's."""
    calibration, responses = study.tables["calibration"], study.responses
    rows = [optimum_row(row, responses) for _, row in calibration.iterrows()]
    if set(study.as_printed) == set(responses):
        rows += [
            printed_row(case, printed, responses) for case, printed in paper.OPTIMA.items() if case in set(calibration["case"])
        ]
    order = {case: k for k, case in enumerate(dict.fromkeys(calibration["case"]))}
    headers = [*map(header, shown_in(calibration).values()), *map(header, responses.values())]
    columns = ["case", "source", *headers, "cost", "iterations", "Gauss–Newton"]
    return pd.DataFrame(sorted(rows, key=lambda row: order.get(row[0], len(order))), columns=columns)


def optimum_row(row: Mapping, responses: Responses) -> tuple:
    """An optimum of ours."""
    end = number(row["cost"], 5), row["iterations"], spoken(row["status"])
    return row["case"], SOURCES[row["surrogate"]], *optimum_cells(row, responses), *end


def printed_row(case: str, printed: Mapping, responses: Responses) -> tuple:
    """An optimum that the paper prints."""
    end = "–", printed["iterations"] or "–", STATUS[printed["converged"]]
    return case, "printed in the paper", *optimum_cells(printed, responses), *end


def optimum_cells(row: Mapping, responses: Responses) -> list[str]:
    """Parameters and properties of one optimum."""
    return [*variable_cells(row), *(number(row.get(r.column), DIGITS.get(r.unit, 1)) for r in responses.values())]


def minima_table(minima: pd.DataFrame, responses: Responses) -> pd.DataFrame:
    """Every distinct minimum of our surrogates."""
    ours = minima[minima["surrogate"] == "ours"]
    return pd.DataFrame(
        {
            "case": ours["case"],
            **{header(v): [number(x, v.digits + 1, v.scale) for x in ours[name]] for name, v in shown_in(ours).items()},
            **{header(response): [number(x) for x in ours[response.column]] for response in responses.values()},
            "cost": [number(v, 5) for v in ours["cost"]],
            "at an edge": ours["at_bound"].str.replace(",", ", "),
            "condition": [f"{v:.2g}" for v in ours["condition_number"]],
        }
    )
