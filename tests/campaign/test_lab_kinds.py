"""Files as other laboratories would write them: languages, encodings, units, instruments, labels, repeats, spikes, statistics."""

import numpy as np
import pytest

from virtual_soil.calibration.errors import CalibrationError
from virtual_soil.campaign.laboratory.quantities import UNITS, is_statistic, unit_key
from virtual_soil.campaign.soils import measure_soil

AREA_M2, COHESION_KPA, PHI_DEG = 0.01, 3.0, 33.0
LOADS_KPA = (30.0, 75.0, 150.0)
WAY = ((0.0, 0.0), (0.3, 0.5), (0.8, 0.85), (1.6, 1.0), (2.8, 0.92), (4.2, 0.85), (5.6, 0.83))


def tau_kpa(load_kpa, part=1.0):
    return part * (COHESION_KPA + load_kpa * np.tan(np.radians(PHI_DEG)))


def table(header, row, mark=",", loads=LOADS_KPA):
    """Lines of a table of all tests; row(number, load in kPa, displacement in mm, shear stress in kPa) gives the cells."""
    rows = [row(k, p, x, tau_kpa(p, part)) for k, p in enumerate(loads, 1) for x, part in WAY]
    return "\n".join(
        [header, *(mark.join(f"{cell:.7g}" if isinstance(cell, float) else str(cell) for cell in some) for some in rows)]
    )


def measured(folder, text, written_in="utf-8", name="box.csv", **entry):
    (folder / name).write_bytes(text.encode(written_in))
    more = "".join(f", {key}: {value}" for key, value in entry.items())
    content = f"direct_shear_csv: {{file: {name}, shear_area_m2: {AREA_M2}{more}}}\n"
    (folder / "soil.yaml").write_text(content, encoding="utf-8")
    return measure_soil(folder / "soil.yaml").set_index("property")


def check(found, n=3, c_pa=1e3 * COHESION_KPA, phi_deg=PHI_DEG):
    assert found.loc["friction_angle", "value"] == pytest.approx(phi_deg, abs=0.01)
    assert found.loc["cohesion", "value"] == pytest.approx(c_pa, abs=10.0)
    assert f"direct shear, {n} tests" in found.loc["cohesion", "method"]


JAPANESE = {
    "encoding": "cp932",
    "columns": "{test: 供試体番号, normal_stress: 垂直応力, displacement: せん断変位, shear_stress: せん断応力}",
}


def test_a_japanese_sheet_names_its_encoding_and_columns(tmp_path):
    header = "供試体番号,垂直応力（kN/m2）,せん断変位（㎜）,せん断応力（ｋＰａ）"
    text = "一面せん断試験,,,\n試料,豊浦砂,,\n" + table(header, lambda k, p, x, tau: [f"No.{k}", p, x, tau])
    check(measured(tmp_path, text, "cp932", **JAPANESE))
    check(measured(tmp_path, text.replace("㎜", "mm"), "shift_jis", **{**JAPANESE, "encoding": "shift_jis"}))
    with pytest.raises(CalibrationError, match="no line is a header .*, or as `columns`, and `encoding`, in the soil file say"):
        measured(tmp_path, text, "cp932", columns=JAPANESE["columns"])
    symbols = text.replace("（ｋＰａ）", "（ｋＰａ）\n(記号),σ,δ,τ")
    with pytest.raises(CalibrationError, match="line 4, column '垂直応力.*': 'σ'; allowed: a number"):
        measured(tmp_path, symbols, "cp932", **JAPANESE)


RUSSIAN = "{test: Образец, normal_stress: Вертикальное давление, displacement: Перемещение, shear_stress: Касательное напряжение}"


def test_a_russian_sheet_has_cyrillic_units_and_decimal_commas(tmp_path):
    header = "Образец;Вертикальное давление, МПа;Перемещение, мм;Касательное напряжение, кПа;Примечание"
    text = table(header, lambda k, p, x, tau: [f"обр. {k}", 1e-3 * p, x, tau, ""], ";").replace(".", ",").replace("обр,", "обр.")
    text += "\n\nИспытал;Н. Н.;;;\n"
    found = measured(tmp_path, text, "cp1251", encoding="cp1251", columns=RUSSIAN)
    check(found)
    assert "1 rows of text below the readings left out" in found.loc["cohesion", "method"]
    wrong = text.replace("МПа", "мПа")
    with pytest.raises(CalibrationError, match="has the unit 'мПа'; allowed: pa, hpa"):
        measured(tmp_path, wrong, "cp1251", encoding="cp1251", columns=RUSSIAN)


