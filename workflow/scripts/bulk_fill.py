"""Adapt rule `bulk_fill` to `virtual_soil.bulk.silo.fill`."""

from _log import log_to
from virtual_soil.bulk import silo
from virtual_soil.bulk.packings import to_table
from virtual_soil.campaign.tables import write_table

if __name__ == "__main__":
    log_to(snakemake.log[0])
    packing = silo.fill(silo.SETUPS[snakemake.wildcards.orifice], seed=1)
    write_table(to_table(packing), snakemake.output.packing, "bulk_packing", {"rule": snakemake.rule})
