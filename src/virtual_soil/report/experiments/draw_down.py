"""The draw-down test: pictures of the box and of the mass that flows out, the film of the flow, and a remark on arches."""

from collections.abc import Mapping

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from dem import Grains
from dem.measure.draw_down import STEADY_SHARES
from virtual_soil.campaign.study import experiment_settings
from virtual_soil.report.items import Entry, Item
from virtual_soil.report.plots import COLOURS, canvas, draw_grains
from virtual_soil.report.study import Study, base_point, before_and_after, couple
from virtual_soil.report.text import number, spoken, with_error
from virtual_soil.report.viewless import packed_views as packed_views
from virtual_soil.report.viewless import views as views

NAME, TITLE, SPECIMEN = "draw_down", "Draw-down", "drawn-down box"
RESPONSES = {"discharge_rate": None, "draw_down_angle": None, "box_bulk_density": None}
FIGURES = {
    "draw_down_box": Entry("Draw-down: filled, and what stays"),
    "draw_down_flow": Entry("Draw-down: mass that flows out"),
}
STAGE, CUT = "flow", False
EYE, FLAT = (0.0, -2.0, 0.15), False
DISPLACED_SINCE = "since the gate was opened"
ASSUMPTIONS = (
    "Draw-down: a periodic slice along the slot, without the box's front and back; smooth end walls.",
    "The lowest grains are glued to the floor before the gate is opened, but none that juts out over the slot.",
    "The draw-down box is filled with reduced friction (tamped): its bulk density is that of a tamped soil.",
    "The rate of discharge is that between 10 and 60 % of the mass that flows out.",
)

#: Column of the history along which specimens are sheared, factor to the printed unit, words; empty: they are not.
SHEARED: tuple = ()
#: Column of a solid fraction -> state of the soil in words.
SOLID_FRACTIONS = {"box_solid_fraction": "filled into the draw-down box"}
#: Horizontal layers of different colour in pictures and film.
N_LAYERS = 6


def figures(study: Study) -> dict[str, Item]:
    """The base set's box and flow."""
    run = base_point(study.tables[NAME], study.config).iloc[0]
    before, after = study.states[run["simulation_id"]]
    setup, flow = experiment_settings(study.config, run.to_dict())["setup"], study.histories.get(run["simulation_id"])
    flow = pd.DataFrame({"time_s": [], "mass_out_kg_m": []}) if flow is None else flow
    where = f"at {couple(run)}; {facts(run)}"
    return {
        "draw_down_box": Item(
            box(before, after, run, setup), before_and_after(before, after), f"Box filled and drawn down {where}"
        ),
        "draw_down_flow": Item(mass_out(flow, run), flow, f"Mass that is through the slot against time {where}"),
    }


def box(before: pd.DataFrame, after: pd.DataFrame, run: Mapping, setup: Mapping) -> Figure:
    """Grains before and after, coloured by their height when filled, with the floor and lines at the slopes."""
    figure, axes = canvas(2, height=3.0)
    if not len(before):
        return figure
    scale_mm = 1e3 * setup["scale_radius_m"]
    length, slot = setup["length_ratio"] * scale_mm, setup["slot_ratio"] * scale_mm
    edges = 0.5 * (length - slot), 0.5 * (length + slot)
    top = 1.05e3 * float((before["z_m"] + before["radius_m"]).max())
    for panel, state, name in zip(axes, (before, after), ("filled", "what stays"), strict=True):
        draw_grains(panel, state, state["z_m"])
        panel.plot([0.0, 0.0, edges[0]], [top, 0.0, 0.0], color="black")
        panel.plot([edges[1], length, length], [0.0, 0.0, top], color="black")
        panel.set(title=name, xlim=(-0.02 * length, 1.02 * length), ylim=(-0.05 * top, top))
    for side, foot, wall in (("left", edges[0], 0.0), ("right", edges[1], length)):
        angle = run[f"draw_down_{side}_deg"]
        if np.isfinite(angle):
            rise = abs(wall - foot) * np.tan(np.radians(angle))
            axes[1].plot([foot, wall], [0.0, rise], color=COLOURS[1], linewidth=2, label=f"{side} {angle:.1f}°")
    if axes[1].lines[2:]:
        axes[1].legend(loc="upper center")
    return figure


def mass_out(flow: pd.DataFrame, run: Mapping) -> Figure:
    """Mass through the slot against time, with the steady part's line."""
    figure, (axes,) = canvas()
    axes.plot(flow["time_s"], flow["mass_out_kg_m"], color=COLOURS[0], label="simulated")
    rate = run["discharge_rate_kg_s_m"]
    if np.isfinite(rate):
        low, high = np.multiply(STEADY_SHARES, flow["mass_out_kg_m"].iloc[-1])
        steady = flow[flow["mass_out_kg_m"].between(low, high)]
        middle = steady[["time_s", "mass_out_kg_m"]].mean()
        times = np.array([steady["time_s"].iloc[0], steady["time_s"].iloc[-1]])
        label = f"{with_error(rate, run['discharge_rate_error_kg_s_m'], 3)} kg/s per m"
        axes.plot(times, middle["mass_out_kg_m"] + rate * (times - middle["time_s"]), color=COLOURS[1], linewidth=2.5, label=label)
    axes.set_xlabel("time since the gate was opened (s)")
    axes.set_ylabel("mass out (kg per m of slot)")
    axes.legend()
    return figure


def facts(run: Mapping) -> str:
    """What was measured of a draw-down."""
    if run["status"] != "done":
        return spoken(run["status"])
    rate = with_error(run["discharge_rate_kg_s_m"], run["discharge_rate_error_kg_s_m"], 3)
    return f"Q {rate} kg/s per m, α {number(run['draw_down_angle_deg'], 1)}°, solid fraction {number(run['box_solid_fraction'], 3)}"


def period_m(setup: dict) -> float:
    """Thickness of the simulated slice."""
    return setup["thickness_ratio"] * setup["scale_radius_m"]


def colour(grains: Grains) -> np.ndarray:
    """Number of the horizontal layer of each grain, from the bottom."""
    z = grains.positions_m[:, 2]
    return np.clip(np.floor(N_LAYERS * z / z.max()), 0, N_LAYERS - 1)


def title(frame, _row: dict, _settings: dict) -> str:
    """Time since the grains were dropped."""
    return f"flows out, {frame.time_s:.3f} s"


def unfinished_remark(study: Study) -> list[str]:
    """Number of draw-downs that arched or did not come to rest."""
    runs = study.every[NAME].drop_duplicates("simulation_id")
    counts = {status: int((runs["status"] == status).sum()) for status in ("arched", "column", "not_finished")}
    said = {
        "arched": "ended with an arch over the slot",
        "column": "left two walls beside the slot",
        "not_finished": "had not come to rest at the time limit",
    }
    return [f"{n} of {len(runs)} draw-downs {said[status]}; they enter no fit." for status, n in counts.items() if n]


REMARKS = {"surrogates": unfinished_remark}
