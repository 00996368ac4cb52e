"""The angle-of-repose test: pictures of heap and lift, the film of the lift, and remarks on the angle of repose."""

from collections.abc import Mapping

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from dem import Grains
from virtual_soil.campaign.experiments.registry import RESPONSES as CAMPAIGN_RESPONSES
from virtual_soil.campaign.experiments.repose.declared import gravity_m_s2, lift_speed_m_s
from virtual_soil.campaign.grains import grain_radii_m
from virtual_soil.campaign.study import experiment_settings
from virtual_soil.report.items import Entry, Item
from virtual_soil.report.pack import packed_grains
from virtual_soil.report.plots import COLOURS, canvas, draw_grains
from virtual_soil.report.study import Study, base_point, before_and_after, couple
from virtual_soil.report.text import number, spoken
from virtual_soil.report.viewless import views as views
from virtual_soil.report.views import coordination, distance_mm

NAME, TITLE, SPECIMEN = "repose", "Angle of repose", "heap"
RESPONSES = {"angle_of_repose": "Figure 5", "bulk_density": None}
FIGURES = {
    "lift": Entry("Figure 2: the tube is lifted", view="lift", hint="Slide through the lift, or play it."),
    "heap": Entry("Tube and heap at the base set"),
}
STAGE, CUT = "lift", True
EYE, FLAT = (0.9, -1.6, 0.7), False
DISPLACED_SINCE = "since the tube was filled"
ASSUMPTIONS = (
    "Tube and plate have the stiffness of the grains, and their friction unless configured otherwise.",
    "Heaps are poured with full friction.",
)

#: Column of the history along which specimens are sheared, factor to the printed unit, words; empty: they are not.
SHEARED: tuple = ()
#: Column of a solid fraction -> state of the soil in words.
SOLID_FRACTIONS = {"poured_solid_fraction": "poured into the tube"}
#: Heaps at Table 2's points should come this near to EDEM's.
EDEM_TOLERANCE_DEG = 2.5
#: Horizontal layers of different colour in the film.
N_LAYERS = 6
#: Frames in the figure of the lift.
N_PANELS = 4
ANGLE = CAMPAIGN_RESPONSES["angle_of_repose"].column


def figures(study: Study) -> dict[str, Item]:
    """The base set's lift and heap."""
    run = base_point(study.tables["repose"], study.config).iloc[0]
    before, after = study.states[run["simulation_id"]]
    assert study.frames is not None  # every study with heaps records a lift
    frames, angle = study.frames, run[ANGLE]
    return {
        "lift": Item(
            lift(frames),
            frames.groupby("frame", as_index=False)[["time_s", "tube_bottom_m"]].first(),
            f"Four moments of the lift at {couple(run)}: grains in the tube, flowing out under its rim, and at rest as a heap",
        ),
        "heap": Item(
            heap(before, after, angle, tube_radius_m(study.config, run)),
            before_and_after(before, after),
            f"Grains in the tube and heap of {angle:.1f} degrees at {couple(run)}",
        ),
    }


def facts(run: Mapping) -> str:
    """What was measured in a heap."""
    height = f"{1e3 * run['heap_height_m']:.3g} mm high, " if run["heap_height_m"] > 0 else ""
    overlap = number(run["max_overlap_ratio"], 1, 100)
    return f"A {number(run[ANGLE])}°, {spoken(run['status'])}, {height}overlaps up to {overlap} % of r"


def tube_radius_m(config: dict, run: pd.Series) -> float:
    """Inner radius of the tube in which a heap's grains were filled."""
    setup = experiment_settings(config, run.to_dict())["setup"]
    return setup["tube_diameter_ratio"] * setup["scale_radius_m"]


def heap(filled: pd.DataFrame, grains: pd.DataFrame, angle_deg: float, tube_m: float) -> Figure:
    """Figure 2: the grains in the tube, to scale, and the heap at rest with a line at its angle of repose; tube_m : its radius."""
    figure, (left, right) = canvas(2, height=3.2)
    for axes, state, title in ((left, filled, "before the lift"), (right, grains, "at rest")):
        if len(state):
            draw_grains(axes, state, np.hypot(state["x_m"], state["y_m"]))
        axes.axhline(0.0, color="black")
        axes.set_title(title)
    if len(filled):
        radii = grain_radii_m(filled)
        top = 1e3 * float((filled["z_m"] + filled["radius_m"]).max())
        for side in (-1e3 * tube_m, 1e3 * tube_m):
            left.plot([side, side], [0.0, 1.1 * top], color="black", linewidth=2)
        size = f"tube {2e3 * tube_m:.3g} mm, filled to {top:.3g} mm"
        left.set_title(f"{size}:\n{len(radii)} grains of {1e3 * radii.mean():.3g} mm radius", fontsize="small")
    if len(grains) and angle_deg > 0:
        top = 1e3 * float((grains["z_m"] + grains["radius_m"]).max())
        foot = top / np.tan(np.radians(angle_deg))
        right.plot([0, foot], [top, 0], color=COLOURS[1], linewidth=2, label=f"{angle_deg:.1f}°")
        right.legend(loc="upper right")
    return figure


