"""The direct shear test: pictures of the box, shear curves and strength line, the film, and remarks on the cohesion."""

from collections.abc import Mapping

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from dem import Grains
from virtual_soil.campaign.experiments.registry import RESPONSES as CAMPAIGN_RESPONSES
from virtual_soil.campaign.experiments.shear.measure import COLUMNS
from virtual_soil.report.items import Entry, Item
from virtual_soil.report.plots import COLOURS, canvas, draw_grains
from virtual_soil.report.quantities import printed_unit
from virtual_soil.report.study import Study, base_point, before_and_after, couple
from virtual_soil.report.text import number
from virtual_soil.report.viewless import packed_views as packed_views
from virtual_soil.report.views import run_label

NAME, TITLE, SPECIMEN = "shear", "Direct shear", "shear box"
RESPONSES = {"friction_angle": None, "cohesion": None, "curve_distance": None}
FIGURES = {
    "shear_box": Entry("Figure 3: shear box"),
    "shear_curves": Entry("Figure 4: shear curves", view="shear", hint="Choose any point of the study."),
    "strength_line": Entry("Equation 1: strength line"),
}
STAGE, CUT = "shear", False
EYE, FLAT = (0.0, -2.0, 0.15), True
DISPLACED_SINCE = "since shearing began"
ASSUMPTIONS = (
    "The shear box's plates have the friction and stiffness of the grains; its side walls are smooth.",
    "Grains that touch floor and lid of the shear box are glued to them, like toothed plates.",
    "Shear specimens are prepared with reduced friction (tamped).",
    "Strength is the plateau, and normal stress that on the shear plane, unless configured otherwise.",
)

#: Column of the history along which specimens are sheared, factor to the printed unit, words; empty: they are not.
SHEARED = ("displacement_m", 1e3, "displacement of the lower frame (mm)")
#: Column of a solid fraction -> state of the soil in words.
SOLID_FRACTIONS = {"solid_fraction": "prepared in the shear box"}
#: Upright stripes of alternating colour in figure and film.
N_STRIPES = 8
COHESION, FRICTION_ANGLE = CAMPAIGN_RESPONSES["cohesion"], CAMPAIGN_RESPONSES["friction_angle"]


def figures(study: Study) -> dict[str, Item]:
    """The base set's shear box, shear curves and strength line."""
    config, every_seed = study.config, base_point(study.tables["shear"], study.config)
    rows = every_seed[every_seed["seed"] == every_seed["seed"].iloc[0]]
    box, where = rows.iloc[-1], couple(rows.iloc[-1])
    curves = {row["normal_stress_pa"]: study.histories[row["simulation_id"]] for _, row in rows.iterrows()}
    columns = COLUMNS[config["shear"]["strength"], config["shear"]["normal_stress"]]
    return {
        "shear_box": Item(
            shear_box(*study.states[box["simulation_id"]]),
            before_and_after(*study.states[box["simulation_id"]]),
            f"Shear box before and after under {box['normal_stress_pa']:g} Pa at {where}",
        ),
        "shear_curves": Item(
            shear_curves(curves),
            pd.concat([table.assign(normal_stress_pa=stress) for stress, table in curves.items()]),
            f"Shear stress against displacement under {len(curves)} normal stresses at {where}",
        ),
        "strength_line": Item(
            strength_line(every_seed, strength_of(study, box["point_id"]), columns),
            every_seed[["simulation_id", "seed", *dict.fromkeys(reversed(columns))]],
            f"Shear strength against normal stress with the Mohr-Coulomb line at {where}",
        ),
    }


def strength_of(study: Study, point: str) -> pd.Series | None:
    """The Mohr-Coulomb line of a point at the campaign's fidelity; None if too few of its tests finished."""
    strength = study.tables["strength"].query("fidelity == 'campaign' and point_id == @point")
    return None if strength.empty else strength.iloc[0]


def facts(run: Mapping) -> str:
    """What was measured in a box."""
    ratio = run["plateau_shear_stress_pa"] / run["plane_normal_stress_pa"]
    return f"τ/σ {number(ratio, 2)} on the plane, solid fraction {number(run['solid_fraction'], 3)}"


def shear_box(before: pd.DataFrame, after: pd.DataFrame) -> Figure:
    """Figure 3: the shear box before and after; colour is the stripe of a grain at the start."""
    figure, axes = canvas(2, height=3.0)
    stripes = np.floor(before["x_m"] / max(before["x_m"].max() / N_STRIPES, 1e-12)) % 2 if len(before) else np.zeros(0)
    for panel, state, name in zip(axes, (before, after), ("before", "after"), strict=True):
        if len(state):
            draw_grains(panel, state, stripes)
        panel.set_title(name)
    return figure


