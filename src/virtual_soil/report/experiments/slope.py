"""The cut slope: picture of the cut that fell, the film of the settling bed, and a remark on columns."""

from collections.abc import Mapping

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from dem import Grains
from dem.experiments.cut_slope import CREST_RATIO, FLOOR_LAYER
from virtual_soil.report.items import Entry, Item
from virtual_soil.report.plots import COLOURS, canvas, draw_grains
from virtual_soil.report.study import Study, base_point, before_and_after, couple
from virtual_soil.report.text import number, spoken

NAME, TITLE, SPECIMEN = "slope", "Cut slope", "cut slope"
RESPONSES = {"slope_angle": None}
FIGURES = {"cut_slope": Entry("Cut slope: as cut, and fallen")}
STAGE, CUT = "settle", False
EYE, FLAT = (0.0, -2.0, 0.15), False
DISPLACED_SINCE = "since the cut"
ASSUMPTIONS = (
    "Cut slopes: the bed settles with reduced friction (tamped) between smooth end walls, on a floor of glued grains.",
    "Every cut starts from the same bed; its angle lies between the steepest cut that stands and the flattest that falls.",
)

#: Column of the history along which specimens are sheared, factor to the printed unit, words; empty: they are not.
SHEARED: tuple = ()
#: Column of a solid fraction -> state of the soil in words.
SOLID_FRACTIONS = {"bed_solid_fraction": "settled to be cut"}
#: Horizontal layers of different colour in the film.
N_LAYERS = 6


def figures(study: Study) -> dict[str, Item]:
    """The base set's slope."""
    run = base_point(study.tables[NAME], study.config).iloc[0]
    before, after = study.states[run["simulation_id"]]
    alt = f"Slope as cut and at its end at {couple(run)}; {facts(run)}"
    return {"cut_slope": Item(slope(before, after, run), before_and_after(before, after), alt)}


def slope(before: pd.DataFrame, after: pd.DataFrame, run: Mapping) -> Figure:
    """Grains as cut and at the end of the cut, coloured by their displacement, with a line at the steepest angle that stood."""
    figure, axes = canvas(2, height=3.0)
    if not len(before):
        return figure
    places = ["x_m", "z_m"]
    moved = np.linalg.norm(after[places].to_numpy() - before[places].to_numpy(), axis=1) / before["radius_m"].mean()
    for panel, state, name in zip(axes, (before, after), ("as cut", spoken(run["status"])), strict=True):
        draw_grains(panel, state, np.minimum(moved, 10.0))
        panel.set_title(name)
    if np.isfinite(run["stands_deg"]):
        bottom = 1e3 * FLOOR_LAYER * before["radius_m"].mean()
        height = 1e3 * run["slope_height_m"]
        crest = CREST_RATIO * height
        toe = crest + height / np.tan(np.radians(run["stands_deg"]))
        label = f"{run['stands_deg']:.1f}° stood"
        axes[0].plot([crest, toe], [bottom + height, bottom], color=COLOURS[1], linewidth=2, label=label)
        axes[0].legend(loc="upper right")
    return figure


def facts(run: Mapping) -> str:
    """What was measured of a slope."""
    height = f"{1e3 * run['slope_height_m']:.3g} mm high"
    if run["status"] == "done":
        return f"β {number(run['slope_angle_deg'], 1)} ± {number(run['slope_half_width_deg'], 1)}°, {height}"
    return f"{spoken(run['status'])}, {height}"


def views(_study: Study, _rows: pd.DataFrame) -> dict:
    """No view without grains."""
    return {}


def packed_views(_study: Study) -> dict:
    """No view of moving grains."""
    return {}


def period_m(setup: dict) -> float:
    """Thickness of the simulated slice."""
    return setup["thickness_ratio"] * setup["scale_radius_m"]


def colour(grains: Grains) -> np.ndarray:
    """Number of the horizontal layer of each grain, from the bottom."""
    z = grains.positions_m[:, 2]
    return np.minimum(np.floor(N_LAYERS * z / z.max()), N_LAYERS - 1)


def title(frame, _row: dict, _settings: dict) -> str:
    """Time since the grains were dropped."""
    return f"bed settles, {frame.time_s:.3f} s"


def column_remark(study: Study) -> list[str]:
    """Number of slopes that stood as a vertical wall."""
    runs = study.every[NAME].drop_duplicates("simulation_id")
    n = int((runs["status"] == "column").sum())
    return [f"{n} of {len(runs)} slopes stood as a vertical wall; they have no angle and enter no fit."] if n else []


REMARKS = {"surrogates": column_remark}
