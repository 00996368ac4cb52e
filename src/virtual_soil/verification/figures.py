"""Figures of the verification page, drawn only from the tables of checks."""

import matplotlib as mpl

mpl.use("Agg")

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from virtual_soil.verification.closed_forms import on_wall
from virtual_soil.verification.oblique_impact import KHARAZ_FRICTION, KHARAZ_RADIUS_M, KHARAZ_RESTITUTION, KHARAZ_SPEED_M_S
from virtual_soil.verification.scene import ALUMINIUM_OXIDE

#: Colours that colour-blind readers can distinguish (Okabe & Ito).
BLUE, RED, GREEN = "#0072B2", "#D55E00", "#009E73"


def restitution(table: pd.DataFrame) -> Figure:
    """Plot obtained against prescribed restitution, and their difference, for small and default time steps."""
    rows = table[table["quantity"] == "restitution"]
    default = rows["case"].str.endswith("default time step")
    figure = Figure(figsize=(9.0, 4.0), layout="constrained")
    axes, beside = figure.subplots(1, 2)
    asked = np.linspace(0.02, 1.0, 99)
    axes.plot([0, 1], [0, 1], color="0.6", linewidth=1, label="asked for")
    cut = [on_wall(ALUMINIUM_OXIDE, 2.5e-3, 3.9, e).push_restitution for e in asked]
    axes.plot(asked, cut, "--", color=GREEN, linewidth=1, label="closed form if the pull were cut off")
    beside.axhline(0.0, color="0.6", linewidth=1)
    for kind, marker, colour, label in (
        (rows[~default], "o", BLUE, "small time step"),
        (rows[default], "s", RED, "default time step"),
    ):
        axes.plot(kind["expected"], kind["obtained"], marker, color=colour, markerfacecolor="none", label=label)
        beside.plot(
            kind["expected"], kind["obtained"] - kind["expected"], marker, color=colour, markerfacecolor="none", label=label
        )
    axes.set_ylabel("restitution obtained")
    beside.set_ylabel("obtained − asked for")
    for panel in (axes, beside):
        panel.set_xlabel("restitution asked for")
        panel.legend(fontsize="small")
    return figure


def oblique_impact(table: pd.DataFrame) -> Figure:
    """Plot tangential restitution and spin against the impact angle: obtained, closed form for sliding, published points."""
    rows = table.assign(angle=pd.to_numeric(table["case"].str.extract(r"^test 4: (\d+)°$")[0])).dropna(subset="angle")
    angles = np.radians(np.linspace(np.degrees(np.arctan(3.5 * KHARAZ_FRICTION * (1.0 + KHARAZ_RESTITUTION))), 90.0, 200))
    impulse = KHARAZ_FRICTION * (1.0 + KHARAZ_RESTITUTION)
    sliding = {
        "tangential restitution": 1.0 - impulse / np.tan(angles),
        "spin": 2.5 * impulse * KHARAZ_SPEED_M_S * np.cos(angles) / KHARAZ_RADIUS_M,
    }
    figure = Figure(figsize=(9.0, 4.0), layout="constrained")
    for axes, (quantity, curve) in zip(figure.subplots(1, 2), sliding.items(), strict=True):
        points = rows[rows["quantity"] == quantity].sort_values("angle")
        digitised = points[points["source"].str.contains("digitised")]
        axes.plot(np.degrees(angles), curve, color="0.6", label="closed form: sliding throughout")
        axes.plot(digitised["angle"], digitised["expected"], "x", color=RED, label="published (Kharaz et al. 2001), digitised")
        axes.plot(points["angle"], points["obtained"], "o", color=BLUE, markerfacecolor="none", label="engine")
        axes.set_xlabel("impact angle from the normal (°)")
        axes.set_ylabel("spin after the impact (rad/s)" if quantity == "spin" else quantity)
        axes.set_xlim(0, 90)
        axes.legend(fontsize="small", loc="lower center" if quantity == "spin" else "lower right")
    return figure


def bulk(runs: pd.DataFrame) -> Figure:
    """Plot the angle of every heap by variant, with the scatter of the base as background."""
    heaps = runs[runs["kind"] == "heap"]
    variants = list(dict.fromkeys(heaps["variant"]))
    variants.sort(key=lambda name: (name != "base", heaps.loc[heaps["variant"] == name, "angle_of_repose_deg"].mean()))
    base = heaps.loc[heaps["variant"] == "base", "angle_of_repose_deg"]
    figure = Figure(figsize=(9.0, 5.0), layout="constrained")
    axes = figure.subplots()
    axes.axvspan(base.mean() - base.std(), base.mean() + base.std(), color="0.92", label="base: mean ± standard deviation")
    for row, variant in enumerate(variants):
        angles = heaps.loc[heaps["variant"] == variant, "angle_of_repose_deg"]
        axes.plot(angles, np.full(len(angles), row), "o", color=BLUE, alpha=0.6, markeredgewidth=0)
        axes.plot([angles.mean()] * 2, [row - 0.3, row + 0.3], color=RED, linewidth=2)
    axes.set_yticks(range(len(variants)), variants)
    axes.invert_yaxis()
    axes.set_xlabel("angle of repose (°)")
    axes.legend(fontsize="small")
    return figure
