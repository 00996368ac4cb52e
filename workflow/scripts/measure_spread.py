"""Adapt rule `measure_spread` to `virtual_soil.wheel.spread_runs.spread_table`."""

from _log import log_to
from virtual_soil.campaign.tables import read_table, write_table
from virtual_soil.wheel.measured import stacked
from virtual_soil.wheel.spread_runs import spread_table

if __name__ == "__main__":
    log_to(snakemake.log[0])
    files = dict(snakemake.input.items())
    table = spread_table(
        stacked(files["runs"], "wheel_run"),
        (read_table(path, "wheel_history") for path in files["histories"]),
        stacked(files["beds"], "wheel_bed"),
        (read_table(path, "press_history") for path in files["plates"]),
        snakemake.params.spread["plate_sinkage_m"],
    )
    write_table(table, snakemake.output.table, "wheel_spread", {"rule": snakemake.rule, **dict(snakemake.params.items())})
