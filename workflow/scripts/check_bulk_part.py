"""Adapt rule `check_bulk_part` to `verification.bulk.run`."""

import pandas as pd

from _log import log_to
from virtual_soil.campaign.tables import write_table
from virtual_soil.verification import bulk


def main(part: int, parts: int, output, source):
    rows = []
    for name in bulk.runs()[part::parts]:
        print(name, flush=True)
        rows.append(bulk.run(name))
    write_table(pd.DataFrame(rows, columns=bulk.COLUMNS), output, "bulk_runs", source)


if __name__ == "__main__":
    log_to(snakemake.log[0])
    params = dict(snakemake.params.items())
    main(int(snakemake.wildcards.part), params["parts"], snakemake.output.table, {"rule": snakemake.rule, **params})
