"""The cut slope: picture of the cut that fell, the film of the settling bed, and a remark on columns."""

from collections.abc import Mapping

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from dem import Grains
from dem.experiments.cut_slope import CREST_RATIO, FLOOR_LAYER
from virtual_soil.campaign.experiments.slope.declared import gravity_m_s2
from virtual_soil.campaign.grains import grain_radii_m
from virtual_soil.report.items import Entry, Item
from virtual_soil.report.plots import COLOURS, canvas, draw_grains
from virtual_soil.report.study import Study, base_point, before_and_after, couple
from virtual_soil.report.text import number, spoken
from virtual_soil.report.viewless import packed_views as packed_views
from virtual_soil.report.viewless import views as views

NAME, TITLE, SPECIMEN = "slope", "Cut slope", "cut slope"
RESPONSES = {"slope_angle": None}
FIGURES = {
    "cut_slope": Entry("Cut slope: as cut, and fallen"),
    "slope_cohesion": Entry("Cut slope: angle against cohesion over weight"),
}
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
    points = cohesive_points(study)
    return {
        "cut_slope": Item(slope(before, after, run), before_and_after(before, after), alt),
        "slope_cohesion": Item(
            against_cohesion(points), points, "Slope angle against cohesion over rho_b g H, with Culmann's wedge"
        ),
    }


def cohesive_points(study: Study) -> pd.DataFrame:
    """Slopes that count or stand as walls, with cohesion and adhesive stress over rho_b g H, and the peak friction angle.

    Cohesion and friction angle are missing where the study measures no peak strength.
    """
    runs = study.tables[NAME]
    runs = runs[(runs["fidelity"] == "campaign") & runs["status"].isin(["done", "column"])].drop_duplicates("simulation_id")
    columns = ["peak_cohesion_pa", "peak_friction_angle_deg"]
    lines = study.tables.get("peak_strength")
    if lines is None:
        runs = runs.assign(**dict.fromkeys(columns, np.nan))
    else:
        lines = lines.loc[lines["fidelity"] == "campaign", ["point_id", *columns]]
        runs = runs.merge(lines, on="point_id", how="left")
    weight_pa = runs["density_kg_m3"] * runs["bed_solid_fraction"] * gravity_m_s2(study.config) * runs["slope_height_m"]
    shown = runs[["simulation_id", "status", "slope_angle_deg", "peak_friction_angle_deg"]]
    return shown.assign(kappa=runs["peak_cohesion_pa"] / weight_pa, adhesion_ratio=runs["adhesive_stress_pa"] / weight_pa)


def culmann_kappa(slope_deg, friction_deg):
    """Cohesion over rho_b g H at which a slope just stands by Culmann's plane wedge; steeper than the friction angle."""
    slope, friction = np.radians(slope_deg), np.radians(friction_deg)
    return (1.0 - np.cos(slope - friction)) / (4.0 * np.sin(slope) * np.cos(friction))


def against_cohesion(points: pd.DataFrame) -> Figure:
    """Slope angle against kappa, with Culmann's wedge for the friction angles found; else against adhesion."""
    figure, (axes,) = canvas()
    known = points["kappa"].notna().any()
    x = points["kappa" if known else "adhesion_ratio"]
    for status, style in (("done", "o"), ("column", "^")):
        which = points["status"] == status
        angle = points.loc[which, "slope_angle_deg"].fillna(90.0)
        if which.any():
            axes.plot(x[which], angle, style, color=COLOURS[0], markersize=4, label=f"simulated, {spoken(status)}")
    if known:
        for shade, friction in zip(COLOURS[1:], np.nanquantile(points["peak_friction_angle_deg"], [0.1, 0.9]), strict=False):
            angles = np.linspace(friction, 90.0, 100)
            axes.plot(culmann_kappa(angles, friction), angles, color=shade, label=f"Culmann's wedge, φ {friction:.0f}°")
    axes.set_xlabel("c / (ρb g H)" if known else "adhesive stress / (ρb g H)")
    axes.set_ylabel("slope angle (deg)")
    axes.legend()
    return figure


def slope(before: pd.DataFrame, after: pd.DataFrame, run: Mapping) -> Figure:
    """Grains as cut and at the end of the cut, coloured by their displacement, with a line at the steepest angle that stood."""
    figure, axes = canvas(2, height=3.0)
    if not len(before):
        return figure
    places, radius = ["x_m", "z_m"], grain_radii_m(before).mean()
    moved = np.linalg.norm(after[places].to_numpy() - before[places].to_numpy(), axis=1) / radius
    for panel, state, name in zip(axes, (before, after), ("as cut", "at its end"), strict=True):
        draw_grains(panel, state, np.minimum(moved, 10.0))
        panel.set_title(name)
    if np.isfinite(run["stands_deg"]):
        bottom = 1e3 * FLOOR_LAYER * radius
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
