"""Figures and tables of the report: name -> (section of the method, title). Captions: captions/<name>.rst."""

from collections.abc import Collection
from pathlib import Path

from snakemake.io import report

from virtual_soil.campaign.experiments.registry import RESPONSES
from virtual_soil.report.curves import sheared_test
from virtual_soil.report.experiments import EXPERIMENTS
from virtual_soil.report.sections import SECTIONS, answer
from virtual_soil.report.study import offers

FOLDER = Path(__file__).resolve().parent
CAPTIONS = FOLDER / "captions"
ANSWER = answer.TITLE

ENTRIES = {name: entry for section in SECTIONS for name, entry in section.FIGURES.items()}
FIGURES = {name: (section.TITLE, entry.title) for section in SECTIONS for name, entry in section.FIGURES.items()}
TABLES = {name: (section.TITLE, title) for section in SECTIONS for name, title in section.TABLES.items()}
#: Files that the page is made of, beside the code.
PAGE = ("template.html.j2", "report.css", "views.js", *(f"sections/{section.NAME}.html.j2" for section in SECTIONS))


def figure_names(config: dict, laboratory: Collection[str] = ()) -> list[str]:
    """The figures of a study: not those of experiments that it does not have; laboratory : names of its soils that have curves."""
    others = [experiment for experiment in EXPERIMENTS if experiment.NAME not in config["experiments"]]
    absent = {name for experiment in others for name in (*experiment.FIGURES, *experiment.RESPONSES)}
    absent |= set() if laboratory else {"laboratory"}
    absent |= {name for name, response in RESPONSES.items() if response.optional and name not in config["experiments"]}
    compared = {case["soil"] for case in config["optimise"]["cases"]} & set(laboratory)
    offered = {"", *offers(config), *(["curves"] if compared and sheared_test(config) else [])}
    return [name for name, entry in ENTRIES.items() if name not in absent and entry.needs in offered]


def caption(name: str) -> str:
    """The caption of a figure or table, on one line."""
    return " ".join((CAPTIONS / f"{name}.rst").read_text(encoding="utf-8").split())


def marked(path: str, section: str, title: str):
    """A file of the report that `snakemake --report` shows too, with its caption, under its section and title."""
    return report(path, caption=str(CAPTIONS / f"{Path(path).stem}.rst"), category=section, labels={"shows": title})
