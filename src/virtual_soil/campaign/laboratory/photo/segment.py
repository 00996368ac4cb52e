"""The pixels of a photograph that belong to the heap.

A pixel is described by colour and local roughness, both smoothed, and these by the nearest of a palette's entries (k-means). The
heap is what has other entries than its surroundings:

1. Triangles of all positions and sizes are laid over a small copy of the picture. Those whose entries differ most from the
   entries around them are guesses.
2. A guess is refined at full size: the log odds of each entry, inside the mask against a ring around it, are smoothed over the
   picture; where they are positive is the next mask. This is the iterated estimation of GrabCut (Rother, Kolmogorov & Blake
   2004, doi:10.1145/1015706.1015720), with a blur in place of the graph cut, and with the surroundings of the heap in place of
   everything else in the picture, so that things elsewhere may have its colour.

The difference is the Jensen-Shannon divergence of the two histograms in bits: 0 if they are equal, 1 if no entry is shared.
"""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from scipy import ndimage
from skimage.color import rgb2lab
from skimage.filters.rank import median
from skimage.measure import label as components
from skimage.morphology import disk, isotropic_opening
from skimage.segmentation import watershed
from sklearn.cluster import MiniBatchKMeans

#: Entries of the palette: enough for a heap with a lit and a dark flank before a dozen things.
N_ENTRIES = 48
#: Entry of pixels that do not count: those below a ground that is given.
NONE = N_ENTRIES
#: Pixels from which the palette is learnt.
N_SAMPLES = 6000
#: Longer side of the picture on which triangles are tried, in pixels.
COARSE_SIZE = 80
#: Triangles that are tried: half width over the picture's width, and slope in degrees.
HALF_WIDTHS = (0.08, 0.11, 0.15, 0.19, 0.24, 0.29, 0.35, 0.41)
SLOPES_DEG = (18.0, 25.0, 32.0, 40.0, 50.0)
#: Distance of neighbouring triangles over their half width.
SHIFT_RATIO = 0.15
#: Guesses that are refined.
N_GUESSES = 14
#: Triangles that share this part of what they cover together are one guess.
SAME_GUESS = 0.5
#: Width of the ring around a mask over the root of the mask's area.
RING_RATIO = 0.3
#: Distance from a mask's edge, over the blur, below which pixels do not tell what either side looks like.
EDGE_RATIO = 2.0
#: Radius of the disk that spurs and bridges are too thin for, over the root of the area.
SPUR_RATIO = 0.01
#: Log odds beyond this (a factor of 50) count as this: no single pixel decides over its neighbours.
MOST_ODDS = 4.0
#: Refinement ends when this share of the pixels stays the same, or after so many rounds.
SETTLED, MOST_ROUNDS = 0.995, 20


def palette_map(colours: np.ndarray, blur: float) -> np.ndarray:
    """Palette entry (rows, columns) of each pixel; blur : standard deviation in pixels at which colour and roughness are seen."""
    lab = rgb2lab(colours)
    fine = np.abs(lab[..., 0] - ndimage.gaussian_filter(lab[..., 0], 2.0 * blur))
    # a median, because it does not see an edge that less than half of the disk lies beyond
    roughness = median(np.minimum(10.0 * fine, 255.0).astype(np.uint8), disk(round(3.0 * blur)))
    smooth = ndimage.gaussian_filter(lab, (blur, blur, 0.0))
    features = np.concatenate([smooth, 0.2 * roughness[..., None]], axis=2).reshape(-1, 4)
    chosen = np.random.default_rng(0).choice(len(features), min(N_SAMPLES, len(features)), replace=False)
    n_entries = min(N_ENTRIES, len(np.unique(features[chosen], axis=0)))
    means = MiniBatchKMeans(n_entries, random_state=0, n_init=1).fit(features[chosen])
    return means.predict(features).reshape(lab.shape[:2]).astype(np.int16)


def histogram(entries: np.ndarray) -> np.ndarray:
    """Number of pixels of each palette entry, along the last axis of (..., pixels); entry NONE is not counted."""
    rows = entries.reshape(int(np.prod(entries.shape[:-1])), -1)
    bins = NONE + 1
    counts = np.bincount((rows + bins * np.arange(len(rows), dtype=np.int64)[:, None]).ravel(), minlength=bins * len(rows))
    return counts.reshape(*entries.shape[:-1], bins)[..., :NONE].astype(float)


