"""Adapt rule `verification_page` to `verification.page.write_page`."""

from pathlib import Path

from _log import log_to
from virtual_soil.campaign.tables import read_table
from virtual_soil.verification.page import write_page

if __name__ == "__main__":
    log_to(snakemake.log[0])
    files = snakemake.input
    tables = {group: read_table(path, "checks") for group, path in zip(snakemake.params.groups, files.tables, strict=True)}
    tables |= {Path(path).stem: read_table(path, "checks") for path in files.peers}
    runs = read_table(files.runs, "bulk_runs")
    write_page(tables, Path(snakemake.output.page), Path(snakemake.output.figures[0]).parent, runs)
