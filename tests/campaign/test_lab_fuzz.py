"""Whatever happens to a laboratory file, it is refused in one line or gives the right answer.

Every test lies on one strength line, at every reading: what is left of a damaged file gives the same line, or none.
"""

import csv
import io

import numpy as np
import openpyxl
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from virtual_soil.calibration.errors import CalibrationError
from virtual_soil.campaign.experiments.shear.laboratory import understood

AREA_M2, COHESION_PA, SLOPE = 0.01, 4000.0, np.tan(np.radians(32.0))
LOADS_KPA = (25, 50, 100, 150, 300)
many = settings(max_examples=60, suppress_health_check=list(HealthCheck))
#: What gets into cells.
JUNK = ("", "x", "kPa", "NaN", "1,5", "1e999", "0", "Max", '"', "DATA", "GROUP", "SHBT_PEAK", "#", "=A1", "１")
PLACE = st.floats(0, 1, exclude_max=True)


def tau_kpa(load_kpa):
    return round(1e-3 * COHESION_PA + SLOPE * load_kpa, 6)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("laboratory")


def outcome(folder, name, content, **entry):
    """The tests in a file, or None and the message that refuses it."""
    (folder / name).write_bytes(content)
    try:
        return understood(folder / "soil.yaml", {"file": name, "shear_area_m2": AREA_M2, **entry}), ""
    except CalibrationError as error:
        return None, str(error)


def right_or_refused(folder, name, content, **entry):
    """Read a file; True if it gave the right line."""
    tests, message = outcome(folder, name, content, **entry)
    if tests is None:
        assert len(message.splitlines()) == 1
        assert "soil.yaml" in message or name in message
        return False
    assert tests.line.cohesion_pa == pytest.approx(COHESION_PA, abs=1.0)
    assert np.tan(np.radians(tests.line.friction_angle_deg)) == pytest.approx(SLOPE, abs=1e-4)
    return True


def at(place, items):
    return int(place * len(items))


def drop_row(rows, a, b, c):
    return rows[: at(a, rows)] + rows[at(a, rows) + 1 :]


def repeat_row(rows, a, b, c):
    return rows[: at(a, rows)] + rows[at(a, rows) :][:1] + rows[at(a, rows) :]


def swap_rows(rows, a, b, c):
    rows = list(rows)
    if rows:
        rows[at(a, rows)], rows[at(b, rows)] = rows[at(b, rows)], rows[at(a, rows)]
    return rows


def edited(change):
    """A change of one row as one of all."""

    def edit(rows, a, b, c):
        return [change(row, b, c) if k == at(a, rows) else row for k, row in enumerate(rows)]

    return edit


drop_cell = edited(lambda row, b, c: row[: at(b, row)] + row[at(b, row) + 1 :])
repeat_cell = edited(lambda row, b, c: row[: at(b, row)] + row[at(b, row) :][:1] + row[at(b, row) :])
empty_cell = edited(lambda row, b, c: row[: at(b, row)] + [""] + row[at(b, row) :])
junk_cell = edited(lambda row, b, c: [JUNK[at(c, JUNK)] if k == at(b, row) else cell for k, cell in enumerate(row)])


def drop_column(rows, a, b, c):
    k = at(a, max(rows, key=len, default=[]))
    return [row[:k] + row[k + 1 :] for row in rows]


def empty_column(rows, a, b, c):
    k = at(a, max(rows, key=len, default=[]))
    return [row[:k] + [""] + row[k:] for row in rows]


CHANGES = st.lists(
    st.tuples(
        st.sampled_from(
            [drop_row, repeat_row, swap_rows, drop_cell, repeat_cell, empty_cell, junk_cell, junk_cell, drop_column, empty_column]
        ),
        PLACE,
        PLACE,
        PLACE,
    ),
    max_size=2,
)


def changed(rows, changes):
    for change, *places in changes:
        rows = change(rows, *places)
    return rows


