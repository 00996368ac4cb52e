"""Adapt rule `check_report` to `virtual_soil.wheel.check_page`."""

from pathlib import Path

from _log import log_to
from virtual_soil.campaign.tables import read_table
from virtual_soil.report.html_page import write_html
from virtual_soil.wheel.check_page import write_page

if __name__ == "__main__":
    log_to(snakemake.log[0])
    table, params = read_table(snakemake.input.table, "wheel_check"), snakemake.params
    write_page(table, params.verdicts, params.run, Path(snakemake.output.page))
    write_html(snakemake.output.page, snakemake.output.html)
