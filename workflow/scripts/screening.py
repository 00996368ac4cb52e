"""Adapt rule `screening` to `calibration.screening_table`."""

from _log import log_to
from virtual_soil.calibration import screening_table
from virtual_soil.campaign.experiments import RESPONSES
from virtual_soil.campaign.tables import read_table, write_table

if __name__ == "__main__":
    log_to(snakemake.log[0])
    response, repose = RESPONSES["angle_of_repose"], read_table(snakemake.input.repose, "repose")
    table = screening_table(response, repose, snakemake.params.material, snakemake.params.screening)
    write_table(table, snakemake.output.table, "screening", {"rule": snakemake.rule, **dict(snakemake.params.items())})
