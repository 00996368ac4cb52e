"""The paper's figures from our tables: each function takes tables and returns a matplotlib figure."""

import io

import matplotlib as mpl

mpl.use("Agg")

import numpy as np
import pandas as pd
from matplotlib.collections import EllipseCollection
from matplotlib.figure import Figure
from matplotlib.ticker import NullLocator

#: Colours that stay apart for colour-blind readers (Okabe & Ito).
COLOURS = ["#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000"]

#: Half width of the band around a target near zero, in its unit (Pa or degrees).
LEAST_BAND = 1.0

LABELS = {
    "cohesion_pa": "cohesion c (Pa)",
    "friction_angle_deg": "friction angle φ (°)",
    "angle_of_repose_deg": "angle of repose A (°)",
    "static_friction": "static friction µs",
    "rolling_friction": "rolling friction µr",
    "radius_m": "radius r (µm)",
}


def svg(figure: Figure) -> str:
    """A figure as SVG; the same figure gives the same text."""
    buffer = io.StringIO()
    with mpl.rc_context({"svg.hashsalt": "virtual-soil"}):
        figure.savefig(buffer, format="svg", dpi=200, metadata={"Date": None})
    return buffer.getvalue()


def canvas(columns: int = 1, width: float = 8.0, height: float = 4.2):
    """A figure with axes side by side."""
    figure = Figure(figsize=(width, height), layout="constrained")
    return figure, np.atleast_1d(figure.subplots(1, columns))


def draw_grains(axes, grains: pd.DataFrame, colour, **settings) -> None:
    """Grains seen along y as circles at true scale (mm), far ones first."""
    order = np.argsort(-grains["y_m"].to_numpy())
    shown = grains.iloc[order]
    diameters = 2e3 * shown["radius_m"].to_numpy()
    circles = EllipseCollection(
        diameters,
        diameters,
        0.0,
        units="xy",
        offsets=1e3 * shown[["x_m", "z_m"]].to_numpy(),
        offset_transform=axes.transData,
        array=np.asarray(colour)[order],
        edgecolors="black",
        linewidths=0.15,
        cmap="viridis",
        rasterized=True,
        **settings,
    )
    axes.add_collection(circles)
    axes.set_aspect("equal")
    axes.autoscale_view()
    axes.set_xlabel("x (mm)")
    axes.set_ylabel("z (mm)")


def heap(filled: pd.DataFrame, grains: pd.DataFrame, angle_deg: float) -> Figure:
    """Figure 2: the grains in the tube, and the heap at rest with a line at its angle of repose."""
    figure, (left, right) = canvas(2, height=3.2)
    for axes, state, title in ((left, filled, "before the lift"), (right, grains, "at rest")):
        if len(state):
            draw_grains(axes, state, np.hypot(state["x_m"], state["y_m"]))
        axes.axhline(0.0, color="black")
        axes.set_title(title)
    if len(grains) and angle_deg > 0:
        top = 1e3 * float((grains["z_m"] + grains["radius_m"]).max())
        foot = top / np.tan(np.radians(angle_deg))
        right.plot([0, foot], [top, 0], color=COLOURS[1], linewidth=2, label=f"{angle_deg:.1f}°")
        right.legend(loc="upper right")
    return figure


def lift(frames: pd.DataFrame) -> Figure:
    """Figure 2 in four moments of the lift, cut through the middle; grains keep the colour of the height at which they began."""
    figure, panels = canvas(4, width=11.0, height=3.4)
    numbers = np.unique(frames["frame"])
    start = frames[frames["frame"] == 0].set_index("grain")["z_m"]
    halves = frames[frames["y_m"] > 0.0]
    for axes, number in zip(panels, numbers[np.linspace(0, len(numbers) - 1, len(panels)).astype(int)], strict=True):
        frame = halves[halves["frame"] == number]
        draw_grains(axes, frame, start.loc[frame["grain"]], clim=(0.0, start.max()))
        moment = frames[frames["frame"] == number].iloc[0]
        for side in (-1e3, 1e3):
            axes.plot([side * moment["tube_radius_m"]] * 2, [1e3 * moment["tube_bottom_m"], 1e3 * start.max()], color="black")
        axes.set(xlim=1e3 * np.array([frames["x_m"].min(), frames["x_m"].max()]), ylim=(0.0, 1.05e3 * start.max()))
        axes.set_title(f"{moment['time_s']:.3f} s")
    return figure


