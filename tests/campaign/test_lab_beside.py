"""Tables side by side: every layout gives the strength of the same tests in a plain table, or is refused with what to do."""

import csv
import io
from itertools import zip_longest

import numpy as np
import openpyxl
import pytest

from virtual_soil.calibration.errors import CalibrationError
from virtual_soil.campaign.experiments.shear.laboratory import BESIDE, CURVE, ENTRY, understood
from virtual_soil.campaign.laboratory.table import read_laboratory
from virtual_soil.campaign.soils import soil_content

AREA_M2, COHESION_KPA, PHI_DEG = 0.01, 2.0, 36.0
LOADS_KPA = (20.0, 60.0, 140.0)
#: Displacement in mm and shear stress over the peak.
WAY = ((0.0, 0.0), (0.4, 0.55), (0.9, 0.9), (1.5, 1.0), (3.0, 0.91), (5.0, 0.84))
HEAD = ["Shear displacement (mm)", "Shear force (N)"]


def force_n(load_kpa, part):
    return 1e3 * AREA_M2 * part * (COHESION_KPA + load_kpa * np.tan(np.radians(PHI_DEG)))


def readings(load_kpa, n=6):
    return [[x, round(force_n(load_kpa, part), 3)] for x, part in WAY[:n]]


def beside(tables, gap=0):
    """Rows of tables side by side, with `gap` empty columns between them; shorter ones end in empty cells."""
    widths = [max(map(len, table)) for table in tables]
    rows = []
    for parts in zip_longest(*tables, fillvalue=[]):
        cells = [[*part, *[""] * (width + gap - len(part))] for part, width in zip(parts, widths, strict=True)]
        rows.append([cell for some in cells for cell in some])
    return rows


def titled(title, head=HEAD, gap=0, loads=LOADS_KPA):
    """Tables below the rows of titles that `title(number, load)` gives."""
    return beside([[*title(k, p), head, *readings(p)] for k, p in enumerate(loads, 1)], gap)


def csv_file(folder, rows, mark=",", name="box.csv"):
    """Path of a text with these rows."""
    lines = io.StringIO()
    csv.writer(lines, delimiter=mark, lineterminator="\n").writerows(rows)
    (folder / name).write_text(lines.getvalue(), encoding="utf-8")
    return folder / name


def read(folder, rows, mark=",", name="box.csv", **entry):
    """The shear tests as they were understood."""
    if isinstance(rows, bytes):
        (folder / name).write_bytes(rows)
    else:
        csv_file(folder, rows, mark, name)
    more = "".join(f", {key}: {value}" for key, value in entry.items())
    (folder / "soil.yaml").write_text(f"direct_shear_csv: {{file: {name}, shear_area_m2: {AREA_M2}{more}}}\n")
    return understood(folder / "soil.yaml", soil_content(folder / "soil.yaml")[ENTRY])


def check(tests, n=3):
    """The tests are the plain ones: loads, peaks, numbers of readings."""
    assert [p for p, _ in tests.points.values()] == pytest.approx([1e3 * p for p in LOADS_KPA])
    assert tests.line.friction_angle_deg == pytest.approx(PHI_DEG, abs=1e-3)
    assert tests.line.cohesion_pa == pytest.approx(1e3 * COHESION_KPA, abs=0.5)
    assert f"{n} tables side by side" in tests.method


TITLES = [
    lambda k, p: [[f"Specimen {k}, normal stress: {p:g} kPa"]],
    lambda k, p: [[f"Specimen {k} - {p:g} kPa"]],
    lambda k, p: [[f"Test {k}", f"{p:g} kPa"]],
    lambda k, p: [["Specimen"], [f"σn = {p:g} kPa"]],
    lambda k, p: [["Normal stress (kPa)", f"{p:g}"]],
    lambda k, p: [[f"S{k}"], ["Vertical stress [kN/m²]", p], []],
    lambda k, p: [["Normal stress, kPa" if k == 1 else "", p]],
    lambda k, p: [["Direct shear of sand A" if k == 1 else ""], [""], [f"{1e-3 * p:g} MPa"]],
    lambda k, p: [["Normal force (N)" if k == 1 else "", 1e3 * AREA_M2 * p]],
]


