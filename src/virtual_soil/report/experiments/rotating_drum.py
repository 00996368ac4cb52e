"""The rotating drum: pictures of its cross-section and of the angle, over time and against the Froude number, and the film."""

from collections.abc import Mapping

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from dem import Grains
from dem.measure.drum import MIDDLE_SHARE, angles_of, steady_angle
from virtual_soil.campaign.study import experiment_settings
from virtual_soil.report.items import Entry, Item
from virtual_soil.report.plots import COLOURS, canvas, draw_grains
from virtual_soil.report.study import Study, base_point, before_and_after, couple
from virtual_soil.report.text import spoken, with_error
from virtual_soil.report.viewless import packed_views as packed_views
from virtual_soil.report.viewless import views as views

NAME, TITLE, SPECIMEN = "rotating_drum", "Rotating drum", "turning drum"
RESPONSES = {"drum_angle": None}
FIGURES = {
    "drum_section": Entry("Rotating drum: cross-section"),
    "drum_froude": Entry("Rotating drum: angle over time, and against the Froude number"),
}
STAGE, CUT = "turn", False
EYE, FLAT = (0.0, -2.0, 0.15), False
DISPLACED_SINCE = "since the drum began to turn"
ASSUMPTIONS = (
    "Rotating drum: a periodic slice along the axis, without end plates; the shell is lined with grains glued to it.",
    "The angle of the drum is that of a line through the middle half of its surface, mean over time.",
)

#: Column of the history along which specimens are sheared, factor to the printed unit, words; empty: they are not.
SHEARED: tuple = ()
#: Column of a solid fraction -> state of the soil in words.
SOLID_FRACTIONS: dict[str, str] = {}
REMARKS: dict = {}
#: Layers of different colour in the film, horizontal before the drum turns.
N_LAYERS = 6


def figures(study: Study) -> dict[str, Item]:
    """The base set's drum and its angles."""
    run = base_point(study.tables[NAME], study.config).iloc[0]
    before, after = study.states[run["simulation_id"]]
    setup, surfaces = experiment_settings(study.config, run.to_dict())["setup"], study.histories.get(run["simulation_id"])
    turns_before = study.config[NAME]["turns_before"]
    table = angles(surfaces, turns_before)
    where = f"at {couple(run)}; {facts(run)}"
    return {
        "drum_section": Item(
            section(before, after, run, setup), before_and_after(before, after), f"Drum at rest and turning {where}"
        ),
        "drum_froude": Item(
            angle_plot(surfaces, table, run, turns_before),
            table,
            f"Angle of the surface over turns, and against Froude number {where}",
        ),
    }


def angles(surfaces: pd.DataFrame | None, turns_before: float) -> pd.DataFrame:
    """Mean angle, its error, and the upper and lower angle at each Froude number."""
    names = ["froude_number", "mean_deg", "error_deg", "scatter_deg", "upper_deg", "lower_deg"]
    if surfaces is None:
        return pd.DataFrame(columns=names, dtype=float)
    found = {froude: steady_angle(*angles_of(surfaces, froude), turns_before) for froude in np.unique(surfaces["froude_number"])}
    return pd.DataFrame([[froude, *(getattr(angle, name) for name in names[1:])] for froude, angle in found.items()], columns=names)


def section(before: pd.DataFrame, after: pd.DataFrame, run: Mapping, setup: Mapping) -> Figure:
    """Grains in the drum at rest, coloured by their height, and turning, by their speed, with a line at the angle."""
    figure, axes = canvas(2, height=4.4)
    if not len(before):
        return figure
    radius = 0.5e3 * setup["diameter_ratio"] * setup["scale_radius_m"]
    turned = np.linspace(0.0, 2.0 * np.pi, 181)
    for panel, state, colour, name in zip(
        axes, (before, after), ("z_m", "speed_m_s"), ("at rest", "turning, bright: fast"), strict=True
    ):
        draw_grains(panel, state, state[colour])
        panel.plot(radius * np.cos(turned), radius * np.sin(turned), color="black")
        panel.set(title=name, xlim=(-1.05 * radius, 1.05 * radius), ylim=(-1.05 * radius, 1.05 * radius))
    angle = run["drum_angle_deg"]
    if np.isfinite(angle):
        x, z = middle_line(after, np.radians(angle), radius, 2e3 * float(after["radius_m"].mean()))
        axes[1].plot(x, z, color=COLOURS[1], linewidth=2, label=f"{angle:.1f}°")
        axes[1].legend(loc="upper left")
    return figure


def middle_line(grains: pd.DataFrame, angle: float, radius: float, width: float) -> tuple[np.ndarray, np.ndarray]:
    """Ends in mm of a line at an angle over the middle part of the surface, at the height of the highest grains near its middle."""
    along = np.array([np.cos(angle), np.sin(angle)])
    places = 1e3 * grains[["x_m", "z_m"]].to_numpy()
    across = places @ np.array([-along[1], along[0]])
    level = float(np.quantile(across[np.abs(places @ along) < width], 0.95))
    half = MIDDLE_SHARE * np.sqrt(max(radius**2 - level**2, 0.0))
    x, z = np.outer(along, [-half, half]) + level * np.array([[-along[1]], [along[0]]])
    return x, z


def angle_plot(surfaces: pd.DataFrame | None, table: pd.DataFrame, run: Mapping, turns_before: float) -> Figure:
    """Angle over turns at the Froude number that is measured, and mean, upper and lower angles against the Froude number."""
    figure, (left, right) = canvas(2)
    if surfaces is not None and len(surfaces):
        left.plot(*angles_of(surfaces, run["froude_number"]), color=COLOURS[0], linewidth=0.8)
    left.axvspan(0.0, turns_before, color="0.9", zorder=0)
    left.set(xlabel="turns", ylabel="angle of the surface (°)", title=f"Fr = {run['froude_number']:.3g}")
    right.errorbar(
        table["froude_number"], table["mean_deg"], table["error_deg"], marker="o", capsize=3, color=COLOURS[0], label="mean"
    )
    for name, marker in (("upper", "^"), ("lower", "v")):
        right.plot(table["froude_number"], table[f"{name}_deg"], marker, color=COLOURS[1], label=name)
    right.set(xscale="log", xlabel="Froude number ω²R/g", ylabel="angle of the surface (°)")
    right.legend()
    return figure


def facts(run: Mapping) -> str:
    """What was measured of a drum."""
    if run["status"] != "done":
        return spoken(run["status"])
    angle = with_error(run["drum_angle_deg"], run["drum_angle_error_deg"], 1)
    upper, lower = (f"{run[f'drum_{name}_angle_deg']:.1f}°" for name in ("upper", "lower"))
    return f"θ {angle}°, between {lower} and {upper}, at Fr {run['froude_number']:.3g}"


def period_m(setup: dict) -> float:
    """Thickness of the simulated slice."""
    return setup["thickness_ratio"] * setup["scale_radius_m"]


def colour(grains: Grains) -> np.ndarray:
    """Number of the horizontal layer of each grain, from the bottom of the drum to its axis."""
    z = grains.positions_m[:, 2]
    return np.clip(np.floor(N_LAYERS * (1.0 - z / z.min())), 0, N_LAYERS - 1)


def title(frame, _row: dict, _settings: dict) -> str:
    """Time since the grains were dropped."""
    return f"turns, {frame.time_s:.3f} s"
