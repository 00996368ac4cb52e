"""Names, symbols and units of responses and design variables, as they stand in headers, on axes and in sentences."""

from collections.abc import Mapping
from dataclasses import dataclass

import pandas as pd

from virtual_soil.calibration.response import Response
from virtual_soil.campaign.experiments.registry import RESPONSES
from virtual_soil.report.text import interval, number

#: Components of a direction below this are left out of its text.
SMALLEST_COMPONENT = 0.1


@dataclass(frozen=True)
class Variable:
    """A design variable: words, symbol, printed unit, factor from the table's unit to the printed one, decimals."""

    words: str
    symbol: str
    unit: str
    scale: float
    digits: int


VARIABLES = {
    "radius_m": Variable("radius", "r", "µm", 1e6, 0),
    "static_friction": Variable("static friction", "µs", "", 1.0, 2),
    "rolling_friction": Variable("rolling friction", "µr", "", 1.0, 3),
    "wall_static_friction": Variable("wall's static friction", "µs,w", "", 1.0, 2),
    "wall_rolling_friction": Variable("wall's rolling friction", "µr,w", "", 1.0, 3),
    "frame_static_friction": Variable("frames' static friction", "µs,f", "", 1.0, 2),
    "restitution": Variable("restitution", "e", "", 1.0, 2),
    "density_kg_m3": Variable("grains' density", "ρ", "kg/m³", 1.0, 0),
    "shear_modulus_pa": Variable("shear modulus", "G", "MPa", 1e-6, 1),
    "poisson_ratio": Variable("Poisson's ratio", "ν", "", 1.0, 2),
    "radius_sd_ratio": Variable("spread of radii", "s", "", 1.0, 2),
    "aspect_ratio": Variable("aspect ratio", "a", "", 1.0, 2),
    "adhesive_stress_pa": Variable("adhesive stress", "σa", "Pa", 1.0, 1),
}


def shown_in(row: Mapping | pd.DataFrame) -> dict[str, Variable]:
    """The variables that a table of a study, or a row of it, has columns of."""
    return {name: variable for name, variable in VARIABLES.items() if name in row}


def symbol(name: str) -> str:
    """Symbol of a design variable; the name itself if it has none."""
    return VARIABLES[name].symbol if name in VARIABLES else name


def symbols(names: str) -> str:
    """Symbols of comma-separated design variables."""
    return ", ".join(map(symbol, names.split(",")))


def printed_unit(response: Response) -> str:
    """Unit as printed."""
    return "°" if response.unit == "deg" else response.unit


def header(quantity: Response | Variable) -> str:
    """Symbol and unit, the header of a column."""
    unit = printed_unit(quantity) if isinstance(quantity, Response) else quantity.unit
    return f"{quantity.symbol} ({unit})" if unit else quantity.symbol


def axis_label(name: str) -> str:
    """Words, symbol and unit of a response or a design variable."""
    quantity = RESPONSES[name] if name in RESPONSES else VARIABLES[name]
    return f"{quantity.words} {header(quantity)}"


def enumerated(parts: list[str]) -> str:
    """The parts as a list in a sentence: a, b and c."""
    return " and ".join(filter(None, (", ".join(parts[:-1]), parts[-1])))


def value_with_interval(row: Mapping, name: str) -> tuple[str, str]:
    """A design variable of an optimum and its 95 % interval, in the printed unit; "fixed" if it was no variable."""
    variable, fixed = VARIABLES[name], row[f"{name}_low_95"] == row[f"{name}_high_95"] == row[name]
    within = "fixed" if fixed else interval(row, name, variable.digits, variable.scale)
    return number(row[name], variable.digits, variable.scale), within


def variable_cells(row: Mapping) -> list[str]:
    """All design variables of an optimum, with one decimal more than beside their intervals."""
    return [number(row[name], variable.digits + 1, variable.scale) for name, variable in shown_in(row).items()]


def variables_in_words(row: Mapping) -> str:
    """The design variables of a refined optimum, in one cell."""
    shown = shown_in(row)
    cells = [number(row[name], v.digits + (name != "radius_m"), v.scale) for name, v in shown.items()]
    return ", ".join(f"{cell} {v.unit}".rstrip() for cell, v in zip(cells, shown.values(), strict=True))


def combination(direction: Mapping) -> str:
    """A direction of the design variables as a weighted sum of their symbols."""
    components = {name: direction.get(f"component_{name}", 0.0) for name in VARIABLES}
    return " ".join(f"{value:+.2f} {symbol(name)}" for name, value in components.items() if abs(value) >= SMALLEST_COMPONENT)
