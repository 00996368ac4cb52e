"""Adapt rule `record_lift` to `virtual_soil.campaign.recording`."""

from _log import log_to
from virtual_soil.campaign.experiments.common import soil_of
from virtual_soil.campaign.experiments.repose.recording import frame_table
from virtual_soil.campaign.recording import record
from virtual_soil.campaign.simulate import provenance
from virtual_soil.campaign.tables import write_table

#: Number of recorded frames.
N_FRAMES = 31


def main(row, settings, engine, path):
    frames = record(row, settings, "lift").shown(N_FRAMES)
    table = frame_table(frames, row["simulation_id"], soil_of(row, settings))
    write_table(table, path, "lift", provenance([(row, settings)], engine))


if __name__ == "__main__":
    log_to(snakemake.log[0])
    main(snakemake.params.row, snakemake.params.settings, snakemake.params.engine, snakemake.output.lift)
