"""The angle-of-repose test as a job: run from a design row, with stages for the progress line and rows for the tables."""

import math

from dem.experiments import angle_of_repose
from virtual_soil.campaign.progress import Stage

MEASURED = ("simulated_time_s", "max_overlap_ratio", "energy_dissipated_j", "energy_residual_ratio")
#: Attributes of the result that hold the stored grains, before and after.
MOMENTS = ("filled", "grains")
#: Columns of the stored time series: none.
HISTORY: tuple[str, ...] = ()


def lifted(simulation, n_looks: int) -> float:
    """Height of the tube's rim over that of the highest grain, whose top still sinks."""
    top, rim = simulation.top_m, simulation.wall("tube").bottom_m
    return rim / top if top > rim else 1.0


#: Stage of the test -> what is known of its end.
STAGES = {"fill": Stage(), "lift": Stage(done=lifted, then="tube is clear, until nothing moves, ")}


def run(soil, setup: dict, engine, seed: int, **callbacks):
    """Run the test, or what is left of it; arguments as of `dem.experiments.angle_of_repose.run`."""
    return angle_of_repose.run(soil, angle_of_repose.Setup(**setup), engine, seed, **callbacks)


def row_of(heap, settings: dict) -> dict:
    """What the table of runs says of a heap; of a failed one (None) that it failed."""
    if heap is None:
        found = {"status": "failed", "n_steps": 0, "n_lost": 0, **dict.fromkeys(MEASURED, math.nan)}
    else:
        found = {key: getattr(heap, key) for key in ("status", "n_steps", "n_lost", *MEASURED)}
    return {"n_particles": settings["setup"]["n_particles"], **found}
