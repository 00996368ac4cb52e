"""Drawing that several figures share: canvas, colours, grains, SVG."""

import io

import matplotlib as mpl

mpl.use("Agg")

import numpy as np
import pandas as pd
from matplotlib.collections import EllipseCollection
from matplotlib.figure import Figure

#: Colours that stay apart for colour-blind readers (Okabe & Ito).
COLOURS = ["#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000"]


def svg(figure: Figure) -> str:
    """A figure as SVG; the same figure gives the same text."""
    buffer = io.StringIO()
    with mpl.rc_context({"svg.hashsalt": "virtual-soil"}):
        figure.savefig(buffer, format="svg", dpi=200, metadata={"Date": None})
    return buffer.getvalue()


def canvas(columns: int = 1, width: float = 8.0, height: float = 4.2):
    """A figure with axes side by side."""
    figure = Figure(figsize=(width, height), layout="constrained")
    return figure, np.atleast_1d(figure.subplots(1, columns))


def draw_grains(axes, grains: pd.DataFrame, colour, **settings) -> None:
    """Grains seen along y as circles at true scale (mm), far ones first."""
    order = np.argsort(-grains["y_m"].to_numpy())
    shown = grains.iloc[order]
    diameters = 2e3 * shown["radius_m"].to_numpy()
    circles = EllipseCollection(
        diameters,
        diameters,
        0.0,
        units="xy",
        offsets=1e3 * shown[["x_m", "z_m"]].to_numpy(),
        offset_transform=axes.transData,
        array=np.asarray(colour)[order],
        edgecolors="black",
        linewidths=0.15,
        cmap="viridis",
        rasterized=True,
        **settings,
    )
    axes.add_collection(circles)
    axes.set_aspect("equal")
    axes.autoscale_view()
    axes.set_xlabel("x (mm)")
    axes.set_ylabel("z (mm)")
