"""Adapt rule `measure_soils` to `calibration.measure_soil` and `calibration.twin_soil`."""

import pandas as pd

from _log import log_to
from virtual_soil.calibration import measure_soil, twin_soil
from virtual_soil.campaign.experiments import RESPONSES
from virtual_soil.campaign.inference import response_tables
from virtual_soil.campaign.tables import read_table, write_table

if __name__ == "__main__":
    log_to(snakemake.log[0])
    params = snakemake.params
    tables = [measure_soil(path) for path in snakemake.input.soils]
    if params.twins:
        runs = response_tables(lambda paths, name: read_table(paths[0], name), snakemake.input)
        for name, twin in params.twins.items():
            method = f"simulated, {len(twin['repose_seeds'])} heaps, {len(twin['shear_seeds'])} specimens"
            tables.append(twin_soil(name, twin, RESPONSES, runs, params.design, params.material).assign(method=method))
    provenance = {"rule": snakemake.rule, **dict(params.items())}
    write_table(pd.concat(tables, ignore_index=True), snakemake.output.table, "soil", provenance)
