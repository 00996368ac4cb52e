"""Adapt rule `report` to `virtual_soil.report.page`."""

from pathlib import Path

from _log import log_to
from virtual_soil.campaign.files import write_text
from virtual_soil.report.inputs import read_study
from virtual_soil.report.page import build, csv


def main(files, config, versions, output):
    report = build(read_study(files, config), versions)
    for paths, texts in (
        (output.figures, report.figures),
        (output.data, {name: csv(table) for name, table in report.data.items()}),
        (output.tables, {name: csv(table) for name, table in report.tables.items()}),
        ([output.html], {"report": report.html}),
    ):
        for path in paths:
            write_text(path, texts[Path(path).stem])


if __name__ == "__main__":
    log_to(snakemake.log[0])
    main(snakemake.input, snakemake.params.config, snakemake.params.versions, snakemake.output)
