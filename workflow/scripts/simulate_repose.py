"""Adapt rule `simulate_repose` to `dem.experiments.angle_of_repose`."""

import math

from _checkpoint import Checkpoint
from _log import log_to
from _simulate import empty_grains, engine_of, grain_table, one_row, provenance, recorded, soil_of, write_timing
from _tables import write_table
from dem.experiments import angle_of_repose

MEASURED = ("simulated_time_s", "max_overlap_ratio", "energy_dissipated_j", "energy_residual_ratio")


def main(row, settings, engine, output, checkpoint_path, checkpoint_interval_s):
    source = provenance(row, settings, engine)
    checkpoint = Checkpoint(checkpoint_path, checkpoint_interval_s, source)
    soil = soil_of(row)
    setup = angle_of_repose.Setup(**settings["setup"])
    numerics = engine_of(settings, settings["softening"]["repose_stiffness_reduction"])
    heap, reason, seconds = recorded(angle_of_repose.run, soil, setup, numerics, row["seed"], checkpoint)
    if heap is None:
        run = {"status": "failed", "n_steps": 0, "n_lost": 0, **dict.fromkeys(MEASURED, math.nan)}
        filled = grains = empty_grains()
    else:
        run = {key: getattr(heap, key) for key in ("status", "n_steps", "n_lost", *MEASURED)}
        filled, grains = grain_table(heap.filled), grain_table(heap.grains)
    run = {"simulation_id": row["simulation_id"], "reason": reason or "", "n_particles": setup.n_particles, **run}
    write_table(filled, output.filled, "grains", source)
    write_table(grains, output.grains, "grains", source)
    write_table(one_row(run), output.run, "repose_run", source)
    write_timing(output.timing, seconds)
    checkpoint.remove()


if __name__ == "__main__":
    log_to(snakemake.log[0])
    main(
        snakemake.params.row,
        snakemake.params.settings,
        snakemake.params.engine,
        snakemake.output,
        snakemake.params.checkpoint,
        snakemake.resources.checkpoint_interval_s,
    )
