"""Adapt rule `twins` to `calibration.twin_table`."""

from _log import log_to
from virtual_soil.calibration.space import space_of
from virtual_soil.calibration.twin import twin_table
from virtual_soil.campaign.inference import likelihoods_of
from virtual_soil.campaign.tables import read_table, write_table

if __name__ == "__main__":
    log_to(snakemake.log[0])
    files, params = snakemake.input, snakemake.params
    calibration, posterior = read_table(files.calibration, "optima"), read_table(files.posterior, "posterior")
    likelihoods, space = likelihoods_of(files, params), space_of(params.design)
    table = twin_table(params.twins, params.optimise["cases"], calibration, posterior, likelihoods, space)
    write_table(table, snakemake.output.table, "twins", {"rule": snakemake.rule, **dict(params.items())})
