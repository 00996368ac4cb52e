"""The angle of repose that a photograph shows, and how well it shows it.

A cone of slope a shows a triangle of slope a only from far away and from the height of its foot. Its outline is where
lines of sight touch it. With the camera raised by the angle e, seen from far away, the triangle's slope s is

    tan^2 s = tan^2 a cos^2 e - sin^2 e,

and from a distance of D radii of its foot, on the level of the foot,

    tan^2 s = tan^2 a (1 - 1/D^2).

Neither can be seen in the picture, so a reading is not corrected for them; `seen_slope` tells by how much it is low. A lens bends
straight lines near the edge of the picture, which shows as flanks that leave their lines.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from virtual_soil.calibration.errors import CalibrationError, demand
from virtual_soil.campaign.laboratory.photo.image import Photo, read_photo
from virtual_soil.campaign.laboratory.photo.outline import Ground, NoHeap, Outline, check_flanks, outline_of
from virtual_soil.campaign.laboratory.photo.segment import NONE, edges, guesses, palette_map, refine, snapped

#: Blurs (standard deviations over the root of the heap's area, but no less than a pixel) at which colours are seen, and
#: thresholds of the log odds (a factor of 2.7 each): the angle is the median of all of them, their scatter the uncertainty of
#: the segmentation.
BLUR_RATIOS = np.array([0.01, 0.017, 0.028])
THRESHOLDS = (-1.0, 0.0, 1.0)
#: Distance over the blur by which an outline is moved to the strongest edge, at most.
SNAP_RATIO = 3.0
#: Standard uncertainty of a reading in degrees, beyond which it is open what was seen; a heap ten grains high reads to 3 deg.
MOST_UNCERTAIN_DEG = 4.0
#: Masks that are measured before a photograph is refused.
MOST_CANDIDATES = 3
#: Part of the variants that may have no heap's outline.
MOST_REFUSED = 0.5
#: ASSUME: the camera is raised by no more than this angle over the foot of the heap, and no nearer than so many radii of the foot.
#: What a 30 degree cone then reads too low, 0.5 degrees, is a standard uncertainty.
RAISED_DEG, DISTANCE_RATIO = 5.0, 10.0
#: Guesses are refined on every other pixel, at this blur in pixels of the whole picture.
GUESS_STEP, GUESS_BLUR = 2, 2.5
#: Divergence in bits that a heap has from its surroundings: at half a bit a third of the pixels could be either.
LEAST_DIVERGENCE = 0.5


@dataclass(frozen=True, kw_only=True)
class HeapPhoto:
    """Angle of repose from one photograph; angles and uncertainties (standard ones) in degrees.

    flanks : half of the difference of both flanks, the standard error of their mean. fit : of both lines. segmentation :
    scatter over blurs and thresholds. tilt : change of the mean with the ground turned by its error. view : by how much a
    camera that is not quite level and far away may see too low. `mask` and `outline` are those of the middle variant.
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
    view_deg: float

    @property
    def angle_deg(self) -> float:
        """Mean of both flanks."""
        return 0.5 * (self.left_deg + self.right_deg)

    @property
    def reading_deg(self) -> float:
        """Standard uncertainty of the angle in this picture, without that of the view, which several photographs share."""
        return float(np.sqrt(self.flanks_deg**2 + self.fit_deg**2 + self.segmentation_deg**2 + self.tilt_deg**2))

    @property
    def uncertainty_deg(self) -> float:
        """Standard uncertainty of the angle: the root of the sum of squares of all contributions."""
        return float(np.hypot(self.reading_deg, self.view_deg))


def seen_slope(angle_deg: float, raised_deg: float = 0.0, distance_ratio: float = np.inf) -> float:
    """Slope in degrees of the outline that a cone shows to a camera raised by an angle, or `distance_ratio` radii of its foot away.

    Each formula (see above) is exact without the other's cause; 0 where the camera looks down onto the cone's flank.
    """
    e = np.radians(raised_deg)
    square = np.tan(np.radians(angle_deg)) ** 2 * (1.0 - 1.0 / distance_ratio**2) * np.cos(e) ** 2 - np.sin(e) ** 2
    return float(np.degrees(np.arctan(np.sqrt(max(square, 0.0)))))


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
        raise CalibrationError(f"{path}: no heap found: the likeliest outline {error}.") from None


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
    """Angle of the heap in a photograph that is read. Raises NoHeap, which says what is wrong with the most likely mask."""
    masks = candidates(photo, ground)
    failures = []
    for mask in masks[:MOST_CANDIDATES]:
        try:
            return measured_from(photo, mask, ground)
        except NoHeap as error:
            failures.append(error)
    if failures:
        raise failures[0]
    raise CalibrationError(f"{photo.path}: no heap found: nothing differs enough from what is around it.")


