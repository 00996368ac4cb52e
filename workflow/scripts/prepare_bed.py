"""Adapt rule `prepare_bed` to `virtual_soil.wheel.runs.prepare_bed`."""

from _log import log_to
from virtual_soil.campaign.resume import Checkpoint
from virtual_soil.wheel.runs import prepare_bed, store_bed, with_preparation

if __name__ == "__main__":
    log_to(snakemake.log[0])
    wildcards, params = dict(snakemake.wildcards.items()), dict(snakemake.params.items())
    params["bed"] = with_preparation(params["bed"], snakemake.input.get("preparation") or None)
    source = {"rule": snakemake.rule, **wildcards, **params}
    interval_s = float(snakemake.resources.checkpoint_interval_s)
    checkpoint = Checkpoint(params["checkpoint"], interval_s, source, snakemake.threads)
    row = prepare_bed(params, int(wildcards["bed_seed"]), snakemake.output.bed, checkpoint)
    store_bed(wildcards, row, snakemake.output.row, source)
    checkpoint.remove()
