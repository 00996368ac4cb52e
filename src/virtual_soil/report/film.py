"""Moving pictures of an experiment: what its looks showed, drawn as frames of a GIF."""

from collections.abc import Callable
from dataclasses import dataclass

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

#: Pictures in a film, and how many are shown in a second.
N_FRAMES = 60
FRAMES_PER_S = 15
#: How often the last picture is repeated, so that the eye can rest on it.
LAST_REPEATED = 20
N_LAYERS = 6
N_STRIPES = 8
WIDTH_PX = 720
DPI = 100


@dataclass(frozen=True)
class Frame:
    """One look: time in s, the grains, which of the first frame's grains they are, and the walls by name where they stand."""

    time_s: float
    grains: Grains
    numbers: np.ndarray
    walls: dict[str, Wall]


class Film:
    """Keeps a frame at every look of one stage; to be handed to an experiment as `each`."""

    def __init__(self, stage: str):
        self.stage = stage
        self.frames: list[Frame] = []

    def __call__(self, simulation: Simulation, stage: str) -> None:
        """Keep this look."""
        if stage != self.stage:
            return
        grains, time_s = simulation.grains, simulation.time_s
        numbers = np.arange(len(grains))
        if self.frames:
            last = self.frames[-1]
            numbers = last.numbers[still_there(last.grains, grains, time_s - last.time_s)]
        self.frames.append(Frame(time_s, grains, numbers, {name: simulation.wall(name) for name in simulation.wall_names}))

    def shown(self, n_frames: int | None = None) -> list[Frame]:
        """At most so many frames (N_FRAMES), evenly over the time, the first and the last among them."""
        times = np.array([frame.time_s for frame in self.frames])
        wanted = np.linspace(times[0], times[-1], n_frames or N_FRAMES)
        chosen = np.unique(np.abs(times - wanted[:, None]).argmin(axis=1))
        return [self.frames[k] for k in chosen]


def still_there(before: Grains, after: Grains, seconds: float) -> np.ndarray:
    """Indices into `before` of the grains in `after`.

    Those that leave have fallen off the plate: they are the ones that fall lowest. The others close the gap, in the same order.
    """
    heights = before.positions_m[:, 2] + seconds * before.velocities_m_s[:, 2]
    return np.sort(np.argsort(heights)[len(before) - len(after) :])


def layers(grains: Grains) -> np.ndarray:
    """Number of the horizontal layer in which each grain lies, from the bottom."""
    z = grains.positions_m[:, 2]
    return np.minimum(np.floor(N_LAYERS * z / z.max()), N_LAYERS - 1)


def stripes(grains: Grains) -> np.ndarray:
    """0 or 1 for the upright stripe in which each grain lies, as in the report's figure of the shear box."""
    x = grains.positions_m[:, 0]
    return np.minimum(np.floor(N_STRIPES * x / x.max()), N_STRIPES - 1) % 2


def draw_wall(axes, wall: Wall) -> None:
    """A wall's cut with the plane of the picture, in mm; what lies outside of the picture is cut off by the axes."""
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
    """What of x and z all frames fill, with a margin of two grains."""
    places = np.concatenate([frame.grains.positions_m for frame in frames])[:, [0, 2]]
    margin = 4.0 * frames[0].grains.radii_m.max()
    low, high = 1e3 * (places.min(axis=0) - margin), 1e3 * (places.max(axis=0) + margin)
    return (low[0], high[0]), (low[1], high[1])


def write_gif(path: str, frames: list[Frame], colour: np.ndarray, title: Callable[[Frame], str], cut: bool = False) -> None:
    """Write a film; `colour` holds a number for every grain of the first frame. Nothing in it depends on the clock."""
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
