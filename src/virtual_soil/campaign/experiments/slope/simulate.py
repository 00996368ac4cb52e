"""The cut slope as a job: run from a design row, with stages for the progress line and rows for the tables."""

import math

from dem.experiments import cut_slope
from virtual_soil.campaign.progress import Stage

MEASURED = ("simulated_time_s", "max_overlap_ratio", "energy_dissipated_j", "energy_residual_ratio")
#: Attribute of the result -> column, of the bracket and of the bed.
OWN = {
    "stands_deg": "stands_deg",
    "falls_deg": "falls_deg",
    "stood_moved_ratio": "stood_moved_ratio",
    "fell_moved_ratio": "fell_moved_ratio",
    "height_m": "slope_height_m",
    "solid_fraction": "bed_solid_fraction",
}
#: Attributes of the result that hold the stored grains, before and after.
MOMENTS = ("before", "after")
#: Columns of the stored series: every cut.
HISTORY = ("cut_angle_deg", "moved_ratio")
#: Stage of the test -> its end, for the progress line.
STAGES = {"settle": Stage(), "cut": Stage(then="until a cut falls or stands, ")}


def run(soil, setup: dict, engine, seed: int, **callbacks):
    """Run or resume the test; arguments as in `dem.experiments.cut_slope.run`."""
    return cut_slope.run(soil, cut_slope.Setup(**setup), engine, seed, **callbacks)


def row_of(slope, settings: dict) -> dict:
    """Return the row of the run table for a slope, or for a failed test (None)."""
    if slope is None:
        numbers = dict.fromkeys((*OWN.values(), *MEASURED), math.nan)
        return {"status": "failed", "n_particles": 0, "n_steps": 0, **numbers}
    found = {key: getattr(slope, key) for key in ("status", "n_particles", "n_steps", *MEASURED)}
    return found | {column: getattr(slope, name) for name, column in OWN.items()}
