"""The rotating drum as a job: run from a design row, with stages for the progress line and rows for the tables."""

import math

from dem.experiments import rotating_drum
from virtual_soil.campaign.progress import Stage

MEASURED = ("simulated_time_s", "max_overlap_ratio")
#: Attributes of the result that hold the stored grains, before and after.
MOMENTS = ("before", "after")
#: Columns of the stored time series.
HISTORY = ("time_s", "froude_number", "turns", "x_ratio", "height_ratio")
#: Stage of the test -> its end, for the progress line.
STAGES = {"fill": Stage(), "turn": Stage(then="until all turns are made, ")}


def run(soil, setup: dict, engine, seed: int, **callbacks):
    """Run or resume the test; arguments as in `dem.experiments.rotating_drum.run`."""
    return rotating_drum.run(soil, rotating_drum.Setup(**setup), engine, seed, **callbacks)


def row_of(drum, settings: dict) -> dict:
    """Return the row of the run table for a drum, or for a failed test (None)."""
    froude = settings["setup"]["froude_number"]
    if drum is None:
        numbers = dict.fromkeys(MEASURED, math.nan)
        return {"status": "failed", "n_particles": 0, "n_lining": 0, "n_steps": 0, "froude_number": froude, **numbers}
    found = {key: getattr(drum, key) for key in ("status", "n_particles", "n_lining", "n_steps", *MEASURED)}
    return found | {"froude_number": froude}
