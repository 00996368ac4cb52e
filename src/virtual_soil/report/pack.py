"""Data made small for a page: grains in steps of a fraction of their radius, everything compressed and written as text."""

import base64
import gzip
import json

import numpy as np
import pandas as pd

#: Positions are stored in steps of the mean radius over this (coarser where 65535 steps do not span the grains).
STEPS_PER_RADIUS = 32
#: Steps of a scalar between its bounds; 255 are possible, and cost a third of a byte more per grain.
LEVELS = 63
#: Colours span the values up to this quantile; a few fast grains would else leave all others in one colour.
COLOUR_QUANTILE = 0.995


def packed_bytes(data: bytes) -> str:
    """Gzip as base64. The same bytes give the same text."""
    return base64.b64encode(gzip.compress(data, mtime=0)).decode()


def packed_json(value) -> str:
    """JSON, packed; NaN becomes null."""
    return packed_bytes(json.dumps(without_nan(value), separators=(",", ":"), ensure_ascii=False, allow_nan=False).encode())


def without_nan(value):
    """The value with arrays as lists of four significant digits, and None for what is not finite."""
    if isinstance(value, dict):
        return {str(key): without_nan(entry) for key, entry in value.items()}
    if isinstance(value, np.ndarray | pd.Series):
        value = np.asarray(value).tolist()
    if isinstance(value, list | tuple):
        return [without_nan(entry) for entry in value]
    if isinstance(value, float | np.floating):
        return float(f"{value:.4g}") if np.isfinite(value) else None
    return value.item() if isinstance(value, np.generic) else value


def packed_grains(grains: pd.DataFrame, scalars: dict[str, np.ndarray]) -> dict:
    """Grains for the 3D view: a header, and packed bytes.

    The bytes are planes of one byte per grain, the grains in the order of x: low and high byte of the steps of x from the grain
    before, of y and of z from the lowest; then each scalar in LEVELS steps between its bounds. Radii are a
    scalar where they differ.
    """
    radii = grains["radius_m"].to_numpy()
    places = grains[["x_m", "y_m", "z_m"]].to_numpy()
    if len(places) == 0:
        return {"n": 0}
    low, span = places.min(axis=0), float(np.ptp(places, axis=0).max())
    step = max(radii.mean() / STEPS_PER_RADIUS, span / 65535.0)
    order = np.argsort(places[:, 0], kind="stable")
    steps = np.rint((places[order] - low) / step).astype("<u2")
    steps[:, 0] = np.diff(steps[:, 0], prepend=np.uint16(0))
    planes = [np.ascontiguousarray(column).view(np.uint8).reshape(-1, 2).T.ravel() for column in steps.T]
    header = {"n": len(places), "step_mm": 1e3 * step, "low_mm": (1e3 * low).tolist(), "radius_mm": 1e3 * radii.mean()}
    header |= {"levels": LEVELS, "scalars": {}}
    if np.ptp(radii) > 1e-9 * radii.mean():
        scalars = {**scalars, "radius": 1e3 * radii}
    for name, values in scalars.items():
        bounds, codes = coded(np.asarray(values, float)[order], exact=name == "radius")
        header["scalars"][name] = bounds
        planes.append(codes)
    return {**header, "data": packed_bytes(np.concatenate(planes).tobytes())}


def coded(values: np.ndarray, exact: bool = False) -> tuple[list[float], np.ndarray]:
    """Bounds and 0 to LEVELS for each value; whole numbers up to LEVELS are kept as they are."""
    if (values == np.rint(values)).all() and values.min() >= 0 and values.max() <= LEVELS:
        return [0.0, float(LEVELS)], values.astype(np.uint8)
    low, high = float(values.min()), float(values.max() if exact else np.quantile(values, COLOUR_QUANTILE))
    width = (high - low) or 1.0
    return [low, low + width], np.rint(LEVELS * np.clip((values - low) / width, 0.0, 1.0)).astype(np.uint8)
