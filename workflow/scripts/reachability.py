"""Adapt rule `reachability` to `calibration.reachability_table`."""

from _log import log_to
from _tables import read_table, write_table
from calibration import reachability_table

if __name__ == "__main__":
    log_to(snakemake.log[0])
    repose, strength = read_table(snakemake.input.repose, "repose"), read_table(snakemake.input.strength, "strength")
    table = reachability_table(repose, strength, read_table(snakemake.input.soils, "soil"))
    write_table(table, snakemake.output.table, "reachability", {"rule": snakemake.rule, **dict(snakemake.params.items())})
