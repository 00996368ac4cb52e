"""Figures of what happens under the wheel: stresses along the rim, the rut, the flow; drawn only from their tables."""

import matplotlib as mpl

mpl.use("Agg")

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

#: Number of runs whose flow is drawn.
N_FIELDS = 3
#: Half width of the picture of the flow and its depth below the axle, in radii.
FIELD_RADII, DEPTH_RADII = 1.8, 1.8
#: Cells of the rut's profile along the track: those within this share of the wheel's width from its middle plane.
TRACK_SHARE = 0.25
#: Cells of the profile across: from where the travel began to this many radii behind the axle.
BEHIND_RADII = 0.5


def first_beds(runs: pd.DataFrame) -> list[int]:
    """Numbers of the runs on the first bed of each case."""
    return np.flatnonzero(runs["seed"] == runs.groupby("case")["seed"].transform("first")).tolist()


def label_of(run: dict) -> str:
    """Case and slip of a run."""
    return f"{run['case']}, " + ("free" if pd.isna(run["asked_slip"]) else f"s = {run['asked_slip']:g}")


def along_rim(runs: pd.DataFrame, rims: list[pd.DataFrame]) -> Figure:
    """Plot normal and shear stress against the angle, a line with its standard error for each run of the first beds."""
    figure = Figure(figsize=(9.0, 3.6), layout="constrained")
    every = runs.to_dict("records")
    shown = [number for number in first_beds(runs) if len(rims[number])]
    loaded = [rims[k]["theta_deg"][rims[k]["normal_stress_pa"] > 0.01 * rims[k]["normal_stress_pa"].max()] for k in shown]
    for axes, name in zip(figure.subplots(1, 2), ("normal_stress", "shear_stress"), strict=True):
        for number in shown:
            rim = rims[number]
            stress, error = 1e-3 * rim[f"{name}_pa"], 1e-3 * rim[f"{name}_error_pa"]
            axes.plot(rim["theta_deg"], stress, linewidth=1.0, label=label_of(every[number]))
            axes.fill_between(rim["theta_deg"], stress - error, stress + error, alpha=0.2)
        axes.axhline(0.0, color="0.7", linewidth=0.7)
        axes.axvline(0.0, color="0.7", linewidth=0.7)
        if loaded:
            axes.set_xlim(min(angles.min() for angles in loaded) - 10.0, max(angles.max() for angles in loaded) + 10.0)
        axes.set_xlabel("angle from the lowest point, forwards (degrees)")
        axes.set_ylabel(f"{name.replace('_', ' ')} (kPa)")
    if shown:
        figure.axes[0].legend(fontsize="x-small")
    return figure


def profiles(run: dict, history: pd.DataFrame, rut: pd.DataFrame) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Change of height across and along the track: means and standard deviations over the cells of each y_m, and of each x_m.

    Across: of the cells behind the wheel. Along: of the cells near its middle plane.
    """
    change = rut.assign(change_m=rut["height_after_m"] - rut["height_before_m"])
    travelled = history["x_m"][history["time_s"] >= 0.0]
    behind = change["x_m"].between(travelled.min(), travelled.max() - BEHIND_RADII * run["radius_m"])
    track = change["y_m"].abs() <= TRACK_SHARE * run["width_m"]
    return tuple(change[cells].groupby(name)["change_m"].agg(["mean", "std"]) for cells, name in ((behind, "y_m"), (track, "x_m")))


def rut(runs: pd.DataFrame, histories: list[pd.DataFrame], ruts: list[pd.DataFrame]) -> Figure:
    """Plot the change of height across and along the track, a line for each run of the first beds."""
    figure = Figure(figsize=(9.0, 3.6), layout="constrained")
    across, along = figure.subplots(1, 2)
    for number in first_beds(runs):
        run = runs.iloc[number].to_dict()
        if ruts[number].empty or histories[number]["time_s"].max() <= 0.0:
            continue
        for axes, profile in zip((across, along), profiles(run, histories[number], ruts[number]), strict=True):
            at, mean, spread = 1e3 * profile.index.to_numpy(), 1e3 * profile["mean"], 1e3 * profile["std"].fillna(0.0)
            (line,) = axes.plot(at, mean, marker=".", linewidth=1.0, label=label_of(run))
            axes.fill_between(at, mean - spread, mean + spread, color=line.get_color(), alpha=0.15)
        along.axvline(1e3 * histories[number]["x_m"].max(), color="0.7", linewidth=0.7, linestyle=":")
    for axes, place in ((across, "across, from the middle plane (mm)"), (along, "along the travel (mm)")):
        axes.axhline(0.0, color="0.7", linewidth=0.7)
        axes.set_xlabel(place)
        axes.set_ylabel("change of height (mm)")
    if across.get_legend_handles_labels()[1]:
        across.legend(fontsize="x-small")
    return figure


def field(runs: pd.DataFrame, fields: list[pd.DataFrame]) -> Figure:
    """Draw displacement (colour) and velocity (arrows) in the middle plane for the first, middle and last run of the first bed."""
    found = [k for k in first_beds(runs) if len(fields[k]) and runs["case"].iloc[k] == runs["case"].iloc[0]]
    shown = (
        [found[k] for k in sorted({round(share * (len(found) - 1)) for share in np.linspace(0.0, 1.0, N_FIELDS)})] if found else []
    )
    figure = Figure(figsize=(4.4 * max(len(shown), 1), 3.6), layout="constrained")
    for axes, number in zip(np.atleast_1d(figure.subplots(1, max(len(shown), 1))), shown, strict=False):
        run, grains = runs.iloc[number].to_dict(), fields[number]
        radius, angles = run["radius_m"], np.linspace(0.0, 2.0 * np.pi, 120)
        near = grains[(grains["x_m"].abs() < FIELD_RADII * radius) & (grains["z_m"] > -DEPTH_RADII * radius)]
        moved = 1e3 * np.hypot(near["displacement_x_m"], near["displacement_z_m"])
        dots = axes.scatter(1e3 * near["x_m"], 1e3 * near["z_m"], c=moved, s=8, cmap="viridis", linewidths=0)
        velocity = near["velocity_x_m_s"], near["velocity_z_m_s"]
        axes.quiver(1e3 * near["x_m"], 1e3 * near["z_m"], *velocity, angles="xy", color="black", width=2e-3)
        axes.plot(1e3 * radius * np.sin(angles), 1e3 * radius * np.cos(angles), color="black", linewidth=1.0)
        figure.colorbar(dots, ax=axes, label="displacement (mm)", shrink=0.6)
        axes.set_aspect("equal")
        axes.set_xlim(-1e3 * FIELD_RADII * radius, 1e3 * FIELD_RADII * radius)
        axes.set_ylim(-1e3 * DEPTH_RADII * radius, 0.0)
        fastest = float(np.hypot(*velocity).max()) if len(near) else 0.0
        axes.set_title(f"{label_of(run)}; longest arrow {1e3 * fastest:.3g} mm/s", fontsize="small")
        axes.set_xlabel("forwards of the axle (mm)")
        axes.set_ylabel("above the axle (mm)")
    return figure
