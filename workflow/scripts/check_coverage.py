"""Adapt rule `check_coverage` to `calibration.coverage_table`."""

from _log import log_to
from virtual_soil.calibration.models import space_of
from virtual_soil.calibration.twin import coverage_table
from virtual_soil.campaign.experiments.registry import responses_of
from virtual_soil.campaign.inference import read_models
from virtual_soil.campaign.tables import write_table

if __name__ == "__main__":
    log_to(snakemake.log[0])
    models = read_models(snakemake.input.surrogates, "gaussian_process")
    table = coverage_table(responses_of(snakemake.params.experiments), models, space_of(snakemake.params.design))
    write_table(table, snakemake.output.table, "coverage", {"rule": snakemake.rule, **dict(snakemake.params.items())})
