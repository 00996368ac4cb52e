"""Adapt rule `verification_page` to `verification.page.write_page`."""

from pathlib import Path

from _log import log_to
from _tables import read_table
from verification.page import write_page

if __name__ == "__main__":
    log_to(snakemake.log[0])
    tables = [read_table(path, "checks") for path in snakemake.input.tables]
    write_page(dict(zip(snakemake.params.groups, tables, strict=True)), Path(snakemake.output.page), Path(snakemake.output.figures))
