"""Reader of laboratory tables: text with a header, in any common encoding, delimiter, decimal mark and unit.

Encodings: UTF-8 with or without a byte order mark, UTF-16 with a byte order mark, otherwise Latin-1. Delimiters: tab, semicolon or
comma, detected from the header. Lines before the header (operator, date) and comment lines (starting with #, % or //) are skipped.
The header is the first line that names every required quantity, in a spelling of `QUANTITIES` or as given by the user (`columns`).
Each quantity has a unit: "Normal stress [kPa]", "Displacement (mm)", "Force / N", "Force, N", "force_n", or in a line of units
below the header. Units are never guessed.

Rows without any measured value are skipped and counted. A row with missing values is refused with its line number, because the
cause may be a faulty data logger. Thousands separators and ambiguous commas are refused as well.
"""

import csv
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import cast

import numpy as np
import pandas as pd

from virtual_soil.calibration.errors import CalibrationError, demand

#: Kind -> unit in lower case -> factor to Pa, m, N or degrees. kgf: 9.80665 N; lbf: 4.4482216 N; inch: 25.4 mm (NIST SP 811).
UNITS = {
    "stress": {
        "pa": 1.0, "hpa": 1e2, "kpa": 1e3, "mpa": 1e6, "n/m2": 1.0, "kn/m2": 1e3, "n/cm2": 1e4, "n/mm2": 1e6,
        "mbar": 1e2, "bar": 1e5, "kgf/cm2": 98066.5, "psi": 6894.757, "psf": 47.88026,
    },
    "length": {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "inch": 0.0254, "in": 0.0254},
    "force": {"n": 1.0, "kn": 1e3, "kgf": 9.80665, "lbf": 4.4482216},
    "angle": {"deg": 1.0, "degree": 1.0, "degrees": 1.0, "°": 1.0, "rad": 180.0 / np.pi},
}  # fmt: skip
#: Quantity -> (column name in SI units or degrees, kind, names in headers); a quantity without kind is a label.
QUANTITIES: dict[str, tuple[str, str | None, set[str]]] = {
    "test": ("test", None, {"test", "test no", "test number", "specimen", "specimen no", "sample"}),
    "normal_stress": ("normal_stress_pa", "stress", {"normal stress", "vertical stress", "sigma n", "σn", "σ n"}),
    "displacement": (
        "displacement_m", "length", {"displacement", "shear displacement", "horizontal displacement", "horiz displacement"},
    ),
    "force": ("force_n", "force", {"force", "shear force", "horizontal force", "horiz force"}),
    "angle_of_repose": ("angle_of_repose_deg", "angle", {"angle of repose", "repose angle", "angle"}),
}  # fmt: skip
DELIMITERS = {"\t": "tab", ";": "semicolon", ",": "comma"}
COMMENTS = ("#", "%", "//")
#: Spellings of a missing measurement, in lower case.
MISSING = {"", "nan", "na", "n/a", "-", "--", "null", "none"}
NUMBER = re.compile(r"[+-]?(\d+([.,]\d*)?|[.,]\d+)([eE][+-]?\d{1,3})?")
#: Ambiguous comma: decimal mark or thousands separator.
AMBIGUOUS = re.compile(r"[+-]?[1-9]\d{0,2},\d{3}")
#: Headers with units: "Normal stress [kPa]", "Force / N", "Force, N", "Force in N", "force_n".
HEADERS = [
    re.compile(pattern)
    for pattern in (
        r"(?P<name>[^\[(]+?)\s*[\[(]\s*(?P<unit>[^\])]*?)\s*[\])]",
        r"(?P<name>[^/,]+?)\s*[/,]\s*(?P<unit>.+)",
        r"(?P<name>.+?)\s+in\s+(?P<unit>\S+)",
        r"(?P<name>.+)_(?P<unit>[^_]+)",
    )
]


@dataclass(frozen=True)
class Readings:
    """Content of a file: one row per reading, columns in SI units (see `QUANTITIES`), and the number of skipped empty rows."""

    table: pd.DataFrame
    n_skipped: int


@dataclass(frozen=True)
class Column:
    """Column of a quantity: index in the row, header, and unit given in the header (None if there is none)."""

    index: int
    header: str
    unit: str | None


