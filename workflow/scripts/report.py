"""Adapt rule `report` to `_report.build`."""

from pathlib import Path

from _log import log_to
from _report import build

if __name__ == "__main__":
    log_to(snakemake.log[0])
    html = build(snakemake.input, snakemake.params.config, snakemake.params.versions)
    Path(snakemake.output.html).write_text(html, encoding="utf-8")
