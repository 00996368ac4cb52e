"""Adapt rule `measure_soils` to `virtual_soil.campaign.soils` and `virtual_soil.calibration.twin`."""

import pandas as pd

from _log import log_to
from virtual_soil.calibration.twin import twin_soil
from virtual_soil.campaign.design import SEED_KEYS
from virtual_soil.campaign.experiments.registry import chosen, responses_of
from virtual_soil.campaign.inference import read_tables
from virtual_soil.campaign.soils import measure_soil
from virtual_soil.campaign.tables import write_table

if __name__ == "__main__":
    log_to(snakemake.log[0])
    params = snakemake.params
    tables = [measure_soil(path) for path in snakemake.input.soils]
    if params.twins:
        runs = read_tables(snakemake.input.tables)
        for name, twin in params.twins.items():
            prepared = [f"{len(twin[SEED_KEYS[test.NAME]])} {test.NOUNS[2]}" for test in reversed(chosen(params.experiments))]
            found = twin_soil(name, twin, responses_of(params.experiments), runs, params.design, params.material)
            tables.append(found.assign(method=", ".join(["simulated", *prepared])))
    provenance = {"rule": snakemake.rule, **dict(params.items())}
    write_table(pd.concat(tables, ignore_index=True).fillna({"strength": ""}), snakemake.output.table, "soil", provenance)
