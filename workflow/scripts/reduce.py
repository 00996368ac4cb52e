"""Adapt rule `reduce` to the `measure.reduce` of an experiment."""

from _log import log_to
from virtual_soil.campaign.measure import reduced_table
from virtual_soil.campaign.tables import read_table, write_table

if __name__ == "__main__":
    log_to(snakemake.log[0])
    params, name = snakemake.params, snakemake.wildcards.reduced
    runs = read_table(snakemake.input.runs, params.experiment)
    write_table(
        reduced_table(name, runs, params.settings), snakemake.output.table, name, {"rule": snakemake.rule, **dict(params.items())}
    )
