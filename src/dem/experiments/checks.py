"""Refusal of settings that no experiment can work with."""


def require(condition: bool, name: str, value, allowed: str) -> None:
    """Raise ValueError naming a quantity, its value and what is allowed, unless the condition holds."""
    if not condition:
        raise ValueError(f"{name} is {value}; allowed: {allowed}.")
