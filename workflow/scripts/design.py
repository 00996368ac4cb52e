"""Adapt rule `design`: write the design table expanded by the Snakefile."""

import pandas as pd

from _log import log_to
from virtual_soil.campaign.experiments.registry import LOADS
from virtual_soil.campaign.tables import write_table

if __name__ == "__main__":
    log_to(snakemake.log[0])
    table = pd.DataFrame(snakemake.params.rows)
    table[list(LOADS)] = table[list(LOADS)].astype(float)
    write_table(table, snakemake.output.table, "design", {"rule": "design"})