def lift(frames: pd.DataFrame) -> Figure:
    """Figure 2 at four times of the lift, cut through the middle; colour is the height of a grain at the start."""
    figure, panels = canvas(N_PANELS, width=11.0, height=3.4)
    start = frames[frames["frame"] == 0].set_index("grain")["z_m"]
    numbers = np.unique(frames["frame"])
    width = 1e3 * np.array([frames["x_m"].min(), frames["x_m"].max()])
    for axes, k in zip(panels, numbers[np.linspace(0, len(numbers) - 1, N_PANELS).astype(int)], strict=True):
        draw_lift(axes, frames[frames["frame"] == k], start)
        axes.set(xlim=width, ylim=(0.0, 1.05e3 * start.max()))
    return figure


def draw_lift(axes, frame: pd.DataFrame, start: pd.Series) -> None:
    """Grains behind the plane y = 0, and the tube; start: height of every grain in the first frame."""
    half, moment = frame[frame["y_m"] > 0.0], frame.iloc[0]
    draw_grains(axes, half, start.loc[half["grain"]], clim=(0.0, start.max()))
    for side in (-1e3, 1e3):
        axes.plot([side * moment["tube_radius_m"]] * 2, [1e3 * moment["tube_bottom_m"], 1e3 * start.max()], color="black")
    axes.set_title(f"{moment['time_s']:.3f} s")


def packed_views(study: Study) -> dict:
    """The lift."""
    return {"lift": lift_view(study.frames)}


def lift_view(frames: pd.DataFrame) -> list[dict]:
    """Frames of the lift: time, tube, and packed grains with initial height, speed, displacement and coordination number."""
    first = frames[frames["frame"] == 0].set_index("grain")
    return [lift_frame(frame, first) for _, frame in frames.groupby("frame")]


def lift_frame(frame: pd.DataFrame, first: pd.DataFrame) -> dict:
    """One frame of the lift; first: the grains of the first frame by number."""
    start = first.loc[frame["grain"]]
    scalars = {
        "height at the start": 1e3 * start["z_m"].to_numpy(),
        "speed": 1e3 * frame["speed_m_s"].to_numpy(),
        "displacement": distance_mm(start, frame),
        "coordination": coordination(frame),
    }
    tube = {"radius_mm": 1e3 * frame["tube_radius_m"].iloc[0], "bottom_mm": 1e3 * frame["tube_bottom_m"].iloc[0]}
    tube["top_mm"] = 1e3 * first["z_m"].max()
    return {"time_s": frame["time_s"].iloc[0], "tube": tube, "grains": packed_grains(frame, scalars)}


def period_m(_setup: dict) -> float:
    """The heap's space is not periodic."""
    return 0.0


def colour(grains: Grains) -> np.ndarray:
    """Number of the horizontal layer of each grain, from the bottom."""
    z = grains.positions_m[:, 2]
    return np.minimum(np.floor(N_LAYERS * z / z.max()), N_LAYERS - 1)


def title(frame, _row: dict, settings: dict) -> str:
    """Height of the tube and time since the lift began."""
    lifted_m = frame.walls["tube"].bottom_m
    return f"tube lifted by {1e3 * lifted_m:.2f} mm, {lifted_m / settings['setup']['lift_speed_m_s']:.3f} s"


def screening_remarks(study: Study) -> list[str]:
    """Heaps that differ from EDEM's, and the effect of the radius on the lift."""
    if ANGLE not in study.tables["screening"]:
        return []
    table, difference = study.tables["screening"], "{}: our heap is {:+.1f}° from EDEM's, more than {}°."
    differences = dict(zip(table["parameter"], table[ANGLE] - table["paper_angle_deg"], strict=True))
    far = {name: value for name, value in differences.items() if abs(value) > EDEM_TOLERANCE_DEG}
    return [difference.format(name, value, EDEM_TOLERANCE_DEG) for name, value in far.items()] + lift_remarks(table, study.config)


def lift_remarks(table: pd.DataFrame, config: dict) -> list[str]:
    """A sentence on the dimensionless lift speed, if the screening changed the radius and the geometry grew with it."""
    changed = table.loc[table["parameter"] == "radius_m", "changed_value"]
    if changed.empty or config["design"]["geometry"] != "scaled" or config["repose_test"]["tube_diameter_m"] is not None:
        return []
    speed, gravity = lift_speed_m_s(config, "campaign"), gravity_m_s2(config)
    before, after = (speed / np.sqrt(gravity * radius) for radius in (config["material"]["radius_m"], changed.iloc[0]))
    return [
        f"A change of radius changes the lift speed relative to √(g r) from {before:.3f} to {after:.3f}. Stiff grains "
        "without cohesion have no other scale when the test grows too; docs/decisions/02 shows that nothing else acts."
    ]


def column_remark(study: Study) -> list[str]:
    """Number of heaps that stood as columns."""
    runs = study.every[NAME].drop_duplicates("simulation_id")
    n = int((runs["status"] == "column").sum())
    return [f"{n} of {len(runs)} heaps stood as columns; they have no angle and enter no fit. A cut slope has one."] if n else []


REMARKS = {"screening": screening_remarks, "surrogates": column_remark}