LB, IN2, FT2 = 4.4482216, 0.0254**2, 0.3048**2
AMERICAN = [
    ("Test No.,Normal Stress (ksf),Horiz. Disp. (in.),Shear Load (lbs.)",
     lambda k, p, x, tau: [k, p / 47.88026, x / 25.4, 1e3 * tau * AREA_M2 / LB]),
    ("Specimen,Vertical Stress [tsf],Lateral Displacement [in],Shear Stress [psi]",
     lambda k, p, x, tau: [f"#{k}", p / 95.76052, x / 25.4, tau / 6.894757]),
    ("Sample No.,Normal Load / kips,Shear Disp. / inches,Shear Load / kips",
     lambda k, p, x, tau: [f"#S-{k}", 1e3 * p * AREA_M2 / LB / 1e3, x / 25.4, 1e3 * tau * AREA_M2 / LB / 1e3]),
    ("Test,Normal stress (kg/sq. cm),Displacement (cm),Shear stress (kg/cm²)",
     lambda k, p, x, tau: [k, p / 98.0665, x / 10.0, tau / 98.0665]),
    ("Test,Normal stress (lb/sq.in),Displacement (ft),Shear stress (tons/sq ft)",
     lambda k, p, x, tau: [k, p / 6.894757, x / 304.8, tau / 95.76052]),
]  # fmt: skip


@pytest.mark.parametrize(("header", "row"), AMERICAN)
def test_units_of_the_united_states_and_of_kilogram_force(tmp_path, header, row):
    check(measured(tmp_path, table(header, row)))


def test_every_spelling_of_a_unit_is_one_that_is_known():
    spelled = {
        "lbs.": ("force", LB), "kg/sq.cm": ("stress", 98066.5), "lbs/sq ft": ("stress", LB / FT2),
        "lb/sq. in.": ("stress", LB / IN2),
        "kips/ft²": ("stress", 1e3 * LB / FT2), "㎜": ("length", 1e-3), "ｋＰａ": ("stress", 1e3), "кгс/см2": ("stress", 98066.5),
        "µm": ("length", 1e-6), "deg.": ("angle", 1.0),
    }  # fmt: skip
    for text, (kind, factor) in spelled.items():
        assert UNITS[kind][unit_key(text)] == pytest.approx(factor, rel=1e-6)


DIVISIONS = (
    "{normal_stress: {header: Lever load, unit: kPa, factor: 10}, displacement: {header: Dial, unit: mm, factor: 0.01}, "
    "force: {header: Ring, unit: N, factor: 1.74}}"
)


def test_dial_gauge_and_proving_ring_are_read_in_divisions(tmp_path):
    text = table(
        "Test,Lever load (kg),Dial (div.),Ring (divs)", lambda k, p, x, tau: [k, p / 10.0, 100.0 * x, 1e3 * tau * AREA_M2 / 1.74]
    )
    check(measured(tmp_path, text, columns=DIVISIONS))
    with pytest.raises(CalibrationError, match=r"column 'Shear force \(div\)' has the unit 'div'; allowed: .*factor"):
        measured(
            tmp_path,
            text.replace("Ring (divs)", "Shear force (div)").replace("Dial (div.)", "Displacement (mm)"),
            columns="{normal_stress: {header: Lever load, unit: kPa, factor: 10}}",
        )


HEADER = "Test,Normal stress (kPa),Displacement (mm),Shear stress (kPa)"


def plain(k, p, x, tau):
    return [k, p, x, tau]


@pytest.mark.parametrize("label", ["#{}", "# {}", "#S-{}", "№{}", "# {}a", "'{}"])
def test_labels_with_a_number_sign_are_no_comments(tmp_path, label):
    text = table(HEADER, lambda k, p, x, tau: [label.format(k), p, x, tau])
    check(measured(tmp_path, "# logger 7, checked\n" + text.replace("\n#", "\n# a remark\n#", 1)))


BLANKS = [
    ("test sigma_n_kpa displacement_mm shear_stress_kpa", " "),
    ("# test normal_stress_kpa displacement_mm tau_kpa", " "),
    ("% test\tnormal_stress_kpa\tdisplacement_mm\ttau_kpa", "\t"),
    ("// Test  Normal stress (kPa)  Displacement (mm)  Shear stress (kPa)", "  "),
    ("   Test    Normal stress (kPa)   Displacement (mm)     Shear stress (kPa)", "  "),
    ("   Test    Normal stress (kPa)   Displacement (mm)     Shear stress (kPa)", " "),
]


@pytest.mark.parametrize(("header", "mark"), BLANKS)
def test_columns_by_blanks(tmp_path, header, mark):
    check(measured(tmp_path, "# written by a logger\n\n" + table(header, plain, mark)))


def test_repeats_are_numbered_anew_under_each_load(tmp_path):
    loads = [load + 0.1 * k for load in LOADS_KPA for k in (0, 1)]
    text = table(HEADER, lambda k, p, x, tau: [f"repeat {1 + (k - 1) % 2}", p, x, tau], loads=loads)
    found = measured(tmp_path, text)
    check(found, n=6)
    assert "6 tests with a label in common told apart by their loads" in found.loc["cohesion", "method"]
    text = table(HEADER, lambda k, p, x, tau: [k, p, x, tau], loads=[50.0, 50.3, 49.6, 50.1])
    with pytest.raises(CalibrationError, match="number of distinct normal stresses is 1; allowed: at least 3"):
        measured(tmp_path, text)


