"""The direct-shear test as a job: run from a design row, with stages for the progress line and rows for the tables."""

import math

from dem.experiments import direct_shear
from virtual_soil.campaign.progress import Stage

RUN_KEYS = (
    "n_particles",
    "n_steps",
    "simulated_time_s",
    "solid_fraction",
    "lid_slip_ratio",
    "max_overlap_ratio",
    "energy_dissipated_j",
    "energy_residual_ratio",
)
#: Attributes of the result that hold the stored grains, before and after.
MOMENTS = ("before", "after")
#: Columns of the stored time series.
HISTORY = (
    "time_s",
    "displacement_m",
    "shear_force_n",
    "shear_stress_pa",
    "applied_normal_stress_pa",
    "plane_normal_stress_pa",
    "lid_height_m",
)


def sheared(simulation, n_looks: int) -> float:
    """Fraction of the samples that have been recorded."""
    return n_looks / direct_shear.N_SAMPLES


#: Stage of the test -> its end, for the progress line.
STAGES = {"consolidate": Stage(), "shear": Stage(done=sheared, exact=True)}


def run(soil, setup: dict, engine, seed: int, **callbacks):
    """Run or resume the test; arguments as in `dem.experiments.direct_shear.run`."""
    return direct_shear.run(soil, direct_shear.Setup(**setup), engine, seed, **callbacks)


def row_of(test, settings: dict) -> dict:
    """Return the row of the run table for a test, or for a failed test (None)."""
    if test is None:
        found = {"status": "failed", **dict.fromkeys(RUN_KEYS, math.nan), "n_particles": 0, "n_steps": 0}
    else:
        found = {"status": "done", **{key: getattr(test, key) for key in RUN_KEYS}}
    setup, engine = settings["setup"], settings["engine"]
    return {"inertial_number": setup["inertial_number"], "stiffness_reduction": engine["stiffness_reduction"], **found}
