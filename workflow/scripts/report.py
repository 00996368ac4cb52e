"""Adapt rule `report` to `_report.build`."""

from _files import write_text
from _log import log_to
from _report import build

if __name__ == "__main__":
    log_to(snakemake.log[0])
    html = build(snakemake.input, snakemake.params.config, snakemake.params.versions)
    write_text(snakemake.output.html, html)
