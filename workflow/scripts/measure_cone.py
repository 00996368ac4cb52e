"""Adapt rule `measure_cone` to `virtual_soil.wheel.measured.cone_table`."""

from _log import log_to
from virtual_soil.campaign.tables import read_table, write_table
from virtual_soil.wheel.measured import cone_table, stacked

if __name__ == "__main__":
    log_to(snakemake.log[0])
    files = snakemake.input
    histories = (read_table(path, "press_history") for path in files.histories)
    table = cone_table(stacked(files.runs, "press_run"), histories, stacked(files.beds, "wheel_bed"))
    write_table(table, snakemake.output.table, "cone", {"rule": snakemake.rule, **dict(snakemake.params.items())})
