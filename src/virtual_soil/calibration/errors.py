"""The inference's error, and the form of its messages."""

from virtual_soil.errors import InputError


class CalibrationError(InputError, ValueError):
    """Input that cannot be calibrated with; the message names key or table, value and what is allowed."""


def demand(condition: bool, name: str, value, allowed: str) -> None:
    """Raise CalibrationError naming name, value and what is allowed, unless the condition holds."""
    if not condition:
        raise CalibrationError(f"{name} is {value}; allowed: {allowed}.")
