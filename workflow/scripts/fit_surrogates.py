"""Adapt rule `fit_surrogates` to `calibration.fit_all`."""

from _log import log_to
from virtual_soil.calibration.models import fit_all, to_json
from virtual_soil.campaign.experiments.registry import responses_of
from virtual_soil.campaign.files import write_text
from virtual_soil.campaign.inference import read_tables
from virtual_soil.campaign.tables import write_table

if __name__ == "__main__":
    log_to(snakemake.log[0])
    params = snakemake.params
    tables = read_tables(snakemake.input.tables)
    models, residuals = fit_all(responses_of(params.experiments), tables, params.design, params.material, params.surrogate)
    write_text(snakemake.output.surrogates, to_json(models, params.surrogate))
    write_table(residuals, snakemake.output.residuals, "residuals", {"rule": snakemake.rule, **dict(params.items())})
