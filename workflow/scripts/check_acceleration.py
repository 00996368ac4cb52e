"""Adapt rule `check_acceleration` to `calibration.acceleration_table`."""

from _log import log_to
from virtual_soil.calibration import acceleration_table
from virtual_soil.campaign.tables import read_table, write_table

if __name__ == "__main__":
    log_to(snakemake.log[0])
    table = acceleration_table(read_table(snakemake.input.repose, "repose"), read_table(snakemake.input.shear, "shear"))
    write_table(table, snakemake.output.table, "acceleration", {"rule": snakemake.rule, **dict(snakemake.params.items())})