@dataclass(frozen=True)
class Reader:
    """Reader of one file: required quantities, and the headers and decimal mark given by the user."""

    path: Path
    quantities: tuple[str, ...]
    own: dict[str, tuple[str, str | None]]
    decimal: str | None

    def read(self, lines: list[str]) -> Readings:
        """Read the lines of a file."""
        start, delimiter, columns = self.header(lines)
        rows = self.rows(lines, start + 1, delimiter)
        columns, rows = self.with_units(columns, rows)
        measured = [name for name in self.quantities if QUANTITIES[name][1]]
        kept, skipped = [], 0
        for line, cells in rows:
            texts = {name: cells[column.index].strip() if column.index < len(cells) else "" for name, column in columns.items()}
            missing = [name for name in self.quantities if texts[name].lower() in MISSING]
            if set(measured) <= set(missing):
                skipped += 1
                continue
            for name in missing:
                raise self.fault(line, columns[name], texts[name], "a value: the other cells of this row have one")
            kept.append((line, texts))
        demand(bool(kept), f"{self.path}: number of rows with values below the header in line {start + 1}", 0, "at least one")
        mark = self.decimal_mark(kept, columns, measured)
        table: dict[str, list[str] | np.ndarray] = {}
        for name in self.quantities:
            target, kind, _ = QUANTITIES[name]
            if kind is None:
                table[target] = [texts[name] for _, texts in kept]
            else:
                factor = UNITS[kind][unit_key(cast(str, columns[name].unit))]  # guaranteed by `with_units`
                table[target] = np.array([factor * self.number(line, texts[name], columns[name], mark) for line, texts in kept])
        return Readings(pd.DataFrame(table), skipped)

    def header(self, lines: list[str]) -> tuple[int, str, dict[str, Column]]:
        """Find the header: line index, delimiter, and the column of every quantity."""
        best, least = None, list(self.quantities)
        for k, line in enumerate(lines):
            if not is_content(line):
                continue
            found = []
            for delimiter in sorted(DELIMITERS, key=lambda mark: -line.count(mark)):
                columns = self.match(split(self.path, k + 1, line, delimiter), k + 1)
                missing = [name for name in self.quantities if name not in columns]
                if len(missing) < len(least):
                    best, least = k, missing
                if not missing:
                    found.append((delimiter, columns))
            if found:
                return k, *max(found, key=lambda item: sum(column.unit is not None for column in item[1].values()))
        wanted = "; ".join(f"{name}: {', '.join(sorted(self.names(name)))}" for name in least)
        where = "" if best is None else f" (nearest to it: line {best + 1})"
        raise CalibrationError(
            f"{self.path}: no line is a header with a column for {', '.join(least)}{where}; allowed: columns separated by tab, "
            f"semicolon or comma, named {wanted}, or as `columns` in the soil file says."
        )

    def match(self, cells: list[str], line: int) -> dict[str, Column]:
        """Return the required columns of a header; two columns for one quantity are refused."""
        columns: dict[str, Column] = {}
        for index, cell in enumerate(cells):
            for name in self.quantities:
                column = self.column(name, index, cell.strip())
                if column is None:
                    continue
                if name in columns:
                    raise CalibrationError(
                        f"{self.path}, line {line}: {columns[name].header!r} and {column.header!r} are both read as {name}; "
                        f"allowed: one of them, named under `columns: {{{name}: ...}}` in the soil file."
                    )
                columns[name] = column
        return columns

    def column(self, name: str, index: int, header: str) -> Column | None:
        """Return the column if this header names the quantity. A header given by the user must match, with or without unit."""
        readings = [(header, None), *((found["name"], found["unit"]) for p in HEADERS if (found := p.fullmatch(header)))]
        if name in self.own:
            wanted, unit = self.own[name]
            for words, stated in reversed(readings):
                if wanted.strip().casefold() in (words.casefold(), header.casefold()):
                    return Column(index, header, unit or stated)
            return None
        kind = QUANTITIES[name][1]
        alike = [(words, unit) for words, unit in readings if normal(words) in self.names(name)]
        known = [(words, unit) for words, unit in alike if unit is None or kind is None or unit_key(unit) in UNITS[kind]]
        for _, unit in known[-1:] or alike[-1:]:
            return Column(index, header, unit)
        return None

    def names(self, name: str) -> set[str]:
        """Normalised headers without unit that name a quantity."""
        return {self.own[name][0]} if name in self.own else QUANTITIES[name][2]

    def rows(self, lines: list[str], start: int, delimiter: str) -> list[tuple[int, list[str]]]:
        """Yield (line number, cells) of all lines from `start` on, except comments."""
        width = len(split(self.path, start, lines[start - 1], delimiter))
        rows = []
        for k, line in enumerate(lines[start:], start + 1):
            if line.lstrip().startswith(COMMENTS):
                continue
            cells = split(self.path, k, line, delimiter)
            if any(cell.strip() for cell in cells[width:]):
                raise CalibrationError(
                    f"{self.path}, line {k}: {len(cells)} cells; allowed: the header's {width}, separated by "
                    f"{DELIMITERS[delimiter]}s. Numbers with decimal commas need another separator or quotes."
                )
            rows.append((k, cells))
        return rows

    def with_units(self, columns: dict[str, Column], rows: list) -> tuple[dict[str, Column], list]:
        """Return the columns with units of `UNITS`; a unit missing in the header is read from the line below it."""
        unknown = [name for name, column in columns.items() if QUANTITIES[name][1] and column.unit is None]
        first = next(((k, row) for k, row in enumerate(rows) if any(cell.strip() for cell in row[1])), None)
        if unknown and first is not None:
            place, (_, cells) = first
            units = {name: cells[columns[name].index].strip(" []()") for name in unknown if columns[name].index < len(cells)}
            if len(units) == len(unknown) and all(
                unit_key(unit) in UNITS[cast(str, QUANTITIES[name][1])] for name, unit in units.items()
            ):
                columns = columns | {name: Column(columns[name].index, columns[name].header, units[name]) for name in unknown}
                rows = rows[:place] + rows[place + 1 :]
        for name, column in columns.items():
            kind = QUANTITIES[name][1]
            if kind and (column.unit is None or unit_key(column.unit) not in UNITS[kind]):
                has = "no unit" if column.unit is None else f"the unit {column.unit!r}"
                raise CalibrationError(
                    f"{self.path}: column {column.header!r} has {has}; allowed: {', '.join(UNITS[kind])}, in brackets behind "
                    f"the name or under `columns: {{{name}: {{header: ..., unit: ...}}}}` in the soil file."
                )
        return columns, rows

    def decimal_mark(self, rows, columns: dict[str, Column], measured: list[str]) -> str:
        """Decimal mark of the whole file; refused if both occur or if a comma could be a thousands separator."""
        if self.decimal:
            return self.decimal
        with_comma = [(line, name, texts[name]) for line, texts in rows for name in measured if "," in texts[name]]
        with_point = [(line, name, texts[name]) for line, texts in rows for name in measured if "." in texts[name]]
        if with_comma and with_point:
            line, name, text = max(with_comma[0], with_point[0])
            raise self.fault(line, columns[name], text, "one decimal mark in the whole file, and no separators of thousands")
        if with_comma and all(AMBIGUOUS.fullmatch(text) for _, _, text in with_comma):
            line, name, text = with_comma[0]
            raise self.fault(
                line, columns[name], text, 'numbers whose comma cannot separate thousands, or `decimal: ","` in the soil file'
            )
        return "," if with_comma else "."

    def number(self, line: int, text: str, column: Column, mark: str) -> float:
        """Convert a cell to a number."""
        other = "." if mark == "," else ","
        if NUMBER.fullmatch(text) is None or other in text or not text.isascii():
            raise self.fault(line, column, text, f"a number with a decimal {'comma' if mark == ',' else 'point'}")
        value = float(text.replace(",", "."))
        if not np.isfinite(value):
            raise self.fault(line, column, text, "a number below 1e308")
        return value

    def fault(self, line: int, column: Column, text: str, allowed: str) -> CalibrationError:
        """Error that names file, line, column, value and the allowed values."""
        return CalibrationError(f"{self.path}, line {line}, column {column.header!r}: {shown(text)}; allowed: {allowed}.")


