"""Adapt rule `handbook_wheel` to `virtual_soil.wheel.beside.handbook_table`."""

from pathlib import Path

from _log import log_to
from virtual_soil.campaign.tables import read_table, write_table
from virtual_soil.wheel.beside import handbook_table

if __name__ == "__main__":
    log_to(snakemake.log[0])
    params = snakemake.params
    tables = {Path(path).stem: read_table(path, Path(path).stem) for path in snakemake.input.tables}
    table = handbook_table(tables, params.handbook, params.measured, params.depth_m, params.gravity_m_s2)
    write_table(table, snakemake.output.table, "wheel_handbook", {"rule": snakemake.rule, **dict(params.items())})
