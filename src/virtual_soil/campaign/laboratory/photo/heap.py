"""The angle of repose that a photograph shows, and how well it shows it."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from virtual_soil.calibration.errors import CalibrationError, demand
from virtual_soil.campaign.laboratory.photo.image import Photo, read_photo
from virtual_soil.campaign.laboratory.photo.outline import Ground, NoHeap, Outline, outline_of
from virtual_soil.campaign.laboratory.photo.segment import NONE, edges, guesses, palette_map, refine, snapped

#: Standard deviations in pixels at which colours are seen, and thresholds of the log odds (a factor of 2.7 each): the angle is
#: the mean over all of them, their scatter the uncertainty of the segmentation.
BLURS = (1.5, 2.5, 4.0)
THRESHOLDS = (-1.0, 0.0, 1.0)
#: Distance over the blur by which an outline is moved to the strongest edge, at most.
SNAP_RATIO = 3.0
#: Part of the variants that may have no heap's outline.
MOST_REFUSED = 0.5
#: Guesses are refined on every other pixel.
GUESS_STEP = 2
#: Divergence in bits that a heap has from its surroundings: at half a bit a third of the pixels could be either.
LEAST_DIVERGENCE = 0.5


@dataclass(frozen=True, kw_only=True)
class HeapPhoto:
    """Angle of repose from one photograph; angles and uncertainties (standard ones) in degrees.

    flanks : half of the difference of both flanks, the standard error of their mean. fit : of both lines. segmentation : scatter over
    blurs and thresholds. tilt : change of the mean with the ground turned by its error. `outline` is that of the middle variant.
    """

    photo: Photo
    mask: np.ndarray
    outline: Outline
    left_deg: float
    right_deg: float
    flanks_deg: float
    fit_deg: float
    segmentation_deg: float
    tilt_deg: float

    @property
    def angle_deg(self) -> float:
        """Mean of both flanks."""
        return 0.5 * (self.left_deg + self.right_deg)

    @property
    def uncertainty_deg(self) -> float:
        """Standard uncertainty of the angle: the root of the sum of squares of the four contributions."""
        return float(np.sqrt(self.flanks_deg**2 + self.fit_deg**2 + self.segmentation_deg**2 + self.tilt_deg**2))


def read_heap(path: Path, box: Sequence[float] | None = None, ground: Sequence[float] | None = None) -> HeapPhoto:
    """Angle of repose of the heap in a photograph.

    Parameters
    ----------
    path : Path
        Image file.
    box : 4 numbers, optional
        Left, top, right and bottom in pixels of what is looked at.
    ground : 4 numbers, optional
        x0, y0, x1, y1 in pixels: two points of the line on which the heap stands. Found if left out.

    Raises
    ------
    CalibrationError
        If the file is no image, an argument lies outside of it, or no heap is seen.
    """
    photo = read_photo(path, None if box is None else (box[0], box[1], box[2], box[3]))
    given = None if ground is None else ground_through(photo, ground)
    try:
        return measured(photo, given)
    except NoHeap as error:
        raise CalibrationError(f"{path}: {error}.") from None


def ground_through(photo: Photo, points: Sequence[float]) -> Ground:
    """The ground through two points x0, y0, x1, y1 of a photograph; a point is as good as a pixel."""
    (x0, y0), (x1, y1) = photo.to_working(np.reshape(points, (2, 2)))
    rows, columns = photo.colours.shape[:2]
    ok = x1 - x0 > 0.1 * columns and abs(y1 - y0) < x1 - x0 and all(0 <= y <= rows for y in (y0, y1))
    allowed = "x0,y0,x1,y1: two points of the picture under the left and the right foot"
    demand(ok, f"{photo.path}: GROUND", ",".join(f"{value:g}" for value in points), allowed)
    tilt = np.degrees(np.arctan2(y0 - y1, x1 - x0))
    error = np.degrees(photo.scale / (x1 - x0))
    return Ground(x=0.5 * (x0 + x1), y=0.5 * (y0 + y1), tilt_deg=float(tilt), tilt_error_deg=float(error))


def measured(photo: Photo, ground: Ground | None) -> HeapPhoto:
    """Angle of the heap in a photograph that is read. Raises NoHeap."""
    mask = found(photo, ground)
    variants, refusals = [], []
    for blur in BLURS:
        region = refine(entries_of(photo, blur, ground), mask, blur)
        change = edges(photo.colours, blur)
        for threshold in THRESHOLDS:
            variant = snapped(region.at(threshold), change, SNAP_RATIO * blur)
            try:
                variants.append((variant, outline_of(variant, ground)))
            except NoHeap as error:
                refusals.append(error)
    n = len(variants) + len(refusals)
    if len(refusals) > MOST_REFUSED * n:
        raise NoHeap(f"the heap's outline is uncertain, and for {len(refusals)} of {n} blurs and thresholds {refusals[0]}")
    outlines = [outline for _, outline in variants]
    left, right = (float(np.mean([getattr(o, side).angle_deg for o in outlines])) for side in ("left", "right"))
    middle, outline = variants[len(variants) // 2]
    error = outline.ground.tilt_error_deg
    turned = [outline_of(middle, outline.ground.turned(turn)).angle_deg for turn in (-error, error)]
    return HeapPhoto(
        photo=photo,
        mask=middle,
        outline=outline,
        left_deg=left,
        right_deg=right,
        flanks_deg=0.5 * abs(left - right),
        fit_deg=0.5 * float(np.hypot(outline.left.error_deg, outline.right.error_deg)),
        segmentation_deg=float(np.std([o.angle_deg for o in outlines], ddof=1)),
        tilt_deg=float(np.abs(np.subtract(turned, outline.angle_deg)).max()),
    )


def entries_of(photo: Photo, blur: float, ground: Ground | None) -> np.ndarray:
    """Palette entries (rows, columns) of a photograph; NONE below a ground that is given."""
    entries = palette_map(photo.colours, blur)
    if ground is not None:
        y, x = np.mgrid[: entries.shape[0], : entries.shape[1]] + 0.5
        entries[ground.frame(x, y)[1] < 0.0] = NONE
    return entries


def found(photo: Photo, ground: Ground | None) -> np.ndarray:
    """Mask (rows, columns) of the heap: of all guesses that lead to a heap's outline, that with the straightest lines.

    Raises NoHeap with what is wrong with the most distinct guess, if none is a heap.
    """
    entries = entries_of(photo, BLURS[1], ground)
    step, blur = GUESS_STEP, BLURS[1] / GUESS_STEP
    change = edges(photo.colours[::step, ::step], blur)
    heaps, refusals = [], []
    for guess in guesses(entries):
        region = refine(entries[::step, ::step], guess[::step, ::step], blur)
        mask = np.repeat(np.repeat(snapped(region.mask, change, SNAP_RATIO * blur), step, axis=0), step, axis=1)[: entries.shape[0], : entries.shape[1]]
        if region.divergence < LEAST_DIVERGENCE or not mask.any():
            continue
        try:
            outline = outline_of(mask, ground)
        except NoHeap as error:
            refusals.append(error)
        else:
            heaps.append((outline.departure, region.divergence, outline.angle_deg, mask))
    if heaps:
        return min(heaps, key=lambda heap: heap[0])[-1]
    if refusals:
        raise NoHeap(f"no heap found: {refusals[0]}")
    raise NoHeap("no heap found: nothing differs enough from what is around it")
