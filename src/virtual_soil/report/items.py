"""What a section of the report consists of."""

from dataclasses import dataclass

import pandas as pd
from matplotlib.figure import Figure


@dataclass(frozen=True)
class Entry:
    """A figure in the list of contents.

    view: name of the interactive view in views.js that is drawn over it; hint: how to use that view.
    needs: what a design must offer for the figure to be drawn, see `report.study.offers`, or "curves": of a laboratory.
    """

    title: str
    view: str = ""
    hint: str = ""
    needs: str = ""


@dataclass(frozen=True)
class Item:
    """A figure, the table behind it, and its alternative text."""

    figure: Figure
    data: pd.DataFrame
    alt: str
