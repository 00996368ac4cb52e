"""Table of readings in a laboratory file: header, columns, units, and which rows are readings.

The header is the first line that names every required quantity, in a spelling of `QUANTITIES` or as given by the user (`columns`);
its words may stand in two lines. Each quantity has a unit: "Normal stress [kPa]", "Displacement (mm)", "Force / N", "Force, N",
"force_n", or in a line of units below the header. Units are never guessed. A header that comes again begins another block, with the
text above it as its title; a label, and a normal stress, that no column holds are read from there.

Counted and left out: rows without any measured value, rows that summarise others (mean, standard deviation), and texts below a
block. A row with missing values is refused with its line number, because the cause may be a faulty data logger; only labels and
loads hold on from the row above, as merged cells do. Thousands separators and ambiguous commas are refused as well.
"""

import re
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from pathlib import Path
from typing import NamedTuple, cast

import numpy as np
import pandas as pd

from virtual_soil.calibration.errors import CalibrationError, demand
from virtual_soil.campaign.laboratory.beside import LOADS, Sheet, stacked
from virtual_soil.campaign.laboratory.own import Own, own_columns
from virtual_soil.campaign.laboratory.quantities import MISSING, QUANTITIES, UNITS, is_statistic, label_key, normal, plain, unit_key
from virtual_soil.campaign.laboratory.rows import Row, joined, last_ways_to_read, ways_to_read
from virtual_soil.campaign.laboratory.titles import AMBIGUOUS, NUMBER, Title

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
#: Quantities of which any one serves; the first that a header has is taken.
Alternatives = tuple[str, ...]


@dataclass(frozen=True)
class Readings:
    """Content of a file: one row per reading, columns in SI units (see `QUANTITIES`), and what was left out or filled, in words.

    n_skipped : number of empty rows.
    """

    table: pd.DataFrame
    n_skipped: int
    remarks: tuple[str, ...] = ()


@dataclass(frozen=True)
class Column:
    """Column of a quantity: index in the row, header, and unit given in the header (None if there is none)."""

    index: int
    header: str
    unit: str | None


@dataclass
class Block:
    """Rows below one header: its columns, title, readings as (line, texts by quantity and column), and texts that follow."""

    columns: dict[str, list[Column]]
    width: int
    line: int
    title: str
    readings: list[tuple[int, dict[tuple[str, int], str]]] = field(default_factory=list)
    texts: list[Row] = field(default_factory=list)


@dataclass
class Left:
    """Numbers of rows that were left out, and of cells that were filled from above."""

    empty: int = 0
    statistics: int = 0
    texts: int = 0
    filled: int = 0

    def remarks(self) -> tuple[str, ...]:
        """The numbers in words, but for empty rows."""
        return tuple(
            text
            for number, text in (
                (self.statistics, f"{self.statistics} rows of means and deviations left out"),
                (self.texts, f"{self.texts} rows of text below the readings left out"),
                (self.filled, f"{self.filled} empty cells filled from above"),
            )
            if number
        )


