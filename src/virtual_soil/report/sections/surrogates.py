"""Virtual tests and surrogates: what was simulated, the surrogates fitted to it, and their errors."""

from collections.abc import Collection, Mapping

import pandas as pd

from virtual_soil.calibration.paper import published
from virtual_soil.campaign.design import DESIGNED
from virtual_soil.report import experiments, response_plots
from virtual_soil.report.experiments import EXPERIMENTS, measured, measured_in, of_study
from virtual_soil.report.items import Entry, Item
from virtual_soil.report.quantities import enumerated, symbol
from virtual_soil.report.study import Study, known_points, offers
from virtual_soil.report.text import number, spoken, with_error

NAME, TITLE = "surrogates", "3. Virtual tests and surrogates"
HEADING = TITLE
LINKS = {"surrogates": "3. Tests and surrogates", "grains": "Look at the grains"}
#: A cross-validation error beyond this multiple of the noise means that the surrogate misses something.
POOR_SCORE = 3.0


def response_title(words: str, paper_figure: str | None) -> str:
    """Title of a response's figure, with the number that it has in the paper."""
    return f"{paper_figure}: {words}" if paper_figure else words.capitalize()


FIGURES = {
    **{name: entry for experiment in EXPERIMENTS for name, entry in experiment.FIGURES.items()},
    **{
        response.name: Entry(response_title(response.words, figure), needs="grid")
        for response, figure in measured(EXPERIMENTS).items()
    },
    "surfaces": Entry(
        "Response surfaces",
        view="surfaces",
        hint="Choose response, surrogate and radius; the paper's own surrogate is among them.",
        needs="plane",
    ),
    "radius_sweep": Entry("Radius sweep", needs="sweep"),
    "slices": Entry("Responses over each variable", needs="filling"),
    "parity": Entry("Predicted against simulated"),
    "residuals": Entry("Errors at left-out points", needs="grid"),
}
TABLES = {
    "equation": "Equation 3: coefficients",
    "quality": "Errors of the surrogates",
    "sensitivity": "Sobol indices",
}


def figures(study: Study) -> dict[str, Item]:
    """Figures of every experiment, of every response, and of all responses together."""
    items = {name: item for experiment in of_study(study.config) for name, item in experiment.figures(study).items()}
    return items | response_figures(study)


def tables(study: Study) -> dict[str, pd.DataFrame]:
    """Coefficients, errors and Sobol indices."""
    return {
        "equation": equation_table(study.models["quadratic"], study.as_printed),
        "quality": quality_table({kind: study.models[kind] for kind in ("quadratic", "gaussian_process")}),
        "sensitivity": sensitivity_table(study.tables["sensitivity"]),
    }


def words(study: Study) -> dict:
    """Figures in their order, and the limits of the surrogates."""
    tests = of_study(study.config)
    return {
        "experiments": tests,
        "specimens": " or ".join(experiment.SPECIMEN for experiment in tests),
        "since": ", or ".join(dict.fromkeys(experiment.DISPLACED_SINCE for experiment in tests)),
        "responses": [response.name for response in measured_in(study.config)],
        "polynomials": bool(study.models["quadratic"]),
        "remarks": [*experiments.remarks(NAME, study), *fit_remarks(study.models["chosen"])],
    }


def response_figures(study: Study) -> dict[str, Item]:
    """Responses over the variables of the design, as far as it allows, and the surrogates' errors."""
    known = {name: known_points(study.tables, response) for name, response in study.responses.items()}
    offered, chosen, radius_m = offers(study.config), study.models["chosen"], study.config["material"]["radius_m"]
    names = enumerated([response.words for response in study.responses.values()])
    points = {name: of_purpose(table, *DESIGNED) for name, table in known.items()}
    items = {
        "parity": Item(
            response_plots.parity(study.residuals, chosen),
            study.residuals,
            f"{names}: predicted without the point against simulated".capitalize(),
        )
    }
    if "plane" in offered:
        items["surfaces"] = Item(
            response_plots.surfaces(points, chosen, radius_m),
            pd.concat(list(points.values())),
            f"{names} as surfaces over static and rolling friction".capitalize(),
        )
    if "grid" in offered:
        items |= {
            response.name: response_figure(study, response.name, points[response.name]) for response in measured_in(study.config)
        }
        items["residuals"] = Item(
            response_plots.residual_map(study.residuals, radius_m),
            study.residuals,
            "Errors of both surrogates at left-out points of the friction grid",
        )
    if "sweep" in offered:
        items |= radius_figure(study, {name: of_purpose(table, "sweep") for name, table in known.items()}, names)
    if "filling" in offered:
        ours = study.tables["calibration"].query("surrogate == 'ours'")
        items["slices"] = Item(
            response_plots.slices(points, chosen, ours, list(study.config["design"]["variables"])),
            pd.concat(list(points.values())),
            f"{names} over each variable, the others as at the optima".capitalize(),
        )
    return items


def of_purpose(table: pd.DataFrame, *purposes: str) -> pd.DataFrame:
    """Rows that were simulated for one of the purposes."""
    return table[[bool(set(purposes) & set(text.split(","))) for text in table["purposes"]]]


