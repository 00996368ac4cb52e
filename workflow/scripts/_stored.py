"""What simulations have stored: a file holds one simulation, or several that one job ran, told apart by a column."""

from pathlib import Path

import pandas as pd

from _tables import read_table

#: Of a file that holds several simulations: which one a row belongs to.
SIMULATION = "simulation"


def stored(paths, name: str) -> dict[str, pd.DataFrame]:
    """Simulation -> its rows of a table of schema `name`; the folder names the simulation where no column does."""
    found = {}
    for path in dict.fromkeys(map(str, paths)):
        table = read_table(path, name)
        if SIMULATION in table:
            rows = table.groupby(SIMULATION, sort=False)
            found |= {simulation: own.drop(columns=SIMULATION).reset_index(drop=True) for simulation, own in rows}
        else:
            found[Path(path).parent.name] = table
    return found
