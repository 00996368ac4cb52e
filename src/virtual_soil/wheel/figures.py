"""Figures of wheel, plates and cone, drawn only from their tables and histories."""

from typing import Any

import matplotlib as mpl

mpl.use("Agg")

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

#: Colours of the cases that colour-blind readers can distinguish (Okabe & Ito).
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9")
MARKERS = "os^vDP"
#: Measured points, hollow so that runs below them are seen.
MEASURED: dict[str, Any] = {
    **{"color": "black", "marker": "D", "markerfacecolor": "white", "markersize": 6},
    **{"linestyle": "", "capsize": 3},
}
DPI = 90
#: Column, its error and factor, and what stands at the axis.
AGAINST_SLIP = (
    ("drawbar_ratio", "drawbar_ratio_error", 1.0, "drawbar pull over load"),
    ("traction_coefficient", "traction_coefficient_error", 1.0, "torque over load and radius"),
    ("sinkage_m", "sinkage_error_m", 1e3, "sinkage (mm)"),
    ("efficiency", "efficiency_error", 1.0, "efficiency"),
)


def style(case: str, cases: list[str], seed_number: int) -> dict:
    """Colour of a case and marker of a bed."""
    colour = COLOURS[cases.index(case) % len(COLOURS)]
    return {"color": colour, "marker": MARKERS[seed_number % len(MARKERS)], "markersize": 5}


def against_slip(table: pd.DataFrame, measured: pd.DataFrame | None = None, handbook: pd.DataFrame | None = None) -> Figure:
    """Plot pull, torque, sinkage and efficiency against slip, a point with its standard error for each run, means with their bands.

    Only a wheel that pulls has an efficiency. table, measured, handbook : of schemas wheel, wheel_measured, wheel_handbook. Bars of
    measurements are standard deviations; for the bands see `means_of`.
    """
    figure = Figure(figsize=(14.0, 3.6), layout="constrained")
    done = table[table["status"] == "done"]
    done = done.assign(at=done["asked_slip"].fillna(done["slip"]))
    tests = None if measured is None else measured[measured["tool"] == "wheel"]
    slips = pd.concat([done["at"], *([] if tests is None else [tests["slip"]])])
    ends = (slips.min() - 0.1, slips.max() + 0.1) if len(slips) else (-1.0, 1.0)
    cases = list(dict.fromkeys(table["case"]))
    for axes, (column, error, factor, label) in zip(figure.subplots(1, len(AGAINST_SLIP)), AGAINST_SLIP, strict=True):
        for case in cases:
            rows = done[done["case"] == case]
            if column == "efficiency":
                rows = rows[(rows["drawbar_pull_n"] > 0.0) & (rows["torque_n_m"] > 0.0)]
            for number, (seed, bed) in enumerate(rows.groupby("seed")):
                errors = factor * bed[error]
                points = {"linestyle": "", "capsize": 2, "label": f"{case}, bed {seed}"} | style(case, cases, number)
                axes.errorbar(bed["at"], factor * bed[column], errors, **points)
            if rows["asked_slip"].notna().any():
                means, colour = factor * means_of(rows, column, error), style(case, cases, 0)["color"]
                axes.plot(means.index, means["mean"], color=colour, linewidth=0.9)
                axes.fill_between(means.index, means["low"], means["high"], color=colour, alpha=0.2, linewidth=0.0)
        if handbook is not None:
            for case, line in handbook.groupby("case", sort=False):
                look = {"color": style(case, cases, 0)["color"] if case else MEASURED["color"], "linewidth": 1.0, "linestyle": "--"}
                of_whom = "handbook" + (f", plates of {case}" if case else "")
                if column in line:
                    axes.plot(line["slip"], factor * line[column], label=of_whom, **look)
        if tests is not None:
            points = tests[tests["quantity"] == column].drop_duplicates("slip")
            if len(points):
                axes.errorbar(points["slip"], factor * points["measured"], bars(factor, points), label="measured", **MEASURED)
        if column == "efficiency" and not axes.lines:
            axes.text(0.5, 0.5, "no wheel pulls", transform=axes.transAxes, ha="center")
            axes.set_yticks([])
        axes.axhline(0.0, color="0.7", linewidth=0.7)
        axes.set_xlim(*ends)
        axes.set_xlabel("slip")
        axes.set_ylabel(label)
    if figure.axes[0].get_legend_handles_labels()[1]:
        figure.axes[0].legend(fontsize="small")
    return figure


