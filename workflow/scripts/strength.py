"""Adapt rule `strength` to `calibration.strength_table`."""

from _log import log_to
from virtual_soil.calibration import strength_table
from virtual_soil.campaign.tables import read_table, write_table

if __name__ == "__main__":
    log_to(snakemake.log[0])
    shear = read_table(snakemake.input.shear, "shear")
    table = strength_table(shear, snakemake.params.strength, snakemake.params.normal_stress)
    write_table(table, snakemake.output.table, "strength", {"rule": snakemake.rule, **dict(snakemake.params.items())})
