"""AGS4 files: the set that the soil file chooses gives its strengths; what is ambiguous, damaged or exchanged is refused."""

import numpy as np
import pytest

from virtual_soil.calibration.errors import CalibrationError
from virtual_soil.campaign.soils import measure_soil

COHESION_KPA, PHI_DEG, RESIDUAL = 5.0, 31.0, 0.8
KEY = ["LOCA_ID", "SAMP_TOP", "SAMP_REF", "SAMP_TYPE", "SAMP_ID", "SPEC_REF", "SPEC_DPTH"]
KEY_UNITS, KEY_TYPES = ["", "m", "", "", "", "", "m"], ["ID", "2DP", "X", "PA", "ID", "X", "2DP"]
FIRST, SECOND = ["BH1", "2.50", "3", "U", "S-17", "1a", "2.60"], ["BH2", "4.00", "1", "B", "S-21", "1", "4.00"]


def peak_kpa(stress_kpa, phi_deg=PHI_DEG):
    return COHESION_KPA + stress_kpa * np.tan(np.radians(phi_deg))


def group(name, headings, units, types, rows):
    """Text of a group as the standard writes it."""
    lines = [["GROUP", name], ["HEADING", *headings], ["UNIT", *units], ["TYPE", *types], *(["DATA", *row] for row in rows)]
    return "\r\n".join(",".join('"' + str(cell).replace('"', '""') + '"' for cell in line) for line in lines) + "\r\n\r\n"


def stages(key, loads=(50, 100, 200), phi_deg=PHI_DEG):
    return [[*key, k, p, f"{peak_kpa(p, phi_deg):.4f}", f"{RESIDUAL * peak_kpa(p, phi_deg):.4f}"] for k, p in enumerate(loads, 1)]


def shbt(rows, units=("kPa", "kPa", "kPa"), types=("0DP", "4DP", "4DP")):
    headings = [*KEY, "SHBT_TESN", "SHBT_NORM", "SHBT_PEAK", "SHBT_RES"]
    return group("SHBT", headings, [*KEY_UNITS, "", *units], [*KEY_TYPES, "X", *types], rows)


def shbg(*keys):
    headings = [*KEY, "SHBG_TYPE", "SHBG_COND", "SHBG_PCOH", "SHBG_PHI"]
    rows = [[*key, "SMALL SBOX", "REMOULDED", "4.8", "31.2"] for key in keys]
    return group("SHBG", headings, [*KEY_UNITS, "", "", "kPa", "deg"], [*KEY_TYPES, "PA", "PA", "2SF", "1DP"], rows)


PROJECT = group("PROJ", ["PROJ_ID", "PROJ_NAME"], ["", ""], ["ID", "X"], [["7", 'Embankment "A", phase 2']])
PLAIN = PROJECT + shbg(FIRST) + shbt(stages(FIRST))
TWO = PROJECT + shbg(FIRST, SECOND) + shbt(stages(FIRST) + stages(SECOND, phi_deg=25.0))


def soil(folder, content, **entry):
    files = content if isinstance(content, dict) else {"site.ags": content}
    for name, text in files.items():
        (folder / name).write_bytes(text if isinstance(text, bytes) else text.encode())
    more = "".join(f", {key}: {value}" for key, value in entry.items())
    path = folder / "soil.yaml"
    path.write_text(f"direct_shear_csv: {{file: [{', '.join(files)}]{more}}}\n", encoding="utf-8")
    return measure_soil(path).set_index("property")


def test_the_only_set_of_a_file_gives_its_strengths(tmp_path):
    found = soil(tmp_path, PLAIN).loc["peak_friction_angle"]
    assert found["value"] == pytest.approx(PHI_DEG, abs=1e-3)
    for said in ("3 tests, peak, strengths as the file states them", "LOCA_ID BH1 SAMP_TOP 2.50", "SMALL SBOX", "REMOULDED"):
        assert said in found["method"]
    assert "the laboratory's own line 4.8 kPa and 31.2 deg, normal stresses SHBT_NORM" in found["method"]
    assert soil(tmp_path, PLAIN).loc["peak_cohesion", "value"] == pytest.approx(1e3 * COHESION_KPA, abs=0.1)


def test_the_steady_strength_is_the_residual(tmp_path):
    found = soil(tmp_path, PLAIN, strength="steady")
    assert found.loc["steady_cohesion", "value"] == pytest.approx(RESIDUAL * 1e3 * COHESION_KPA, abs=0.1)
    assert found.loc["steady_friction_angle", "value"] == pytest.approx(
        np.degrees(np.arctan(RESIDUAL * np.tan(np.radians(31.0)))), abs=1e-3
    )


