"""Tables of grains: a row for every sphere, with the clump that it belongs to if grains are clumps."""

import numpy as np

from dem import Grains
from dem.experiments.soil import Soil

COLUMNS = ("x_m", "y_m", "z_m", "radius_m", "speed_m_s")
#: Further columns of clumps: number of the clump in the table, and radius of the sphere of equal volume.
CLUMP, CLUMP_RADIUS = "clump", "clump_radius_m"


def of_simulation(simulation: str, columns: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Prepend a column with the id of the simulation."""
    return {"simulation": np.full(len(next(iter(columns.values()), ())), simulation, dtype="U10"), **columns}


def empty_columns(names) -> dict[str, np.ndarray]:
    """Columns without rows and the column of the simulation's id."""
    return of_simulation("", {name: np.zeros(0) for name in names})


def grain_table(grains: Grains, simulation: str = "", soil: Soil | None = None) -> dict[str, np.ndarray]:
    """Return id of the simulation, positions, radii and speeds of spheres as columns; of a soil of clumps CLUMP, CLUMP_RADIUS."""
    x, y, z = grains.positions_m.reshape(-1, 3).T
    speeds = np.linalg.norm(grains.velocities_m_s.reshape(-1, 3), axis=1)
    columns = {"x_m": x, "y_m": y, "z_m": z, "radius_m": grains.radii_m, "speed_m_s": speeds}
    if soil is not None and soil.shape is not None:
        columns |= {
            CLUMP: soil.owners(grains),
            CLUMP_RADIUS: soil.wholes(grains).radii_m[soil.owners(grains)],
        }
    return of_simulation(simulation, columns)


def empty_grains(clumps: bool = False) -> dict[str, np.ndarray]:
    """Empty grain table, for a failed simulation."""
    if not clumps:
        return empty_columns(COLUMNS)
    return empty_columns((*COLUMNS, CLUMP_RADIUS)) | {CLUMP: np.zeros(0, int)}


def grain_radii_m(table) -> np.ndarray:
    """Radii of the grains of a table (DataFrame), of clumps those of the spheres of equal volume, (n grains,)."""
    if CLUMP not in table:
        return table["radius_m"].to_numpy()
    return table.drop_duplicates(CLUMP)[CLUMP_RADIUS].to_numpy()
