"""What both simulation scripts share: soil and engine from the design row, progress, and failures that are recorded."""

import json
import time
import traceback

import numpy as np

from _checkpoint import Checkpoint
from _files import write_text
from _provenance import versions
from dem import SimulationError
from dem.experiments import angle_of_repose, direct_shear
from dem.experiments.soil import Engine, Soil

SOIL_KEYS = tuple(Soil.__dataclass_fields__)
#: Seconds between two progress lines in a simulation's log.
PROGRESS_S = 5.0

#: What a simulation may raise because of its parameters; anything else is a fault of the program and stops the job.
FAILURES = (SimulationError, ValueError, FloatingPointError)


def soil_of(row: dict) -> Soil:
    """The virtual soil of a design row."""
    return Soil(**{key: row[key] for key in SOIL_KEYS if key in row})


def engine_of(settings: dict, stiffness_reduction: float) -> Engine:
    """The engine settings of a simulation."""
    return Engine(stiffness_reduction=stiffness_reduction, **settings["engine"])


class Progress:
    """Prints a line every few seconds: stage and how much of it is done, simulated time, steps, speed, time left.

    Percent and time left are those of the stage that the line names, and stand there only when its end is known:

    - shear: a known number of looks, so both are exact as far as the speed is steady; neither is known when a saved test goes on.
    - lift: how high the tube's rim is over the highest grain, whose top still sinks: so "about". The heap may go on rolling when
      the tube is clear, so the time left is "at least". It then ends when nothing moves, at no known time.
    - fill, consolidate: end when nothing moves, as a rule long before their time limit, of which a percentage would mean nothing.
    """

    def __init__(self):
        self.start = self.last = time.monotonic()
        self.stage = self.first_step = None

    def __call__(self, simulation, stage: str) -> None:
        """Report one look at the simulation."""
        now = time.monotonic()
        if self.first_step is None:  # a resumed simulation has made steps before
            self.first_step = simulation.n_steps
        if stage != self.stage:
            self.whole = self.stage is not None or stage != "shear"
            self.stage, self.n_looks, self.first = stage, 0, None
        self.n_looks += 1
        if now - self.last >= PROGRESS_S or self.first is None:
            share = self.done(simulation)
            self.first = self.first or (now, share)
        if now - self.last >= PROGRESS_S:
            self.last = now
            speed = (simulation.n_steps - self.first_step) * simulation.n_grains / (now - self.start) / 1e6
            print(
                f"{stage}: {self.percent(share)}t = {simulation.time_s:.4f} s, step {simulation.n_steps}, "
                f"{speed:.1f} M grain-steps/s{self.left(now, share)}"
            )

    def done(self, simulation) -> float | None:
        """How much of the stage is done (0 to 1); None where its end is not known."""
        if self.stage == "shear":
            return self.n_looks / direct_shear.N_SAMPLES if self.whole else None
        if self.stage == "lift":
            top = angle_of_repose.height_m(simulation.grains)
            return simulation.wall("tube").bottom_m / top if top > simulation.wall("tube").bottom_m else 1.0
        return None

    def percent(self, share: float | None) -> str:
        """The share in words, ready to be put before the rest of the line."""
        if share is None:
            return "" if self.stage == "shear" else "until nothing moves, "
        if self.stage == "lift":
            return f"about {100.0 * share:.0f} %, " if share < 1.0 else "tube is clear, until nothing moves, "
        return f"{100.0 * share:.0f} %, "

    def left(self, now: float, share: float | None) -> str:
        """Wall time until the stage ends, at the pace since its first look; empty where that cannot be said."""
        if share is None or share >= 1.0 or share <= self.first[1]:
            return ""
        seconds = (now - self.first[0]) * (1.0 - share) / (share - self.first[1])
        return f", {'at least ' if self.stage == 'lift' else ''}{seconds:.0f} s left"


def provenance(row: dict, settings: dict, engine: str) -> dict:
    """Where a result comes from; nothing in it changes from run to run."""
    return {"design": row, "settings": settings, "engine": engine, "versions": versions()}


def grain_table(grains) -> dict[str, np.ndarray]:
    """Positions and radii of grains as columns."""
    x, y, z = grains.positions_m.reshape(-1, 3).T
    return {"x_m": x, "y_m": y, "z_m": z, "radius_m": grains.radii_m}


def empty_grains() -> dict[str, np.ndarray]:
    """The grain table of a failed simulation."""
    return empty_columns(("x_m", "y_m", "z_m", "radius_m"))


def empty_columns(names) -> dict[str, np.ndarray]:
    """Columns of numbers without rows."""
    return {name: np.zeros(0) for name in names}


def one_row(values: dict) -> dict[str, list]:
    """A table of one row."""
    return {name: [value] for name, value in values.items()}


def recorded(run, soil, setup, engine, seed: int, checkpoint: Checkpoint):
    """Run an experiment, from its checkpoint if there is one.

    Returns (result, None, seconds), or (None, reason, seconds) when the parameters do not work. Ends the job after a signal.
    """
    state = checkpoint.state()
    try:
        with checkpoint.on_signals():
            result = run(soil, setup, engine, seed, each=Progress(), state=state, keep=checkpoint.keep)
        reason = None
    except FAILURES as error:
        traceback.print_exc()
        result, reason = None, str(error)
    return result, reason, checkpoint.spent_s


def write_timing(path: str, seconds: float) -> None:
    """The only output that differs from run to run: how long it took."""
    write_text(path, json.dumps({"wall_time_s": seconds}))
