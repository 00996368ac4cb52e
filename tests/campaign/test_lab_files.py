"""Layouts and habits of laboratory files: each gives the right strength, with what was done said, or is refused with what to do."""

import importlib.util
from pathlib import Path

import numpy as np
import pytest

from virtual_soil.calibration.errors import CalibrationError
from virtual_soil.campaign.soils import measure_soil

SHARED = Path(__file__).parents[3] / "shared" / "lab-files"
AREA_M2, COHESION_PA, SLOPE = 0.0036, 800.0, np.tan(np.radians(34.0))
LOADS_KPA = (25.0, 50.0, 100.0, 200.0)
#: Displacement in mm and shear stress over the peak of every test.
WAY = ((0.0, 0.0), (0.5, 0.62), (1.0, 0.93), (2.0, 1.0), (4.0, 0.88), (6.0, 0.86))
HEADER = ["Test", "Normal stress (kPa)", "Horizontal displacement (mm)", "Shear force (N)"]


def peak_n(load_kpa):
    return AREA_M2 * (COHESION_PA + 1e3 * load_kpa * SLOPE)


def plain():
    """Rows (test, load, displacement, force) of four tests."""
    return [[k, load, x, part * peak_n(load)] for k, load in enumerate(LOADS_KPA, 1) for x, part in WAY]


def written(rows, header=HEADER, mark=","):
    return "\n".join(mark.join(f"{cell:.6g}" if isinstance(cell, float) else str(cell) for cell in row) for row in [header, *rows])


def by_test(make):
    """Rows of every test from `make(number, load, its plain rows)`."""
    rows = plain()
    return [row for k, load in enumerate(LOADS_KPA, 1) for row in make(k, load, [row for row in rows if row[0] == k])]


def soil(folder, content, name="box.csv", area=AREA_M2, **entry):
    names = content if isinstance(content, dict) else {name: content}
    for file, text in names.items():
        (folder / file).write_bytes(text if isinstance(text, bytes) else text.encode())
    files = list(names) if len(names) > 1 else f"'{name}'"
    more = "".join(f", {key}: {value}" for key, value in entry.items())
    path = folder / "soil.yaml"
    path.write_text(f"direct_shear_csv: {{file: {files}, shear_area_m2: {area}{more}}}\n")
    return measure_soil(path).set_index("property")


def consolidated(k, load, rows):
    return [[k, load * part, 1e-4 * part, 0.0] for part in (0.0, 0.3, 0.6, 1.0)] + rows


def unloaded(k, load, rows):
    return [*rows, [k, load, 5.9, 0.3 * peak_n(load)], [k, 0.2 * load, 5.8, 0.0]]


def there_and_back(k, load, rows):
    back = [[k, load, x, -0.7 * peak_n(load)] for x, _ in reversed(WAY)]
    return [*rows, *back, *([k, load, x, 0.6 * part * peak_n(load)] for x, part in WAY)]


def paused(k, load, rows):
    return [*rows[:3], *([k, load, 1.0, part * peak_n(load)] for part in (0.9, 0.87, 0.86)), *rows[3:]]


def spiked(k, load, rows):
    return [*rows[:5], [k, load, 5.0, 3.0 * peak_n(load)] if k == 2 else [k, load, 5.0, 0.87 * peak_n(load)], *rows[5:]]


@pytest.mark.parametrize(
    ("rows", "said"),
    [
        (plain(), "direct shear, 4 tests, peak"),
        (by_test(consolidated), "readings before or after the shearing left out"),
        (by_test(unloaded), "readings before or after the shearing left out"),
        (by_test(there_and_back), "first pass forward of 4 tests that go back"),
        (by_test(paused), "4 tests, peak"),
        (by_test(spiked), "1 single readings far above their neighbours left out"),
        ([[k, p, x, f + 12.0] for k, p, x, f in plain()], "the force at the first reading taken as zero"),
        ([[k, p, x, -f] for k, p, x, f in plain()], "their sign reversed"),
        ([[k, p, x, 3.0 + 0.2 * k - f] for k, p, x, f in plain()], "their sign reversed"),
        ([[k, p, 20.0 - x, f] for k, p, x, f in plain()], "4 tests, peak"),
        ([[f"#{k}", p, x, f] for k, p, x, f in plain()], "4 tests"),
        ([[f"{k}.0" if x else k, p, x, f] for k, p, x, f in plain()], "4 tests"),
        ([[k if not x else "", p if not x else "", x, f] for k, p, x, f in plain()], "40 empty cells filled from above"),
        ([*plain(), ["", "", "", ""], ["Tested by", "N. N.", "Checked", "M. M."]], "1 rows of text below the readings left out"),
        (
            by_test(lambda k, load, rows: [*rows, ["Mean", load, 2.0, 0.5 * peak_n(load)]]),
            "4 rows of means and deviations left out",
        ),
        (by_test(lambda k, load, rows: rows if k == 1 else [[], HEADER, *rows]), "3 empty rows skipped"),
        ([["", "kPa", "mm", "N"], *plain()], "4 tests, peak"),
    ],
)
def test_what_loggers_write_is_read_and_what_was_done_is_said(tmp_path, rows, said):
    found = soil(tmp_path, written(rows))
    assert found.loc["friction_angle", "value"] == pytest.approx(34.0, abs=0.02)
    assert found.loc["cohesion", "value"] == pytest.approx(COHESION_PA, abs=20.0)
    assert said in found.loc["cohesion", "method"]


