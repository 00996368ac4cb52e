"""Groups of an AGS4 file, the exchange format of the Association of Geotechnical and Geoenvironmental Specialists (UK).

A file is a sequence of groups, each with a row of headings, one of units, one of types and rows of data; the first field of a row
says which it is, and every field stands in double quotes (AGS4, edition 4.1.1, rules 3 to 6; www.ags.org.uk/data-format). Rows are
read strictly: a row that was cut off, or saved again by a spreadsheet, would otherwise pass with another number.
"""

import re
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from virtual_soil.calibration.errors import CalibrationError, demand
from virtual_soil.campaign.laboratory.quantities import UNITS, unit_key
from virtual_soil.campaign.laboratory.rows import Row, text_of

SUFFIX = ".ags"
#: What the first field of a row may say; the first three come once in each group, above its data.
ONCE = ("HEADING", "UNIT", "TYPE")
ROW = re.compile(r'"(?:[^"]|"")*"(?:,"(?:[^"]|"")*")*')
FIELD = re.compile(r'"((?:[^"]|"")*)"')
DESCRIPTOR = re.compile(r'\s*"?(GROUP|HEADING|UNIT|TYPE|DATA)\b')
#: Types of numbers: decimals, significant figures, scientific notation, any format.
NUMERIC = re.compile(r"\d+(DP|SF|SCI)|U")
NUMBER = re.compile(r"[+-]?\d+(\.\d*)?([eE][+-]?\d{1,3})?")


@dataclass
class Group:
    """A group: its name, the line it begins in, headings, units and types by heading, and rows of data, each with its line."""

    path: Path
    name: str
    line: int
    heads: dict[str, list[str]] = field(default_factory=dict)
    rows: list[Row] = field(default_factory=list)

    @property
    def headings(self) -> list[str]:
        """Headings in the order of the file."""
        return self.heads["HEADING"]

    def text(self, row: Row, heading: str) -> str:
        """Text of a row under a heading; empty if the group has no such heading."""
        return row.cells[self.headings.index(heading)].strip() if heading in self.headings else ""

    def unit(self, heading: str) -> str:
        """Unit of a heading as the file states it."""
        return self.heads["UNIT"][self.headings.index(heading)].strip()

    def number(self, row: Row, heading: str, kind: str) -> float:
        """Number of a row in SI units (see `UNITS`), by the group's own units; raises CalibrationError for any other text."""
        where = f"{self.path}, line {row.line}, {heading}"
        unit, form = self.unit(heading), self.heads["TYPE"][self.headings.index(heading)].strip()
        demand(unit_key(unit) in UNITS[kind], f"{self.path}: unit of {heading}", repr(unit), ", ".join(UNITS[kind]))
        demand(NUMERIC.fullmatch(form) is not None, f"{self.path}: type of {heading}", repr(form), "nDP, nSF, nSCI or U: a number")
        text = self.text(row, heading)
        demand(NUMBER.fullmatch(text) is not None and text.isascii(), where, repr(text), "a number with a decimal point")
        value = float(text) * UNITS[kind][unit_key(unit)]
        demand(bool(np.isfinite(value)), where, repr(text), "a number below 1e308")
        return value


def is_ags(path: Path) -> bool:
    """True if a file's name says that it is an AGS file."""
    return path.suffix.lower() == SUFFIX


def read_groups(path: Path, wanted: tuple[str, ...], encoding: str | None = None) -> dict[str, Group]:
    """Groups of an AGS4 file by name; only those `wanted` have rows, and only theirs are checked.

    Raises CalibrationError naming file, line and what is allowed: descriptions in other groups may well break the rules.
    """
    groups: dict[str, Group] = {}
    current: Group | None = None
    for number, line in enumerate(text_of(path, encoding).splitlines(), 1):
        if not line.strip():
            continue
        demand(not line.startswith(('"**', "**")), f"{path}, line {number}", "of an AGS 3 file", "AGS4; convert it first")
        found = DESCRIPTOR.match(line)
        kind = found[1] if found else None
        if current is not None and current.name not in wanted and kind in (None, "DATA"):
            continue
        fields = fields_of(path, number, line)
        allowed = "GROUP, HEADING, UNIT, TYPE or DATA, after a row GROUP"
        demand(fields[0] in (*ONCE, "GROUP", "DATA"), f"{path}, line {number}: first field", repr(fields[0]), allowed)
        if fields[0] == "GROUP":
            current = begun(path, number, fields, groups)
        else:
            demand(current is not None, f"{path}, line {number}: first field", repr(fields[0]), allowed)
            assert current is not None  # for mypy: `demand` has raised
            add(current, number, fields)
    demand(bool(groups), f"{path}: number of groups", 0, 'at least one: rows that begin with "GROUP"')
    for name in set(wanted) & set(groups):
        missing = [kind for kind in ONCE if kind not in groups[name].heads]
        demand(
            not missing, f"{path}: group {name} in line {groups[name].line}", f"without {' and '.join(missing)}", "all three rows"
        )
    return groups


def fields_of(path: Path, number: int, line: str) -> list[str]:
    """Fields of a row; raises CalibrationError unless each stands in quotes."""
    text = line.strip()
    if ROW.fullmatch(text) is None:
        short = text if len(text) <= 40 else f"{text[:40]}..."
        raise CalibrationError(
            f"{path}, line {number}: {short!r}; allowed: fields in double quotes, separated by commas. A row that was cut off, or "
            f"saved by a spreadsheet, is not read: export the file again."
        )
    return [name.replace('""', '"') for name in FIELD.findall(text)]


def begun(path: Path, number: int, fields: list[str], groups: dict[str, Group]) -> Group:
    """A new group, added to those that the file has; raises CalibrationError if it has it already."""
    demand(len(fields) == 2, f"{path}, line {number}: number of names of a group", len(fields) - 1, "one")
    name = fields[1].strip()
    first = groups[name].line if name in groups else 0
    demand(name not in groups, f"{path}, line {number}: group {name}", f"in line {first} already", "once in a file")
    groups[name] = Group(path, name, number)
    return groups[name]


def add(group: Group, number: int, fields: list[str]) -> None:
    """Add a row to its group; raises CalibrationError if it does not fit the rows above."""
    where, kind, values = f"{group.path}, line {number}: group {group.name}", fields[0], fields[1:]
    heads = group.heads
    if kind == "HEADING":
        twice = sorted({name for name in values if values.count(name) > 1})
        demand(not twice, where, f"with heading {', '.join(twice)} twice", "each heading once")
    else:
        demand("HEADING" in heads, where, f"with {kind} above its headings", "HEADING, UNIT, TYPE, DATA in this order")
        n = len(heads["HEADING"])
        demand(len(values) == n, f"{where}: number of fields", len(values), f"{n}, as there are headings")
    if kind == "DATA":
        group.rows.append(Row(number, values))
        return
    demand(kind not in heads, where, f"with {kind} twice", "HEADING, UNIT and TYPE once")
    demand(not group.rows, where, f"with {kind} below its data", "HEADING, UNIT, TYPE, DATA in this order")
    heads[kind] = [name.strip() for name in values]
