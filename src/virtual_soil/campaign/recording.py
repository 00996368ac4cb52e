"""Recording of one simulation: grains and walls at every sampling interval of a stage, for films and for the recorded lift."""

from dataclasses import dataclass
from importlib import import_module

import numpy as np

from dem import Grains, Simulation, Wall
from virtual_soil.campaign.experiments import module_of
from virtual_soil.campaign.experiments.common import engine_of, soil_of

#: Number of frames in a film.
N_FRAMES = 60


@dataclass(frozen=True)
class Frame:
    """State at one time: grains, their indices in the first frame, and walls by name."""

    time_s: float
    grains: Grains
    numbers: np.ndarray
    walls: dict[str, Wall]


class Film:
    """Keep a frame at every sampling interval of one stage; pass it to an experiment as `each`. n_spheres : of a grain."""

    def __init__(self, stage: str, n_spheres: int = 1):
        self.stage, self.n_spheres = stage, n_spheres
        self.frames: list[Frame] = []

    def __call__(self, simulation: Simulation, stage: str) -> None:
        """Append the current state."""
        if stage != self.stage:
            return
        grains, time_s = simulation.grains, simulation.time_s
        numbers = np.arange(len(grains))
        if self.frames:
            last = self.frames[-1]
            numbers = last.numbers[still_there(last.grains, grains, time_s - last.time_s, self.n_spheres)]
        self.frames.append(Frame(time_s, grains, numbers, {name: simulation.wall(name) for name in simulation.wall_names}))

    def shown(self, n_frames: int | None = None) -> list[Frame]:
        """Return at most `n_frames` frames (N_FRAMES), evenly distributed in time, including the first and the last."""
        times = np.array([frame.time_s for frame in self.frames])
        wanted = np.linspace(times[0], times[-1], n_frames or N_FRAMES)
        chosen = np.unique(np.abs(times - wanted[:, None]).argmin(axis=1))
        return [self.frames[k] for k in chosen]


def still_there(before: Grains, after: Grains, seconds: float, n_spheres: int = 1) -> np.ndarray:
    """Return the indices into `before` of the spheres in `after`.

    Removed grains have fallen off the plate, so they are the lowest; clumps go as a whole. The others keep their order.
    """
    if len(before) == len(after):
        return np.arange(len(after))
    heights = (before.positions_m[:, 2] + seconds * before.velocities_m_s[:, 2]).reshape(-1, n_spheres).mean(axis=1)
    left = np.sort(np.argsort(heights)[(len(before) - len(after)) // n_spheres :])
    return (n_spheres * left[:, None] + np.arange(n_spheres)).ravel()


def record(row: dict, settings: dict, stage: str) -> Film:
    """Simulate a design row and store a frame at every sampling interval of one stage."""
    soil, job = soil_of(row, settings), import_module(module_of(row["experiment"], "simulate"))
    film = Film(stage, soil.n_spheres)
    job.run(soil, settings["setup"], engine_of(settings), row["seed"], each=film)
    return film
