"""Adapt rule `lower_wheel` to `virtual_soil.wheel.runs.lower_wheel`."""

from _log import log_to
from virtual_soil.campaign.resume import Checkpoint
from virtual_soil.wheel.runs import lower_wheel

if __name__ == "__main__":
    log_to(snakemake.log[0])
    params = dict(snakemake.params.items())
    source = {"rule": snakemake.rule, **dict(snakemake.wildcards.items()), **params}
    interval_s = float(snakemake.resources.checkpoint_interval_s)
    checkpoint = Checkpoint(params["checkpoint"], interval_s, source, snakemake.threads)
    lower_wheel(params, snakemake.input.bed, snakemake.output.lowered, checkpoint)
    checkpoint.remove()