def read_laboratory(
    path: Path, quantities: tuple[str, ...], columns: Mapping | None = None, decimal: str | None = None, origin: str = "columns"
) -> Readings:
    """Read a laboratory file.

    Parameters
    ----------
    quantities : required keys of `QUANTITIES`. columns : quantity -> header in the file, or {header, unit}.
    decimal : "." or ","; detected by default. origin : file and key of columns and decimal, for messages.

    Returns
    -------
    Readings; every number is finite. Raises CalibrationError naming file, line, column, value and the allowed values.
    """
    own = own_headers(columns, quantities, origin)
    demand(decimal in (None, ".", ","), f"{origin}: decimal", repr(decimal), '"." or ","')
    try:
        content = path.read_bytes()
    except (OSError, ValueError) as error:
        raise CalibrationError(f"{path}: cannot be read ({getattr(error, 'strerror', None) or error}).") from error
    return Reader(path, tuple(quantities), own, decimal).read(decoded(path, content).splitlines())


def own_headers(columns, quantities, origin: str) -> dict[str, tuple[str, str | None]]:
    """Return the user's mapping as quantity -> (header, unit or None); raises CalibrationError for anything else."""
    if columns is None:
        return {}
    demand(isinstance(columns, Mapping), f"{origin}: columns", repr(columns), f"a mapping with keys of {sorted(quantities)}")
    own = {}
    for name, entry in columns.items():
        demand(name in quantities, f"{origin}: columns.{name}", "unknown", f"{sorted(quantities)}")
        full = entry if isinstance(entry, Mapping) else {"header": entry}
        header, unit, kind = full.get("header"), full.get("unit"), QUANTITIES[name][1]
        ok = isinstance(header, str) and header.strip() and set(full) <= {"header", "unit"}
        demand(bool(ok), f"{origin}: columns.{name}", repr(entry), "a header of the file, or {header, unit}")
        known = unit is None or (kind is not None and isinstance(unit, str) and unit_key(unit) in UNITS[kind])
        demand(
            known, f"{origin}: columns.{name}.unit", repr(unit), f"one of {', '.join(UNITS[kind])}" if kind else "no unit: a label"
        )
        own[name] = (cast(str, header), unit)
    return own


