"""Points of the design: the material at a point, and the hash that identifies it."""

import hashlib
import json


def point_at(base: dict, values: dict) -> dict:
    """The material with some values replaced, rounded to four digits.

    No test resolves more digits, and the same point must have the same identifier. A value that is the base's own stays as it is.
    """
    return {**base, **{name: base[name] if value == base.get(name) else float(f"{value:.4g}") for name, value in values.items()}}


def point_id(material: dict) -> str:
    """Hash of the material values."""
    return hashed({key: float(material[key]) for key in sorted(material)}, 8)


def hashed(value, n_digits: int) -> str:
    """Hexadecimal digits of the hash of a JSON-like value; independent of the order of keys."""
    return hashlib.sha256(json.dumps(value, sort_keys=True).encode()).hexdigest()[:n_digits]


def own_seed(row: dict) -> int:
    """Seed of a simulation's random numbers, from its seed and its point.

    Specimens that start from the same places of grains share a deviation of some 10 % in strength, whatever the grains' friction.
    Points that shared a seed would err together, and surrogates would follow the error: each point has specimens of its own.
    """
    return int(hashed([int(row["seed"]), row["point_id"]], 8), 16) % 2**31
