"""Adapt rule `screening` to `calibration.screening_table`."""

from _log import log_to
from virtual_soil.calibration.screening import screening_table
from virtual_soil.campaign.experiments.registry import RESPONSES
from virtual_soil.campaign.tables import read_table, write_table

if __name__ == "__main__":
    log_to(snakemake.log[0])
    response = RESPONSES[snakemake.params.screening["response"]]
    runs = read_table(snakemake.input.runs, response.table)
    table = screening_table(response, runs, snakemake.params.material, snakemake.params.screening, snakemake.params.printed)
    write_table(table, snakemake.output.table, "screening", {"rule": snakemake.rule, **dict(snakemake.params.items())})
