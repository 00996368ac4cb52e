"""Adapt rule `push_cone` to `virtual_soil.wheel.runs.push_cone`."""

from _log import log_to
from virtual_soil.campaign.resume import Checkpoint
from virtual_soil.wheel.runs import push_cone, store

if __name__ == "__main__":
    log_to(snakemake.log[0])
    wildcards, params = dict(snakemake.wildcards.items()), dict(snakemake.params.items())
    source = {"rule": snakemake.rule, **wildcards, **params}
    interval_s = float(snakemake.resources.checkpoint_interval_s)
    checkpoint = Checkpoint(params["checkpoint"], interval_s, source, snakemake.threads)
    done = push_cone(params, snakemake.input.bed, checkpoint)
    store(wildcards, *done, dict(snakemake.output.items()), "press", source)
    checkpoint.remove()
