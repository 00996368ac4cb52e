"""Adapt checkpoint `verification_design` to `calibration.further`."""

from _log import log_to
from virtual_soil.campaign.design import further
from virtual_soil.campaign.inference import optima
from virtual_soil.campaign.tables import read_table, write_table

if __name__ == "__main__":
    log_to(snakemake.log[0])
    study = snakemake.params.study
    points = list(optima(read_table(snakemake.input.calibration, "optima"), study["design"]["variables"]).values())
    table = further(study, "verification", points, snakemake.params.verify)
    write_table(table, snakemake.output.table, "design", {"rule": snakemake.rule})
