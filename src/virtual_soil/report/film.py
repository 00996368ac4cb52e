"""Films of an experiment: recorded frames drawn as a GIF."""

from collections.abc import Callable, Sequence
from types import ModuleType
from typing import cast

import matplotlib as mpl

mpl.use("Agg")

import numpy as np
import pandas as pd
from matplotlib.animation import PillowWriter
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure

from dem import Box, Mesh, Tube, Wall
from dem.meshes.topology import topology_of
from virtual_soil.campaign.files import whole
from virtual_soil.campaign.grains import grain_table
from virtual_soil.campaign.recording import Frame, record
from virtual_soil.report.plots import draw_grains

#: Frames shown per second.
FRAMES_PER_S = 15
#: Number of repetitions of the last frame.
LAST_REPEATED = 20
WIDTH_PX = 720
#: Faces that differ by less lie in one plane.
FLAT_RAD = 1e-3
DPI = 100


def draw_wall(axes, wall: Wall) -> None:
    """Draw the section of a wall with the plane of the picture, in mm; of a mesh its edges."""
    style = {"color": "black", "linewidth": 1.5}
    if isinstance(wall, Box):
        axes.plot([1e3 * wall.low_m[0], 1e3 * wall.high_m[0]], [1e3 * wall.low_m[2], 1e3 * wall.high_m[2]], **style)
    elif isinstance(wall, Tube):
        for side in (-1e3, 1e3):
            axes.plot([side * wall.radius_m] * 2, [1e3 * wall.bottom_m, 1e3 * wall.top_m], **style)
    elif isinstance(wall, Mesh):
        axes.add_collection(LineCollection(list(1e3 * edges_m(wall)[..., [0, 2]]), color="black", linewidth=1.0))


def edges_m(mesh: Mesh) -> np.ndarray:
    """Edges (k, 2, 3) between faces that do not lie in one plane, and a spoke to a corner, by which the mesh is seen to turn."""
    topology = topology_of(mesh.vertices_m, mesh.triangles, mesh.crease_angle_deg)
    corners = mesh.corners_m
    sides = np.stack([corners, np.roll(corners, -1, axis=1)], axis=2)[topology.angle[topology.edge_of] > FLAT_RAD]
    return np.concatenate([sides, [[mesh.position_m, corners[0, 0]]]])


def draw_frame(axes, frame: Frame, colour: np.ndarray, limits_mm, title: str, cut: bool) -> None:
    """Grains and walls of one frame on cleared axes; with `cut`, only the half behind the plane y = 0."""
    axes.clear()
    seen = frame.grains.positions_m[:, 1] > 0.0 if cut else np.ones(len(frame.grains), bool)
    draw_grains(axes, pd.DataFrame(grain_table(frame.grains))[seen], colour[frame.numbers[seen]], clim=(0.0, colour.max() or 1.0))
    for wall in frame.walls.values():
        draw_wall(axes, wall)
    (left, right), (low, high) = limits_mm
    axes.set(xlim=(left, right), ylim=(low, high), title=title)


def limits_mm(frames: list[Frame], bodies: Sequence[str] = ()) -> tuple[tuple[float, float], tuple[float, float]]:
    """Ranges of x and z of the grains, and of some meshes, over all frames, with a margin of two grain diameters."""
    grains = [frame.grains.positions_m for frame in frames]
    surfaces = [cast(Mesh, frame.walls[name]).corners_m.reshape(-1, 3) for frame in frames for name in bodies]
    places = np.concatenate([*grains, *surfaces])[:, [0, 2]]
    margin = 4.0 * frames[0].grains.radii_m.max()
    low, high = 1e3 * (places.min(axis=0) - margin), 1e3 * (places.max(axis=0) + margin)
    return (low[0], high[0]), (low[1], high[1])


def animate(experiment: ModuleType, row: dict, settings: dict, path: str) -> list[Frame]:
    """Simulate a design row, write the film of it and return its frames."""
    film = record(row, settings, experiment.STAGE)
    shown, colour = film.shown(), experiment.colour(film.frames[0].grains)
    write_gif(path, shown, colour, lambda frame: experiment.title(frame, row, settings), experiment.CUT)
    return shown


def write_gif(
    path: str,
    frames: list[Frame],
    colour: np.ndarray,
    title: Callable[[Frame], str],
    cut: bool = False,
    bodies: Sequence[str] = (),
) -> None:
    """Write a film; `colour` holds a number for every grain of the first frame. The same frames give the same bytes.

    bodies : names of the meshes that are to be seen as a whole, as all grains are.
    """
    limits = limits_mm(frames, bodies)
    (left, right), (low, high) = limits
    width = WIDTH_PX / DPI
    figure = Figure(figsize=(width, 0.82 * width * (high - low) / (right - left) + 1.0), dpi=DPI)
    axes = figure.subplots()
    writer = PillowWriter(fps=FRAMES_PER_S)
    with whole(path) as part, writer.saving(figure, part, DPI):
        for frame in [*frames, *frames[-1:] * LAST_REPEATED]:
            draw_frame(axes, frame, colour, limits, title(frame), cut)
            writer.grab_frame()
