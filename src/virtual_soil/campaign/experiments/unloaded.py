"""What an experiment without a load declares of loads and strengths: one simulation per seed, and no strength."""

import math


def loads(config: dict, material: dict) -> list[float]:
    """Loads of a point: none, so one simulation per seed."""
    return [math.nan]


def check_loads(config: dict) -> list[float]:
    """Loads of the check points."""
    return [math.nan]


def floors(config: dict) -> dict[str, float]:
    """Least scale of the errors of a response: none beside the combined uncertainties."""
    return {}


def strength(config: dict, response: str) -> str:
    """Which strength a response is: none."""
    return ""