def measured_from(photo: Photo, mask: np.ndarray, ground: Ground | None) -> HeapPhoto:
    """Angle of the heap that a mask nearly covers. Raises NoHeap."""
    variants, refusals = [], []
    for blur in np.maximum(1.0, np.sqrt(mask.sum()) * BLUR_RATIOS):
        region = refine(entries_of(photo, blur, ground), mask, blur)
        change = edges(photo.colours, blur)
        for threshold in THRESHOLDS:
            rough = region.at(threshold)
            try:
                # where the heap is as bright as what is behind it, roughness alone tells them apart, and a snapped edge is ragged
                variants.append(heap_of([snapped(rough, change, SNAP_RATIO * blur), rough], ground))
            except NoHeap as error:
                refusals.append(error)
    n = len(variants) + len(refusals)
    if len(refusals) > MOST_REFUSED * n:
        raise NoHeap(f"is uncertain: for {len(refusals)} of {n} blurs and thresholds it {refusals[0]}")
    outlines = [outline for _, outline in variants]
    sides = np.array([(o.left.angle_deg, o.right.angle_deg) for o in outlines])
    left, right = (float(angle) for angle in np.median(sides, axis=0))
    middle, outline = variants[len(variants) // 2]
    turn = outline.ground.tilt_error_deg
    turned = [outline_of(middle, outline.ground.turned(sign * turn)).angle_deg for sign in (-1.0, 1.0)]
    angle = 0.5 * (left + right)
    heap = HeapPhoto(
        photo=photo,
        mask=middle,
        outline=outline,
        left_deg=left,
        right_deg=right,
        flanks_deg=0.5 * abs(left - right),
        fit_deg=0.5 * float(np.hypot(outline.left.error_deg, outline.right.error_deg)),
        segmentation_deg=float(np.std([o.angle_deg for o in outlines], ddof=1)),
        tilt_deg=float(np.abs(np.subtract(turned, outline.angle_deg)).max()),
        view_deg=angle - seen_slope(angle, RAISED_DEG, DISTANCE_RATIO),
    )
    if heap.reading_deg > MOST_UNCERTAIN_DEG:
        raise NoHeap(f"shows {angle:.0f} deg to +- {heap.reading_deg:.1f} deg only, where {MOST_UNCERTAIN_DEG:.0f} are the most")
    return heap


def heap_of(masks: Sequence[np.ndarray], ground: Ground | None) -> tuple[np.ndarray, Outline]:
    """The first mask that is a heap, and its outline. Raises NoHeap, that of the first, if none is."""
    failures = []
    for mask in masks:
        try:
            outline = outline_of(mask, ground)
            check_flanks(outline)
        except NoHeap as error:
            failures.append(error)
        else:
            return mask, outline
    raise failures[0]


def entries_of(photo: Photo, blur: float, ground: Ground | None) -> np.ndarray:
    """Palette entries (rows, columns) of a photograph; NONE below a ground that is given."""
    entries = palette_map(photo.colours, blur)
    if ground is not None:
        y, x = np.mgrid[: entries.shape[0], : entries.shape[1]] + 0.5
        entries[ground.frame(x, y)[1] < 0.0] = NONE
    return entries


def candidates(photo: Photo, ground: Ground | None) -> list[np.ndarray]:
    """Masks (rows, columns) that guesses lead to and that are one hump, those with the straightest lines first.

    Raises NoHeap with what is wrong with the first guess if there is none.
    """
    entries = entries_of(photo, GUESS_BLUR, ground)
    step, blur = GUESS_STEP, GUESS_BLUR / GUESS_STEP
    change = edges(photo.colours[::step, ::step], blur)
    humps, refusals = [], []
    for guess in guesses(entries):
        region = refine(entries[::step, ::step], guess[::step, ::step], blur)
        mask = snapped(region.mask, change, SNAP_RATIO * blur).repeat(step, axis=0).repeat(step, axis=1)
        mask = mask[: entries.shape[0], : entries.shape[1]]
        if region.divergence < LEAST_DIVERGENCE or not mask.any():
            continue
        try:
            humps.append((outline_of(mask, ground).departure, mask))
        except NoHeap as error:
            refusals.append(error)
    if refusals and not humps:
        raise refusals[0]
    return [mask for _, mask in sorted(humps, key=lambda hump: hump[0])]
