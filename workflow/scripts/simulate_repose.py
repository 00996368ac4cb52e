"""Adapt rule `simulate_repose` to `dem.experiments.angle_of_repose`."""

import math

from _log import log_to
from dem.experiments import angle_of_repose
from virtual_soil.campaign.simulate import empty_grains, engine_of, grain_table, one_row, recorded, run_batch, soil_of

MEASURED = ("simulated_time_s", "max_overlap_ratio", "energy_dissipated_j", "energy_residual_ratio")


def simulate(row, settings, checkpoint):
    """One heap: {output: (schema, columns)}, and the wall time in s."""
    name, setup = row["simulation_id"], angle_of_repose.Setup(**settings["setup"])
    numerics = engine_of(settings, settings["softening"]["repose_stiffness_reduction"])
    heap, reason, seconds = recorded(angle_of_repose.run, soil_of(row), setup, numerics, row["seed"], checkpoint)
    if heap is None:
        run = {"status": "failed", "n_steps": 0, "n_lost": 0, **dict.fromkeys(MEASURED, math.nan)}
        filled = grains = empty_grains()
    else:
        run = {key: getattr(heap, key) for key in ("status", "n_steps", "n_lost", *MEASURED)}
        filled, grains = grain_table(heap.filled, name), grain_table(heap.grains, name)
    run = {"simulation_id": name, "reason": reason or "", "n_particles": setup.n_particles, **run}
    return {"filled": ("grains", filled), "grains": ("grains", grains), "run": ("repose_run", one_row(run))}, seconds


if __name__ == "__main__":
    log_to(snakemake.log[0])
    params, interval_s = snakemake.params, float(snakemake.resources.checkpoint_interval_s)
    run_batch(params.members, params.engine, dict(snakemake.output.items()), params.checkpoints, interval_s, simulate)
