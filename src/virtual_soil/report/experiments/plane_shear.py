"""The plane shear test: pictures of the bed, shear curves and strength lines, the film, and a remark on steadiness."""

from collections.abc import Mapping

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from dem.experiments.strength import STEADY_PART
from virtual_soil.campaign.experiments.registry import RESPONSES as CAMPAIGN_RESPONSES
from virtual_soil.report.experiments import shear as box
from virtual_soil.report.items import Entry, Item
from virtual_soil.report.plots import COLOURS, canvas
from virtual_soil.report.study import Study, base_point, before_and_after, couple
from virtual_soil.report.text import number, spoken
from virtual_soil.report.viewless import views as views

NAME, TITLE, SPECIMEN = "plane_shear", "Plane shear", "sheared bed"
RESPONSES = {
    name: None
    for name in ("steady_friction_angle", "steady_cohesion", "peak_friction_angle", "peak_cohesion", "sheared_bulk_density")
}
FIGURES = {
    "plane_shear_bed": Entry("Plane shear: the bed"),
    "plane_shear_curves": Entry("Plane shear: shear curves"),
    "plane_shear_lines": Entry("Plane shear: strength lines"),
}
STAGE, CUT = "strain", False
EYE, FLAT = (0.0, -2.0, 0.15), False
DISPLACED_SINCE = "since shearing began"
ASSUMPTIONS = (
    "Plane shear: no side walls, no gravity; grains that touch floor and lid after consolidation are glued to them.",
    "Beds of the plane shear test are prepared with reduced friction (tamped), and every normal stress has a bed of its own.",
    "Steady strength is the mean over the last half of the strain, which a test adds to until that mean no longer drifts.",
)

#: Column of the history along which specimens are sheared, factor to the printed unit, words; empty: they are not.
SHEARED = ("shear_strain", 1.0, "shear strain")
#: Column of a solid fraction -> state of the soil in words.
SOLID_FRACTIONS = {"solid_fraction": "prepared for plane shear", "steady_solid_fraction": "steadily sheared"}

#: As of the shear box: no views of moving grains, period along y, colour in the film.
packed_views, period_m, colour = box.packed_views, box.period_m, box.colour
#: State of the soil -> names of cohesion and friction angle.
STATES = {state: (f"{state}_cohesion", f"{state}_friction_angle") for state in ("steady", "peak")}


def figures(study: Study) -> dict[str, Item]:
    """The base set's bed, shear curves and strength lines."""
    every_seed = base_point(study.tables[NAME], study.config)
    rows = every_seed[every_seed["seed"] == every_seed["seed"].iloc[0]]
    bed, where = rows.iloc[-1], couple(rows.iloc[-1])
    curves = {row["normal_stress_pa"]: study.histories[row["simulation_id"]] for _, row in rows.iterrows()}
    columns = [column for state in STATES for column in (f"{state}_normal_stress_pa", f"{state}_shear_stress_pa")]
    return {
        "plane_shear_bed": Item(
            box.shear_box(*study.states[bed["simulation_id"]]),
            before_and_after(*study.states[bed["simulation_id"]]),
            f"Sheared bed before and after under {bed['normal_stress_pa']:g} Pa at {where}",
        ),
        "plane_shear_curves": Item(
            shear_curves(curves),
            pd.concat([table.assign(normal_stress_pa=stress) for stress, table in curves.items()]),
            f"Shear stress over normal stress against shear strain under {len(curves)} normal stresses at {where}",
        ),
        "plane_shear_lines": Item(
            strength_lines(every_seed, {state: line_of(study, state, bed["point_id"]) for state in STATES}),
            every_seed[["simulation_id", "seed", "status", *columns]],
            f"Peak and steady shear strengths against normal stress with their Mohr-Coulomb lines at {where}",
        ),
    }


def facts(run: Mapping) -> str:
    """What was measured in a bed."""
    ratio, density = run["steady_shear_stress_pa"] / run["steady_normal_stress_pa"], run["steady_solid_fraction"]
    packing = f"solid fraction {number(density, 3)}, void ratio {number(1.0 / density - 1.0, 2)}"
    return f"τ/σ {number(ratio, 3)} {spoken(run['status'])}, {packing}"


def line_of(study: Study, state: str, point: str) -> pd.Series | None:
    """The Mohr-Coulomb line of a point's peak or steady strengths; None if too few of its tests count."""
    found = study.tables[f"{state}_strength"].query("fidelity == 'campaign' and point_id == @point")
    return None if found.empty else found.iloc[0]


def shear_curves(histories: dict[float, pd.DataFrame]) -> Figure:
    """Shear over normal stress against shear strain, with the steady part as a level line."""
    figure, (axes,) = canvas()
    for k, (stress, history) in enumerate(sorted(histories.items())):
        strain, ratio = history["shear_strain"], history["shear_stress_pa"] / history["plane_normal_stress_pa"]
        shade, part = COLOURS[k % len(COLOURS)], strain >= (1.0 - STEADY_PART) * strain.iloc[-1]
        axes.plot(strain, ratio, color=shade, linewidth=0.8, label=f"p = {stress:g} Pa")
        axes.plot([strain[part].iloc[0], strain.iloc[-1]], [ratio[part].mean()] * 2, color=shade, linewidth=2.5)
    axes.set_xlabel("shear strain")
    axes.set_ylabel("shear stress over normal stress")
    axes.legend()
    return figure


def strength_lines(tests: pd.DataFrame, lines: dict[str, pd.Series | None]) -> Figure:
    """Shear strengths of one point against normal stress, peak and steady, with their lines."""
    figure, (axes,) = canvas()
    for shade, (state, line) in zip(COLOURS, lines.items(), strict=False):
        p, tau = tests[f"{state}_normal_stress_pa"], tests[f"{state}_shear_stress_pa"]
        axes.plot(p, tau, "o", color=shade, markersize=4)
        if line is None:
            continue
        cohesion, angle = (CAMPAIGN_RESPONSES[name] for name in STATES[state])
        stresses = np.linspace(0.0, 1.05 * p.max(), 50)
        label = f"{box.value_with_error(line, cohesion, 0, ' ')}, {box.value_with_error(line, angle, 1)}"
        axes.plot(stresses, line[cohesion.column] + stresses * np.tan(np.radians(line[angle.column])), color=shade, label=label)
    axes.set_xlabel("normal stress (Pa)")
    axes.set_ylabel("shear strength (Pa)")
    axes.legend()
    return figure


def title(frame, row: dict, _settings: dict) -> str:
    """Time since shearing began, and the normal stress."""
    return f"sheared for {1e3 * frame.time_s:.1f} ms under {row['normal_stress_pa']:g} Pa"


def unsteady_remark(study: Study) -> list[str]:
    """Number of tests whose strength was not steady at the largest strain."""
    runs = study.every[NAME].drop_duplicates("simulation_id")
    n = int((runs["status"] == "unsteady").sum())
    ends = f"{n} of {len(runs)} plane shear tests were not steady at the largest strain; their steady strengths enter no fit."
    return [ends] if n else []


REMARKS = {"surrogates": unsteady_remark}
