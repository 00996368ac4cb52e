"""Points of the design: a material with some values changed, and its identifier."""

import hashlib
import json


def point_at(base: dict, values: dict) -> dict:
    """The material with some values changed; four digits are as much as any test can tell, and make the same point the same."""
    return {**base, **{name: float(f"{value:.4g}") for name, value in values.items()}}


def point_id(material: dict) -> str:
    """Hash of the material values."""
    return hashed({key: float(material[key]) for key in sorted(material)}, 8)


def hashed(value, n_digits: int) -> str:
    """Hexadecimal digits of the hash of a JSON-like value; the order of keys does not count."""
    return hashlib.sha256(json.dumps(value, sort_keys=True).encode()).hexdigest()[:n_digits]
