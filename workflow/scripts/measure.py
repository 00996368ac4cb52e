"""Adapt rule `measure` to `virtual_soil.campaign.measure`."""

from _log import log_to
from virtual_soil.campaign.measure import measured_table
from virtual_soil.campaign.tables import read_table, write_table

if __name__ == "__main__":
    log_to(snakemake.log[0])
    files, params, experiment = snakemake.input, snakemake.params, snakemake.wildcards.experiment
    design = read_table(files.design, "design")
    table = measured_table(experiment, design, files.runs, files.results, files.timings, params.settings)
    write_table(table, snakemake.output.table, experiment, {"rule": snakemake.rule, **dict(params.items())})