def without_test_column(header, rows):
    """A table for each test, with a title and without the columns of test and load."""
    blocks = []
    for k, load in enumerate(LOADS_KPA, 1):
        own = [row[2:] for row in rows if row[0] == k]
        blocks.append(f"Specimen {k}, Normal stress: {load:g} kPa\n\n{written(own, header[2:])}\n")
    return "\n".join(blocks)


@pytest.mark.parametrize(
    "text",
    [
        written(plain()).replace(",", ";").replace(".", ","),
        written(plain(), mark="   "),
        written(plain(), [HEADER[0], '"Normal\nstress (kPa)"', '"Horizontal\ndisplacement (mm)"', HEADER[3]]),
        written([["No.", "stress (kPa)", "displacement (mm)", "force (N)"], *plain()], ["Test", "Normal", "Horizontal", "Shear"]),
        without_test_column(HEADER, plain()),
        written([[k, 1e3 * p * AREA_M2, x, f] for k, p, x, f in plain()], ["Test", "Normal force (N)", *HEADER[2:]]),
        written([[k, p, x, 1e-3 * f / AREA_M2] for k, p, x, f in plain()], [*HEADER[:3], "Shear stress (kPa)"]),
        written(
            [[k, p / 95.76052, x / 25.4, f / 4.448222 / 1e3] for k, p, x, f in plain()],
            ["Test", "Normal stress (tsf)", "Horizontal displacement (in.)", "Shear force (kips)"],
        ),
        written(
            [[k, p / 98.0665, x, f / 4.448222] for k, p, x, f in plain()],
            ["Sample No.", "Vertical stress [kg/cm2]", "Horiz. displacement [mm]", "Horiz. force [lbs]"],
        ),
    ],
)
def test_the_same_tests_in_every_layout_give_the_same_strength(tmp_path, text):
    found = soil(tmp_path, text)
    assert found.loc["friction_angle", "value"] == pytest.approx(34.0, abs=0.03)
    assert found.loc["cohesion", "value"] == pytest.approx(COHESION_PA, abs=30.0)
    assert "4 tests" in found.loc["cohesion", "method"]


def test_one_specimen_a_file_is_a_list_of_files(tmp_path):
    files = {}
    for k, load in enumerate(LOADS_KPA, 1):
        own = [row[2:] for row in plain() if row[0] == k]
        files[f"s{k}.csv"] = f"BS 1377\nSample No.,S{k},Normal stress,{load:g},kPa\n\n{written(own, HEADER[2:])}"
    found = soil(tmp_path, files)
    assert found.loc["friction_angle", "value"] == pytest.approx(34.0, abs=0.02)
    assert found.loc["friction_angle", "source"] == "s1.csv, s2.csv, s3.csv, s4.csv"


def test_strengths_without_curves_are_taken_as_stated(tmp_path):
    rows = [[load, 1e-3 * peak_n(load) / AREA_M2] for load in LOADS_KPA]
    found = soil(tmp_path, written(rows, ["Normal stress (kPa)", "Peak shear stress (kPa)"]))
    assert found.loc["peak_friction_angle", "value"] == pytest.approx(34.0, abs=0.02)
    assert "strengths as the file states them" in found.loc["cohesion", "method"]
    with pytest.raises(CalibrationError, match="no line is a header with a column for displacement"):
        soil(tmp_path, written(rows, ["Normal stress (kPa)", "Peak shear stress (kPa)"]), strength="steady")


