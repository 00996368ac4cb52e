"""Adapt rule `bulk_packing` to `virtual_soil.bulk.packings`."""

import pandas as pd

from _log import log_to
from virtual_soil.bulk.packings import of_table, to_table
from virtual_soil.campaign.tables import write_table

if __name__ == "__main__":
    log_to(snakemake.log[0])
    path = snakemake.input.table
    write_table(to_table(of_table(pd.read_parquet(path), path)), snakemake.output.packing, "bulk_packing", {"rule": snakemake.rule})
