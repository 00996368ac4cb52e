"""Adapt rule `check_coverage` to `calibration.coverage_table`."""

from _log import log_to
from virtual_soil.calibration.space import space_of
from virtual_soil.calibration.twin import coverage_table
from virtual_soil.campaign.experiments.registry import responses_of
from virtual_soil.campaign.inference import read_models
from virtual_soil.campaign.tables import read_table, write_table

if __name__ == "__main__":
    log_to(snakemake.log[0])
    files, params = snakemake.input, snakemake.params
    models = [read_models(files.surrogates, kind) for kind in ("gaussian_process", "chosen")]
    soils = read_table(files.soils, "soil")
    table = coverage_table(responses_of(params.experiments), *models, space_of(params.design), params.twins, soils)
    write_table(table, snakemake.output.table, "coverage", {"rule": snakemake.rule, **dict(params.items())})
