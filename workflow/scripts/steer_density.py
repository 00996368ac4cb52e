"""Adapt rule `steer_density` to `virtual_soil.wheel.runs.steer_density`."""

from _log import log_to
from virtual_soil.wheel.runs import steer_density, store_preparation

if __name__ == "__main__":
    log_to(snakemake.log[0])
    params = dict(snakemake.params.items())
    source = {"rule": snakemake.rule, "case": snakemake.wildcards.case, **params}
    row = steer_density(params, params["seed"], params["bulk_density_kg_m3"], params["nearest"])
    store_preparation(snakemake.wildcards.case, row, snakemake.output.row, source)
