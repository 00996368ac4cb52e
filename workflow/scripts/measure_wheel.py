"""Adapt rule `measure_wheel` to `virtual_soil.wheel.measured.wheel_table`."""

from _log import log_to
from virtual_soil.campaign.tables import read_table, write_table
from virtual_soil.wheel.measured import stacked, wheel_table

if __name__ == "__main__":
    log_to(snakemake.log[0])
    files = snakemake.input
    histories = (read_table(path, "wheel_history") for path in files.histories)
    table = wheel_table(stacked(files.runs, "wheel_run"), histories, stacked(files.beds, "wheel_bed"))
    write_table(table, snakemake.output.table, "wheel", {"rule": snakemake.rule, **dict(snakemake.params.items())})
