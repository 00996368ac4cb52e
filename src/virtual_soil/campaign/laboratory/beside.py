"""Tables side by side in one sheet, a specimen each, as spreadsheets and loggers write them: they are put below each other.

Side by side stand tables whose quantities repeat in one order. Above each is a title; a merged cell holds its text in the first of
its cells, so every text above a table's columns is of its title. One column of displacements may serve all. Tables are told from a
second column of one quantity (raw and corrected forces, say) by their normal stresses: each states one, in a column or above it.
"""

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from virtual_soil.calibration.errors import CalibrationError
from virtual_soil.campaign.laboratory.quantities import is_statistic
from virtual_soil.campaign.laboratory.rows import Row, joined
from virtual_soil.campaign.laboratory.titles import BELOW, BETWEEN, NUMBER

LOADS = {"normal_stress", "normal_force"}
#: What a table of its own must have, and what all tables may have in common.
OWN, COMMON = {"force", "shear_stress"}, {"displacement"}


@dataclass(frozen=True)
class Sheet:
    """How a sheet is read. marks : (column, quantity) of a header's cells. states_load : True if the title, of a line, does."""

    path: Path
    marks: Callable[[list[str]], list[tuple[int, str]]]
    states_load: Callable[[str, int], bool]
    separator: str


@dataclass(frozen=True)
class Spread:
    """A header over tables side by side.

    first, last : places of its rows in the sheet. cells, line : its words. marked : columns of quantities. ranges : first and last
    column (exclusive) of each table. titles : of each. n_titles : number of rows above that hold them.
    """

    first: int
    last: int
    line: int
    cells: list[str]
    marked: set[int]
    ranges: list[tuple[int, int]]
    titles: list[str]
    n_titles: int


def stacked(sheet: Sheet, rows: list[Row]) -> tuple[list[Row], int]:
    """Rows with the tables of each header below each other, and the number of tables that stand side by side.

    Raises CalibrationError for tables that state no normal stress, and for rows that cannot be divided.
    """
    spreads: list[Spread] = []
    for k in range(len(rows)):
        spread = spread_at(sheet, rows, k, spreads[-1].last + 1 if spreads else 0)
        if spread is not None:
            spreads.append(spread)
    if not spreads:
        return rows, 0
    found = rows[: spreads[0].first - spreads[0].n_titles]
    ends = [spread.first - spread.n_titles for spread in spreads[1:]] + [len(rows)]
    for spread, end in zip(spreads, ends, strict=True):
        readings = rows[spread.last + 1 : end]
        check_widths(sheet, spread, readings)
        for title, columns in zip(spread.titles, spread.ranges, strict=True):
            found += one_table(spread, title, columns, readings)
    return found, sum(len(spread.ranges) for spread in spreads)


def spread_at(sheet: Sheet, rows: list[Row], k: int, above: int) -> Spread | None:
    """The header over tables side by side that begins in row k, in one line or two; its titles stand in row `above` or below."""
    if not rows[k].worded:
        return None
    ways = [(k, rows[k].cells)]
    if k + 1 < len(rows) and rows[k + 1].worded:
        if divided(rows[k + 1].cells, sheet.marks(rows[k + 1].cells)) is None:
            ways.append((k + 1, joined(rows[k].cells, rows[k + 1].cells)))
    for last, cells in ways:
        marks = sheet.marks(cells)
        found = divided(cells, marks)
        if found is None:
            continue
        ranges, names = found
        titles, n_titles = titles_above(sheet, rows[above:k], ranges)
        line = rows[last].line
        without = [] if names & LOADS else [j for j, title in enumerate(titles, 1) if not sheet.states_load(title, line)]
        if without and not names & COMMON:
            continue  # a second column of forces
        if without:
            raise CalibrationError(
                f"{sheet.path}, line {line}: {len(ranges)} tables side by side, without a normal stress in number "
                f"{', '.join(map(str, without))}; allowed: a text such as `Normal stress: 25 kPa` above each, or one table chosen "
                f"by its columns, `columns: {{displacement: {{column: ...}}, force: {{column: ...}}}}` in the soil file."
            )
        return Spread(k, last, line, cells, {index for index, _ in marks}, ranges, titles, n_titles)
    return None


