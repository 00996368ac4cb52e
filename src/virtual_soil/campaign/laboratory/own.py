"""What a soil file says of the columns of a laboratory file: headers, units, factors, numbers of columns."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import cast

import numpy as np

from virtual_soil.calibration.errors import demand
from virtual_soil.campaign.laboratory.quantities import QUANTITIES, UNITS, unit_key
from virtual_soil.campaign.yamls import hint


@dataclass(frozen=True)
class Own:
    """A user's description of a quantity's column: headers, unit, factor on its numbers, or its number in the file."""

    headers: tuple[str, ...] = ()
    unit: str | None = None
    factor: float = 1.0
    number: int | None = None


def own_columns(columns, quantities, origin: str) -> dict[str, Own]:
    """Return the user's mapping by quantity; raises CalibrationError for anything else."""
    if columns is None:
        return {}
    demand(isinstance(columns, Mapping), f"{origin}: columns", repr(columns), f"a mapping with keys of {sorted(quantities)}")
    own = {}
    for name, entry in columns.items():
        demand(name in quantities, f"{origin}: columns.{name}", "unknown", f"{sorted(quantities)}")
        own[name] = own_column(name, entry, f"{origin}: columns.{name}")
    return own


def own_column(name: str, entry, key: str) -> Own:
    """A user's description of one column."""
    full = entry if isinstance(entry, Mapping) else {"header": entry}
    headers, unit, kind = full.get("header"), full.get("unit"), QUANTITIES[name].kind
    headers = tuple(headers) if isinstance(headers, list) else (headers,)
    named = all(isinstance(header, str) and header.strip() for header in headers) and bool(headers)
    number, factor = full.get("column"), full.get("factor", 1.0)
    numbered = headers == (None,) and isinstance(number, int) and not isinstance(number, bool) and number > 0
    scaled = isinstance(factor, int | float) and not isinstance(factor, bool) and np.isfinite(factor) and factor != 0
    ok = (named != numbered) and set(full) <= {"header", "unit", "factor", "column"} and (numbered or number is None)
    demand(ok, key, repr(entry), "a header of the file, several, or {header or column (its number), unit, factor}")
    demand(bool(scaled), f"{key}.factor", repr(factor), f"a number other than zero{hint(factor)}")
    known = unit is None or (kind is not None and isinstance(unit, str) and unit_key(unit) in UNITS[kind])
    demand(known, f"{key}.unit", repr(unit), f"one of {', '.join(UNITS[kind])}" if kind else "no unit: a label")
    return Own(() if numbered else cast(tuple[str, ...], headers), unit, float(factor), number)