@pytest.mark.parametrize("gap", [0, 1, 2])
@pytest.mark.parametrize("title", TITLES)
def test_the_load_of_each_table_stands_above_it(tmp_path, title, gap):
    check(read(tmp_path, titled(title, gap=gap)))


def test_the_load_is_a_column_of_each_table(tmp_path):
    tables = [[["Normal stress (kPa)", *HEAD], *([p, *row] for row in readings(p))] for p in LOADS_KPA]
    check(read(tmp_path, beside(tables, 1)))


def test_columns_that_are_not_read_belong_to_their_table(tmp_path):
    head = ["Time (min)", HEAD[0], "Vertical movement (mm)", HEAD[1], "Remark"]
    tables = [[[f"{p:g} kPa"], head, *([k, x, -0.01 * k, f, ""] for k, (x, f) in enumerate(readings(p)))] for p in LOADS_KPA]
    check(read(tmp_path, beside(tables, 1)))
    check(read(tmp_path, beside(tables)))


def test_one_column_of_displacements_serves_all(tmp_path):
    forces = zip(*(readings(p) for p in LOADS_KPA), strict=True)
    rows = [
        ["", *(f"{p:g} kPa" for p in LOADS_KPA)], [HEAD[0], *[HEAD[1]] * 3], *([row[0][0], *(f for _, f in row)] for row in forces),
    ]  # fmt: skip
    check(read(tmp_path, rows))
    with pytest.raises(CalibrationError, match="are both read as force"):
        read(tmp_path, [["", "raw", "corrected", "checked"], *rows[1:]])


def test_units_stand_in_a_row_of_their_own_and_headers_in_two(tmp_path):
    check(read(tmp_path, beside([[[f"{p:g} kPa"], ["Displacement", "Force"], ["mm", "N"], *readings(p)] for p in LOADS_KPA])))
    two = [[[f"{p:g} kPa"], ["Horizontal", "Horizontal"], ["movement (mm)", "load (N)"], *readings(p)] for p in LOADS_KPA]
    check(read(tmp_path, beside(two, 1)))


@pytest.mark.parametrize("mark", [";", "\t"])
def test_tables_of_different_lengths_end_in_empty_cells(tmp_path, mark):
    tables = [[[f"{p:g} kPa"], HEAD, *readings(p, n)] for p, n in zip(LOADS_KPA, (4, 6, 5), strict=True)]
    tests = read(tmp_path, beside(tables), mark)
    check(tests)
    assert [len(curve.shear) for curve in tests.curves] == [4, 6, 5]
    assert "empty rows" not in tests.method


def test_decimal_commas_between_semicolons(tmp_path):
    rows = [[str(cell).replace(".", ",") for cell in row] for row in titled(TITLES[0], gap=1)]
    check(read(tmp_path, rows, ";"))


def test_two_rows_of_tables(tmp_path):
    first = beside([[[f"{p:g} kPa"], HEAD, *readings(p)] for p in LOADS_KPA[:2]], 1)
    second = beside([[[f"{p:g} kPa"], HEAD, *readings(p)] for p in (LOADS_KPA[2], 200.0)], 1)
    tests = read(tmp_path, [*first, [], *second])
    assert [p for p, _ in tests.points.values()] == pytest.approx([20e3, 60e3, 140e3, 200e3])
    assert "4 tables side by side" in tests.method
    assert tests.line.friction_angle_deg == pytest.approx(PHI_DEG, abs=1e-3)


