"""Adapt rule `measure_shear` to `dem.measure.shear`."""

import math

import pandas as pd

from _log import log_to
from dem.measure.shear import strength
from virtual_soil.campaign.tables import batch_results, empty_table, read_table, write_table

#: The plateau is the mean over this last fraction of the displacement.
PLATEAU_WINDOW = 0.3
STRENGTHS = ("peak_shear_stress_pa", "plateau_shear_stress_pa", "plane_normal_stress_pa", "peak_plane_normal_stress_pa")


def measured(run: dict, history: pd.DataFrame | None) -> dict:
    """A run's row with its strengths and its dilation; a failed run has none."""
    if run["status"] == "failed":
        return {**run, **dict.fromkeys((*STRENGTHS, "dilation_m"), math.nan)}
    columns = (history[name].to_numpy() for name in ("displacement_m", "shear_stress_pa", "plane_normal_stress_pa"))
    result = strength(*columns, PLATEAU_WINDOW)
    dilation = history["lid_height_m"].iloc[-1] - history["lid_height_m"].iloc[0]
    return {**run, **{key: getattr(result, key) for key in STRENGTHS}, "dilation_m": dilation}


def main(files, provenance, output):
    design = read_table(files.design, "design")
    results = batch_results(files.runs, "shear_run", files.histories, "shear_history", files.timings)
    rows = [measured(run, history) for run, history in results]
    table = design.merge(pd.DataFrame(rows), on="simulation_id", validate="many_to_one") if rows else empty_table("shear")
    write_table(table, output, "shear", provenance)


if __name__ == "__main__":
    log_to(snakemake.log[0])
    main(snakemake.input, {"rule": snakemake.rule, "estimators": snakemake.params.estimators}, snakemake.output.table)
