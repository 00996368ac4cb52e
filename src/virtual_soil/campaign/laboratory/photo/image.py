"""A photograph as an array, its region of interest, and the scale at which it is worked on.

Coordinates: pixels of the photograph as a viewer shows it, origin at the top left corner, x to the right, y down.
"""

import warnings
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from PIL import Image, ImageOps, UnidentifiedImageError
from skimage.transform import resize
from skimage.util import img_as_float

from virtual_soil.calibration.errors import CalibrationError, demand

#: Longer side of the picture that is worked on, in pixels: an outline of 300 columns, and seconds of computing.
WORKING_SIZE = 800
#: Shorter side of a picture or a box, in pixels.
LEAST_SIZE = 60


@dataclass(frozen=True, kw_only=True)
class Photo:
    """A photograph or a box of it: colours (rows, columns, 3) from 0 to 1.

    corner : its upper left corner in the photograph. scale : working pixels per pixel of the photograph.
    """

    path: Path
    colours: np.ndarray
    corner: tuple[float, float]
    scale: float

    def to_working(self, points) -> np.ndarray:
        """Working coordinates (n, 2: x, y) of points of the photograph."""
        return (np.asarray(points, dtype=float) - self.corner) * self.scale

    def to_photo(self, points) -> np.ndarray:
        """Coordinates in the photograph (n, 2: x, y) of working points."""
        return np.asarray(points, dtype=float) / self.scale + self.corner


def open_photo(path: Path) -> np.ndarray:
    """Colours (rows, columns, 3) of an image file from 0 to 1, turned as its camera says. Raises CalibrationError."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error", Image.DecompressionBombWarning)
            with Image.open(path) as opened:
                image = ImageOps.exif_transpose(opened)
                deep = image.mode.startswith(("I", "F"))
                pixels = np.asarray(image if deep else image.convert("RGB"))
    except UnidentifiedImageError:
        raise CalibrationError(f"{path} is no image that can be read; allowed: JPEG, PNG, TIFF, BMP, WebP.") from None
    except (Image.DecompressionBombWarning, Image.DecompressionBombError):
        raise CalibrationError(f"{path} has too many pixels; allowed: {Image.MAX_IMAGE_PIXELS} at most.") from None
    except (OSError, SyntaxError, ValueError) as error:
        raise CalibrationError(f"{path} cannot be read as an image: {getattr(error, 'strerror', None) or error}.") from None
    if not deep:
        return img_as_float(pixels)
    low, high = float(pixels.min()), float(pixels.max())
    grey = (pixels - low) / (high - low if high > low else 1.0)
    return np.repeat(grey[..., None], 3, axis=2)


def read_photo(path: Path, box: tuple[float, float, float, float] | None = None) -> Photo:
    """Read a photograph.

    Parameters
    ----------
    path : Path
        Image file.
    box : tuple, optional
        Region of interest: left, top, right and bottom in pixels.

    Raises
    ------
    CalibrationError
        If the file is no image, the box lies outside of it, or either is too small.
    """
    colours = open_photo(path)
    rows, columns = colours.shape[:2]
    demand(min(rows, columns) >= LEAST_SIZE, f"{path}: size", f"{columns} x {rows} pixels", f"{LEAST_SIZE} pixels and more a side")
    corner = (0, 0)
    if box is not None:
        left, top, right, bottom = (round(edge) for edge in box)
        inside = 0 <= left and left + LEAST_SIZE <= right <= columns and 0 <= top and top + LEAST_SIZE <= bottom <= rows
        allowed = f"left,top,right,bottom inside 0,0,{columns},{rows}, {LEAST_SIZE} pixels and more a side"
        demand(inside, f"{path}: BOX", ",".join(f"{edge:g}" for edge in box), allowed)
        colours, corner = colours[top:bottom, left:right], (left, top)
    scale = min(1.0, WORKING_SIZE / max(colours.shape[:2]))
    if scale < 1.0:
        shape = tuple(round(scale * n) for n in colours.shape[:2])
        colours = resize(colours, (*shape, 3), order=1, anti_aliasing=True)
    return Photo(path=path, colours=colours, corner=corner, scale=scale)
