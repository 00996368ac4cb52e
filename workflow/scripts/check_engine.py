"""Adapt rule `check_engine` to `verification.groups`."""

from _log import log_to
from virtual_soil.campaign.tables import write_table
from virtual_soil.verification import table_of
from virtual_soil.verification.groups import GROUPS

if __name__ == "__main__":
    log_to(snakemake.log[0])
    table = table_of(GROUPS[snakemake.wildcards.group]())
    write_table(table, snakemake.output.table, "checks", {"rule": snakemake.rule, **dict(snakemake.params.items())})