def radius_figure(study: Study, sweeps: Mapping[str, pd.DataFrame], names: str) -> dict[str, Item]:
    """Responses over the radius."""
    figure = response_plots.radius_sweep(sweeps, study.models["quadratic"])
    return {"radius_sweep": Item(figure, pd.concat(list(sweeps.values())), f"{names} over the radius".capitalize())}


def response_figure(study: Study, name: str, grid: pd.DataFrame) -> Item:
    """A response over the friction grid, with the paper's surrogate if the paper shows it."""
    response, radius_m = study.responses[name], study.config["material"]["radius_m"]
    fits = {"chosen": study.models["chosen"][name], "polynomial": study.models["quadratic"][name]}
    printed = published().get(name) if measured(EXPERIMENTS)[response] and name in study.as_printed else None
    return Item(
        response_plots.response_lines(grid, response, fits, radius_m, printed),
        grid,
        f"{response.words} over static friction, a line for each rolling friction",
    )


def equation_table(surrogates: Mapping, as_printed: Collection[str]) -> pd.DataFrame:
    """Coefficients of f and g in Pa and degrees, beside the printed ones of the responses in as_printed."""
    printed, rows = {name: surrogate for name, surrogate in published().items() if name in as_printed}, []
    for name, surrogate in surrogates.items():
        rows += [(spoken(name), *row) for row in f_rows(surrogate, printed.get(name))]
        rows += [(spoken(name), *row) for row in g_rows(surrogate, printed.get(name))]
    table = pd.DataFrame(rows, columns=["response", "term", "ours", "paper's"])
    return table if printed else table.drop(columns="paper's")


def f_rows(surrogate, printed) -> list[tuple[str, str, str]]:
    """Coefficients of f."""
    theirs = {}
    if printed and surrogate.grid_variables == printed.grid_variables:
        theirs = dict(zip(printed.powers, printed.coefficients, strict=True))
    return [
        (f"f: {monomial(surrogate.grid_variables, powers)}", number(value, 2), number(theirs.get(tuple(powers)), 2))
        for powers, value in zip(surrogate.powers, surrogate.coefficients, strict=True)
    ]


def monomial(names, powers) -> str:
    """A monomial for a table."""
    parts = [symbol(name) + ("²" if power == 2 else "") for name, power in zip(names, powers, strict=True) if power]
    return "·".join(parts) or "1"


def g_rows(surrogate, printed) -> list[tuple[str, str, str]]:
    """Coefficients of g."""
    rows = []
    for variable, factor in surrogate.g.items():
        theirs = printed.g.get(variable) if printed else None
        comparable = theirs is not None and theirs.form == factor.form
        terms = ("1", "x", "x²") if factor.form == "quadratic" else ("−ln x",)
        reference = f"x = {variable.removesuffix('_m')}/{factor.reference:g}"
        for k, term in enumerate(terms):
            other = theirs.coefficients[k] if theirs is not None and comparable else None
            rows.append((f"g: {term}, {reference}", number(factor.coefficients[k], 3), number(other, 3)))
    return rows


def quality_table(models: Mapping[str, Mapping]) -> pd.DataFrame:
    """Errors of both kinds of surrogate: {kind: {response: model}}."""
    rows = [quality_row(kind, model) for kind, surrogates in models.items() for model in surrogates.values()]
    return pd.DataFrame(rows).sort_values("response", kind="stable", ignore_index=True)


def quality_row(kind: str, model) -> dict[str, str]:
    """Errors of a surrogate."""
    return {
        "response": spoken(model.response),
        "surrogate": spoken(kind),
        "points": model.n_points,
        "R² of f": number(getattr(model, "r_squared", None), 3),
        "error, left out": f"{number(model.cv_rmse, 2)} {model.unit}",
        "in units of the noise": number(model.cv_score, 2),
        "in units of its own error": number(getattr(model, "cv_calibration", None), 2),
    }


def sensitivity_table(table: pd.DataFrame) -> pd.DataFrame:
    """Sobol indices."""
    return pd.DataFrame(
        {
            "response": table["response"].map(spoken),
            "variable": table["variable"].map(symbol),
            "alone": [with_error(v, e, 2) for v, e in zip(table["first_order"], table["first_order_ci95"], strict=True)],
            "alone and with others": [with_error(v, e, 2) for v, e in zip(table["total"], table["total_ci95"], strict=True)],
            "response's spread over the design": [number(v) for v in table["response_sd"]],
        }
    )


def fit_remarks(chosen: Mapping) -> list[str]:
    """The surrogates that the optimiser uses, and those with large errors."""
    used = "; ".join(f"{spoken(name)}: {spoken(model.model)}" for name, model in chosen.items())
    poor = {name: model.cv_score for name, model in chosen.items() if model.cv_score > POOR_SCORE}
    return [
        f"The optimiser uses, for {used}.",
        *(
            f"The surrogate of the {spoken(name)} misses left-out points by {score:.1f} times their noise."
            for name, score in poor.items()
        ),
    ]