@dataclass(frozen=True)
class Reader:
    """Reader of one file: required quantities, and what the user says of the file.

    wanted : each with alternatives. optional : quantities that are read if there, or found in titles. own : by quantity.
    """

    path: Path
    wanted: tuple[Alternatives, ...]
    optional: tuple[str, ...]
    own: dict[str, Own]
    decimal: str | None

    @property
    def names(self) -> list[str]:
        """All quantities that a header may name."""
        return [name for alternatives in self.wanted for name in alternatives] + list(self.optional)

    def read(self, rows: list[Row], start: int, columns: dict[str, list[Column]], separator: str) -> Readings:
        """Read the rows of a file below its header in row `start`."""
        left = Left()
        blocks = self.blocks(rows, start, columns, separator, left)
        labels = labels_of([block.title for block in blocks])
        parts = [self.table(block, rows, left, label) for block, label in zip(blocks, labels, strict=True) if block.readings]
        demand(
            bool(parts), f"{self.path}: number of rows with values below the header in line {rows[start].line}", 0, "at least one"
        )
        return Readings(pd.concat(parts, ignore_index=True), left.empty, left.remarks())

    def header(self, rows: list[Row]) -> tuple[int, dict[str, list[Column]]]:
        """Find the header: index of its (last) row, and the columns of every quantity.

        The words may stand in two lines: those are taken if together they name more than each of them alone. Raises NoHeader, with
        what the nearest row lacks.
        """
        best, least = None, list(self.wanted)
        for k, row in enumerate(rows):
            if not row.worded:  # certainly no header
                continue
            ways = [(k, row.cells)]
            if k + 1 < len(rows):
                below = rows[k + 1].cells
                ways += [(k + 1, below), (k + 1, joined(row.cells, below))]
            found = [(place, self.match(cells, rows[place].line)) for place, cells in ways]
            whole = [(place, columns) for place, columns in found if not self.lacking(columns)]
            if whole:
                return max(whole, key=lambda way: len(way[1]))  # of equals the first: a row alone
            lacking = self.lacking(found[0][1])
            if len(lacking) < len(least):
                best, least = row.line, lacking
        raise NoHeader(self.path, [("/".join(some), self.spellings(some)) for some in least], best)

    def lacking(self, columns: Mapping) -> list[Alternatives]:
        """Required quantities that have no column, but for a load that a title may state."""
        return [some for some in self.wanted if not any(name in columns for name in some)]

    def spellings(self, names: Alternatives) -> list[str]:
        """Headers that would be understood."""
        return sorted({word for name in names for word in (self.own[name].headers if name in self.own else QUANTITIES[name].names)})

    def marks(self, cells: list[str]) -> list[tuple[int, str]]:
        """Column and quantity of every cell that would be understood as a header."""
        texts = [(index, text.strip()) for index, text in enumerate(cells) if NUMBER.fullmatch(text.strip()) is None]
        return [(index, name) for index, text in texts if text for name in self.names if self.column(name, index, text) is not None]

    def states_load(self, text: str, line: int) -> bool:
        """True if the title of a table states its normal stress or force."""
        return any(self.stated(name, text, line, bare=True) is not None for name in sorted(LOADS & set(self.names)))

    def stated(self, name: str, text: str, line: int, *, bare: bool) -> float | None:
        """Value of a quantity in a title, in SI units; None if it has none."""
        words = self.own[name].headers if name in self.own else ()
        return Title(self.path, line, text, self.decimal).stated(name, words, bare=bare)

    def below_each_other(self, rows: list[Row], separator: str) -> tuple[list[Row], int]:
        """Rows of shear tests with tables that stand side by side below each other, and the number of these tables."""
        by_number = any(own.number is not None for own in self.own.values())
        if by_number or not any("displacement" in some for some in self.wanted):
            return rows, 0
        return stacked(Sheet(self.path, self.marks, self.states_load, separator), rows)

    def match(self, cells: list[str], line: int) -> dict[str, list[Column]]:
        """Return the columns of a header; two columns for one quantity are refused, unless the user names both."""
        found: dict[str, list[Column]] = {}
        for index, cell in enumerate(cells):
            for name in self.names:
                column = self.column(name, index, cell.strip())
                if column is None:
                    continue
                if name in found and not (name in self.own and len(self.own[name].headers) > 1):
                    raise CalibrationError(
                        f"{self.path}, line {line}: {found[name][0].header!r} (column {found[name][0].index + 1}) and "
                        f"{column.header!r} (column {index + 1}) are both read as {name}; allowed: one of them, named under "
                        f"`columns: {{{name}: ...}}` in the soil file, or by its number, `columns: {{{name}: {{column: ...}}}}`."
                    )
                found.setdefault(name, []).append(column)
        return found

    def column(self, name: str, index: int, header: str) -> Column | None:
        """Return the column if this header names the quantity. A header given by the user must match, with or without unit."""
        kind, own, header = QUANTITIES[name].kind, self.own.get(name), plain(header)
        readings = words_and_units(header)
        if own is not None:
            if own.number is not None:
                unit = next(
                    (unit for _, unit in reversed(readings) if unit is not None and kind and unit_key(unit) in UNITS[kind]), None
                )
                a_word = bool(header) and NUMBER.fullmatch(header) is None
                return Column(index, header, own.unit or unit) if index == own.number - 1 and a_word else None
            for wanted in (plain(text).casefold() for text in own.headers):
                for words, stated in reversed(readings):
                    if stated is not None and kind and not own.unit and unit_key(stated) not in UNITS[kind]:
                        continue  # "sig_v" is no "sig" in v
                    if wanted in (words.casefold(), header.casefold()):
                        return Column(index, header, own.unit or stated)
                for words, stated in readings[1:]:  # a unit that is not known, and will be named
                    if wanted == words.casefold() and not header.endswith(f"_{stated}"):
                        return Column(index, header, stated)
            return None
        alike = [(words, unit) for words, unit in readings if normal(words) in QUANTITIES[name].names]
        known = [(words, unit) for words, unit in alike if unit is None or kind is None or unit_key(unit) in UNITS[kind]]
        for _, unit in known[-1:] or alike[-1:]:
            return Column(index, header, unit)
        return None

    def blocks(self, rows: list[Row], start: int, columns, separator: str, left: Left) -> list[Block]:
        """Divide the rows from a header on into blocks, and their rows into readings, texts and what is left out."""
        current = Block(columns, len(rows[start].cells), rows[start].line, title_of(rows[start], title_above(rows, start)))
        found, title, gap = [current], "", False
        for row in rows[start + 1 :]:
            again = self.match(row.cells, row.line) if row.worded else {}
            if again and not self.lacking(again) and self.alike(again, columns):
                current = Block(again, len(row.cells), row.line, title_of(row, title))
                found.append(current)
                continue
            kind, gap = self.kind_of(row, current, separator, gap), row.empty
            if kind == "empty":
                left.empty += 1
                title = row.words or title
            elif kind == "statistics":
                left.statistics += 1
            elif kind == "text":
                current.texts.append(row)
                title = row.words
            elif kind == "reading":
                for text in current.texts:  # no footer: readings follow
                    raise self.not_a_number(text, current)
                self.check_inherited(row, current)
                current.readings.append((row.line, self.texts_of(row, current)))
            elif kind == "units":
                current.columns = self.with_units(row, current)
        left.texts += sum(len(block.texts) for block in found)
        return found

    def alike(self, again: Mapping[str, list[Column]], first: Mapping[str, list[Column]]) -> bool:
        """True if columns that the user numbered have the header again that they had first: any word would do otherwise."""
        numbered = [name for name, own in self.own.items() if own.number is not None and name in first]
        return all(
            [column.header.casefold() for column in again.get(name, ())] == [column.header.casefold() for column in first[name]]
            for name in numbered
        )

    def kind_of(self, row: Row, block: Block, separator: str, gap: bool) -> str:
        """One of "empty", "units", "statistics", "text" and "reading"; gap : True if the row above is empty.

        A text is words in place of numbers. With digits it is a faulty reading, unless an empty row sets it apart.
        """
        measured = [column for name, some in block.columns.items() if QUANTITIES[name].kind for column in some]
        cells = {column: cell(row, column.index) for column in measured}
        full = [text for text in cells.values() if text.lower() not in MISSING]
        if not full:
            return "empty"
        if not block.readings and self.are_units(row, block):
            return "units"
        if any(is_statistic(text) for k, text in enumerate(row.cells) if all(k != column.index for column in measured)):
            return "statistics"
        worded = not any(NUMBER.fullmatch(text) for text in full) and (gap or not any(c.isdigit() for c in "".join(full)))
        if worded and block.readings:  # above all readings it is a fault, and named as one
            return "text"
        if any(text.strip() for text in row.cells[block.width :]):
            raise CalibrationError(
                f"{self.path}, line {row.line}: {len(row.cells)} cells; allowed: the header's {block.width}, separated by "
                f"{separator}s. Numbers with decimal commas need another separator or quotes."
            )
        return "reading"

    def are_units(self, row: Row, block: Block) -> bool:
        """True if the cells of all measured quantities in a row are empty or units, and some are units."""
        texts = {
            (name, column.index): cell(row, column.index).strip(" []()")
            for name, some in block.columns.items() if QUANTITIES[name].kind for column in some
        }  # fmt: skip
        units = {key: unit_key(text) in UNITS[cast(str, QUANTITIES[key[0]].kind)] for key, text in texts.items() if text}
        return bool(units) and all(units.values())

    def with_units(self, row: Row, block: Block) -> dict[str, list[Column]]:
        """Columns with the units of a row below the header; one that the header states otherwise is refused."""
        columns: dict[str, list[Column]] = {name: [] for name in block.columns}
        for name, some in block.columns.items():
            for column in some:
                below = cell(row, column.index).strip(" []()") if QUANTITIES[name].kind else ""
                if below and column.unit is not None and unit_key(column.unit) != unit_key(below) and name not in self.own:
                    raise self.fault(row.line, column, below, f"the header's unit, {column.unit}")
                columns[name].append(column if column.unit is not None or not below else Column(column.index, column.header, below))
        return columns

    def texts_of(self, row: Row, block: Block) -> dict[tuple[str, int], str]:
        """Texts of a reading by quantity and column."""
        return {(name, column.index): cell(row, column.index) for name, some in block.columns.items() for column in some}

    def table(self, block: Block, rows: list[Row], left: Left, label: str | None) -> pd.DataFrame:
        """Readings of a block in SI units; label : its own among several blocks."""
        self.check_units(block)
        self.check_trials(block)
        kept = self.filled(block, left)
        mark = self.decimal_mark(kept, block)
        table: dict[str, list | np.ndarray] = {}
        several_columns = max(map(len, block.columns.values()))
        for name, columns in block.columns.items():
            quantity = QUANTITIES[name]
            parts = [[(line, texts[name, column.index]) for line, texts in kept] for column in columns]
            if quantity.kind is None:
                table[quantity.column] = [label_key(text) for _, text in parts[0] for _ in range(several_columns)]
                continue
            numbers = []
            for column, part in zip(columns, parts, strict=True):
                factor = UNITS[quantity.kind][unit_key(cast(str, column.unit))] * self.own.get(name, Own()).factor
                numbers.append([factor * self.number(line, text, column, mark) for line, text in part])
            table[quantity.column] = np.repeat(np.array(numbers).T.ravel(), several_columns // len(columns))
        found = pd.DataFrame(table)
        for name in self.optional:
            if QUANTITIES[name].column not in found:
                self.add_titled(found, name, block, rows, label)
        return found

    def add_titled(self, found: pd.DataFrame, name: str, block: Block, rows: list[Row], label: str | None) -> None:
        """Add a label, or a load, that only the title of a block or the head of the file states."""
        quantity = QUANTITIES[name]
        if quantity.kind is None:
            if label is not None:
                found[quantity.column] = label
            return
        several = label is not None
        head = [block.title, *(row.words for row in rows if row.line < block.line and not several)]
        values = {self.stated(name, text, block.line, bare=several) for text in head} - {None}
        allowed = "one value, or a column"
        demand(len(values) < 2, f"{self.path}: {name.replace('_', ' ')} above line {block.line}", sorted(values), allowed)
        if values:
            found[quantity.column] = values.pop()

    def filled(self, block: Block, left: Left) -> list[tuple[int, dict[tuple[str, int], str]]]:
        """Readings with the labels and loads that hold on from above; raises CalibrationError for any other missing value."""
        above: dict[tuple[str, int], str] = {}
        kept = []
        columns = {column.index: column for some in block.columns.values() for column in some}
        for line, texts in block.readings:
            whole = dict(texts)
            for key, text in texts.items():
                if text.lower() not in MISSING:
                    above[key] = text
                elif QUANTITIES[key[0]].inherited and key in above:
                    whole[key] = above[key]
                    left.filled += 1
                else:
                    raise self.fault(line, columns[key[1]], text, "a value: the other cells of this row have one")
            kept.append((line, whole))
        return kept

    def check_units(self, block: Block) -> None:
        """Raise CalibrationError for a column whose unit is missing or unknown."""
        for name, columns in block.columns.items():
            kind = QUANTITIES[name].kind
            for column in columns:
                if kind and (column.unit is None or unit_key(column.unit) not in UNITS[kind]):
                    has = "no unit" if column.unit is None else f"the unit {column.unit!r}"
                    raise CalibrationError(
                        f"{self.path}: column {column.header!r} has {has}; allowed: {', '.join(UNITS[kind])}, in brackets behind "
                        f"the name or under `columns: {{{name}: {{header: ..., unit: ..., factor: ...}}}}` in the soil file."
                    )

    def check_inherited(self, row: Row, block: Block) -> None:
        """Raise CalibrationError for a short row without a load to the right of its readings: it may be one of them, moved."""
        if len(row.cells) >= block.width:
            return
        read = [column.index for name, some in block.columns.items() if not QUANTITIES[name].inherited for column in some]
        for name, columns in block.columns.items():
            for column in columns:
                empty = cell(row, column.index).lower() in MISSING
                if QUANTITIES[name].inherited and empty and column.index > min(read):
                    raise self.fault(row.line, column, "", f"as many cells as the header, {block.width}, not {len(row.cells)}")

    def check_trials(self, block: Block) -> None:
        """Raise CalibrationError for columns of trials that do not belong together."""
        numbers = {name: len(columns) for name, columns in block.columns.items() if QUANTITIES[name].kind}
        ok = len(set(numbers.values())) == 1 and ("displacement" not in numbers or max(numbers.values()) == 1)
        allowed = "as many headers for each quantity; of shear tests one, or a normal stress for each table above it"
        demand(ok, f"{self.path}, line {block.line}: columns of each quantity", numbers, allowed)

    def decimal_mark(self, readings, block: Block) -> str:
        """Decimal mark of a block; refused if both occur or if a comma could be a thousands separator."""
        if self.decimal:
            return self.decimal
        columns = [(name, column) for name, some in block.columns.items() if QUANTITIES[name].kind for column in some]
        cells = [(line, column, texts[name, column.index]) for line, texts in readings for name, column in columns]
        with_comma, with_point = ([entry for entry in cells if mark in entry[2]] for mark in ",.")
        if with_comma and with_point:
            line, column, text = max(with_comma[0], with_point[0], key=lambda entry: entry[0])
            raise self.fault(line, column, text, "one decimal mark in the whole file, and no separators of thousands")
        if with_comma and all(AMBIGUOUS.fullmatch(text) for _, _, text in with_comma):
            line, column, text = with_comma[0]
            raise self.fault(
                line, column, text, 'numbers whose comma cannot separate thousands, or `decimal: ","` in the soil file'
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

    def not_a_number(self, row: Row, block: Block) -> CalibrationError:
        """Error for a row of text between readings."""
        columns = [column for name, some in block.columns.items() if QUANTITIES[name].kind for column in some]
        column = next(column for column in columns if cell(row, column.index).lower() not in MISSING)
        return self.fault(row.line, column, cell(row, column.index), "a number: readings follow below")

    def fault(self, line: int, column: Column, text: str, allowed: str) -> CalibrationError:
        """Error that names file, line, column, value and the allowed values."""
        return CalibrationError(f"{self.path}, line {line}, column {column.header!r}: {shown(text)}; allowed: {allowed}.")


class NoHeader(CalibrationError):
    """No line of a file is a header; lacking : required quantities and their spellings, line : of the nearest line."""

    def __init__(self, path: Path, lacking: list[tuple[str, list[str]]], line: int | None):
        wanted = "; ".join(f"{name}: {', '.join(words)}" for name, words in lacking)
        where = "" if line is None else f" (nearest to it: line {line})"
        super().__init__(
            f"{path}: no line is a header with a column for {', '.join(name for name, _ in lacking)}{where}; allowed: columns "
            f"separated by tab, semicolon, comma or blanks, named {wanted}, or as `columns`, and `encoding`, in the soil file say."
        )
        self.n_lacking = len(lacking)


def read_laboratory(
    path: Path,
    quantities: Sequence[str | Alternatives],
    columns: Mapping | None = None,
    decimal: str | None = None,
    origin: str = "columns",
    *,
    optional: Collection[str] = (),
    encoding: str | None = None,
    sheet: str | None = None,
    rows: Mapping | None = None,
) -> Readings:
    """Read a laboratory file.

    Parameters
    ----------
    quantities : required keys of `QUANTITIES`, or tuples of them of which one is required. optional : read if there, or found in
    titles. columns : quantity -> header in the file, headers, or {header, unit, factor, column}.
    decimal : "." or ","; detected by default. encoding : name of the text's encoding. sheet : of a workbook. rows : header -> text,
    to which the rows are restricted. origin : file and key of these, for messages.

    Returns
    -------
    Readings; every number is finite. Raises CalibrationError naming file, line, column, value and the allowed values.
    """
    wanted = tuple((name,) if isinstance(name, str) else tuple(name) for name in quantities)
    known = [name for some in wanted for name in some] + list(optional)
    own = own_columns(columns, known, origin)
    demand(decimal in (None, ".", ","), f"{origin}: decimal", repr(decimal), '"." or ","')
    for name, value in (("encoding", encoding), ("sheet", sheet)):
        demand(value is None or isinstance(value, str), f"{origin}: {name}", repr(value), "a text")
    reader = Reader(path, wanted, tuple(optional), own, decimal)
    ways, failures, faults = with_header(reader, ways_to_read(path, encoding, sheet), rows, origin)
    if not ways and faults:
        raise faults[0]
    if not ways:
        ways, _, _ = with_header(reader, last_ways_to_read(path, encoding), rows, origin)
    if not ways:
        raise min(failures, key=lambda error: error.n_lacking)
    # of equals the first
    kept, start, header, separator, n_beside = max(ways, key=lambda way: score(way.columns, way.rows[way.start]))
    read = reader.read(kept, start, header, separator)
    return replace(read, remarks=(f"{n_beside} tables side by side", *read.remarks)) if n_beside else read


class Way(NamedTuple):
    """A file as it may be split: its rows, place and columns of the header, separator, number of tables side by side."""

    rows: list[Row]
    start: int
    columns: dict[str, list[Column]]
    separator: str
    n_beside: int


def with_header(
    reader: Reader, ways: Iterable, rows: Mapping | None, origin: str
) -> tuple[list[Way], list[NoHeader], list[CalibrationError]]:
    """Those of the ways to split a file (separator, rows) that find a header in it, and the errors of the others."""
    found: list[Way] = []
    failures: list[NoHeader] = []
    faults: list[CalibrationError] = []
    for separator, lines in ways:
        try:
            kept, n_beside = reader.below_each_other(restricted(reader.path, lines, rows, origin), separator)
            start, columns = reader.header(kept)
        except NoHeader as error:
            failures.append(error)
        except CalibrationError as error:
            faults.append(error)
        else:
            found.append(Way(kept, start, columns, separator, n_beside))
    return found, failures, faults


def score(columns: Mapping[str, list[Column]], header: Row) -> tuple[int, int, int]:
    """How well a way of splitting a file fits its header: quantities, known units, cells."""
    every = [(QUANTITIES[name].kind, column) for name, some in columns.items() for column in some]
    known = sum(column.unit is not None and unit_key(column.unit) in UNITS.get(kind or "", ()) for kind, column in every)
    return len(columns), known, len(header.cells)


def restricted(path: Path, rows: list[Row], only: Mapping | None, origin: str) -> list[Row]:
    """Rows up to the header that names the columns of `only`, and those below it whose cells there have its texts."""
    if only is None:
        return rows
    ok = isinstance(only, Mapping) and bool(only) and all(isinstance(header, str) for header in only)
    demand(ok, f"{origin}: rows", repr(only), "a mapping of headers to the texts of their rows")
    for k, row in enumerate(rows):
        places = {
            header: [i for i, text in enumerate(row.cells) if text.strip().casefold() == header.casefold()] for header in only
        }
        if all(places.values()):
            wanted = {places[header][0]: str(text).strip().casefold() for header, text in only.items()}
            kept = [row for row in rows[k + 1 :] if all(cell(row, i).casefold() == text for i, text in wanted.items())]
            demand(bool(kept), f"{path}: number of rows with {dict(only)}", 0, f"at least one; see `rows` of {origin}")
            return [*rows[: k + 1], *kept]
    return []


@lru_cache(maxsize=4096)
def words_and_units(header: str) -> list[tuple[str, str | None]]:
    """Ways to read a header as a name with a unit; the first is the whole of it, without one."""
    return [(header, None), *((found["name"], found["unit"]) for p in HEADERS if (found := p.fullmatch(header)))]


def cell(row: Row, index: int) -> str:
    """Text of a cell; empty beyond the row's end."""
    return row.cells[index].strip() if index < len(row.cells) else ""


def labels_of(titles: list[str]) -> list[str | None]:
    """Label of every block, its title or its number; those that are alike are told apart. None for the only block."""
    if len(titles) < 2:
        return [None] * len(titles)
    return [f"{title} ({k})".strip() if titles.count(title) > 1 or not title else title for k, title in enumerate(titles, 1)]


def title_of(header: Row, above: str) -> str:
    """Title that a header has already, or the text above it."""
    return above if header.title is None else header.title


def title_above(rows: list[Row], start: int) -> str:
    """Words of the nearest row with a text above a header."""
    return next((row.words for row in reversed(rows[:start]) if not row.empty), "")


def shown(text: str) -> str:
    """Format a cell for a message, shortened."""
    return repr(text if len(text) <= 40 else text[:40] + "...") if text else "empty"
