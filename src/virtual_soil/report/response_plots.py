"""Figures of responses over the design variables: simulated points, surrogates, and errors at left-out points."""

from collections.abc import Mapping

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from matplotlib.ticker import NullLocator

from virtual_soil.calibration.response import Response
from virtual_soil.campaign.experiments.registry import RESPONSES
from virtual_soil.report.plots import COLOURS, canvas
from virtual_soil.report.quantities import VARIABLES, axis_label, printed_unit, symbol
from virtual_soil.report.text import spoken

#: Points of a drawn line, and of a drawn surface along each axis.
LINE_POINTS, SWEEP_POINTS, SURFACE_POINTS = 80, 60, 25
#: Panels beside each other, so that their labels do not overlap.
MOST_COLUMNS = 4
#: Colours of the residuals span values up to this quantile.
COLOUR_QUANTILE = 0.98


def response_lines(points: pd.DataFrame, response: Response, fits: Mapping, radius_m: float, printed=None) -> Figure:
    """A response over static friction, one colour per rolling friction.

    Points: simulated. Lines: fits["chosen"] with its error. Dotted: fits["polynomial"]. Dashed: the printed surrogate, if given.
    """
    figure, (axes,) = canvas()
    s = np.linspace(points["static_friction"].min(), points["static_friction"].max(), LINE_POINTS)
    for k, (rolling, group) in enumerate(points.groupby("rolling_friction")):
        colour = COLOURS[k % len(COLOURS)]
        means = group.groupby("static_friction")[response.column].mean()
        bars = group.groupby("static_friction")[response.error_column].mean() if response.error_column else None
        axes.errorbar(means.index, means, yerr=bars, fmt="o", color=colour, capsize=2, label=f"µr = {rolling:g}")
        values = {"static_friction": s, "rolling_friction": np.full_like(s, rolling), "radius_m": np.full_like(s, radius_m)}
        draw_fits(axes, fits, values, colour, printed)
    axes.set_xlabel(axis_label("static_friction"))
    axes.set_ylabel(axis_label(response.name))
    if not response.signed:
        axes.set_ylim(bottom=0.0)  # a surrogate may go below, a soil cannot
    axes.legend(fontsize="small", ncols=2)
    return figure


def draw_fits(axes, fits: Mapping, values: dict[str, np.ndarray], colour: str, printed) -> None:
    """All surrogates of a response along static friction."""
    s, (mean, spread) = values["static_friction"], fits["chosen"].predict_with_error(values)
    axes.plot(s, mean, color=colour, linewidth=1.2)
    axes.fill_between(s, mean - spread, mean + spread, color=colour, alpha=0.15, linewidth=0)
    axes.plot(s, fits["polynomial"].predict(values), ":", color=colour, linewidth=1)
    if printed is not None:
        axes.plot(s, printed.predict(values), "--", color=colour, linewidth=0.8)


