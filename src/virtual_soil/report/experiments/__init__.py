"""What the report says and draws about each virtual test: a module per test, and the only list of them.

Every module declares

- NAME, as in the configuration; TITLE, its heading; SPECIMEN, a simulation in words; RUNS, the plural of it;
- TABLES of the campaign that its simulations fill; the first has a row per simulation and the test's NAME;
- RESPONSES that it measures -> the paper's figure of the response with its surrogate, or None;
- FIGURES, name -> `Entry`, and figures(study), name -> `Item`;
- views(study, rows), name -> data of interactive views, and packed_views(study), the same for views of grains;
- period_m(setup), the period of its simulation box along y in m, 0 if there is none;
- EYE, position of the camera in the 3D view, FLAT, True if the specimen is seen edge on, and DISPLACED_SINCE, the start of the
  displacements shown there;
- STAGE that is filmed, simulate(row, settings, each), colour(grains), title(frame, row, settings) and CUT, True if the film shows
  the half behind the plane y = 0;
- MOMENTS, the stored files of grains;
- REMARKS, name of a section -> function from the study to its sentences on this test; ASSUMPTIONS.
"""

from types import ModuleType

import pandas as pd

from virtual_soil.calibration.response import Response
from virtual_soil.campaign.experiments import RESPONSES
from virtual_soil.report.experiments import repose, shear
from virtual_soil.report.study import Study

EXPERIMENTS: tuple[ModuleType, ...] = (repose, shear)


def measured() -> dict[Response, str | None]:
    """Every response in the order of the experiments -> the paper's figure of it, if there is one."""
    return {RESPONSES[name]: figure for experiment in EXPERIMENTS for name, figure in experiment.RESPONSES.items()}


def remarks(section: str, study: Study) -> list[str]:
    """Sentences of a section on single experiments."""
    told = [experiment.REMARKS[section] for experiment in EXPERIMENTS if section in experiment.REMARKS]
    return [sentence for tell in told for sentence in tell(study)]


def runs(study: Study) -> pd.DataFrame:
    """Rows of all simulations of all experiments, with the columns that every experiment has."""
    tables = [study.every[experiment.NAME] for experiment in EXPERIMENTS]
    return pd.concat(tables, join="inner")
