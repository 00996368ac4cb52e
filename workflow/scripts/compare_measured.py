"""Adapt rule `compare_measured` to `virtual_soil.wheel.beside.compared`."""

from _log import log_to
from virtual_soil.campaign.tables import read_table, write_table
from virtual_soil.wheel.beside import compared

if __name__ == "__main__":
    log_to(snakemake.log[0])
    files, params = snakemake.input, snakemake.params
    table = compared(
        read_table(files.wheel, "wheel"),
        files.plate_runs,
        files.plate_histories,
        {"wheel": params.wheel, "plate": params.plate},
        params.gravity_m_s2,
    )
    write_table(table, snakemake.output.table, "wheel_measured", {"rule": snakemake.rule, **dict(params.items())})
