"""Adapt rule `measure_soils` to `calibration.measure_soil` and `calibration.twin_soil`."""

import pandas as pd

from _log import log_to
from virtual_soil.calibration import measure_soil, twin_soil
from virtual_soil.campaign.tables import read_table, write_table

if __name__ == "__main__":
    log_to(snakemake.log[0])
    params = snakemake.params
    tables = [measure_soil(path) for path in snakemake.input.soils]
    if params.twins:
        repose, strength = read_table(snakemake.input.repose[0], "repose"), read_table(snakemake.input.strength[0], "strength")
        tables += [twin_soil(name, twin, repose, strength, params.design, params.material) for name, twin in params.twins.items()]
    provenance = {"rule": snakemake.rule, **dict(params.items())}
    write_table(pd.concat(tables, ignore_index=True), snakemake.output.table, "soil", provenance)
