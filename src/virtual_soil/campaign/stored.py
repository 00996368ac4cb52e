"""What simulations have stored, by simulation: a file holds what one job ran."""

import pandas as pd

from virtual_soil.campaign.tables import read_simulations


def stored(paths, name: str) -> dict[str, pd.DataFrame]:
    """Simulation -> its rows of a table of schema `name`; one that failed is not there."""
    return {
        simulation: table.drop(columns="simulation")
        for path in dict.fromkeys(map(str, paths))
        for simulation, table in read_simulations(path, name)
    }
