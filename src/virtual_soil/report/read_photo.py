"""The angle of repose from photographs: `make angle PHOTO="a.jpg b.jpg"` prints it and draws what was seen into each photograph.

Options: BOX=left,top,right,bottom is the part of the pictures that is looked at; GROUND=x0,y0,x1,y1 are two points of the line on
which the heaps stand; both in pixels of the photographs.
"""

import argparse
import json
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
    axes.set(xlim=(left, right), ylim=(bottom, top), aspect="equal")
    axes.set_title(f"{photo.path.name}: {heap.angle_deg:.1f} ± {heap.uncertainty_deg:.1f}°")
    return figure


def described(heap: HeapPhoto) -> str:
    """A line on one photograph."""
    parts = ("flanks", "fit", "segmentation", "tilt", "view")
    angles = f"left {heap.left_deg:.2f}, right {heap.right_deg:.2f}"
    contributions = ", ".join(f"{part} {getattr(heap, part + '_deg'):.2f}" for part in parts)
    ground = heap.outline.ground
    return (
        f"{heap.photo.path.name}: {heap.angle_deg:.2f} +- {heap.uncertainty_deg:.2f} deg "
        f"({angles}; {contributions}; ground {ground.tilt_deg:+.2f} +- {ground.tilt_error_deg:.2f})"
    )


def mean_of(heaps: Sequence[HeapPhoto]) -> tuple[float, float]:
    """Mean angle of repose over photographs and its standard uncertainty in degrees.

    The standard error has Student's factor (see `noise.student`) and is at least what the single readings leave open. The view's
    uncertainty is the same in all photographs and does not become less.
    """
    angles, n = np.array([heap.angle_deg for heap in heaps]), len(heaps)
    error = np.sqrt(np.mean([heap.reading_deg**2 for heap in heaps]) / n)
    if n > 1:
        error = max(error, float(student(n - 1)) * angles.std(ddof=1) / np.sqrt(n))
    return float(angles.mean()), float(np.hypot(error, np.mean([heap.view_deg for heap in heaps])))


def soil_line(heaps: Sequence[HeapPhoto]) -> str:
    """The entry of a soil file that photographs make."""
    value, error = mean_of(heaps)
    names = ", ".join(heap.photo.path.name for heap in heaps)
    source = json.dumps(f"photograph{'s' if len(heaps) > 1 else ''} {names}", ensure_ascii=False)
    return f"angle_of_repose_deg: {{value: {value:.2f}, standard_uncertainty: {error:.2f}, source: {source}}}"


def read_photos(
    paths: Sequence[Path], box: Sequence[float] | None = None, ground: Sequence[float] | None = None, folder: Path = FOLDER
) -> list[str]:
    """Lines on photographs of heaps of one soil; draws each into a folder. Raises CalibrationError at the first refused."""
    resolved = [path.resolve() for path in paths]
    twice = next((path for k, path in enumerate(paths) if resolved.index(resolved[k]) < k), None)
    demand(twice is None, "PHOTO", f"{twice} twice", "different photographs")
    lines, heaps = [], []
    for k, path in enumerate(paths, 1):
        heaps.append(read_heap(path, box, ground))
        unique = sum(other.stem == path.stem for other in paths) == 1
        picture = folder / (f"{path.stem}.png" if unique else f"{k}-{path.stem}.png")
        folder.mkdir(parents=True, exist_ok=True)
        draw_heap(heaps[-1]).savefig(picture, dpi=150)
        lines += [described(heaps[-1]), f"    drawn: {picture}"]
    return [*lines, "", "For the soil file, if the drawn lines follow the flanks:", soil_line(heaps)]


def four(name: str, text: str | None) -> tuple[float, ...] | None:
    """Four numbers separated by commas, or None. Raises CalibrationError."""
    if text is None:
        return None
    try:
        values = tuple(float(part) for part in text.split(","))
    except ValueError:
        values = ()
    demand(len(values) == 4 and bool(np.isfinite(values).all()), name, repr(text), "four numbers separated by commas")
    return values


def main(arguments: list[str] | None = None) -> None:
    """Print the angle of repose that photographs show."""
    parser = argparse.ArgumentParser(description="Read the angle of repose from photographs of heaps.")
    parser.add_argument("photos", type=Path, nargs="+", help="photographs, one heap each, all of one soil")
    parser.add_argument("--box", help="left,top,right,bottom in pixels: the part that is looked at")
    parser.add_argument("--ground", help="x0,y0,x1,y1 in pixels: two points of the line on which the heap stands")
    given = parser.parse_args(arguments)
    try:
        print("\n".join(read_photos(given.photos, four("BOX", given.box), four("GROUND", given.ground))))
    except CalibrationError as error:
        raise SystemExit(str(error)) from None


if __name__ == "__main__":
    main()
