"""Adapt rule `measure_soils` to `calibration.measure_soil`."""

import pandas as pd

from _log import log_to
from _tables import write_table
from calibration import measure_soil

if __name__ == "__main__":
    log_to(snakemake.log[0])
    table = pd.concat([measure_soil(path) for path in snakemake.input.soils], ignore_index=True)
    write_table(table, snakemake.output.table, "soil", {"rule": snakemake.rule, "inference": snakemake.params.inference})
