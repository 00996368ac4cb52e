"""The plane shear test as a job: run from a design row, with stages for the progress line and rows for the tables."""

import math

from dem.experiments import plane_shear
from virtual_soil.calibration.points import hashed
from virtual_soil.campaign.progress import Stage

RUN_KEYS = (
    "n_particles",
    "n_steps",
    "simulated_time_s",
    "solid_fraction",
    "localisation",
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
    "shear_strain",
    "shear_force_n",
    "shear_stress_pa",
    "applied_normal_stress_pa",
    "plane_normal_stress_pa",
    "lid_height_m",
    "solid_fraction",
)


def sheared(simulation, n_looks: int) -> float:
    """Fraction of the strain at which most tests end, at most one."""
    return min(1.0, n_looks / (plane_shear.SAMPLES_PER_STRAIN * USUAL_STRAIN))


#: Shear strain of the progress line.
USUAL_STRAIN = 3.0
#: Stage of the test -> its end, for the progress line.
STAGES = {"consolidate": Stage(), "strain": Stage(done=sheared, then="sheared further, until the strength is steady, ")}


def specimen_seed(seed: int, normal_stress_pa: float) -> int:
    """Seed of the specimen under one stress: without gravity one specimen under several stresses would be one and the same test."""
    return int(hashed([seed, float(normal_stress_pa)], 8), 16) % 2**31


def run(soil, setup: dict, engine, seed: int, **callbacks):
    """Run or resume the test; arguments as in `dem.experiments.plane_shear.run`."""
    test = plane_shear.Setup(**setup)
    return plane_shear.run(soil, test, engine, specimen_seed(seed, test.normal_stress_pa), **callbacks)


def row_of(test, settings: dict) -> dict:
    """Return the row of the run table for a test, or for a failed test (None)."""
    if test is None:
        found = {"status": "failed", **dict.fromkeys(RUN_KEYS, math.nan), "n_particles": 0, "n_steps": 0}
    else:
        found = {"status": test.status, **{key: getattr(test, key) for key in RUN_KEYS}}
    setup, engine = settings["setup"], settings["engine"]
    return {"inertial_number": setup["inertial_number"], "stiffness_reduction": engine["stiffness_reduction"], **found}
