"""What the report says and draws about each virtual test: a module per test, of the name that the campaign lists.

Every module declares the names in DECLARED:

- NAME, as in the configuration; TITLE, its heading; SPECIMEN, a simulation in words;
- RESPONSES that it measures -> the paper's figure of the response with its surrogate, or None;
- FIGURES, name -> `Entry`, and figures(study), name -> `Item`;
- views(study, rows), name -> data of interactive views, and packed_views(study), the same for views of grains;
- period_m(setup), the period of its simulation box along y in m, 0 if there is none;
- EYE, position of the camera in the 3D view, FLAT, True if the specimen is seen edge on, and DISPLACED_SINCE, the start of the
  displacements shown there;
- SHEARED, the column of its history over which it is sheared, factor to the printed unit and words, or (); SOLID_FRACTIONS,
  columns of solid fractions -> the soil's state in words;
- STAGE that is filmed, colour(grains), title(frame, row, settings) and CUT, True if the film shows the half behind the plane y = 0;
- REMARKS, name of a section -> function from the study to its sentences on this test; ASSUMPTIONS.
"""

from collections.abc import Iterable
from importlib import import_module
from types import ModuleType

import pandas as pd

from virtual_soil.calibration.response import Response
from virtual_soil.campaign.experiments import registry
from virtual_soil.report.study import Study

DECLARED = (
    *("NAME", "TITLE", "SPECIMEN", "RESPONSES", "FIGURES", "EYE", "FLAT", "DISPLACED_SINCE", "STAGE", "CUT", "REMARKS"),
    *("ASSUMPTIONS", "SHEARED", "SOLID_FRACTIONS", "figures", "views", "packed_views", "period_m", "colour", "title", "facts"),
)


def module_of(experiment: str) -> str:
    """Full name of the module on an experiment."""
    return f"{__name__}.{experiment}"


EXPERIMENTS: tuple[ModuleType, ...] = tuple(
    import_module(module_of(experiment.NAME)) for experiment in reversed(registry.EXPERIMENTS)
)


def of_study(config: dict) -> tuple[ModuleType, ...]:
    """Modules on the experiments of a study."""
    return tuple(experiment for experiment in EXPERIMENTS if experiment.NAME in config["experiments"])


def measured(experiments: Iterable[ModuleType]) -> dict[Response, str | None]:
    """Every response in the order of the experiments -> the paper's figure of it, if there is one."""
    return {registry.RESPONSES[name]: figure for experiment in experiments for name, figure in experiment.RESPONSES.items()}


def measured_in(config: dict) -> list[Response]:
    """Responses of a study in the order of its experiments in the report."""
    asked = registry.responses_of(config["experiments"])
    return [response for response in measured(of_study(config)) if response.name in asked]


def remarks(section: str, study: Study) -> list[str]:
    """Sentences of a section on single experiments."""
    told = [experiment.REMARKS[section] for experiment in of_study(study.config) if section in experiment.REMARKS]
    return [sentence for tell in told for sentence in tell(study)]


def runs(study: Study) -> pd.DataFrame:
    """Rows of all simulations of all experiments, with the columns that every experiment has."""
    tables = [study.every[experiment.NAME] for experiment in of_study(study.config)]
    return pd.concat(tables, join="inner")
