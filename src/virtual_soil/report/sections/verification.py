"""The verification: predicted and simulated properties at the optima, and the gaps of the refinement rounds."""

import numpy as np
import pandas as pd

from virtual_soil.calibration.noise import error_of_mean, scatter_at
from virtual_soil.calibration.space import space_of
from virtual_soil.calibration.verify import UNASKED
from virtual_soil.report.curves import curves_at, draw_beside, sheared_test
from virtual_soil.report.items import Entry, Item
from virtual_soil.report.quantities import header, shown_in, variables_in_words
from virtual_soil.report.study import Study, known_points
from virtual_soil.report.text import number, spoken, with_error

NAME, TITLE, HEADING = "verification", "6. Simulating the answer", "6. Simulating the answer"
LINKS = {"verification": "6. Simulating the answer"}
FIGURES = {"curves": Entry("Shear curves: laboratory, and simulated at the optimum", needs="curves")}
TABLES = {"verification": "Optima simulated", "best": "Best simulated points"}
#: Simulated points listed for every case.
N_BEST = 5


def figures(study: Study) -> dict[str, Item]:
    """Shear curves beside the laboratory's, for the first case whose soil has some."""
    experiment, ours = sheared_test(study.config), study.tables["calibration"].query("surrogate == 'ours'")
    with_curves = ours[ours["soil"].isin(list(study.laboratory))]
    if with_curves.empty or experiment is None:
        return {}
    optimum = with_curves.iloc[0]
    tests, simulated = study.laboratory[optimum["soil"]], curves_at(study, optimum)
    alt = f"Shear stress over normal stress: tests of the laboratory beside those simulated at the optimum of {optimum['case']}"
    return {"curves": Item(draw_beside(tests, simulated, experiment), simulated, alt)}


def tables(study: Study) -> dict[str, pd.DataFrame]:
    """Predicted and simulated properties, and the simulated points nearest to the targets."""
    return {"verification": verification_table(study.tables["verification"]), "best": best_table(study)}


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


def best_table(study: Study) -> pd.DataFrame:
    """The simulated points nearest to the targets of each case, whatever a surrogate says.

    Distance: root mean square, over the case's targets, of the difference between the mean of the simulations and the target, in
    units of the target's standard uncertainty and the simulation's together.
    """
    points, rows = simulated_points(study), []
    for case in study.config["optimise"]["cases"]:
        lines = study.tables["verification"]
        lines = lines[(lines["case"] == case["case"]) & (lines["match"] != UNASKED)]
        squares = [
            ((points[line["response"]] - line["target"]) / np.hypot(points[f"{line['response']}_se"], line["target_se"])) ** 2
            for _, line in lines.iterrows()
        ]
        distance = np.sqrt(sum(squares) / max(len(squares), 1)) if squares else pd.Series(np.nan, index=points.index)
        for place in distance.dropna().nsmallest(N_BEST).index:
            point = points.loc[place]
            where = [number(point[name], variable.digits + 1, variable.scale) for name, variable in study.variables.items()]
            found = [with_error(point[name], point[f"{name}_se"]) for name in study.responses]
            rows.append((spoken(case["case"]), number(distance[place]), *where, *found))
    columns = [*map(header, study.variables.values()), *(header(response) for response in study.responses.values())]
    return pd.DataFrame(rows, columns=["case", "distance", *columns])


def simulated_points(study: Study) -> pd.DataFrame:
    """Variables of every simulated point of all stages, mean and standard error of each response; point_id is the index."""
    parts, places = [], []
    for name, response in study.responses.items():
        table = known_points(study.every, response)
        table = table[table["purposes"] != "twin"]  # hidden soils
        space, groups = space_of(study.config["design"]), table.groupby("point_id")
        scatter = {
            point: float(scatter_at(response, study.tables[response.table], space, rows.iloc[0])[0]) for point, rows in groups
        }
        errors = pd.Series({point: error_of_mean(response, rows, scatter[point], len(rows)) for point, rows in groups})
        parts.append(pd.DataFrame({name: groups[response.column].mean(), f"{name}_se": errors}))
        places.append(groups[list(study.variables)].first())
    where = pd.concat(places)
    return pd.concat([where[~where.index.duplicated()], *parts], axis=1)


def gap_table(rounds: list[pd.DataFrame], verification: pd.DataFrame) -> pd.DataFrame:
    """Gap between predicted and simulated at the optimum of each round; the last one is the verification's."""
    rows = []
    for k, comparison in enumerate([*rounds, verification]):
        for _, row in comparison.iterrows():
            gap = with_error(row["gap"], row["gap_se"])
            rows.append((row["case"], spoken(row["response"]), k, variables_in_words(row), number(row["predicted_se"]), gap))
    optimum = f"optimum ({', '.join(variable.symbol for variable in shown_in(verification).values())})"
    columns = ["case", "property", "round", optimum, "predicted error", "simulated − predicted"]
    return pd.DataFrame(rows, columns=columns).sort_values(["case", "property", "round"], ignore_index=True)
