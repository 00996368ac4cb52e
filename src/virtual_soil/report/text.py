"""How the report writes numbers."""

import pandas as pd


def number(value, digits: int = 1, scale: float = 1.0) -> str:
    """A number for a table; a dash where there is none."""
    return "–" if value is None or pd.isna(value) else f"{scale * value:.{digits}f}"


def with_error(value, error, digits: int = 1) -> str:
    """Value ± error; the value alone where the error is unknown."""
    return number(value, digits) if pd.isna(error) else f"{number(value, digits)} ± {number(error, digits)}"


def interval(row, column: str, digits: int, scale: float = 1.0) -> str:
    """The 95 % interval of a column."""
    low, high = (number(row[f"{column}_{side}_95"], digits, scale) for side in ("low", "high"))
    return f"{low} to {high}"


def spoken(name: str) -> str:
    """A column's or response's name as words."""
    return name.replace("_", " ")