def test_a_second_run_under_the_same_load_is_no_other_test(tmp_path):
    again = [(k, p, x, 0.6 * tau_kpa(p, part)) for k, p in enumerate(LOADS_KPA, 1) for x, part in WAY]
    lines = table(HEADER, plain).splitlines()
    rows = [lines[0]]
    for k in range(3):
        rows += lines[1 + 7 * k : 8 + 7 * k] + [",".join(map(str, row)) for row in again[7 * k : 7 * k + 7]]
    found = measured(tmp_path, "\n".join(rows))
    check(found)
    assert "first pass forward of 3 tests that go back" in found.loc["cohesion", "method"]
    assert "told apart" not in found.loc["cohesion", "method"]


def test_a_last_reading_after_the_way_back_is_no_test(tmp_path):
    lines = table(HEADER, plain).splitlines()
    for k, _ in enumerate(LOADS_KPA, 1):
        last = max(place for place, line in enumerate(lines) if line.startswith(f"{k},"))
        lines.insert(last + 1, f"{k},0.0,0.0,0.0")
    check(measured(tmp_path, "\n".join(lines)))


@pytest.mark.parametrize(
    ("factor", "said"),
    [(4.0, "1 single readings far above their neighbours left out"), (0.0, "1 single zeros between readings left out")],
)
def test_one_reading_of_a_disturbed_gauge_does_not_count(tmp_path, factor, said):
    lines = table(HEADER, plain).splitlines()
    cells = lines[13].split(",")
    without = measured(tmp_path, "\n".join(lines[:13] + lines[14:]), strength="plateau")
    lines[13] = ",".join([*cells[:3], f"{factor * float(cells[3]):.6g}"])
    found = measured(tmp_path, "\n".join(lines), strength="plateau")
    assert found.loc["cohesion", "value"] == pytest.approx(without.loc["cohesion", "value"], rel=1e-9)
    assert said in found.loc["cohesion", "method"]


@pytest.mark.parametrize(
    "word", ["Mean", "S.D.", "St. dev.", "C.V. (%)", "Arithmetic mean", "Mittel", "Écart-type", "平均", "Avg. of 3"]
)
def test_a_word_of_statistics_says_that_its_row_summarises(tmp_path, word):
    assert is_statistic(word)
    (tmp_path / "heaps.csv").write_text(f"Heap,Angle of repose (deg.)\n1,31.0\n2,33.0\n3,32.0\n{word},12.0\n", encoding="utf-8")
    (tmp_path / "soil.yaml").write_text("repose_csv: {file: heaps.csv}\n")
    found = measure_soil(tmp_path / "soil.yaml").iloc[0]
    assert found["value"] == pytest.approx(32.0)
    assert "1 rows of means and deviations left out" in found["method"]


@pytest.mark.parametrize("label", ["Meander sand", "S1", "C 3", "CI 2", "Dense", "1"])
def test_a_label_is_no_word_of_statistics(label):
    assert not is_statistic(label)


def test_trials_in_columns_belong_to_one_quantity(tmp_path):
    text = table(
        "Test,Normal stress (kPa),Displacement (mm),Raw (kPa),Corrected (kPa)", lambda k, p, x, tau: [k, p, x, tau, 0.9 * tau]
    )
    with pytest.raises(CalibrationError, match="columns of each quantity is .*'shear_stress': 2.*; allowed: as many headers"):
        measured(tmp_path, text, columns="{shear_stress: {header: [Raw, Corrected], unit: kPa}}")


def test_a_load_at_the_end_of_a_row_holds_on_only_in_a_cell_of_its_own(tmp_path):
    header = "Test,Displacement (mm),Shear stress (kPa),Normal stress (kPa),Remark"
    merged = table(header, lambda k, p, x, tau: [k, x, tau, "" if x else p, ""])
    check(measured(tmp_path, merged))
    lines = merged.splitlines()
    lines[3] = lines[3].removeprefix("1,")  # all other cells would be read one column to the left
    with pytest.raises(CalibrationError, match="line 4, column 'Normal stress .kPa.': empty; allowed: as many cells as the header"):
        measured(tmp_path, "\n".join(lines))


def test_a_head_states_one_load(tmp_path):
    lines = table("Displacement (mm),Shear stress (kPa)", lambda k, p, x, tau: [x, tau], loads=LOADS_KPA[:1])
    with pytest.raises(
        CalibrationError, match=r"normal stress above line 4 is \[25000.0, 50000.0\]; allowed: one value, or a column"
    ):
        measured(tmp_path, f"Stage 1,Normal stress,25 kPa\nStage 2,Normal stress,50 kPa\n\n{lines}")