def shear_box(before: pd.DataFrame, after: pd.DataFrame) -> Figure:
    """Figure 3: the shear box before and after; grains keep the colour of the stripe in which they began."""
    figure, axes = canvas(2, height=3.0)
    stripes = np.floor(before["x_m"] / max(before["x_m"].max() / 8.0, 1e-12)) % 2 if len(before) else np.zeros(0)
    for panel, state, title in zip(axes, (before, after), ("before", "after"), strict=True):
        if len(state):
            draw_grains(panel, state, stripes)
        panel.set_title(title)
    return figure


def shear_curves(histories: dict[float, pd.DataFrame]) -> Figure:
    """Figure 4: shear stress against displacement at several normal stresses (Pa)."""
    figure, (axes,) = canvas()
    for k, (stress, history) in enumerate(sorted(histories.items())):
        colour = COLOURS[k % len(COLOURS)]
        axes.plot(1e3 * history["displacement_m"], history["shear_stress_pa"], color=colour, label=f"p = {stress:g} Pa")
    axes.set_xlabel("displacement of the lower frame (mm)")
    axes.set_ylabel("shear stress (Pa)")
    axes.legend()
    return figure


def strength_lines(shear: pd.DataFrame, strength: pd.Series | None, columns: tuple[str, str]) -> Figure:
    """Shear strengths of one point against normal stress, with its Mohr-Coulomb line if it has one."""
    figure, (axes,) = canvas()
    tau, p = columns
    axes.plot(shear[p], shear[tau], "o", color=COLOURS[0], label="simulated, each seed")
    if strength is not None:
        stresses = np.linspace(0.0, 1.05 * shear[p].max(), 50)
        line = strength["cohesion_pa"] + stresses * np.tan(np.radians(strength["friction_angle_deg"]))
        label = (
            f"c = {strength['cohesion_pa']:.0f} ± {strength['cohesion_se_pa']:.0f} Pa, "
            f"φ = {strength['friction_angle_deg']:.1f} ± {strength['friction_angle_se_deg']:.1f}°"
        )
        axes.plot(stresses, line, color=COLOURS[1], label=label)
    axes.set_xlabel("normal stress on the shear plane (Pa)")
    axes.set_ylabel("shear strength (Pa)")
    axes.legend()
    return figure


def response_lines(
    points: pd.DataFrame, column: str, surrogate, polynomial, radius_m: float, error: str | None = None, printed=None
) -> Figure:
    """Figure 5 and its kin: a response over mu_s, one colour per mu_r.

    Points simulated, lines fitted, dotted the polynomial, dashed the one that the paper prints, if it is given.
    """
    figure, (axes,) = canvas()
    s = np.linspace(points["static_friction"].min(), points["static_friction"].max(), 80)
    for k, (rolling, group) in enumerate(points.groupby("rolling_friction")):
        colour = COLOURS[k % len(COLOURS)]
        means = group.groupby("static_friction")[column].mean()
        bars = group.groupby("static_friction")[error].mean() if error else None
        axes.errorbar(means.index, means, yerr=bars, fmt="o", color=colour, capsize=2, label=f"µr = {rolling:g}")
        values = {"static_friction": s, "rolling_friction": np.full_like(s, rolling), "radius_m": np.full_like(s, radius_m)}
        mean, spread = surrogate.predict_with_error(values)
        axes.plot(s, mean, color=colour, linewidth=1.2)
        axes.fill_between(s, mean - spread, mean + spread, color=colour, alpha=0.15, linewidth=0)
        axes.plot(s, polynomial.predict(values), ":", color=colour, linewidth=1)
        if printed is not None:
            axes.plot(s, printed.predict(values), "--", color=colour, linewidth=0.8)
    axes.set_xlabel(LABELS["static_friction"])
    axes.set_ylabel(LABELS[column])
    axes.legend(fontsize="small", ncols=2)
    return figure


