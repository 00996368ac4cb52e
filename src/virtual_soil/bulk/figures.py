"""Figures of the bulk benchmarks, drawn only from the curves of the runs."""

import matplotlib as mpl

mpl.use("Agg")

import pandas as pd
from matplotlib.figure import Figure

from virtual_soil.bulk.drum import GRAINS, ZONES
from virtual_soil.bulk.variants import CODES, LIGGGHTS, OURS

#: Colours that colour-blind readers can distinguish (Okabe & Ito).
COLOURS = {OURS: "#0072B2", LIGGGHTS: "#D55E00"}
NAMES = {OURS: "virtual-soil", LIGGGHTS: "LIGGGHTS"}
SIZE, DPI = (9.0, 3.8), 90


def impact(curves: dict[str, dict[str, dict[int, pd.DataFrame]]]) -> Figure:
    """Plot the ball's height and speed over time; curves : bed -> code -> number of the start -> curves."""
    figure = Figure(figsize=(SIZE[0], SIZE[1] * len(curves)), layout="constrained")
    for row, (bed, by_code) in zip(figure.subplots(len(curves), 2, squeeze=False), curves.items(), strict=True):
        for code in CODES:
            for start, curve in by_code[code].items():
                label = NAMES[code] if start == 0 else None
                style = {"color": COLOURS[code], "linewidth": 1.0, "linestyle": "-" if code == OURS else "--", "label": label}
                row[0].plot(1e3 * curve.index, 1e3 * curve["ball_z_m"], **style)
                row[1].plot(1e3 * curve.index, curve["ball_speed_m_s"], **style)
        row[0].set_ylabel(f"height of the ball (mm), {bed} grains")
        row[1].set_ylabel("its velocity upwards (m/s)")
        for axes in row:
            axes.set_xlabel("time since the late start (ms)")
            axes.legend(fontsize="small")
    return figure


def drum(curves: dict[str, list[pd.DataFrame]]) -> Figure:
    """Plot grains in the zones and barycentres over time; curves : code -> curves of each start."""
    figure = Figure(figsize=SIZE, layout="constrained")
    left, right = figure.subplots(1, 2)
    for code, start, curve in ((name, *run) for name in CODES for run in enumerate(curves[name])):
        line, name = "-" if code == OURS else "--", NAMES[code] if start == 0 else None
        for zone, width in zip(ZONES, (1.6, 0.8), strict=True):
            total = sum(curve[f"{zone}_{grains}"] for grains in GRAINS)
            label = name and f"{name}, zone {zone[-1]}"
            left.plot(curve.index, total, line, color=COLOURS[code], linewidth=width, label=label)
        for grains, width in zip(GRAINS, (0.8, 1.6), strict=True):
            x_mm, z_mm, label = 1e3 * curve[f"x_{grains}"], 1e3 * curve[f"z_{grains}"], name and f"{name}, {grains}"
            right.plot(x_mm, z_mm, line, color=COLOURS[code], linewidth=width, label=label)
    left.set_xlabel("time (s)")
    left.set_ylabel("grains in the zone")
    right.set_xlabel("barycentre x (mm)")
    right.set_ylabel("barycentre z (mm)")
    for axes in (left, right):
        axes.legend(fontsize="small")
    return figure


def silo(curves: dict[str, dict[str, pd.DataFrame]]) -> Figure:
    """Plot grains above the orifice over time and their outflow; curves : variant -> code -> curves."""
    figure = Figure(figsize=SIZE, layout="constrained")
    left, right = figure.subplots(1, 2)
    for (variant, by_code), width in zip(curves.items(), (0.9, 1.8), strict=True):
        for code, curve in by_code.items():
            line, label = "-" if code == OURS else "--", f"{NAMES[code]}, {variant.split('_')[0]} orifice"
            left.plot(curve.index, curve["above"], line, color=COLOURS[code], linewidth=width, label=label)
            several = curve["above"].iloc[::5]  # single samples scatter
            middles = 0.5 * (several.index[1:] + several.index[:-1])
            outflow = -several.diff().iloc[1:] / (several.index[1:] - several.index[:-1])
            right.plot(middles, outflow, line, color=COLOURS[code], linewidth=width, label=label)
    for axes, title in ((left, "grains above the orifice"), (right, "outflow (grains/s)")):
        axes.set_xlabel("time since the opening (s)")
        axes.set_ylabel(title)
        axes.set_ylim(bottom=0)
        axes.legend(fontsize="small")
    return figure