def divergence(inside: np.ndarray, outside: np.ndarray) -> np.ndarray:
    """Jensen-Shannon divergence in bits of histograms (..., NONE); 0 where one is empty."""
    n, m = (h.sum(axis=-1, keepdims=True) for h in (inside, outside))
    p, q = inside / np.maximum(n, 1.0), outside / np.maximum(m, 1.0)
    mean = 0.5 * (p + q)
    found = entropy(mean) - 0.5 * (entropy(p) + entropy(q))
    return np.where((n > 0)[..., 0] & (m > 0)[..., 0], found, 0.0)


def entropy(p: np.ndarray) -> np.ndarray:
    """Entropy in bits of probabilities along the last axis."""
    return -(p * np.log2(np.where(p > 0.0, p, 1.0))).sum(axis=-1)


class Triangle(NamedTuple):
    """A triangle on a level ground; lengths in pixels, `foot` the ground's row, `slope` the flanks'."""

    centre: float
    foot: float
    half_width: float
    slope: float

    def holds(self, rows, columns, margin: float = 0.0) -> np.ndarray:
        """True for pixels inside, or no farther outside than a margin."""
        up = self.foot - rows
        depth = self.slope * (self.half_width - np.abs(columns - self.centre)) - up
        return (up >= -margin) & (depth >= -margin * np.hypot(1.0, self.slope))

    def scaled(self, factor: float) -> "Triangle":
        """The triangle in a picture that is larger by a factor."""
        return Triangle(self.centre * factor, self.foot * factor, self.half_width * factor, self.slope)