def surfaces(points: dict[str, pd.DataFrame], surrogates: dict, radius_m: float) -> Figure:
    """Every response's surface over the friction plane at one radius, with the simulated points."""
    figure = Figure(figsize=(11, 4.2))
    figure.subplots_adjust(left=0.0, right=0.94, bottom=0.06, top=0.98, wspace=0.1)
    panels = np.atleast_1d(figure.subplots(1, len(points), subplot_kw={"projection": "3d"}))
    for axes, (response, table) in zip(panels, points.items(), strict=True):
        column, surrogate = next(name for name in LABELS if name.startswith(response)), surrogates[response]
        ranges = (surrogate.ranges[name] for name in ("static_friction", "rolling_friction"))
        grids = (np.linspace(low, high, 25) for low, high in ranges)
        s, r = np.meshgrid(*grids)
        field = surrogate.predict({"static_friction": s, "rolling_friction": r, "radius_m": np.full_like(s, radius_m)})
        axes.plot_surface(s, r, field, cmap="viridis", alpha=0.7, linewidth=0)
        axes.scatter(table["static_friction"], table["rolling_friction"], table[column], color="black", s=8, depthshade=False)
        axes.set(xlabel=LABELS["static_friction"], ylabel=LABELS["rolling_friction"], zlabel=LABELS[column])
        axes.view_init(25, -130)
    return figure


def residual_map(residuals: pd.DataFrame, radius_m: float) -> Figure:
    """Left-out errors over the friction grid at the base radius: a column per response, a row per kind of surrogate."""
    here = residuals[np.isclose(residuals["radius_m"], radius_m) & (residuals["set"] == "f")]
    responses, kinds = list(dict.fromkeys(here["response"])), list(dict.fromkeys(here["model"]))
    figure = Figure(figsize=(11, 5.6), layout="constrained")
    panels = figure.subplots(len(kinds), len(responses), squeeze=False, sharex=True, sharey=True)
    for column, response in enumerate(responses):
        of_response = here[here["response"] == response]
        limit = float(of_response["left_out_residual"].abs().quantile(0.98)) or 1.0
        for row, kind in enumerate(kinds):
            axes, points = panels[row, column], of_response[of_response["model"] == kind]
            shades = axes.scatter(
                points["static_friction"], points["rolling_friction"], c=points["left_out_residual"], s=160, cmap="RdBu",
                vmin=-limit, vmax=limit, edgecolors="black", linewidths=0.4,
            )  # fmt: skip
            axes.set_title(f"{response.replace('_', ' ')}, {kind.replace('_', ' ')}", fontsize="small")
        figure.colorbar(shades, ax=panels[:, column], label=f"error ({'Pa' if response == 'cohesion' else '°'})")
    for axes in panels[-1]:
        axes.set_xlabel(LABELS["static_friction"])
    for axes in panels[:, 0]:
        axes.set_ylabel(LABELS["rolling_friction"])
    return figure


