"""Adapt rule `grains_vtu` to `virtual_soil.report.paraview`: convert one file of stored grains."""

from _log import log_to
from virtual_soil.campaign.files import whole
from virtual_soil.campaign.tables import TableError, read_simulation
from virtual_soil.report.paraview import write_grains

PLACES = ["x_m", "y_m", "z_m"]


def main(grains_path, simulation, path):
    """Write the grains; all columns except the positions are point data."""
    grains = read_simulation(grains_path, "grains", simulation).drop(columns="simulation")
    if grains.empty:
        raise TableError(f"{grains_path}: holds no grains of {simulation}, as it failed; run.parquet beside it says why.")
    with whole(path) as part:
        write_grains(part, grains[PLACES].to_numpy(), {name: grains[name].to_numpy() for name in grains.columns.drop(PLACES)})


if __name__ == "__main__":
    log_to(snakemake.log[0])
    main(snakemake.input.grains, snakemake.wildcards.simulation, snakemake.output.vtu)