def arranged(n: int) -> tuple[int, int]:
    """Rows and columns of n panels, at most MOST_COLUMNS of them beside each other."""
    rows = -(-n // MOST_COLUMNS)
    return rows, -(-n // rows)


def several(n: int, height: float):
    """A figure with n axes in rows of a height."""
    rows, columns = arranged(n)
    figure = Figure(figsize=(11, height * rows), layout="constrained")
    return figure, [figure.add_subplot(rows, columns, k + 1) for k in range(n)]


def surfaces(points: Mapping[str, pd.DataFrame], surrogates: Mapping, radius_m: float) -> Figure:
    """Surface of every response over the friction plane at one radius, with the simulated points."""
    rows, columns = arranged(len(points))
    figure = Figure(figsize=(11, min(4.2, 12.6 / columns) * rows))
    figure.subplots_adjust(left=0.03, right=0.94, bottom=0.06 / rows, top=0.96, wspace=0.1, hspace=0.12)
    panels = [figure.add_subplot(rows, columns, k + 1, projection="3d") for k in range(len(points))]
    for axes, (name, table) in zip(panels, points.items(), strict=True):
        draw_surface(axes, table, RESPONSES[name], surrogates[name], radius_m)
    return figure


def draw_surface(axes, table: pd.DataFrame, response: Response, surrogate, radius_m: float) -> None:
    """One response's surface and its simulated points."""
    static, rolling = "static_friction", "rolling_friction"
    ranges = [surrogate.ranges[name] for name in (static, rolling)]
    s, r = np.meshgrid(*(np.linspace(low, high, SURFACE_POINTS) for low, high in ranges))
    field = surrogate.predict({static: s, rolling: r, "radius_m": np.full_like(s, radius_m)})
    field = field if response.signed else np.maximum(field, 0.0)
    axes.plot_surface(s, r, field, cmap="viridis", alpha=0.7, linewidth=0)
    axes.scatter(table[static], table[rolling], table[response.column], color="black", s=8, depthshade=False)
    axes.set(xlabel=symbol(static), ylabel=symbol(rolling))
    axes.set_title(axis_label(response.name), fontsize="small")
    axes.view_init(25, -130)


def residual_map(residuals: pd.DataFrame, radius_m: float) -> Figure:
    """Left-out errors over the friction grid at the base radius: a column per response, a row per kind of surrogate."""
    here = residuals[np.isclose(residuals["radius_m"], radius_m) & (residuals["set"] == "f")]
    responses, kinds = list(dict.fromkeys(here["response"])), list(dict.fromkeys(here["model"]))
    figure = Figure(figsize=(max(11, 2.8 * len(responses)), 5.6), layout="constrained")
    panels = figure.subplots(len(kinds), len(responses), squeeze=False, sharex=True, sharey=True)
    for column, response in enumerate(responses):
        draw_residuals(figure, panels[:, column], here[here["response"] == response], RESPONSES[response], kinds)
    for axes in panels[-1]:
        axes.set_xlabel(axis_label("static_friction"))
    for axes in panels[:, 0]:
        axes.set_ylabel(axis_label("rolling_friction"))
    return figure


def slices(points: Mapping[str, pd.DataFrame], surrogates: Mapping, optima: pd.DataFrame, variables: list[str]) -> Figure:
    """Every response (rows) over every variable (columns): simulated points, and surrogates through the optimum of every case."""
    figure = Figure(figsize=(max(3.2 * len(variables), 6.0), 2.6 * len(points)), layout="constrained")
    panels = figure.subplots(len(points), len(variables), squeeze=False, sharey="row", sharex="col")
    for row, (name, table) in zip(panels, points.items(), strict=True):
        column, surrogate = RESPONSES[name].column, surrogates[name]
        means = table.groupby("point_id")[[*variables, column]].mean()
        for axes, variable in zip(row, variables, strict=True):
            scale = VARIABLES[variable].scale
            axes.plot(scale * means[variable], means[column], ".", color="0.6", label="simulated")
            low, high = surrogate.ranges[variable]
            x = np.linspace(low, high, LINE_POINTS)
            for colour, (_, optimum) in zip(COLOURS, optima.iterrows(), strict=False):
                values = {other: np.full_like(x, optimum[other]) for other in variables} | {variable: x}
                mean, spread = surrogate.predict_with_error(values)
                axes.plot(scale * x, mean, color=colour, label=spoken(optimum["case"]))
                axes.fill_between(scale * x, mean - spread, mean + spread, color=colour, alpha=0.15, linewidth=0)
                axes.plot(scale * optimum[variable], optimum[column], "*", color=colour, markersize=11)
        row[0].set_ylabel(axis_label(name))
    for axes, variable in zip(panels[-1], variables, strict=True):
        axes.set_xlabel(axis_label(variable))
    panels[0, 0].legend(fontsize="x-small")
    return figure


def parity(residuals: pd.DataFrame, chosen: Mapping) -> Figure:
    """Predictions of the chosen surrogates at left-out points over the simulated responses, a panel per response."""
    figure, panels = several(len(chosen), 3.2)
    for axes, (name, model) in zip(panels, chosen.items(), strict=True):
        points = residuals[(residuals["response"] == name) & (residuals["model"] == model.model)].dropna(subset="left_out_residual")
        predicted = points["observed"] - points["left_out_residual"]
        ends = [min(points["observed"].min(), predicted.min()), max(points["observed"].max(), predicted.max())]
        axes.plot(ends, ends, color="0.6", linewidth=1)
        axes.errorbar(points["observed"], predicted, xerr=points["noise"], fmt="o", markersize=3, linewidth=0.7, color=COLOURS[0])
        axes.set(xlabel="simulated", ylabel="predicted")
        axes.set_title(axis_label(name), fontsize="small")
    return figure


def draw_residuals(figure: Figure, panels: np.ndarray, residuals: pd.DataFrame, response: Response, kinds: list[str]) -> None:
    """Left-out errors of one response, a panel per kind of surrogate."""
    limit = float(residuals["left_out_residual"].abs().quantile(COLOUR_QUANTILE)) or 1.0
    style = {"s": 160, "cmap": "RdBu", "vmin": -limit, "vmax": limit, "edgecolors": "black", "linewidths": 0.4}
    for axes, kind in zip(panels, kinds, strict=True):
        points = residuals[residuals["model"] == kind]
        shades = axes.scatter(points["static_friction"], points["rolling_friction"], c=points["left_out_residual"], **style)
        axes.set_title(f"{response.words}, {spoken(kind)}", fontsize="small")
    figure.colorbar(shades, ax=panels, label=f"error ({printed_unit(response)})")


def radius_sweep(points: Mapping[str, pd.DataFrame], surrogates: Mapping) -> Figure:
    """Responses over the radius at the sweep's couples; lines are g(r) times the couple's own value at r0."""
    figure, panels = several(len(points), 3.4)
    for axes, (name, table) in zip(panels, points.items(), strict=True):
        for k, (couple, group) in enumerate(table.groupby(["static_friction", "rolling_friction"])):
            means = group.groupby("radius_m")[RESPONSES[name].column].mean()
            draw_sweep(axes, means, table["radius_m"], surrogates[name].g["radius_m"], couple, COLOURS[k % len(COLOURS)])
        axes.set_xscale("log")
        axes.set_xticks(1e6 * np.sort(table["radius_m"].unique()))
        axes.xaxis.set_major_formatter("{x:g}")
        axes.xaxis.set_minor_locator(NullLocator())
        axes.set_xlabel(axis_label("radius_m"))
        axes.set_ylabel(axis_label(name))
        axes.legend(fontsize="small")
    return figure


def draw_sweep(axes, means: pd.Series, radii_m: pd.Series, factor, couple: tuple[float, float], colour: str) -> None:
    """Mean responses of one couple over the radius, and g(r) through its value at the reference radius."""
    axes.plot(1e6 * means.index, means, "o", color=colour, label=f"µs {couple[0]:g}, µr {couple[1]:g}")
    home = means[np.isclose(means.index, factor.reference)]
    if len(home):
        radii = np.geomspace(radii_m.min(), radii_m.max(), SWEEP_POINTS)
        axes.plot(1e6 * radii, home.iloc[0] * factor(radii), color=colour, linewidth=1)
