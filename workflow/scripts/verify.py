"""Adapt rules `compare_round` and `verify` to `calibration.comparison_table`."""

from _log import log_to
from virtual_soil.calibration import comparison_table
from virtual_soil.calibration.noise import known_scatter
from virtual_soil.campaign.experiments import RESPONSES
from virtual_soil.campaign.inference import read_models, values_by_seed
from virtual_soil.campaign.tables import read_table, write_table

if __name__ == "__main__":
    log_to(snakemake.log[0])
    files, params = snakemake.input, snakemake.params
    tables = {name: read_table(files[name], name) for name in ("repose", "shear", "strength")}
    campaign = {"repose": read_table(files.campaign_repose, "repose"), "strength": read_table(files.campaign_strength, "strength")}
    table = comparison_table(
        RESPONSES,
        read_table(files.calibration, "optima"),
        read_models(files.surrogates),
        tables,
        values_by_seed(tables, params.strength, params.normal_stress),
        {name: known_scatter(response, campaign[response.table]) for name, response in RESPONSES.items()},
        params.material,
    )
    write_table(table, snakemake.output.table, "verification", {"rule": snakemake.rule, **dict(params.items())})
