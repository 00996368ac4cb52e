"""Adapt rule `measure_repose` to `dem.measure.heap`."""

import pandas as pd

from _log import log_to
from dem.measure.heap import measure_heap
from virtual_soil.campaign.tables import batch_results, empty_table, read_table, write_table

NOTHING = {"angle_profile_deg": None, "angle_silhouette_deg": None, "angle_azimuth_sd_deg": None, "heap_height_m": None}


def measured(run: dict, grains: pd.DataFrame | None) -> dict:
    """A run's row with its angles; a run without a heap to measure has none, one with nothing standing has 0."""
    if run["status"] == "failed":
        return {**run, **NOTHING}
    if run["status"] == "flat":
        return {**run, **dict.fromkeys(NOTHING, 0.0)}
    shape = measure_heap(grains[["x_m", "y_m", "z_m"]].to_numpy(), grains["radius_m"].to_numpy())
    status = "flat" if shape.is_flat else run["status"]
    return {**run, "status": status, **{key: getattr(shape, key) for key in NOTHING}}


def main(files, estimator, provenance, output):
    design = read_table(files.design, "design")
    results = batch_results(files.runs, "repose_run", files.grains, "grains", files.timings)
    rows = [measured(run, grains) for run, grains in results]
    if not rows:  # a round in which every case is settled
        write_table(empty_table("repose"), output, "repose", provenance)
        return
    table = design.merge(pd.DataFrame(rows), on="simulation_id", validate="many_to_one")
    for column in NOTHING:
        table[column] = table[column].astype(float)
    table["angle_of_repose_deg"] = table[f"angle_{estimator}_deg"]
    write_table(table, output, "repose", provenance)


if __name__ == "__main__":
    log_to(snakemake.log[0])
    provenance = {"rule": snakemake.rule, "estimator": snakemake.params.estimator, "estimators": snakemake.params.estimators}
    main(snakemake.input, snakemake.params.estimator, provenance, snakemake.output.table)