def shear_curves(histories: dict[float, pd.DataFrame]) -> Figure:
    """Figure 4: shear stress against displacement at several normal stresses (Pa)."""
    figure, (axes,) = canvas()
    for k, (stress, history) in enumerate(sorted(histories.items())):
        style = {"color": COLOURS[k % len(COLOURS)], "label": f"p = {stress:g} Pa"}
        axes.plot(1e3 * history["displacement_m"], history["shear_stress_pa"], **style)
    axes.set_xlabel("displacement of the lower frame (mm)")
    axes.set_ylabel("shear stress (Pa)")
    axes.legend()
    return figure


def strength_line(shear: pd.DataFrame, strength: pd.Series | None, columns: tuple[str, str]) -> Figure:
    """Equation 1: shear strengths of one point against normal stress, with its Mohr-Coulomb line if it has one."""
    figure, (axes,) = canvas()
    tau, p = columns
    axes.plot(shear[p], shear[tau], "o", color=COLOURS[0], label="simulated, each seed")
    if strength is not None:
        stresses = np.linspace(0.0, 1.05 * shear[p].max(), 50)
        line = strength[COHESION.column] + stresses * np.tan(np.radians(strength[FRICTION_ANGLE.column]))
        label = f"{value_with_error(strength, COHESION, 0, ' ')}, {value_with_error(strength, FRICTION_ANGLE, 1)}"
        axes.plot(stresses, line, color=COLOURS[1], label=label)
    axes.set_xlabel("normal stress on the shear plane (Pa)")
    axes.set_ylabel("shear strength (Pa)")
    axes.legend()
    return figure


def value_with_error(strength: pd.Series, response, digits: int, space: str = "") -> str:
    """A response of a point with its standard error and unit."""
    value, error = strength[response.column], strength[response.error_column]
    return f"{response.symbol} = {value:.{digits}f} ± {error:.{digits}f}{space}{printed_unit(response)}"


def views(study: Study, rows: pd.DataFrame) -> dict:
    """The shear curves of every point; rows: `labelled`."""
    return {"shear": shear_view(rows, study.histories)}


def shear_view(rows: pd.DataFrame, histories: dict[str, pd.DataFrame]) -> dict:
    """Label of a point -> its shear curves; a failed test has none."""
    view: dict[str, list[dict]] = {}
    for _, row in rows[(rows["experiment"] == NAME) & rows["simulation_id"].isin(histories)].iterrows():
        history = histories[row["simulation_id"]]
        curve = {
            "pressure": row["normal_stress_pa"],
            "label": run_label(row),
            "displacement": 1e3 * history["displacement_m"].to_numpy(),
            "time": history["time_s"].to_numpy(),
            "stress": history["shear_stress_pa"].to_numpy(),
        }
        view.setdefault(row["label"], []).append(curve)
    return view


def period_m(setup: dict) -> float:
    """Width of the simulated slice."""
    return setup["width_ratio"] * setup["scale_radius_m"]


def colour(grains: Grains) -> np.ndarray:
    """0 or 1 for the upright stripe of each grain, as in the figure of the shear box."""
    x = grains.positions_m[:, 0]
    return np.minimum(np.floor(N_STRIPES * x / x.max()), N_STRIPES - 1) % 2


def title(frame, row: dict, _settings: dict) -> str:
    """Displacement of the lower frame, and the normal stress."""
    return f"sheared by {1e3 * frame.walls['lower_left'].low_m[0]:.2f} mm under {row['normal_stress_pa']:g} Pa"


def adhesion_remark(study: Study) -> list[str]:
    """Why a target of the cohesion is out of reach."""
    reach = study.tables["reachability"]
    if COHESION.name not in set(reach.loc[~reach["reachable"], "response"]):
        return []
    return ["Grains without adhesion have no cohesion: a soil's own can only be met with a contact law that has one."]


def noise_remark(study: Study) -> list[str]:
    """Noise of the cohesion beside its spread over the design."""
    strength = study.tables["strength"].query("fidelity == 'campaign'")
    noise, spread = strength[COHESION.error_column].median(), strength[COHESION.column].std()
    return [
        f"Cohesion of a point is known to ± {noise:.0f} Pa (median standard error), beside a spread of {spread:.0f} Pa "
        "over the design: grains without adhesion have almost none, and what the regression finds is mostly noise."
    ]


REMARKS = {"soils": adhesion_remark, "surrogates": noise_remark}