KEY = ["LOCA_ID", "SAMP_TOP", "SAMP_REF", "SPEC_REF"]
AGS = [
    ["GROUP", "PROJ"], ["HEADING", "PROJ_ID", "PROJ_NAME"], ["UNIT", "", ""], ["TYPE", "ID", "X"], ["DATA", "7", 'Dam "A"'],
    ["GROUP", "SHBG"], ["HEADING", *KEY, "SHBG_TYPE", "SHBG_PCOH", "SHBG_PHI", "SHBG_REM"],
    ["UNIT", "", "m", "", "", "", "kPa", "deg", ""], ["TYPE", "ID", "2DP", "X", "X", "PA", "2SF", "1DP", "X"],
    ["DATA", "BH1", "2.50", "3", "1a", "SMALL SBOX", "4.1", "32.0", ""],
    ["DATA", "BH2", "4.00", "1", "1", "SMALL SBOX", "9.1", "25.0", ""],
    ["GROUP", "SHBT"], ["HEADING", *KEY, "SHBT_TESN", "SHBT_NORM", "SHBT_PEAK", "SHBT_RES"],
    ["UNIT", "", "m", "", "", "", "kPa", "kPa", "kPa"], ["TYPE", "ID", "2DP", "X", "X", "X", "0DP", "6DP", "1DP"],
    *(["DATA", "BH1", "2.50", "3", "1a", str(k), str(p), str(tau_kpa(p)), "5.0"] for k, p in enumerate(LOADS_KPA, 1)),
    *(["DATA", "BH2", "4.00", "1", "1", str(k), str(p), str(5 + p), "5.0"] for k, p in enumerate(LOADS_KPA, 1)),
]  # fmt: skip


#: The set of the file that is chosen.
OF_AGS = {"sample": {"LOCA_ID": "BH1"}}


def quoted(rows):
    return "\r\n".join(",".join('"' + cell.replace('"', '""') + '"' for cell in row) for row in rows).encode()


@many
@given(CHANGES, PLACE, st.booleans())
def test_a_changed_ags_file_gives_the_right_line_or_none(folder, changes, cut, whole):
    content = quoted(changed(AGS, changes))
    right_or_refused(folder, "site.ags", content if whole else content[: at(cut, content)], **OF_AGS)


def beside(gap, own_loads):
    """Rows of tables side by side, with a column of numbers before the readings."""
    rows = [[] for _ in range(9)]
    for k, p in enumerate(LOADS_KPA, 1):
        cells = [[f"Test {k}: {p} kPa", "", ""], ["No.", "Displacement (mm)", "Shear stress (kPa)"]]
        cells += [[str(i), f"{0.25 * i}", str(tau_kpa(p))] for i in range(7)]
        if own_loads:
            cells = [[f"Test {k}", "", "", ""]] + [
                row + [text] for row, text in zip(cells[1:], ["Normal stress (kPa)"] + 7 * [str(p)], strict=True)
            ]
        for row, some in zip(rows, cells, strict=True):
            row += [*some, *gap * [""]]
    return rows


def joined(rows, mark):
    lines = io.StringIO()
    csv.writer(lines, delimiter=mark, lineterminator="\n").writerows(rows)
    return lines.getvalue()


@many
@given(CHANGES, st.integers(0, 2), st.booleans(), st.sampled_from(",;\t"), st.floats(0.6, 1.0))
def test_changed_tables_side_by_side_give_the_right_line_or_none(folder, changes, gap, own_loads, mark, kept):
    text = joined(changed(beside(gap, own_loads), changes), mark)
    right_or_refused(folder, "box.csv", text[: int(kept * len(text))].encode())


def workbook(rows, merged):
    book = openpyxl.Workbook()
    for row in rows:
        book.active.append([float(cell) if cell.replace(".", "", 1).isdigit() and cell.isascii() else cell or None for cell in row])
    for k in range(5) if merged else ():
        book.active.merge_cells(start_row=1, end_row=1, start_column=4 * k + 1, end_column=4 * k + 3)
    content = io.BytesIO()
    book.save(content)
    return content.getvalue()


@many
@given(CHANGES, st.booleans())
def test_a_changed_workbook_gives_the_right_line_or_none(folder, changes, merged):
    right_or_refused(folder, "box.xlsx", workbook(changed(beside(1, False), changes), merged))


def sound():
    """The files as they are written."""
    tables = beside(1, False)
    return {"site.ags": quoted(AGS), "box.csv": joined(tables, ",").encode(), "box.xlsx": workbook(tables, True)}


def test_the_files_as_they_are_written_give_the_right_line(folder):
    for name, content in sound().items():
        assert right_or_refused(folder, name, content, **(OF_AGS if name == "site.ags" else {}))
    for gap in (0, 1, 2):
        for own_loads in (False, True):
            assert right_or_refused(folder, "box.csv", joined(beside(gap, own_loads), ";").encode())


@many
@given(st.sampled_from(sorted(sound())), PLACE, st.integers(0, 400), st.binary(min_size=1, max_size=30))
def test_damaged_bytes_are_read_or_refused_in_one_line(folder, name, place, n, junk):
    content = sound()[name]
    k = at(place, content)
    _, message = outcome(folder, name, content[:k] + junk + content[k + n :], **(OF_AGS if name == "site.ags" else {}))
    assert len(message.splitlines()) < 2
