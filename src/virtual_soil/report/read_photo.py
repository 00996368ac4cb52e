"""The angle of repose from photographs: `make angle PHOTO="a.jpg b.jpg"` prints it and draws what was seen into each photograph.

Options: BOX=left,top,right,bottom is the part of the pictures that is looked at; GROUND=x0,y0,x1,y1 are two points of the line on
which the heaps stand; both in pixels of the photographs.
"""

import argparse
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from virtual_soil.calibration.errors import CalibrationError, demand
from virtual_soil.calibration.noise import student
from virtual_soil.campaign.laboratory.photo.heap import HeapPhoto, read_heap
from virtual_soil.report.plots import COLOURS, canvas

FOLDER = Path("results") / "read_photo"


def draw_heap(heap: HeapPhoto) -> Figure:
    """A photograph with the heap's outline, the ground, and the lines of both flanks; axes in pixels of the photograph."""
    photo, outline = heap.photo, heap.outline
    rows, columns = photo.colours.shape[:2]
    (left, top), (right, bottom) = photo.to_photo([(0, 0), (columns, rows)])
    figure, (axes,) = canvas(width=9.0, height=9.0 * rows / columns + 0.8)
    axes.imshow(photo.colours, extent=(left, right, bottom, top))
    axes.contour(heap.mask, [0.5], colors=[COLOURS[5]], linewidths=1.0, extent=(left, right, top, bottom))
    ends = photo.to_photo(outline.ground.picture(outline.along[[0, -1]], np.zeros(2)))
    axes.plot(*ends.T, color=COLOURS[4], linewidth=1.5)
    for side, angle in ((outline.left, heap.left_deg), (outline.right, heap.right_deg)):
        line = photo.to_photo(outline.ground.picture(*side.line.T))
        axes.plot(*line.T, color=COLOURS[1], linewidth=2.5)
        place = line.mean(axis=0) + (np.sign(line[1, 0] - line[0, 0]) * 0.03 * (right - left), -0.03 * (bottom - top))
        align = "left" if line[1, 0] > line[0, 0] else "right"
        label = {"boxstyle": "round", "facecolor": "white", "alpha": 0.8, "edgecolor": "none"}
        axes.text(*place, f"{angle:.1f}°", color=COLOURS[1], ha=align, va="bottom", fontsize="large", bbox=label)
    axes.set(
        title=f"{photo.path.name}: {heap.angle_deg:.1f} ± {heap.uncertainty_deg:.1f}°", xlim=(left, right), ylim=(bottom, top), aspect="equal"
    )
    return figure
