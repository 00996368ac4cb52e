"""Representation of an object in a notebook: a table of its fields in plain HTML."""

from dataclasses import dataclass, fields
from html import escape

import numpy as np


@dataclass(frozen=True)
class Rich:
    """Base of the dataclasses that a notebook shows as a table; the fields' names carry their units."""

    def _repr_html_(self) -> str:
        return table(type(self).__name__, {field.name: getattr(self, field.name) for field in fields(self)})


def table(title: str, rows: dict) -> str:
    """A table of two columns, name and value, under a title; their content is escaped."""
    cells = "".join(f"<tr><th>{escape(name)}</th><td>{escape(in_words(value))}</td></tr>" for name, value in rows.items())
    return f"<table><caption>{escape(title)}</caption>{cells}</table>"


def in_words(value) -> str:
    """A value on one line: six digits of a number, shape and range of an array."""
    if isinstance(value, np.ndarray):
        return f"{value.shape}, {value.min():.6g} to {value.max():.6g}" if value.size else f"{value.shape}"
    if isinstance(value, dict):
        return "; ".join(f"{name}: {in_words(entry)}" for name, entry in value.items())
    return f"{value:.6g}" if isinstance(value, float) else str(value)
