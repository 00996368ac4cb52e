"""Adapt rule `sensitivity` to `calibration.sobol_table`."""

from _log import log_to
from virtual_soil.calibration.sensitivity import sobol_table
from virtual_soil.calibration.space import space_of
from virtual_soil.campaign.inference import read_models
from virtual_soil.campaign.tables import write_table

if __name__ == "__main__":
    log_to(snakemake.log[0])
    table = sobol_table(read_models(snakemake.input.surrogates), space_of(snakemake.params.design))
    write_table(table, snakemake.output.table, "sensitivity", {"rule": snakemake.rule, **dict(snakemake.params.items())})
