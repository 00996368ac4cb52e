"""Adapt rule `simulate` to `virtual_soil.campaign.simulate`."""

from _log import log_to
from virtual_soil.campaign.simulate import run_batch

if __name__ == "__main__":
    log_to(snakemake.log[0])
    params, interval_s = snakemake.params, float(snakemake.resources.checkpoint_interval_s)
    run_batch(params.members, params.engine, dict(snakemake.output.items()), params.checkpoints, interval_s)
