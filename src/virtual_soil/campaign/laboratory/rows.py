"""Rows of a laboratory file: text in any common encoding, split by tab, semicolon, comma or blanks; or a workbook's sheet."""

import csv
import re
import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from virtual_soil.calibration.errors import CalibrationError, demand

DELIMITERS = {"\t": "tab", ";": "semicolon", ",": "comma", "  ": "blank"}
#: Columns by blanks have two or more between them, so that a header may have words; one will do between numbers.
BLANKS, NUMBERS = re.compile(r"\s{2,}|\t"), re.compile(r"[\d.+-][\d.eE+-]*(\s+[\d.+-][\d.eE+-]*)*")
COMMENTS = ("#", "%", "//")
#: A label such as "#4" in the first cell; with a blank after the sign the line is a comment, unless two numbers follow.
LABEL = re.compile(r"#(\w|\s*[\w.-]+(\s*[,;\t]\s*|\s{2,})[\d.,+-]+(\s*[,;\t]\s*|\s{2,})[\d.,+-]+\s*([,;\t]|\s{2,}|$))")
#: Suffixes of workbooks that openpyxl reads.
WORKBOOKS = (".xlsx", ".xlsm")


@dataclass(frozen=True)
class Row:
    """A line of a file: its number, counted from 1, and its cells; of a header, the title of its table if known already."""

    line: int
    cells: list[str]
    title: str | None = None

    @property
    def empty(self) -> bool:
        """True if no cell has a text."""
        return not any(cell.strip() for cell in self.cells)

    @property
    def worded(self) -> bool:
        """True if a cell has a letter."""
        return any(any(map(str.isalpha, cell)) for cell in self.cells)

    @property
    def words(self) -> str:
        """The texts of the row, as a title."""
        return " ".join(cell.strip() for cell in self.cells if cell.strip())


def text_of(path: Path, encoding: str | None) -> str:
    """Content of a text file; raises CalibrationError if it cannot be read."""
    try:
        content = path.read_bytes()
    except (OSError, ValueError) as error:
        raise CalibrationError(f"{path}: cannot be read ({getattr(error, 'strerror', None) or error}).") from error
    return decoded(path, content, encoding)


def decoded(path: Path, content: bytes, encoding: str | None = None) -> str:
    """Decode a file; Latin-1 if none is given and it is neither UTF-8 nor UTF-16 with a byte order mark."""
    if encoding:
        try:
            return content.decode(encoding)
        except (LookupError, UnicodeDecodeError) as error:
            raise CalibrationError(f"{path}: not a text in encoding {encoding!r} ({error}); allowed: the file's own.") from error
    encodings = ["utf-16"] if content.startswith((b"\xff\xfe", b"\xfe\xff")) else ["utf-8-sig", "latin-1"]
    for name in encodings:
        try:
            text = content.decode(name)
        except UnicodeDecodeError:
            continue
        if "\0" not in text:
            return text
    raise CalibrationError(f"{path}: not a text file; allowed: a table saved as CSV or text, or a workbook (.xlsx).")


def ways_to_read(path: Path, encoding: str | None, sheet: str | None) -> Iterator[tuple[str, list[Row]]]:
    """Yield (name of the separator, rows) of every way in which a file may be split into cells."""
    if path.suffix.lower() in WORKBOOKS:
        yield "cell", sheet_rows(path, sheet)
        return
    demand(sheet is None, f"{path}: sheet", repr(sheet), "none: it is no workbook")
    lines = text_of(path, encoding).splitlines()
    for delimiter, name in DELIMITERS.items():
        yield name, [Row(k, split(path, k, line, delimiter)) for k, line in enumerate(lines, 1) if not is_comment(line)]
    for delimiter in (mark for mark in DELIMITERS if mark != "  "):  # headers whose cells have line breaks
        if '"' in "".join(lines):
            yield DELIMITERS[delimiter], quoted_rows(lines, delimiter)


def last_ways_to_read(path: Path, encoding: str | None) -> Iterator[tuple[str, list[Row]]]:
    """Yield further ways for a text without a header in the usual ones: behind a number sign, and words without blanks."""
    if path.suffix.lower() in WORKBOOKS:
        return
    lines = text_of(path, encoding).splitlines()
    first = next((k for k, line in enumerate(lines) if line.strip() and not is_comment(line)), 0)
    if first and is_comment(lines[first - 1]):  # as numpy writes it
        lines[first - 1] = lines[first - 1].lstrip().lstrip("".join(COMMENTS)).lstrip(" ")
        for delimiter, name in DELIMITERS.items():
            yield name, [Row(k, split(path, k, line, delimiter)) for k, line in enumerate(lines, 1) if not is_comment(line)]
    yield "blank", [Row(k, line.split()) for k, line in enumerate(lines, 1) if not is_comment(line)]


def is_comment(line: str) -> bool:
    """True if a line is a comment and no row whose label begins with a number sign."""
    text = line.lstrip()
    return text.startswith(COMMENTS) and LABEL.match(text) is None


def split(path: Path, line: int, text: str, delimiter: str) -> list[str]:
    """Split a line into cells; delimiters inside quotes are kept."""
    if delimiter == "  ":
        text = text.strip()
        return text.split() if NUMBERS.fullmatch(text) else BLANKS.split(text) if text else []
    try:
        return next(csv.reader([text], delimiter=delimiter, skipinitialspace=True), [])
    except csv.Error as error:
        raise CalibrationError(f"{path}, line {line}: not a row of a table ({error}).") from error


def joined(above: list[str], below: list[str]) -> list[str]:
    """Cells of a header in two lines."""
    n = max(len(above), len(below))
    pairs = zip(above + [""] * (n - len(above)), below + [""] * (n - len(below)), strict=True)
    return [f"{first.strip()} {second.strip()}".strip() for first, second in pairs]


def quoted_rows(lines: list[str], delimiter: str) -> list[Row]:
    """Rows of a text whose quoted cells may span several lines; none if it is no such text."""
    reader, rows = csv.reader((f"{line}\n" for line in lines), delimiter=delimiter, skipinitialspace=True), []
    try:
        for cells in reader:
            rows.append(Row(reader.line_num, [" ".join(cell.split()) for cell in cells]))
    except csv.Error:
        return []
    return rows


def sheet_rows(path: Path, sheet: str | None) -> list[Row]:
    """Rows of a workbook's sheet: the one named, or the only one."""
    import openpyxl  # takes a third of a second

    try:
        with warnings.catch_warnings(action="ignore"):  # of parts of the workbook that are not read
            book = openpyxl.load_workbook(path, read_only=True, data_only=True)
            sheets = {one.title: one for one in book.worksheets}
            demand(
                sheet in sheets or (sheet is None and len(sheets) == 1),
                f"{path}: sheet",
                repr(sheet),
                f"one of {', '.join(sheets)}",
            )
            rows = list((sheets[sheet] if sheet else next(iter(sheets.values()))).iter_rows(values_only=True))
    except CalibrationError:
        raise
    except Exception as error:  # a damaged part raises whatever its reader stumbles over
        raise CalibrationError(
            f"{path}: cannot be read as a workbook ({' '.join(str(error).split()) or type(error).__name__})."
        ) from error
    return [Row(k, ["" if value is None else cell_text(value) for value in cells]) for k, cells in enumerate(rows, 1)]


def cell_text(value) -> str:
    """Text of a workbook's cell; numbers without an exponent that the reader would have to guess."""
    return repr(value) if isinstance(value, float) else str(value)
