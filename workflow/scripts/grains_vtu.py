"""Adapt rule `grains_vtu` to meshio: the grains of one stored moment as points for ParaView."""

import meshio
import numpy as np

from _files import whole
from _log import log_to
from _tables import TableError, read_table

PLACES = ["x_m", "y_m", "z_m"]


def main(grains_path, path):
    """Each grain a vertex at its centre; every column that is no place becomes data of the point."""
    grains = read_table(grains_path, "grains")
    if grains.empty:
        raise TableError(f"{grains_path}: holds no grains, as its simulation failed; run.parquet beside it says why.")
    mesh = meshio.Mesh(
        grains[PLACES].to_numpy(),
        {"vertex": np.arange(len(grains))[:, None]},
        point_data={name: grains[name].to_numpy() for name in grains.columns.drop(PLACES)},
    )
    with whole(path) as part:
        mesh.write(part, file_format="vtu")


if __name__ == "__main__":
    log_to(snakemake.log[0])
    main(snakemake.input.grains, snakemake.output.vtu)