def means_of(rows: pd.DataFrame, column: str, error: str) -> pd.DataFrame:
    """Slip -> mean over the beds, and two standard errors below and above it.

    The standard error is that of the scatter of the beds, or that of the runs' own errors, whichever is larger.
    """
    beds = rows.groupby("asked_slip")
    n, own = beds[column].count(), (rows[error] ** 2).groupby(rows["asked_slip"]).mean()
    half = 2.0 * np.sqrt(np.maximum(beds[column].var().fillna(0.0), own) / n)
    mean = beds[column].mean()
    return pd.DataFrame({"mean": mean, "low": mean - half, "high": mean + half})


def bars(factor: float, points: pd.DataFrame) -> pd.Series:
    """Lengths of the bars of measured points; nothing where the deviation is not known."""
    return factor * points["measured_sd"].fillna(0.0)


def over_time(runs: pd.DataFrame, histories: list[pd.DataFrame]) -> Figure:
    """Plot drawbar pull and sinkage over time, a line for each run of the first bed of each case; runs, histories : one by one."""
    figure = Figure(figsize=(9.0, 3.6), layout="constrained")
    left, right = figure.subplots(1, 2)
    first = runs.groupby("case")["seed"].transform("first")
    for number, (run, history) in enumerate(zip(runs.to_dict("records"), histories, strict=True)):
        if run["seed"] != first.iloc[number] or history.empty:
            continue
        label = f"{run['case']}, " + ("free" if pd.isna(run["asked_slip"]) else f"s = {run['asked_slip']:g}")
        left.plot(history["time_s"], history["drawbar_pull_n"], linewidth=0.8, label=label)
        right.plot(history["time_s"], 1e3 * history["sinkage_m"], linewidth=0.8, label=label)
    for axes, title in ((left, "drawbar pull (N)"), (right, "sinkage (mm)")):
        axes.axvline(0.0, color="0.7", linewidth=0.7)
        axes.set_xlabel("time since the travel began (s)")
        axes.set_ylabel(title)
    if right.lines[1:]:
        right.legend(fontsize="x-small")
    return figure


def pressed(runs: pd.DataFrame, histories: list[pd.DataFrame], what: str, measured: pd.DataFrame | None = None) -> Figure:
    """Plot pressure against depth, a line for each test; what : the tool. measured : of schema wheel_measured, of plates."""
    figure = Figure(figsize=(5.5, 3.8), layout="constrained")
    axes = figure.subplots()
    cases, sizes = list(dict.fromkeys(runs["case"])), sorted(set(runs["diameter_m"]))
    for run, history in zip(runs.to_dict("records"), histories, strict=True):
        below = history[history["depth_m"] >= 0.0]
        line = {"color": style(run["case"], cases, 0)["color"], "linewidth": 0.7 + 0.5 * sizes.index(run["diameter_m"])}
        label = f"{run['case']}, {1e3 * run['diameter_m']:.3g} mm"
        known = axes.get_legend_handles_labels()[1]
        axes.plot(1e3 * below["depth_m"], 1e-3 * below["pressure_pa"], label=None if label in known else label, **line)
    if measured is not None:
        tests = measured[(measured["tool"] == what) & (measured["quantity"] == "pressure_pa")].drop_duplicates(
            ["diameter_m", "at_m"]
        )
        for number, (diameter, points) in enumerate(tests.groupby("diameter_m")):
            look = MEASURED | {"marker": MARKERS[number % len(MARKERS)], "label": f"measured, {1e3 * diameter:.3g} mm"}
            axes.errorbar(1e3 * points["at_m"], 1e-3 * points["measured"], bars(1e-3, points), **look)
    axes.set_xlabel(f"depth of the {what} (mm)")
    axes.set_ylabel("pressure (kPa)")
    if axes.get_legend_handles_labels()[1]:
        axes.legend(fontsize="small")
    return figure