@pytest.mark.parametrize("column", ["{header: Force gauge, unit: N, factor: 0.5}", "{column: 4, unit: N, factor: 0.5}"])
def test_a_proving_ring_has_a_factor(tmp_path, column):
    rows = [[k, p, x, 2.0 * f] for k, p, x, f in plain()]
    found = soil(tmp_path, written(rows, [*HEADER[:3], "Force gauge (div)"]), columns=f"{{force: {column}}}")
    assert found.loc["friction_angle", "value"] == pytest.approx(34.0, abs=0.02)


def test_two_columns_of_one_name_are_told_apart_by_number(tmp_path):
    text = written([[k, p, x, x, f] for k, p, x, f in plain()], [*HEADER[:3], HEADER[2], HEADER[3]])
    with pytest.raises(CalibrationError, match=r"\(column 3\) and .* \(column 4\) are both read as displacement; .* by its number"):
        soil(tmp_path, text)
    assert soil(tmp_path, text, columns="{displacement: {column: 4}}").loc["friction_angle", "value"] == pytest.approx(
        34.0, abs=0.02
    )


def test_an_encoding_may_be_named(tmp_path):
    text = written(plain(), ["試料", *HEADER[1:]]).encode("shift_jis")
    found = soil(tmp_path, text, encoding="shift_jis", columns="{test: 試料}")
    assert found.loc["friction_angle", "value"] == pytest.approx(34.0, abs=0.02)
    with pytest.raises(CalibrationError, match="not a text in encoding 'klingon'"):
        soil(tmp_path, text, encoding="klingon")


@pytest.mark.skipif(importlib.util.find_spec("openpyxl") is None, reason="needs openpyxl")
def test_a_workbook_is_read_by_its_sheet(tmp_path):
    import openpyxl

    book = openpyxl.Workbook()
    book.active.title = "notes"
    sheet = book.create_sheet("shear")
    for row in [["Shear box", None, None, None], HEADER, *plain()]:
        sheet.append(row)
    book.save(tmp_path / "box.xlsx")
    content = (tmp_path / "box.xlsx").read_bytes()
    assert soil(tmp_path, content, "box.xlsx", sheet="shear").loc["friction_angle", "value"] == pytest.approx(34.0, abs=0.02)
    with pytest.raises(CalibrationError, match=r"box.xlsx: sheet is None; allowed: one of notes, shear"):
        soil(tmp_path, content, "box.xlsx")
    with pytest.raises(CalibrationError, match="cannot be read as a workbook"):
        soil(tmp_path, b"PK\x03\x04", "box.xlsx")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            written([[k, 50.0 + 0.01 * k, x, f] for k, p, x, f in plain()]),
            "number of distinct normal stresses is 1; allowed: at least 3; stresses closer than 2% are one",
        ),
        (written([row[2:] for row in plain()], HEADER[2:]), "normal stress is in no column and no title"),
        (written([[k, p, x, "x1" if x == 2.0 else f] for k, p, x, f in plain()]), r"line 5, column 'Shear force \(N\)': 'x1'"),
        (
            written([[k, p, x, "broken" if x == 2.0 else f] for k, p, x, f in plain()]),
            r"line 5, column 'Shear force \(N\)': 'broken'; allowed: a number",
        ),
        (written([[k, p, x, "" if x == 2.0 else f] for k, p, x, f in plain()]), r"line 5, column 'Shear force \(N\)': empty"),
        (
            written([["", "kPa", "cm", "N"], *plain()]),
            r"line 2, column 'Horizontal displacement \(mm\)': 'cm'; allowed: the header's",
        ),
    ],
)
def test_what_is_ambiguous_or_broken_is_refused_with_what_to_do(tmp_path, text, message):
    with pytest.raises(CalibrationError, match=message):
        soil(tmp_path, text)


def test_curves_that_begin_with_their_strength_keep_their_zero(tmp_path):
    rows = [[k, p, x, peak_n(p)] for k, p, x, _ in plain()]
    assert soil(tmp_path, written(rows)).loc["friction_angle", "value"] == pytest.approx(34.0, abs=0.02)


def heaps(folder, text, **entry):
    (folder / "heaps.csv").write_text(text)
    more = "".join(f", {key}: {value}" for key, value in entry.items())
    path = folder / "soil.yaml"
    path.write_text(f"repose_csv: {{file: heaps.csv{more}}}\n")
    return measure_soil(path).iloc[0]