def decoded(path: Path, content: bytes) -> str:
    """Decode a file; Latin-1 if it is neither UTF-8 nor UTF-16 with a byte order mark."""
    if content.startswith((b"\xff\xfe", b"\xfe\xff")):
        encodings = ["utf-16"]
    else:
        encodings = ["utf-8-sig", "latin-1"]
    for encoding in encodings:
        try:
            text = content.decode(encoding)
        except UnicodeDecodeError:
            continue
        if "\0" not in text:
            return text
    raise CalibrationError(f"{path}: not a text file; allowed: a table saved as CSV or text.")


def split(path: Path, line: int, text: str, delimiter: str) -> list[str]:
    """Split a line into cells; delimiters inside quotes are kept."""
    try:
        return next(csv.reader([text], delimiter=delimiter, skipinitialspace=True), [])
    except csv.Error as error:
        raise CalibrationError(f"{path}, line {line}: not a row of a table ({error}).") from error


def is_content(line: str) -> bool:
    """True if a line may be a header: neither empty nor a comment."""
    return bool(line.strip()) and not line.lstrip().startswith(COMMENTS)


def normal(name: str) -> str:
    """Normalise a header: words in lower case, separated by one space."""
    return " ".join(re.findall(r"[^\W_]+", name.casefold()))


def unit_key(unit: str) -> str:
    """Convert a unit to the spelling of `UNITS`. "mPa" is kept as millipascal: it may be a typing error for MPa."""
    text = unit.strip().replace("²", "2").replace("^", "").replace("µ", "u").replace("μ", "u").replace(" ", "")
    return "millipascal" if text == "mPa" else text.lower()


def shown(text: str) -> str:
    """Format a cell for a message, shortened."""
    return repr(text if len(text) <= 40 else text[:40] + "...") if text else "empty"


def laboratory_path(soil: Path, key: str, entry, known: frozenset[str]) -> Path:
    """Path of the laboratory file of an entry with known keys; it must be in the soil file's folder or below."""
    ok = isinstance(entry, dict) and isinstance(entry.get("file"), str) and set(entry) <= known
    demand(ok, f"{soil}: {key}", repr(entry), f"a mapping with the key file and others of {sorted(known)}")
    demand("\0" not in entry["file"], f"{soil}: {key}.file", repr(entry["file"]), "a file beside the soil file")
    path = soil.parent / entry["file"]
    inside = path.resolve().is_relative_to(soil.parent.resolve())
    demand(inside, f"{soil}: {key}.file", entry["file"], "a file beside the soil file")
    return path


def readings(soil: Path, key: str, entry, known: frozenset[str], quantities: tuple[str, ...]) -> Readings:
    """Read the laboratory file of an entry."""
    path = laboratory_path(soil, key, entry, known)
    demand(isinstance(entry.get("source", ""), str), f"{soil}: {key}.source", repr(entry.get("source")), "a text")
    return read_laboratory(path, quantities, entry.get("columns"), entry.get("decimal"), f"{soil}: {key}")


def skipped(found: Readings) -> str:
    """Number of skipped rows, as text for the description of the method."""
    return f", {found.n_skipped} empty rows skipped" if found.n_skipped else ""


def is_number(value) -> bool:
    """True if a value from YAML is a finite number."""
    return isinstance(value, int | float) and not isinstance(value, bool) and bool(np.isfinite(float(value)))
