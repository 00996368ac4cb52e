"""Adapt rule `simulate_shear` to `dem.experiments.direct_shear`."""

import math

from _checkpoint import Checkpoint
from _log import log_to
from _simulate import (
    empty_columns,
    empty_grains,
    engine_of,
    grain_table,
    one_row,
    provenance,
    recorded,
    soil_of,
    write_timing,
)
from _tables import write_table
from dem.experiments import direct_shear

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


def main(row, settings, engine, output, checkpoint_path, checkpoint_interval_s):
    source = provenance(row, settings, engine)
    checkpoint = Checkpoint(checkpoint_path, checkpoint_interval_s, source)
    soil = soil_of(row)
    setup = direct_shear.Setup(normal_stress_pa=row["normal_stress_pa"], **settings["setup"])
    number, gravity = settings["softening"]["shear_stiffness_number"], settings["engine"]["gravity_m_s2"]
    reduction = direct_shear.stiffness_reduction(soil, setup, number, gravity)
    numerics = engine_of(settings, reduction)
    shear, reason, seconds = recorded(direct_shear.run, soil, setup, numerics, row["seed"], checkpoint)
    if shear is None:
        run = {"status": "failed", **dict.fromkeys(RUN_KEYS, math.nan), "n_particles": 0, "n_steps": 0}
        before = after = empty_grains()
        history = empty_columns(HISTORY)
    else:
        run = {"status": "done", **{key: getattr(shear, key) for key in RUN_KEYS}}
        before, after, history = grain_table(shear.before), grain_table(shear.after), shear.history
    run = {
        "simulation_id": row["simulation_id"],
        "reason": reason or "",
        "inertial_number": setup.inertial_number,
        "stiffness_reduction": reduction,
        **run,
    }
    write_table(before, output.before, "grains", source)
    write_table(after, output.after, "grains", source)
    write_table(history, output.history, "shear_history", source)
    write_table(one_row(run), output.run, "shear_run", source)
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