WIDE = """condition,trial_1_deg,trial_2_deg,trial_3_deg,average_deg
Quartz sand,27.6,32.3,29.4,29.77
Glass beads,22.1,18.8,16.4,19.10
"""
TRIALS = "{angle_of_repose: {header: [trial_1_deg, trial_2_deg, trial_3_deg]}}"


@pytest.mark.parametrize(
    ("text", "entry", "mean", "n"),
    [
        ("Heap,Angle of repose (deg)\n1,31.5\n2,33.0\n3,32.1\nMean,32.2\nStd,0.75\n", {}, 32.2, 3),
        ("heap,left (deg.),right (deg.)\n1,31,33\n2,30,34\n3,29,31\n", {}, 94 / 3, 3),
        ("heap,height (mm),diameter (mm)\n1,50,173.205\n2,50,173.205\n3,51,173.205\n", {}, 30.16, 3),
        (WIDE, {"columns": TRIALS, "rows": "{condition: quartz sand}"}, 29.77, 3),
    ],
)
def test_heaps_in_every_form(tmp_path, text, entry, mean, n):
    found = heaps(tmp_path, text, **entry)
    assert found["value"] == pytest.approx(mean, abs=0.01)
    assert f"mean of {n} heaps" in found["method"]
    assert found["standard_uncertainty"] > 0.0


@pytest.mark.parametrize(
    ("text", "entry", "message"),
    [
        (WIDE, {"columns": TRIALS}, "soils is 'Glass beads', 'Quartz sand'; allowed: one, chosen by `rows"),
        (WIDE, {"columns": TRIALS, "rows": "{condition: gravel}"}, "number of rows with {'condition': 'gravel'} is 0"),
        ("Angle (deg)\n32.2\n32.2\n32.2\n", {}, "3 times 32.2 deg; allowed: those of single heaps, not a mean repeated"),
        ("heap,left (deg)\n1,31\n", {}, "no line is a header with a column for angle_of_repose"),
    ],
)
def test_heaps_of_several_soils_and_means_in_their_place_are_refused(tmp_path, text, entry, message):
    with pytest.raises(CalibrationError, match=message):
        heaps(tmp_path, text, **entry)


#: What the shared files' README says is right: friction angle and cohesion, or the words of the refusal.
PEAK, PLATEAU = (34.0, 800.0), (30.12, 687.0)
RIGHT = {
    "00-plain": PEAK, "00-plain-plateau": PLATEAU, "01-consolidation-stage": PEAK, "02-negative-force-offset": PEAK,
    "02-tare": PEAK,
    "03-reversal": PLATEAU, "04-label-hash": PEAK, "07-one-nominal-stress": "number of distinct normal stresses is 1",
    "08-blocks-with-title": PEAK, "08-footer": PEAK, "08-header-in-two-lines": PEAK, "08-merged-cells": PEAK,
    "08-repeated-header": PEAK, "08-same-header-twice": "by its number", "09-own-header-underscore": PEAK, "09-units-twice": PEAK,
    "10-bs1377-form": "number of distinct normal stresses is 1", "10-peaks-only": PEAK, "10-shear-stress-column": PEAK,
    "11-us-units": PEAK, "16-braces": PEAK, "06-heaps-wide": "chosen by `rows",
}  # fmt: skip


@pytest.mark.skipif(not SHARED.is_dir(), reason="needs the shared laboratory files")
@pytest.mark.parametrize("name", RIGHT)
def test_the_shared_files_are_read_right_or_refused(name):
    right = RIGHT[name]
    if isinstance(right, str):
        with pytest.raises(CalibrationError, match=right):
            measure_soil(SHARED / f"{name}.yaml")
        return
    found = measure_soil(SHARED / f"{name}.yaml").set_index("property")["value"]
    assert found["friction_angle"] == pytest.approx(right[0], abs=0.1)
    assert found["cohesion"] == pytest.approx(right[1], abs=50.0)


@pytest.mark.skipif(not SHARED.is_dir(), reason="needs the shared laboratory files")
def test_the_shared_heaps_have_their_means_left_out():
    row = measure_soil(SHARED / "05-heaps-mean-row.yaml").set_index("property").loc["angle_of_repose"]
    assert row["value"] == pytest.approx(32.23, abs=0.01)
    assert "2 rows of means and deviations left out" in row["method"]
