"""The finished study that the report is about, and how sections find the points in it that they show."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
import pandas as pd

from virtual_soil.calibration.optimise import weighted
from virtual_soil.calibration.response import Response, Responses
from virtual_soil.campaign.design import DESIGNED
from virtual_soil.campaign.experiments.registry import responses_of
from virtual_soil.campaign.experiments.shear.laboratory import ShearTests
from virtual_soil.campaign.grains import CLUMP, CLUMP_RADIUS
from virtual_soil.campaign.study import as_printed, distance_from_base
from virtual_soil.report.quantities import VARIABLES, Variable

#: Relative difference up to which a simulated point is an optimum: points are rounded to four digits.
SAME_POINT = 1e-3
#: Columns of a table of grains.
GRAIN_COLUMNS = ["x_m", "y_m", "z_m", "radius_m", "speed_m_s"]


@dataclass(frozen=True)
class Study:
    """All that the report reads.

    tables: the campaign's tables by name. every: the experiments' tables of campaign, refinement and verification together.
    states: simulation -> grains before and after. histories: simulation -> its curve. frames: grains during the recorded lift, if
    the study has heaps. laboratory: soil -> its laboratory's shear tests, of soils whose curves were read.
    """

    config: dict
    tables: dict[str, pd.DataFrame]
    every: dict[str, pd.DataFrame]
    models: dict[str, dict]
    rounds: list[pd.DataFrame]
    residuals: pd.DataFrame
    twins: pd.DataFrame | None
    states: dict[str, tuple[pd.DataFrame, pd.DataFrame]]
    histories: dict[str, pd.DataFrame]
    frames: pd.DataFrame | None
    engine: str
    laboratory: dict[str, ShearTests] = field(default_factory=dict)

    @property
    def as_printed(self) -> list[str]:
        """Responses that may stand beside what the paper prints of them."""
        return list(responses_of(as_printed(self.config)))

    @property
    def variables(self) -> dict[str, Variable]:
        """What tables show of a point: its design variables, radius and frictions."""
        shown = {*self.config["design"]["variables"], *self.config["design"].get("fixed", {})}
        return {name: variable for name, variable in VARIABLES.items() if name in shown}

    @property
    def responses(self) -> Responses:
        """Responses that the study's experiments measure, by name."""
        return responses_of(self.config["experiments"])

    @property
    def wanted(self) -> Responses:
        """Those that a case is calibrated by."""
        asked = {name for case in self.config["optimise"]["cases"] for name in weighted(case, self.responses)}
        return {name: response for name, response in self.responses.items() if name in asked}


def offers(config: dict) -> set[str]:
    """What a design offers to figures.

    plane: the frictions, and at most the radius, are its variables. grid: static and rolling friction are its grid, too. sweep: the
    radius is swept, too. filling: it has points that fill its box in place of a grid.
    """
    design = config["design"]
    frictions, variables = {"static_friction", "rolling_friction"}, set(design["variables"])
    if not design["grid"]:
        return {"filling", *(["plane"] if frictions <= variables <= {*frictions, "radius_m"} else [])}
    if set(design["grid"]) != frictions or not variables <= {*frictions, "radius_m"}:
        return set()
    return {"plane", "grid", *(["sweep"] if "radius_m" in variables & set(design["sweep"]) else [])}


def base_point(table: pd.DataFrame, config: dict) -> pd.DataFrame:
    """Rows of the point of the design nearest to the base set, at campaign fidelity."""
    designed = np.array([bool({*DESIGNED} & set(text.split(","))) for text in table["purposes"]], bool)
    points = table[designed & (table["fidelity"] == "campaign")].reset_index(drop=True)
    nearest = int(distance_from_base(config, points).argmin())
    return points[points["point_id"] == points.loc[nearest, "point_id"]]


def runs_at(study: Study, experiment: str, optimum: Mapping) -> pd.DataFrame:
    """Rows of all simulations of an experiment at an optimum, at campaign fidelity."""
    runs = study.every[experiment].drop_duplicates("simulation_id")
    same = [np.isclose(runs[name], optimum[name], rtol=SAME_POINT) for name in study.config["design"]["variables"]]
    return runs[np.logical_and.reduce(same) & (runs["fidelity"] == "campaign").to_numpy()]


def couple(row: Mapping) -> str:
    """Static and rolling friction of a point in words."""
    return f"µs {row['static_friction']:g}, µr {row['rolling_friction']:g}"


def known_points(tables: Mapping[str, pd.DataFrame], response: Response) -> pd.DataFrame:
    """Rows of the campaign's fidelity in which a response was measured."""
    source = tables[response.table]
    return source[(source["fidelity"] == "campaign") & source[response.column].notna()]


def before_and_after(before: pd.DataFrame, after: pd.DataFrame) -> pd.DataFrame:
    """Grains before and after in one table."""
    columns = [name for name in (*GRAIN_COLUMNS, CLUMP, CLUMP_RADIUS) if name in before]
    return pd.concat([state[columns].assign(moment=name) for name, state in (("before", before), ("after", after))])