def test_the_row_of_units_is_obeyed_column_by_column(tmp_path):
    rows = [[*row[:-2], f"{float(row[-2]) / 1e3:.7f}", f"{float(row[-1]) / 6.894757:.5f}"] for row in stages(FIRST)]
    found = soil(tmp_path, PROJECT + shbg(FIRST) + shbt(rows, units=("kN/m2", "MPa", "psi")))
    assert found.loc["peak_cohesion", "value"] == pytest.approx(1e3 * COHESION_KPA, abs=0.2)
    found = soil(tmp_path, PROJECT + shbg(FIRST) + shbt(rows, units=("kN/m2", "MPa", "psi")), strength="steady")
    assert found.loc["steady_cohesion", "value"] == pytest.approx(RESIDUAL * 1e3 * COHESION_KPA, abs=0.2)


def test_the_normal_stress_beside_a_strength_goes_before_the_nominal_one(tmp_path):
    headings = [*KEY, "SHBT_TESN", "SHBT_NORM", "SHBT_PEAK", "SHBT_PVST"]
    units, types = [*KEY_UNITS, "", "kPa", "kPa", "kPa"], [*KEY_TYPES, "X", "0DP", "4DP", "1DP"]
    rows = [[*FIRST, k, p, f"{peak_kpa(1.1 * p):.4f}", f"{1.1 * p:.1f}"] for k, p in enumerate((50, 100, 200), 1)]
    found = soil(tmp_path, group("SHBT", headings, units, types, rows)).loc["peak_friction_angle"]
    assert found["value"] == pytest.approx(PHI_DEG, abs=1e-3)
    assert "no group SHBG: kind of test not stated, normal stresses SHBT_PVST" in found["method"]
    rows[1][-1] = ""  # one is missing: the nominal stresses, for all
    assert "normal stresses SHBT_NORM" in soil(tmp_path, group("SHBT", headings, units, types, rows)).iloc[0]["method"]


@pytest.mark.parametrize("sample", ["{LOCA_ID: bh1}", "{SAMP_TOP: 2.5}", "{SAMP_REF: 3, SAMP_TYPE: U}", "{SAMP_ID: S-17}"])
def test_the_soil_file_chooses_a_set(tmp_path, sample):
    assert soil(tmp_path, TWO, sample=sample).loc["peak_friction_angle", "value"] == pytest.approx(PHI_DEG, abs=1e-3)
    assert soil(tmp_path, TWO, sample="{LOCA_ID: BH2}").loc["peak_friction_angle", "value"] == pytest.approx(25.0, abs=1e-3)


SPECIMENS = [[*FIRST[:5], f"{k}a", f"2.{k}0"] for k in (1, 2, 3)]


def test_specimens_with_a_set_each_are_one_line_where_the_soil_file_lists_them(tmp_path):
    rows = [row for key, load in zip(SPECIMENS, (50, 100, 200), strict=True) for row in stages(key, (load,))]
    text = PROJECT + shbg(*SPECIMENS) + shbt(rows)
    with pytest.raises(CalibrationError, match=r"\(SPEC_REF: '1a', SPEC_DPTH: '2.10'\), .*; allowed: one, chosen by `sample: "):
        soil(tmp_path, text)
    found = soil(tmp_path, text, sample="{SPEC_REF: [1a, 2a, 3a]}")
    assert found.loc["peak_friction_angle", "value"] == pytest.approx(PHI_DEG, abs=1e-3)
    with pytest.raises(CalibrationError, match="sample.SPEC_REF is '4a'; allowed: a set of the file"):
        soil(tmp_path, text, sample="{SPEC_REF: [1a, 2a, 3a, 4a]}")
    files = {
        f"{k}.ags": PROJECT + shbg(key) + shbt(stages(key, (load,)))
        for k, key, load in zip("123", SPECIMENS, (50, 100, 200), strict=True)
    }
    assert soil(tmp_path, files, sample="{SPEC_REF: [1a, 2a, 3a]}").loc["peak_friction_angle", "value"] == pytest.approx(
        PHI_DEG, abs=1e-3
    )


def test_stages_without_the_strength_are_left_out_and_counted(tmp_path):
    rows = [*stages(FIRST), [*FIRST, "4", 300, "", "120.0"]]
    found = soil(tmp_path, PROJECT + shbg(FIRST) + shbt(rows)).loc["peak_friction_angle"]
    assert found["value"] == pytest.approx(PHI_DEG, abs=1e-3)
    assert "3 tests" in found["method"]
    assert "1 stages without SHBT_PEAK left out" in found["method"]


def test_descriptions_in_other_groups_may_break_the_rules(tmp_path):
    geology = group("GEOL", ["LOCA_ID", "GEOL_DESC"], ["", ""], ["ID", "X"], [["BH1", "sand"]]).replace(
        '"sand"', '"2" gravel\r\nand sand"'
    )
    found = soil(tmp_path, (PROJECT + geology + shbg(FIRST) + shbt(stages(FIRST))).replace("sand", "50° sand").encode("latin-1"))
    assert found.loc["peak_friction_angle", "value"] == pytest.approx(PHI_DEG, abs=1e-3)


