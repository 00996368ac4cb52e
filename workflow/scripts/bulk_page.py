"""Adapt rule `bulk_page` to `virtual_soil.bulk.page.write_page`."""

from pathlib import Path

import pandas as pd

from _log import log_to
from virtual_soil.bulk.cases import curves_of
from virtual_soil.bulk.packings import of_table
from virtual_soil.bulk.page import Results, write_page
from virtual_soil.campaign.tables import read_table

if __name__ == "__main__":
    log_to(snakemake.log[0])
    files = snakemake.input
    costs = pd.concat([read_table(path, "bulk_cost") for path in files.costs], ignore_index=True)
    curves = [curves_of(read_table(path, "bulk_curve")) for path in files.curves]
    fillings = {Path(path).stem.removeprefix("silo_"): of_table(read_table(path, "bulk_packing"), path) for path in files.fillings}
    names = costs[["case", "code", "variant"]].itertuples(index=False, name=None)
    results = Results(costs=costs, curves=dict(zip(names, curves, strict=True)), fillings=fillings)
    write_page(results, Path(snakemake.output.page), Path(snakemake.output.figures[0]).parent)
