"""Adapt rule `drive_wheel` to `virtual_soil.wheel.runs.drive_wheel`."""

from _log import log_to
from virtual_soil.campaign.resume import Checkpoint
from virtual_soil.wheel.runs import drive_wheel, store

if __name__ == "__main__":
    log_to(snakemake.log[0])
    wildcards, params = dict(snakemake.wildcards.items()), dict(snakemake.params.items())
    source = {"rule": snakemake.rule, **wildcards, **params}
    interval_s = float(snakemake.resources.checkpoint_interval_s)
    checkpoint = Checkpoint(params["checkpoint"], interval_s, source, snakemake.threads)
    done = drive_wheel(params, wildcards["slip"], snakemake.input.bed, snakemake.input.lowered, checkpoint)
    store(wildcards, *done, dict(snakemake.output.items()), "wheel", source)
    checkpoint.remove()
