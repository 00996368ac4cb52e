"""Stored tables by simulation; a file contains all simulations of one job."""

import pandas as pd

from virtual_soil.campaign.tables import read_simulations


def stored(paths, name: str) -> dict[str, pd.DataFrame]:
    """Return simulation -> its rows of a table of schema `name`, without failed simulations."""
    return {
        simulation: table.drop(columns="simulation")
        for path in dict.fromkeys(map(str, paths))
        for simulation, table in read_simulations(path, name)
    }
