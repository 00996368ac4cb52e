"""Adapt rule `wheel_tests_design` to `virtual_soil.campaign.tables`."""

import pandas as pd

from _log import log_to
from virtual_soil.campaign.tables import write_table

if __name__ == "__main__":
    log_to(snakemake.log[0])
    params = snakemake.params
    write_table(pd.DataFrame(params.rows), snakemake.output.table, "design", {"rule": snakemake.rule, "code": params.code})
