"""The angle-of-repose test as a job: run from a design row, with stages for the progress line and rows for the tables."""

import math

from dem.experiments import angle_of_repose
from dem.measure.packing import core_solid_fraction
from virtual_soil.campaign.progress import Stage

MEASURED = ("simulated_time_s", "max_overlap_ratio", "energy_dissipated_j", "energy_residual_ratio")
#: Attributes of the result that hold the stored grains, before and after.
MOMENTS = ("filled", "grains")
#: Columns of the stored time series: none.
HISTORY: tuple[str, ...] = ()


def lifted(simulation, n_looks: int) -> float:
    """Height of the tube's rim over the current height of the highest grain: completed fraction of the lift."""
    top, rim = simulation.top_m, simulation.wall("tube").bottom_m
    return rim / top if top > rim else 1.0


#: Stage of the test -> its end, for the progress line.
STAGES = {"fill": Stage(), "lift": Stage(done=lifted, then="tube is clear, until nothing moves, ")}


def run(soil, setup: dict, engine, seed: int, **callbacks):
    """Run or resume the test; arguments as in `dem.experiments.angle_of_repose.run`."""
    return angle_of_repose.run(soil, angle_of_repose.Setup(**setup), engine, seed, **callbacks)


def row_of(heap, settings: dict) -> dict:
    """Return the row of the run table for a heap, or for a failed test (None)."""
    if heap is None:
        found = {
            "status": "failed",
            "n_steps": 0,
            "n_lost": 0,
            "poured_solid_fraction": math.nan,
            **dict.fromkeys(MEASURED, math.nan),
        }
    else:
        found = {key: getattr(heap, key) for key in ("status", "n_steps", "n_lost", *MEASURED)}
        filled = heap.filled
        tube_m = settings["setup"]["tube_diameter_ratio"] * settings["setup"]["scale_radius_m"]
        found["poured_solid_fraction"] = core_solid_fraction(filled.positions_m, filled.radii_m, tube_m, heap.filled_radii_m)
    return {"n_particles": settings["setup"]["n_particles"], **found}
