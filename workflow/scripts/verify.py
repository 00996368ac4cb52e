"""Adapt rules `compare_round` and `verify` to `virtual_soil.calibration.verify`."""

from _log import log_to
from virtual_soil.calibration.noise import known_scatter
from virtual_soil.calibration.uncertainty import target_errors
from virtual_soil.calibration.verify import comparison_table
from virtual_soil.campaign.experiments.registry import responses_of
from virtual_soil.campaign.inference import read_models, read_tables
from virtual_soil.campaign.measure import largest_overlaps, responses_by_seed, spoiled
from virtual_soil.campaign.tables import read_table, write_table

if __name__ == "__main__":
    log_to(snakemake.log[0])
    files, params = snakemake.input, snakemake.params
    responses = responses_of(params.experiments)
    tables, campaign = read_tables(files.tables), read_tables(files.campaign)
    table = comparison_table(
        responses,
        read_table(files.calibration, "optima"),
        read_models(files.surrogates),
        tables,
        responses_by_seed(responses, tables, params.settings),
        {name: known_scatter(response, campaign[response.table]) for name, response in responses.items()},
        target_errors(read_table(files.soils, "soil"), params.uncertainty["target_uncertainty_ratio"]),
        params.verify,
        spoiled(tables),
        largest_overlaps(tables),
        params.material,
    )
    write_table(table, snakemake.output.table, "verification", {"rule": snakemake.rule, **dict(params.items())})