def test_repeats_under_one_title_stay_different_tests(tmp_path):
    tests = read(tmp_path, titled(lambda k, p: [[f"{p:g} kPa"]], loads=(*LOADS_KPA, 20.0)))
    assert list(tests.points) == ["20 kPa (1)", "60 kPa", "140 kPa", "20 kPa (4)"]


def test_means_below_are_those_of_all_tables(tmp_path):
    head = ["No.", *HEAD]
    tables = [[[f"{p:g} kPa"], head, *([k, *row] for k, row in enumerate(readings(p)))] for p in LOADS_KPA]
    rows = [*beside(tables), ["Max", 6.0, 9000.0, "", 6.0, 9000.0, "", 6.0, 9000.0]]
    check(read(tmp_path, rows))
    assert "rows of means and deviations left out" in read(tmp_path, rows).method


def test_words_of_the_user(tmp_path):
    rows = titled(lambda k, p: [[f"Auflast: {p:g} kPa"]], ["Weg [mm]", "Kraft [N]"])
    check(read(tmp_path, rows, columns="{displacement: Weg, force: Kraft, normal_stress: Auflast}"))
    named = [
        [f"Probe {k}: {p:g} kPa" for k, p in enumerate(LOADS_KPA, 1) for _ in HEAD],
        ["x1", "F1", "x2", "F2", "x3", "F3"],
        *rows[2:],
    ]
    named[0][1::2] = ["", "", ""]
    lists = "{displacement: {header: [x1, x2, x3], unit: mm}, force: {header: [F1, F2, F3], unit: N}}"
    with pytest.raises(CalibrationError, match="3 tables side by side, without a normal stress in number 1, 2, 3; allowed: a text"):
        read(tmp_path, named, columns=lists)  # "Probe" may be anything
    named[0] = [cell.replace("Probe", "Test") for cell in named[0]]
    check(read(tmp_path, named, columns=lists))


@pytest.mark.parametrize("merged", [False, True])
def test_a_workbook_has_its_titles_in_merged_cells(tmp_path, merged):
    book = openpyxl.Workbook()
    sheet = book.active
    for row in [["Sand A, shear box 100 mm"], [], *titled(lambda k, p: [[f"Specimen {k}"], [f"Normal stress {p:g} kPa"]], gap=1)]:
        sheet.append([None if cell == "" else cell for cell in row])
    for column in (1, 4, 7) if merged else ():
        for row in (3, 4):
            sheet.merge_cells(start_row=row, end_row=row, start_column=column, end_column=column + 1)
    if merged:
        sheet.merge_cells("A1:H1")
    book.save(tmp_path / "box.xlsx")
    tests = read(tmp_path, (tmp_path / "box.xlsx").read_bytes(), name="box.xlsx")
    check(tests)
    assert list(tests.points)[0] == "Specimen 1; Normal stress 20 kPa"


PLAIN = titled(TITLES[0])


@pytest.mark.parametrize(
    ("rows", "mark", "message"),
    [
        (titled(lambda k, p: [[f"Specimen {k}"]]), ",", "line 2: 3 tables side by side, without a normal stress in number 1, 2, 3"),
        (titled(lambda k, p: [[f"{p:g} kPa" if k < 3 else "?"]]), ",", "without a normal stress in number 3; allowed: a text such"),
        (titled(lambda k, p: [[f"peak {p:g} kPa"]]), ",", "without a normal stress in number 1, 2, 3"),
        (titled(lambda k, p: [[f"1 {p:g}0 kPa"]]), ",", "without a normal stress in number 1, 2, 3"),
        (titled(lambda k, p: [[f"Normal stress: {p:g},000 Pa"]]), ";", "table in line 2: '20,000'; allowed: a number whose"),
        (titled(lambda k, p: [[f"{p:g} kPa", "40 kPa"]]), ",", "line 2: .*20 kPa | 40 kPa.*; allowed: one normal stress"),
        ([*PLAIN[:4], [*PLAIN[4][:3], "x1", *PLAIN[4][4:]], *PLAIN[5:]], ",", r"line 5, column 'Shear force \(N\)': 'x1'"),
        ([*PLAIN[:4], [*PLAIN[4][:3], "", *PLAIN[4][4:]], *PLAIN[5:]], ",", r"line 5, column 'Shear force \(N\)': empty"),
        ([*PLAIN[:4], [*PLAIN[4], 7], *PLAIN[5:]], ",", "line 5: 7 cells; allowed: the header's 6, separated by commas"),
        ([["", *PLAIN[0]], ["Test", *PLAIN[1]], *([1, *row] for row in PLAIN[2:])], ",", "are both read as displacement"),
        (beside([titled(TITLES[1]), [[""], ["Force (N)"], *([1] for _ in WAY)]]), ",", "are both read as displacement"),
        (titled(lambda k, p: [[f"Normal stress (kPa): {p:g}, 60"]]), ",", "without a normal stress in number 1, 2, 3"),
    ],
)  # fmt: skip
def test_what_cannot_be_divided_is_refused_with_what_to_do(tmp_path, rows, mark, message):
    with pytest.raises(CalibrationError, match=message):
        read(tmp_path, rows, mark)


