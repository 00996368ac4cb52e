"""What a section of the report consists of."""

from dataclasses import dataclass

import pandas as pd
from matplotlib.figure import Figure


@dataclass(frozen=True)
class Entry:
    """A figure in the list of contents.

    view: name of the interactive view in views.js that is drawn over it; hint: how to use that view.
    friction_grid: True if the figure needs a design whose grid is static and rolling friction.
    """

    title: str
    view: str = ""
    hint: str = ""
    friction_grid: bool = False


@dataclass(frozen=True)
class Item:
    """A figure, the table behind it, and its alternative text."""

    figure: Figure
    data: pd.DataFrame
    alt: str
