"""The page of the report: all sections of a finished study, with their figures, tables and interactive views."""

import base64
import json
from dataclasses import dataclass

import jinja2
import pandas as pd
import plotly
import yaml
from plotly.offline import get_plotlyjs

from virtual_soil.calibration.paper import published
from virtual_soil.campaign.experiments.registry import BY_NAME
from virtual_soil.campaign.study import experiment_settings
from virtual_soil.report import pack, plots, views
from virtual_soil.report.contents import ENTRIES, FOLDER, caption
from virtual_soil.report.experiments import measured_in, of_study, runs
from virtual_soil.report.items import Item
from virtual_soil.report.quantities import axis_label, enumerated
from virtual_soil.report.sections import SECTIONS
from virtual_soil.report.study import Study, known_points, offers


@dataclass(frozen=True)
class Report:
    """The page, and its contents as separate files: SVG and data of each figure, each table."""

    html: str
    figures: dict[str, str]
    data: dict[str, pd.DataFrame]
    tables: dict[str, pd.DataFrame]


def build(study: Study, versions: dict) -> Report:
    """The report on a finished study."""
    items = {name: item for section in SECTIONS for name, item in section.figures(study).items()}
    tables = {name: table for section in SECTIONS for name, table in section.tables(study).items()}
    figures = {name: plots.svg(item.figure) for name, item in items.items()}
    # Wall time differs from run to run and is shown in no figure: the data of a figure are reproducible without it.
    data = {name: item.data.drop(columns="wall_time_s", errors="ignore") for name, item in items.items()}
    html = template().render(
        **words_of(study),
        **data_of(study, data),
        versions={**versions, "plotly": plotly.__version__},
        tables={name: {"frame": frame, "caption": caption(name)} for name, frame in tables.items()},
        figures={name: shown(name, item, figures[name]) for name, item in items.items()},
    )
    return Report(html, figures, data, tables)


def template() -> jinja2.Template:
    """The page's template, which includes one of each section."""
    environment = jinja2.Environment(loader=jinja2.FileSystemLoader(FOLDER), autoescape=True, trim_blocks=True)
    return environment.get_template("template.html.j2")


def words_of(study: Study) -> dict:
    """Text of the page: the sections' own, and that of its head and its end."""
    return {
        "study": study.config["study"],
        "responses": enumerated([f"{response.words} {response.symbol}" for response in study.wanted.values()]),
        "cost": cost_sentence(study),
        "sections": [{"module": section, "words": section.words(study)} for section in SECTIONS],
        "engine": study.engine,
        "configuration": yaml.safe_dump(study.config, sort_keys=False),
    }


def data_of(study: Study, data: dict[str, pd.DataFrame]) -> dict:
    """Data of interactive views and of figures, and the code that draws them, all packed."""
    flat, grains, note = views_of(study)
    return {
        "grains_note": note,
        "plotly": pack.packed_bytes(get_plotlyjs().encode()),
        "views": pack.packed_json(flat),
        "grains": embedded_json(grains),
        "csv": embedded_json({name: pack.packed_bytes(csv(table).encode()) for name, table in data.items()}),
    }


def shown(name: str, item: Item, svg: str) -> dict:
    """A figure for the template."""
    image = base64.b64encode(svg.encode()).decode()
    return {"entry": ENTRIES[name], "caption": caption(name), "alt": item.alt, "image": image}


def csv(table: pd.DataFrame) -> str:
    """A table as CSV."""
    return table.to_csv(index=False, float_format="%.6g", lineterminator="\n")


def embedded_json(value) -> str:
    """JSON that may stand in a script element."""
    return json.dumps(value, separators=(",", ":")).replace("<", "\\u003c")


def views_of(study: Study) -> tuple[dict, dict, str]:
    """Data of flat views, data of views of grains, and a sentence on the simulations that the 3D view offers."""
    rows = runs(study).drop_duplicates(["simulation_id", "point_id"])
    rows = views.labelled(rows, study.config["material"], study.tables["calibration"])
    tests, note = views.grain_view(rows, study.states, periods_m(study.config, rows), facts_of(study))
    flat: dict = {}
    grains = {"tests": tests, "specimens": specimens(study.config)}
    for experiment in of_study(study.config):
        flat |= experiment.views(study, rows)
        grains |= experiment.packed_views(study)
    return flat | (response_views(study) if "plane" in offers(study.config) else {}), grains, note


def periods_m(config: dict, rows: pd.DataFrame) -> dict[str, float]:
    """Simulation -> period of its box along y."""
    tests = {experiment.NAME: experiment for experiment in of_study(config)}
    return {
        row["simulation_id"]: tests[row["experiment"]].period_m(experiment_settings(config, row)["setup"])
        for _, row in rows.iterrows()
    }


def facts_of(study: Study) -> dict[str, str]:
    """Simulation -> what was measured in it, in a few words."""
    return {
        row["simulation_id"]: test.facts(row) for test in of_study(study.config) for _, row in study.every[test.NAME].iterrows()
    }


def specimens(config: dict) -> dict[str, dict]:
    """Experiment -> words for its specimen, position of the camera, and True if it is seen edge on."""
    return {test.NAME: {"words": test.SPECIMEN, "eye": test.EYE, "flat": test.FLAT} for test in of_study(config)}


def response_views(study: Study) -> dict:
    """Response surfaces and curves of equal response."""
    tables = study.tables
    radii = views.shown_radii(study.config["design"], tables["calibration"])
    kinds = {"ours": study.models["chosen"], "polynomial": views.others(study.models["quadratic"], study.models["chosen"])}
    if set(study.as_printed) == set(study.responses):
        kinds["published"] = published()
    points = {name: known_points(study.every, response) for name, response in study.responses.items()}
    return {
        "responses": {response.name: axis_label(response.name) for response in measured_in(study.config)},
        "surfaces": views.surface_view(kinds, radii, points),
        "iso": views.iso_view(tables["calibration"], tables["posterior"], tables["equivalents"], radii),
    }


def cost_sentence(study: Study) -> str:
    """Number of simulations, grain-steps and core-minutes."""
    table = runs(study).drop_duplicates("simulation_id")
    counts = [f"{(table['experiment'] == test.NAME).sum()} {BY_NAME[test.NAME].NOUNS[1]}" for test in of_study(study.config)]
    steps, minutes = float((table["n_steps"] * table["n_particles"]).sum()), table["wall_time_s"].sum() / 60.0
    return f"{enumerated(counts)}: {steps:.2g} grain-steps in {minutes:.1f} core-minutes."