def test_one_table_may_be_chosen_by_its_columns(tmp_path):
    rows = titled(lambda k, p: [["", f"{p:g} kPa"]])
    numbered = {"displacement": {"column": 3}, "force": {"column": 4}}
    text = [["Run", 1, 2, 3], ["Normal stress: 60 kPa"], rows[1], *rows[2:], [], ["checked", "by", "N.", "N."]]
    table = read_laboratory(csv_file(tmp_path, text), CURVE, numbered, optional=BESIDE).table
    assert table["force_n"].tolist() == [f for _, f in readings(60.0)]
    assert set(table["normal_stress_pa"]) == {60e3}
    with pytest.raises(CalibrationError, match="line 6, column 'Shear displacement .*': 'then'; allowed: a number"):
        read_laboratory(csv_file(tmp_path, [*text[:5], ["", "", "then", "on"], *text[5:]]), CURVE, numbered, optional=BESIDE)
    with pytest.raises(CalibrationError, match="are both read as force"):
        read(tmp_path, rows, columns="{displacement: {column: 3}}")


def test_a_lost_cell_is_no_other_number(tmp_path):
    tables = [[[*HEAD, "Normal stress (kPa)"], *([*row, p] for row in readings(p))] for p in LOADS_KPA]
    for gap, message in (
        (0, "line 4, column 'Normal stress .*': empty; allowed: as many"),
        (1, "line 4, column 4: '0.9'; allowed: no"),
    ):
        rows = beside(tables, gap)
        check(read(tmp_path, rows))
        with pytest.raises(CalibrationError, match=message):
            read(tmp_path, [*rows[:3], rows[3][1:], *rows[4:]])  # a load would count as a force
        with pytest.raises(CalibrationError, match="line 4, column 'Normal stress .*': empty; allowed: as many"):
            read(tmp_path, [*rows[:3], [*rows[3][: -3 - gap], *rows[3][-2 - gap :]], *rows[4:]])
    rows = titled(TITLES[1], gap=1)
    with pytest.raises(CalibrationError, match="line 3, column 8: '.*'; allowed: no number"):
        read(tmp_path, [rows[0], [*rows[1][:5], *rows[1][6:]], *rows[2:]])  # a displacement would


def test_columns_by_blanks_have_equal_lengths(tmp_path):
    rows = [PLAIN[0][::2], *PLAIN[1:]]
    text = "\n".join("   ".join(map(str, row)) for row in rows)
    check(read(tmp_path, text.encode()))
    shorter = "\n".join(text.splitlines()[:-1] + ["   ".join(map(str, rows[-1][2:]))])
    with pytest.raises(CalibrationError, match="line 8: 4 cells; allowed: .* Tables of different lengths"):
        read(tmp_path, shorter.encode())
