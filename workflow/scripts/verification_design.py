"""Adapt checkpoint `verification_design` to `campaign.design.further`."""

from _log import log_to
from virtual_soil.calibration.verify import sampled
from virtual_soil.campaign.design import further
from virtual_soil.campaign.inference import optima
from virtual_soil.campaign.tables import read_table, write_table

if __name__ == "__main__":
    log_to(snakemake.log[0])
    study, files, n_sets = snakemake.params.study, snakemake.input, snakemake.params.n_sets
    variables, at_optima = study["design"]["variables"], read_table(files.calibration, "optima")
    points = list(optima(at_optima, variables).values())
    if n_sets:
        points += sampled(read_table(files.equivalents, "equivalents"), at_optima, n_sets)[variables].to_dict("records")
    table = further(study, "verification", points, snakemake.params.verify)
    write_table(table, snakemake.output.table, "design", {"rule": snakemake.rule})
