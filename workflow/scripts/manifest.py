"""Adapt rule `manifest` to `_manifest`."""

from pathlib import Path

from _log import log_to
from virtual_soil.campaign.manifest import write_manifest

if __name__ == "__main__":
    log_to(snakemake.log[0])
    write_manifest(Path(snakemake.output.manifest).parent)
