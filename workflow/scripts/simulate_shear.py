"""Adapt rule `simulate_shear` to `dem.experiments.direct_shear`."""

import math

from _log import log_to
from dem.experiments import direct_shear
from virtual_soil.campaign.simulate import (
    empty_columns,
    empty_grains,
    engine_of,
    grain_table,
    of_simulation,
    one_row,
    recorded,
    run_batch,
    soil_of,
)

RUN_KEYS = (
    *("n_particles", "n_steps", "simulated_time_s", "solid_fraction", "lid_slip_ratio", "max_overlap_ratio"),
    *("energy_dissipated_j", "energy_residual_ratio"),
)
HISTORY = (
    "time_s",
    "displacement_m",
    "shear_force_n",
    "shear_stress_pa",
    "applied_normal_stress_pa",
    "plane_normal_stress_pa",
    "lid_height_m",
)


def simulate(row, settings, checkpoint):
    """One shear test: {output: (schema, columns)}, and the wall time in s."""
    name, soil = row["simulation_id"], soil_of(row)
    setup = direct_shear.Setup(normal_stress_pa=row["normal_stress_pa"], **settings["setup"])
    number, gravity = settings["softening"]["shear_stiffness_number"], settings["engine"]["gravity_m_s2"]
    reduction = direct_shear.stiffness_reduction(soil, setup, number, gravity)
    shear, reason, seconds = recorded(direct_shear.run, soil, setup, engine_of(settings, reduction), row["seed"], checkpoint)
    if shear is None:
        run = {"status": "failed", **dict.fromkeys(RUN_KEYS, math.nan), "n_particles": 0, "n_steps": 0}
        before = after = empty_grains()
        history = empty_columns(HISTORY)
    else:
        run = {"status": "done", **{key: getattr(shear, key) for key in RUN_KEYS}}
        before, after = grain_table(shear.before, name), grain_table(shear.after, name)
        history = of_simulation(name, shear.history)
    run = {
        "simulation_id": name,
        "reason": reason or "",
        "inertial_number": setup.inertial_number,
        "stiffness_reduction": reduction,
        **run,
    }
    tables = {"before": ("grains", before), "after": ("grains", after), "history": ("shear_history", history)}
    return {**tables, "run": ("shear_run", one_row(run))}, seconds


if __name__ == "__main__":
    log_to(snakemake.log[0])
    params, interval_s = snakemake.params, float(snakemake.resources.checkpoint_interval_s)
    run_batch(params.members, params.engine, dict(snakemake.output.items()), params.checkpoints, interval_s, simulate)
