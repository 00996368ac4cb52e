"""Adapt rules `compare_round`, `compare_seeds`, `verify` and `verify_equivalents` to `virtual_soil.calibration.verify`."""

from functools import partial

from _log import log_to
from virtual_soil.calibration.noise import scatter_at
from virtual_soil.calibration.space import space_of
from virtual_soil.calibration.uncertainty import target_errors
from virtual_soil.calibration.verify import comparison_table, sampled
from virtual_soil.campaign.experiments.registry import responses_of
from virtual_soil.campaign.inference import read_models, read_tables
from virtual_soil.campaign.measure import largest_overlaps, responses_by_seed, spoiled
from virtual_soil.campaign.tables import read_table, write_table

if __name__ == "__main__":
    log_to(snakemake.log[0])
    files, params = snakemake.input, snakemake.params
    responses = responses_of(params.experiments)
    space, tables, campaign = space_of(params.design), read_tables(files.tables), read_tables(files.campaign)
    sets, schema = read_table(files.calibration, "optima"), "verification"
    if "equivalents" in dict(files.items()):
        sets = sampled(read_table(files.equivalents, "equivalents"), sets, params.n_sets)
        schema = "equivalents_simulated"
    table = comparison_table(
        responses,
        sets,
        read_models(files.surrogates),
        tables,
        responses_by_seed(responses, tables, params.settings),
        {name: partial(scatter_at, response, campaign[response.table], space) for name, response in responses.items()},
        target_errors(read_table(files.soils, "soil"), params.uncertainty["target_uncertainty_ratio"]),
        params.verify,
        spoiled(tables),
        largest_overlaps(tables),
        params.material,
    )
    write_table(table, snakemake.output.table, schema, {"rule": snakemake.rule, **dict(params.items())})
