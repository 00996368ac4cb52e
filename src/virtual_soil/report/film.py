"""Film an experiment: keep its state at every sampling interval, and draw frames of a GIF."""

from collections.abc import Callable
from dataclasses import dataclass
from types import ModuleType

import matplotlib as mpl

mpl.use("Agg")

import numpy as np
import pandas as pd
from matplotlib.animation import PillowWriter
from matplotlib.figure import Figure

from dem import Box, Grains, Simulation, Tube, Wall
from virtual_soil.campaign.files import whole
from virtual_soil.campaign.simulate import grain_table
from virtual_soil.report.plots import draw_grains

#: Number of frames in a film, and frames shown per second.
N_FRAMES = 60
FRAMES_PER_S = 15
#: Number of repetitions of the last frame.
LAST_REPEATED = 20
WIDTH_PX = 720
DPI = 100


@dataclass(frozen=True)
class Frame:
    """State at one time: grains, their numbers in the first frame, and walls by name."""

    time_s: float
    grains: Grains
    numbers: np.ndarray
    walls: dict[str, Wall]


class Film:
    """Keep a frame at every sampling interval of one stage; pass it to an experiment as `each`."""

    def __init__(self, stage: str):
        self.stage = stage
        self.frames: list[Frame] = []

    def __call__(self, simulation: Simulation, stage: str) -> None:
        """Keep this state."""
        if stage != self.stage:
            return
        grains, time_s = simulation.grains, simulation.time_s
        numbers = np.arange(len(grains))
        if self.frames:
            last = self.frames[-1]
            numbers = last.numbers[still_there(last.grains, grains, time_s - last.time_s)]
        self.frames.append(Frame(time_s, grains, numbers, {name: simulation.wall(name) for name in simulation.wall_names}))

    def shown(self, n_frames: int | None = None) -> list[Frame]:
        """Return at most `n_frames` frames (N_FRAMES), evenly distributed in time, including the first and the last."""
        times = np.array([frame.time_s for frame in self.frames])
        wanted = np.linspace(times[0], times[-1], n_frames or N_FRAMES)
        chosen = np.unique(np.abs(times - wanted[:, None]).argmin(axis=1))
        return [self.frames[k] for k in chosen]


def still_there(before: Grains, after: Grains, seconds: float) -> np.ndarray:
    """Indices into `before` of the grains in `after`.

    Removed grains have fallen off the plate, so they are the lowest ones. The others keep their order.
    """
    heights = before.positions_m[:, 2] + seconds * before.velocities_m_s[:, 2]
    return np.sort(np.argsort(heights)[len(before) - len(after) :])


def draw_wall(axes, wall: Wall) -> None:
    """Draw the section of a wall with the plane of the picture, in mm."""
    style = {"color": "black", "linewidth": 1.5}
    if isinstance(wall, Box):
        axes.plot([1e3 * wall.low_m[0], 1e3 * wall.high_m[0]], [1e3 * wall.low_m[2], 1e3 * wall.high_m[2]], **style)
    elif isinstance(wall, Tube):
        for side in (-1e3, 1e3):
            axes.plot([side * wall.radius_m] * 2, [1e3 * wall.bottom_m, 1e3 * wall.top_m], **style)


def draw_frame(axes, frame: Frame, colour: np.ndarray, limits_mm, title: str, cut: bool) -> None:
    """Grains and walls of one frame on cleared axes; with `cut`, only the half behind the plane y = 0."""
    axes.clear()
    seen = frame.grains.positions_m[:, 1] > 0.0 if cut else np.ones(len(frame.grains), bool)
    draw_grains(axes, pd.DataFrame(grain_table(frame.grains))[seen], colour[frame.numbers[seen]], clim=(0.0, colour.max() or 1.0))
    for wall in frame.walls.values():
        draw_wall(axes, wall)
    (left, right), (low, high) = limits_mm
    axes.set(xlim=(left, right), ylim=(low, high), title=title)


def limits_mm(frames: list[Frame]) -> tuple[tuple[float, float], tuple[float, float]]:
    """Ranges of x and z over all frames, with a margin of two grain diameters."""
    places = np.concatenate([frame.grains.positions_m for frame in frames])[:, [0, 2]]
    margin = 4.0 * frames[0].grains.radii_m.max()
    low, high = 1e3 * (places.min(axis=0) - margin), 1e3 * (places.max(axis=0) + margin)
    return (low[0], high[0]), (low[1], high[1])


def shoot(experiment: ModuleType, row: dict, settings: dict) -> Film:
    """Simulate a design row and film the stage that its experiment shows."""
    film = Film(experiment.STAGE)
    experiment.simulate(row, settings, film)
    return film


def animate(experiment: ModuleType, row: dict, settings: dict, path: str) -> list[Frame]:
    """Simulate a design row, write the film of it and return its frames."""
    film = shoot(experiment, row, settings)
    shown, colour = film.shown(), experiment.colour(film.frames[0].grains)
    write_gif(path, shown, colour, lambda frame: experiment.title(frame, row, settings), experiment.CUT)
    return shown


def write_gif(path: str, frames: list[Frame], colour: np.ndarray, title: Callable[[Frame], str], cut: bool = False) -> None:
    """Write a film; `colour` holds a number for every grain of the first frame. The same frames give the same bytes."""
    limits = limits_mm(frames)
    (left, right), (low, high) = limits
    width = WIDTH_PX / DPI
    figure = Figure(figsize=(width, 0.82 * width * (high - low) / (right - left) + 1.0), dpi=DPI)
    axes = figure.subplots()
    writer = PillowWriter(fps=FRAMES_PER_S)
    with whole(path) as part, writer.saving(figure, part, DPI):
        for frame in [*frames, *frames[-1:] * LAST_REPEATED]:
            draw_frame(axes, frame, colour, limits, title(frame), cut)
            writer.grab_frame()
