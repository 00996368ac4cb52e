"""Recording of one simulation: grains and walls at every sampling interval of a stage, for films and for the recorded lift."""

from dataclasses import dataclass
from importlib import import_module

import numpy as np

from dem import Grains, Simulation, Wall
from virtual_soil.calibration.points import own_seed
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
    """Keep a frame at every sampling interval of one stage, in which grains may leave; pass it to an experiment as `each`."""

    def __init__(self, stage: str):
        self.stage = stage
        self.frames: list[Frame] = []

    def __call__(self, simulation: Simulation, stage: str) -> None:
        """Append the current state."""
        if stage != self.stage:
            return
        grains, time_s = simulation.grains, simulation.time_s
        first = self.frames[0].grains if self.frames else grains
        numbers = np.flatnonzero(np.isin(first.wholes, grains.wholes))
        self.frames.append(Frame(time_s, grains, numbers, {name: simulation.wall(name) for name in simulation.wall_names}))

    def shown(self, n_frames: int | None = None) -> list[Frame]:
        """Return at most `n_frames` frames (N_FRAMES), evenly distributed in time, including the first and the last."""
        times = np.array([frame.time_s for frame in self.frames])
        wanted = np.linspace(times[0], times[-1], n_frames or N_FRAMES)
        chosen = np.unique(np.abs(times - wanted[:, None]).argmin(axis=1))
        return [self.frames[k] for k in chosen]


def record(row: dict, settings: dict, stage: str) -> Film:
    """Simulate a design row and store a frame at every sampling interval of one stage."""
    soil, job = soil_of(row, settings), import_module(module_of(row["experiment"], "simulate"))
    film = Film(stage)
    job.run(soil, settings["setup"], engine_of(settings), own_seed(row), each=film)
    return film
