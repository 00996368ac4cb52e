"""Adapt rule `reachability` to `calibration.reachability_table`."""

from _log import log_to
from virtual_soil.calibration.checks import reachability_table
from virtual_soil.calibration.space import space_of
from virtual_soil.campaign.experiments.registry import responses_of
from virtual_soil.campaign.inference import read_models, read_tables
from virtual_soil.campaign.tables import read_table, write_table

if __name__ == "__main__":
    log_to(snakemake.log[0])
    models = read_models(snakemake.input.surrogates)
    tables, soils = read_tables(snakemake.input.tables), read_table(snakemake.input.soils, "soil")
    space, ratio = space_of(snakemake.params.design), snakemake.params.uncertainty["target_uncertainty_ratio"]
    responses = responses_of(snakemake.params.experiments)
    table = reachability_table(responses, models, space, tables, soils, ratio)
    write_table(table, snakemake.output.table, "reachability", {"rule": snakemake.rule, **dict(snakemake.params.items())})
