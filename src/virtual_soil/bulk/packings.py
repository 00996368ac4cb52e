"""Packings at rest, from which both codes start: read from the published files, or filled."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from virtual_soil.errors import InputError

COLUMNS = ("radius_m", "x_m", "y_m", "z_m", "material")


@dataclass(frozen=True, kw_only=True)
class Packing:
    """Grains at rest: positions_m (n, 3), radii_m (n,), materials (n,) names; grains of one material stand together."""

    positions_m: np.ndarray
    radii_m: np.ndarray
    materials: np.ndarray

    def __len__(self):
        return len(self.radii_m)

    @property
    def names(self) -> list[str]:
        """Names of the materials, in their order."""
        return list(dict.fromkeys(self.materials.tolist()))


def packing_file(folder: Path, name: str) -> Path:
    """Path of a published packing, by its name without ending.

    Raises
    ------
    InputError : it is not there.
    """
    path = folder / f"{name}.parquet"
    if not path.is_file():
        raise InputError(
            f"bulk.packings is {folder}, which has no {path.name}; allowed: a folder with the benchmark's packings, "
            f"tables with the columns {', '.join(COLUMNS)}."
        )
    return path


def of_table(table: pd.DataFrame, source: str) -> Packing:
    """Packing of a table.

    Raises
    ------
    InputError : columns are missing, it has no rows, or values that are not finite, or a radius is not positive.
    """
    missing = [column for column in COLUMNS if column not in table]
    if missing:
        raise InputError(f"{source} has no column {', '.join(missing)}; needed: {', '.join(COLUMNS)}.")
    numbers = table[list(COLUMNS[:4])].to_numpy(float)
    if not len(numbers) or not np.isfinite(numbers).all() or not (numbers[:, 0] > 0).all():
        raise InputError(f"{source} has {len(numbers)} grains; needed: at least one, finite places and positive radii.")
    order = np.argsort(table["material"].to_numpy(str), kind="stable")
    rows = table.iloc[order]
    return Packing(
        positions_m=rows[["x_m", "y_m", "z_m"]].to_numpy(float),
        radii_m=rows["radius_m"].to_numpy(float),
        materials=rows["material"].to_numpy(str),
    )


def to_table(packing: Packing) -> pd.DataFrame:
    """Table of a packing, with COLUMNS."""
    x, y, z = packing.positions_m.T
    return pd.DataFrame({"radius_m": packing.radii_m, "x_m": x, "y_m": y, "z_m": z, "material": packing.materials})