def divided(cells: list[str], marks: list[tuple[int, str]]) -> tuple[list[tuple[int, int]], set[str]] | None:
    """Columns of each table of a header, and the quantities that each has; None if it is a header of one table, or none."""
    counts = Counter(name for _, name in marks)
    names = {name for name, n in counts.items() if n > 1}
    own = [(index, name) for index, name in marks if name in names]
    order, width = [name for _, name in own], len(names)
    n = len(order) // width if width else 0
    regular = bool(names & OWN) and "displacement" in counts and set(counts) - names <= COMMON and order == order[:width] * n
    if not regular or len(set(order[:width])) < width:
        return None
    starts = [own[k * width][0] for k in range(n)]
    marked = {index for index, _ in marks}
    while starts[0] > 0 and len({cells[k - 1].strip().casefold() for k in starts}) == 1 and cells[starts[0] - 1].strip():
        if any(k - 1 in marked for k in starts):
            break
        starts = [k - 1 for k in starts]  # columns of times or heights before the first quantity
    gaps = {b - a for a, b in zip(starts, starts[1:], strict=False)}
    end = max(starts[-1] + gaps.pop(), own[-1][0] + 1) if len(gaps) == 1 else len(cells)
    return list(zip(starts, [*starts[1:], end], strict=True)), names


def titles_above(sheet: Sheet, rows: list[Row], ranges: list[tuple[int, int]]) -> tuple[list[str], int]:
    """Title of each table, of all rows directly above a header that hold texts for several tables, and the number of these rows."""
    found: list[list[str]] = []
    n = 0
    for k, row in enumerate(reversed(rows), 1):
        texts = None if row.empty else title_row(sheet, row, ranges)
        if texts is not None:
            found.insert(0, texts)
            n = k
        elif not row.empty:
            break
    return [BELOW.join(text for text in column if text) for column in zip(*found, strict=True)] or [""] * len(ranges), n


def title_row(sheet: Sheet, row: Row, ranges: list[tuple[int, int]]) -> list[str] | None:
    """Texts of a row by table; None if it is no row of titles. A name before the first number is that of all: "Load (N)", 9, 18."""
    texts = [[text.strip() for text in row.cells[a:b] if text.strip()] for a, b in ranges]
    before = [text.strip() for text in row.cells[: ranges[0][0]] if text.strip()]
    if sheet.separator == "blank":  # empty cells cannot be seen
        if len(row.cells) != len(ranges):
            return None
        texts, before = [[text] for text in row.cells], []
    name = (before or texts[0] or [""])[0]
    if sheet.marks([name]):
        rest = [texts[0] if before else texts[0][1:], *texts[1:]]
        if len(before) < 2 and all(len(some) == 1 for some in rest):
            return [f"{name}: {some[0]}" for some in rest]
    numbers = all(NUMBER.fullmatch(text) for some in texts for text in some)
    if before or numbers or sum(map(bool, texts)) < 2:
        return None
    return [BETWEEN.join(some) for some in texts]


def check_widths(sheet: Sheet, spread: Spread, readings: list[Row]) -> None:
    """Raise CalibrationError for a row of numbers whose cells do not stand under the header's, as after a lost separator."""
    width, first = len(spread.cells), spread.ranges[0][0]
    for row in readings:
        numbers = [k for k, text in enumerate(row.cells) if NUMBER.fullmatch(text.strip())]
        if not numbers:
            continue
        gaps = sheet.separator == "blank" and len(row.cells) != width  # blanks do not show which cells are empty
        if gaps or any(text.strip() for text in row.cells[width:]):
            raise CalibrationError(
                f"{sheet.path}, line {row.line}: {len(row.cells)} cells; allowed: the header's {width}, separated by "
                f"{sheet.separator}s. Tables of different lengths, and numbers with decimal commas, need tabs or semicolons."
            )
        alone = [k for k in numbers if k >= first and not spread.cells[k].strip()]
        if alone:
            raise CalibrationError(
                f"{sheet.path}, line {row.line}, column {alone[0] + 1}: {row.cells[alone[0]]!r}; allowed: no number, since the "
                f"column has no header beside the tables'."
            )


def one_table(spread: Spread, title: str, columns: tuple[int, int], readings: list[Row]) -> list[Row]:
    """Header and rows of one of the tables: the columns that all have in common, then its own."""
    n = spread.ranges[0][0]

    def cut(cells: list[str]) -> list[str]:
        return [*(cells[:n] + [""] * (n - len(cells[:n]))), *cells[columns[0] : columns[1]]]

    table = []
    for row in readings:
        cells = cut(row.cells)
        word = next((text for k, text in enumerate(row.cells) if k not in spread.marked and is_statistic(text)), None)
        if word is not None and any(NUMBER.fullmatch(text.strip()) for text in row.cells):
            cells.append(word)  # it stands beside one table and is meant for all
        table.append(Row(row.line, cells))
    last = max((k for k, row in enumerate(table, 1) if any(text.strip() for text in row.cells[n:])), default=0)
    return [Row(spread.line, cut(spread.cells), title), *table[:last]]