def guesses(entries: np.ndarray) -> Iterator[np.ndarray]:
    """Masks (rows, columns) of the triangles that differ most from what is around them, best first."""
    step = max(1, round(max(entries.shape) / COARSE_SIZE))
    small = entries[step // 2 :: step, step // 2 :: step]
    found = [pair for half_width in HALF_WIDTHS for slope in SLOPES_DEG for pair in tried(small, half_width, slope)]
    found.sort(key=lambda pair: -pair[0])
    rows, columns = np.mgrid[: entries.shape[0], : entries.shape[1]]
    taken: list[np.ndarray] = []
    for _, triangle in found:
        mask = triangle.scaled(step).holds(rows, columns) & (entries != NONE)
        if all((mask & other).sum() < SAME_GUESS * (mask | other).sum() for other in taken):
            taken.append(mask)
            yield mask
        if len(taken) == N_GUESSES:
            return


def tried(small: np.ndarray, half_width_ratio: float, slope_deg: float) -> list[tuple[float, Triangle]]:
    """(score, triangle) at all positions in a small picture (rows, columns) of palette entries."""
    half_width, slope = round(half_width_ratio * small.shape[1]), float(np.tan(np.radians(slope_deg)))
    ring = int(np.ceil(RING_RATIO * half_width))
    height = int(np.ceil(slope * half_width))
    if height > small.shape[0]:
        return []
    shape = (height + 2 * ring, 2 * half_width + 1 + 2 * ring)
    template = Triangle(half_width + ring, height + ring - 1.0, half_width, slope)
    y, x = np.mgrid[: shape[0], : shape[1]]
    inside, wider = template.holds(y, x), template.holds(y, x, margin=ring)
    padded = np.pad(small, ring, constant_values=NONE)
    windows = np.lib.stride_tricks.sliding_window_view(padded, shape)
    step = max(1, round(SHIFT_RATIO * half_width)), max(1, round(SHIFT_RATIO * height))
    rows, columns = np.mgrid[: windows.shape[0] : step[1], : windows.shape[1] : step[0]].reshape(2, -1)
    seen = windows[rows, columns]
    scores = divergence(histogram(seen[:, inside]), histogram(seen[:, wider & ~inside]))
    # a small part of something differs from its surroundings by chance as much as the whole heap does
    scores *= inside.sum() ** 0.25
    places = (Triangle(x + half_width, y + height - 1.0, half_width, slope) for y, x in zip(rows, columns, strict=True))
    return list(zip(scores.tolist(), places, strict=True))


class Region(NamedTuple):
    """A mask (rows, columns), the log odds it comes from, and its divergence from its surroundings in bits."""

    mask: np.ndarray
    odds: np.ndarray
    divergence: float

    def at(self, threshold: float) -> np.ndarray:
        """The mask for another threshold of the log odds."""
        return connected(self.odds > threshold, self.mask)


def refine(entries: np.ndarray, mask: np.ndarray, blur: float) -> Region:
    """Region that a guess leads to; `mask` is empty if it leads to nothing.

    Parameters
    ----------
    entries : (rows, columns)
        Palette entries; NONE where there is neither heap nor surroundings.
    mask : (rows, columns)
        The guess.
    blur : float
        Standard deviation in pixels over which log odds are smoothed.
    """
    odds, difference = np.full(entries.shape, -MOST_ODDS), 0.0
    for _ in range(MOST_ROUNDS):
        if not mask.any():
            break
        width = RING_RATIO * np.sqrt(mask.sum())
        window = around(mask, int(width + 4.0 * blur) + 1)
        seen, now = entries[window], mask[window]
        outward, inward = ndimage.distance_transform_edt(~now), ndimage.distance_transform_edt(now)
        near = (outward < width) & (seen != NONE)
        # pixels at the edge have mixed colours, which belong to neither side
        margin = min(EDGE_RATIO * blur, 0.3 * inward.max())
        inside, outside = histogram(seen[inward > margin]), histogram(seen[near & (outward > margin)])
        difference = float(divergence(inside, outside))
        share_in, share_out = ((h + 1.0) / (h.sum() + NONE) for h in (inside, outside))
        of_entry = np.append(np.clip(np.log(share_in / share_out), -MOST_ODDS, MOST_ODDS), 0.0)
        smooth = ndimage.gaussian_filter(of_entry[seen], blur, mode="nearest")
        odds[:] = -MOST_ODDS
        odds[window] = np.where(near | now, smooth, -MOST_ODDS)
        before, mask = mask, connected(odds > 0.0, mask)
        if (before ^ mask).sum() < (1.0 - SETTLED) * before.sum():
            break
    return Region(mask, odds, difference)


def around(mask: np.ndarray, margin: int) -> tuple[slice, slice]:
    """The part of a picture that a mask lies in, and a margin around it."""
    rows, columns = (np.flatnonzero(mask.any(axis=axis)) for axis in (1, 0))
    return slice(max(0, rows[0] - margin), rows[-1] + margin + 1), slice(max(0, columns[0] - margin), columns[-1] + margin + 1)


def edges(colours: np.ndarray, blur: float) -> np.ndarray:
    """Change of colour (rows, columns) over a pixel, in CIELAB units, seen at a blur."""
    lab = rgb2lab(colours)
    return np.sqrt(sum(ndimage.gaussian_gradient_magnitude(lab[..., k], blur) ** 2 for k in range(3)))


def snapped(mask: np.ndarray, change: np.ndarray, margin: float) -> np.ndarray:
    """A mask whose edge is moved, by no more than a margin in pixels, to where colours change most (watershed).

    change : (rows, columns), of `edges`.
    """
    if not mask.any():
        return mask
    window = around(mask, int(margin) + 2)
    now = mask[window]
    markers = np.zeros(now.shape, dtype=int)
    inward = ndimage.distance_transform_edt(now)
    markers[inward > min(margin, 0.5 * inward.max())] = 1
    markers[ndimage.distance_transform_edt(~now) > margin] = 2
    moved = np.zeros_like(mask)
    moved[window] = watershed(change[window], markers) == 1
    return moved


def connected(candidates: np.ndarray, mask: np.ndarray) -> np.ndarray:
    """The connected part of some pixels that has most of a mask, without holes and without spurs."""
    kept = np.zeros_like(candidates)
    if not candidates.any():
        return kept
    radius = max(1, round(SPUR_RATIO * np.sqrt(candidates.sum())))
    window = around(candidates, radius + 1)
    parts = components(isotropic_opening(ndimage.binary_fill_holes(candidates[window]), radius), connectivity=1)
    shares = np.bincount(parts[mask[window]], minlength=parts.max() + 1)
    shares[0] = 0
    kept[window] = (parts == shares.argmax()) & (shares.max() > 0)
    return kept
