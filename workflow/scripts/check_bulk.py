"""Adapt rule `check_bulk` to `verification.bulk.checks`."""

import pandas as pd

from _log import log_to
from virtual_soil.campaign.tables import read_table, write_table
from virtual_soil.verification import bulk, table_of

if __name__ == "__main__":
    log_to(snakemake.log[0])
    source = {"rule": snakemake.rule, **dict(snakemake.params.items())}
    runs = pd.concat([read_table(path, "bulk_runs") for path in snakemake.input.parts]).sort_values("run", ignore_index=True)
    write_table(runs, snakemake.output.runs, "bulk_runs", source)
    write_table(table_of(bulk.checks(runs)), snakemake.output.table, "checks", source)