def iso_responses(calibration: pd.DataFrame, posterior: pd.DataFrame, equivalents: pd.DataFrame, surrogates: dict) -> Figure:
    """For every case: curves of equal response through its targets in the friction plane, posterior, equivalents and optimum."""
    ours = calibration[calibration["surrogate"] == "ours"]
    figure, panels = canvas(len(ours), width=max(5.0 * len(ours), 8.0), height=4.4)
    limits = next(iter(surrogates.values())).ranges
    s, r = np.meshgrid(*(np.linspace(low, high, 90) for low, high in (limits["static_friction"], limits["rolling_friction"])))
    for axes, (_, optimum) in zip(panels, ours.iterrows(), strict=False):
        own = posterior[posterior["case"] == optimum["case"]]
        axes.plot(own["static_friction"], own["rolling_friction"], ".", color="0.7", markersize=2.5, zorder=0)
        values = {"static_friction": s, "rolling_friction": r, "radius_m": np.full_like(s, optimum["radius_m"])}
        for k, (response, surrogate) in enumerate(surrogates.items()):
            column = next(name for name in LABELS if name.startswith(response))
            target, field = optimum[f"target_{column}"], surrogate.predict(values)
            reached = field.min() <= target <= field.max()
            label = f"{LABELS[column].split('(')[0]}= {target:g}" + ("" if reached else ": nowhere")
            axes.plot([], [], color=COLOURS[k], label=label)
            if reached:
                axes.contour(s, r, field, levels=[target], colors=COLOURS[k])
                band = max(0.05 * abs(target), LEAST_BAND)
                axes.contourf(s, r, field, levels=[target - band, target + band], colors=COLOURS[k], alpha=0.15)
        sets = equivalents[equivalents["case"] == optimum["case"]]
        axes.plot(sets["static_friction"], sets["rolling_friction"], "o", color="0.2", markerfacecolor="none", markersize=4)
        axes.plot(optimum["static_friction"], optimum["rolling_friction"], "*", color="black", markersize=13)
        axes.set_title(f"{optimum['case'].replace('_', ' ')}, r = {1e6 * optimum['radius_m']:.0f} µm", fontsize="medium")
        axes.set_xlabel(LABELS["static_friction"])
        axes.legend(fontsize="x-small", loc="upper right")
    panels[0].set_ylabel(LABELS["rolling_friction"])
    return figure


def radius_sweep(points: dict[str, pd.DataFrame], surrogates: dict) -> Figure:
    """Responses over the radius at the sweep's couples; lines are g(r) times the couple's own value at r0."""
    figure, panels = canvas(len(points), width=11, height=3.4)
    for axes, (response, table) in zip(panels, points.items(), strict=True):
        column = next(name for name in LABELS if name.startswith(response))
        factor = surrogates[response].g["radius_m"]
        radii = np.geomspace(table["radius_m"].min(), table["radius_m"].max(), 60)
        for k, ((s, r), group) in enumerate(table.groupby(["static_friction", "rolling_friction"])):
            colour = COLOURS[k % len(COLOURS)]
            means = group.groupby("radius_m")[column].mean()
            axes.plot(1e6 * means.index, means, "o", color=colour, label=f"µs {s:g}, µr {r:g}")
            home = means[np.isclose(means.index, factor.reference)]
            if len(home):
                axes.plot(1e6 * radii, home.iloc[0] * factor(radii), color=colour, linewidth=1)
        axes.set_xscale("log")
        axes.set_xticks(1e6 * np.sort(table["radius_m"].unique()))
        axes.xaxis.set_major_formatter("{x:g}")
        axes.xaxis.set_minor_locator(NullLocator())
        axes.set_xlabel(LABELS["radius_m"])
        axes.set_ylabel(LABELS[column])
        axes.legend(fontsize="small")
    return figure


def iterations(history: pd.DataFrame) -> Figure:
    """Cost over Gauss-Newton iterations for every case, ours and on the published surrogates."""
    figure, (axes,) = canvas()
    for k, ((case, source), run) in enumerate(history.groupby(["case", "surrogate"], sort=False)):
        style = {"ours": "-", "polynomial": "-.", "published": "--"}[source]
        axes.semilogy(run["iteration"], run["cost"], style, color=COLOURS[k % 7], label=f"{case} ({source})")
    axes.set_xlabel("Gauss–Newton iteration")
    axes.set_ylabel("cost")
    axes.legend(fontsize="small")
    return figure
