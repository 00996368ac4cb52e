"""Recording of a wheel's travel, for a film (`virtual_soil.report.wheel_film`)."""

from dataclasses import replace
from typing import cast

import numpy as np

from dem import Mesh, Simulation, SimulationError, Wall
from dem.experiments import wheel
from dem.experiments.soil_bed import Setup
from virtual_soil.campaign.recording import Film, Frame
from virtual_soil.errors import InputError
from virtual_soil.wheel.runs import BROKE_OFF, bed_of, lowered_of
from virtual_soil.wheel.setups import refused, shape_of, soil_and_engine, test_of

#: Looks of the travel from one frame to the next: some 40 frames in all, so that a large bed's fit into memory.
LOOKS_PER_FRAME = wheel.N_SAMPLES // 40


class Thinned:
    """Pass every n-th look of the travel on to a film, beginning with the first."""

    def __init__(self, film: Film, n: int):
        self.film, self.n, self.looks = film, n, 0

    def __call__(self, simulation: Simulation, stage: str) -> None:
        """Record the current state if it is due."""
        if stage == self.film.stage:
            if self.looks % self.n == 0:
                self.film(simulation, stage)
            self.looks += 1


def centred(frame: Frame, setup: Setup) -> Frame:
    """A frame whose grains stand in one period of the bed, and the wheel's middle plane at y = 0."""
    places = frame.grains.positions_m - (0.0, 0.5 * setup.width_m, 0.0)
    period = np.array([setup.length_m, setup.width_m])
    places[:, :2] -= period * np.floor(places[:, :2] / period + (0.0, 0.5))
    now = cast(Mesh, frame.walls["wheel"])
    x, y, z = now.position_m
    walls: dict[str, Wall] = {"wheel": replace(now, position_m=(x, y - 0.5 * setup.width_m, z))}
    return replace(frame, grains=replace(frame.grains, positions_m=places), walls=walls)


def film_wheel(job: dict, name: str, bed_path: str, lowered_path: str) -> list[Frame]:
    """Frames of the travel of a run, which is made again; arguments as of `virtual_soil.wheel.runs.drive_wheel`.

    Raises InputError if the simulation breaks off, or the wheel does not travel.
    """
    soil, _ = soil_and_engine(job)
    bed, shape, test, lowered = bed_of(bed_path), shape_of(job["wheel"]), test_of(job["wheel"], name), lowered_of(lowered_path)
    film = Film("travel")
    if lowered.stage == BROKE_OFF:
        raise InputError(f"The wheel broke off while it was lowered: {lowered.notes['reason']}")
    try:
        with refused("wheel"):
            wheel.drive(bed, soil, shape, test, Thinned(film, LOOKS_PER_FRAME), state=lowered)
    except (SimulationError, FloatingPointError) as error:
        raise InputError(f"The wheel at slip {name} broke off: {error}") from None
    if not film.frames:
        raise InputError(f"The wheel at slip {name} did not travel: the soil did not carry it.")
    return [centred(frame, bed.setup) for frame in film.frames]
