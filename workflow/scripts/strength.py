"""Adapt rule `strength` to `calibration.strength_table`."""

from _log import log_to
from _tables import read_table, write_table
from calibration import strength_table

if __name__ == "__main__":
    log_to(snakemake.log[0])
    shear = read_table(snakemake.input.shear, "shear")
    table = strength_table(shear, snakemake.params.strength, snakemake.params.normal_stress)
    write_table(table, snakemake.output.table, "strength", {"rule": snakemake.rule, **dict(snakemake.params.items())})