LAST = PLAIN.rstrip()


@pytest.mark.parametrize(
    ("text", "entry", "message"),
    [
        (TWO, {}, r"sets of shear tests is \(LOCA_ID: 'BH1', .*\), \(LOCA_ID: 'BH2', .*\); allowed: one, chosen by `sample"),
        (TWO, {"sample": "{LOCA_ID: BH3}"}, r"sample is \{'LOCA_ID': 'BH3'\}; allowed: a set of the file: \(LOCA_ID: 'BH1'"),
        (TWO, {"sample": "{HOLE_ID: BH1}"}, "sample is .*; allowed: a mapping of headings to their texts; headings: LOCA_ID"),
        (PLAIN, {"columns": "{force: a}"}, "columns is .*; allowed: none: an AGS4 file states its own"),
        (PLAIN, {"strength": "plateau"}, "strength is plateau; allowed: peak or steady: AGS4 holds no curves"),
        (PROJECT, {}, "groups is PROJ; allowed: SHBT among them"),
        (PROJECT + shbg(FIRST), {}, "SHBT among them; SHBG has cohesions and angles of friction only: give them as values"),
        (PROJECT + shbt([]), {}, "number of rows in SHBT is 0"),
        (PLAIN + shbt(stages(SECOND)), {}, "line 21: group SHBT is in line 13 already; allowed: once in a file"),
        (PLAIN.replace("SHBT_PEAK", "SHBT_NORM"), {}, "group SHBT is with heading SHBT_NORM twice"),
        (PLAIN.replace("SHBT_PEAK", "SHBT_PK"), {}, "headings of SHBT is .*SHBT_PK.*; allowed: SHBT_PEAK among them"),
        (PROJECT + shbt(stages(FIRST), units=("kPa", "", "kPa")), {}, "unit of SHBT_PEAK is ''; allowed: pa, hpa, kpa"),
        (PROJECT + shbt(stages(FIRST), units=("kPa", "mPa", "kPa")), {}, "unit of SHBT_PEAK is 'mPa'; allowed"),
        (PROJECT + shbt(stages(FIRST), types=("0DP", "X", "1DP")), {}, "type of SHBT_PEAK is 'X'; allowed: nDP"),
        (PLAIN.replace('"35.0430"', '"35,0430"'), {}, "line 17, SHBT_PEAK is '35,0430'; allowed: a number with a decimal point"),
        (PLAIN.replace('"35.0430"', '"<35"'), {}, "line 17, SHBT_PEAK is '<35'"),
        (PLAIN.replace('"50"', '""'), {}, "line 17, SHBT_NORM is ''"),
        (PLAIN.replace('"35.0430"', '"3.5"'), {}, "line 17, SHBT_RES is 28034.4 Pa; allowed: the peak, 3500 Pa, at most"),
        (PLAIN.replace('"2.60","2",', '"2.60","1",'), {}, "line 18: stage 1 of .* is in line 17 already; allowed: once"),
        (PROJECT + shbt(stages(FIRST)[:2] + 2 * [[*FIRST, "", 300, 185.0, 80.0]]), {}, "stage without a number .* already"),
        (LAST[:-3], {}, "line 19: .*; allowed: fields in double quotes, .* cut off"),
        (LAST[: LAST.rindex(",")], {}, "line 19: group SHBT: number of fields is 10; allowed: 11"),
        (PLAIN.replace('"', ""), {}, "line 1: 'GROUP,PROJ'; allowed: fields in double quotes"),
        (PLAIN.replace('"UNIT"', '"UNITS"'), {}, "first field is 'UNITS'; allowed: GROUP, HEADING, UNIT, TYPE or DATA"),
        (PROJECT + shbt(stages(FIRST)).replace('"UNIT"', '"DATA"'), {}, "with TYPE below its data"),
        (PLAIN.replace('"GROUP"', '"DATA"', 1), {}, "line 1: first field is 'DATA'"),
        ('"**SHBT"\n"*HOLE_ID","*SHBT_NORM"\n', {}, "line 1 is of an AGS 3 file; allowed: AGS4"),
        ("", {}, "number of groups is 0"),
        (b"\0\1", {}, "not a text file"),
        ({"a.ags": PLAIN, "b.csv": "x"}, {}, "file is a.ags, b.csv; allowed: AGS4 files alone"),
        ({"a.ags": PLAIN, "b.ags": PLAIN}, {}, "b.ags, line 17: stage 1 of .* is in line 17 already"),
        ({"a.csv": "x"}, {"sample": "{LOCA_ID: BH1}"}, "sample is .*; allowed: none: it is no AGS4 file"),
    ],
)
def test_what_is_ambiguous_or_damaged_is_refused_in_one_line(tmp_path, text, entry, message):
    with pytest.raises(CalibrationError, match=message) as caught:
        soil(tmp_path, text, **entry)
    assert len(str(caught.value).splitlines()) == 1
