"""Files of measurements: what is read, and every fault in one line that names file, line, value and what is allowed."""

import copy
import math
from pathlib import Path

import pandas as pd
import pytest

from virtual_soil.calibration.errors import CalibrationError
from virtual_soil.campaign.sections import Study
from virtual_soil.campaign.settings import defaults
from virtual_soil.wheel.measurements import checked_files, read_plates, read_wheel, sd_name

ROOT = Path(__file__).parents[2]
EXAMPLES = ROOT / "config/measured"
SHARED = ROOT.parent / "shared/wheel-data"
HEAD = "slip,load_n,drawbar_pull_n,drawbar_pull_sd_n,torque_n_m,sinkage_m"
PLATES = "diameter_m,sinkage_m,pressure_pa,pressure_sd_pa"
RADIUS_M, LOAD_N, GRAVITY_M_S2 = 0.058, 24.5, 9.81


@pytest.fixture
def written(tmp_path):
    """Write lines to a file; its path."""

    def write(*lines):
        path = tmp_path / "tests.csv"
        path.write_text("\n".join(lines) + "\n", encoding="utf-8")
        return path

    return write


def test_a_row_that_stands_alone_keeps_its_deviation(written):
    path = written("# somebody's tests", HEAD, "0.5,25.0,1.0,0.25,0.6,0.02", "", "-0.2,25.0,-7.5,,,0.015")
    braked, driven = read_wheel(path, RADIUS_M, LOAD_N).to_dict("records")
    assert (braked["slip"], driven["slip"]) == (-0.2, 0.5)
    assert (driven["drawbar_pull_n"], driven["drawbar_pull_sd_n"], driven["n_tests"]) == (1.0, 0.25, 1)
    assert driven["drawbar_ratio"] == pytest.approx(0.04)
    assert driven["drawbar_ratio_sd"] == pytest.approx(0.01)
    assert driven["traction_coefficient"] == pytest.approx(0.6 / (25.0 * RADIUS_M))
    assert math.isnan(braked["torque_n_m"])
    assert math.isnan(braked["drawbar_pull_sd_n"])
    assert math.isnan(driven["sinkage_sd_m"])


def test_repeated_tests_have_a_mean_and_their_own_deviation(written):
    path = written("slip;load_n;sinkage_m;sinkage_sd_m", "-0.001;20;0.010;0.5e-3", "0.002;30;0.014;0.5e-3", "0.1;25;0.02;")
    repeated, single = read_wheel(path, RADIUS_M, LOAD_N).to_dict("records")
    assert (repeated["slip"], repeated["n_tests"], repeated["load_n"]) == (0.0, 2, 25.0)
    assert str(repeated["slip"]) == "0.0"  # not -0.0
    assert repeated["sinkage_m"] == pytest.approx(0.012)
    assert repeated["sinkage_sd_m"] == pytest.approx(0.004 / math.sqrt(2.0))
    assert single["slip"] == 0.1


def test_the_deviation_of_a_ratio_has_that_of_the_load(written):
    path = written("slip,load_n,load_sd_n,drawbar_pull_n,drawbar_pull_sd_n", "0.5,25,5,10,0")
    assert read_wheel(path, RADIUS_M, LOAD_N)["drawbar_ratio_sd"].tolist() == pytest.approx([0.4 * 0.2])


def test_plates_are_sorted_by_diameter_and_sinkage(written):
    lines = ("0.1,0.02,40e3,", "0.06,0.02,20e3,1e3", "0.06,0.01,8e3,", "0.1,0.02,44e3,")
    table = read_plates(written(PLATES, *lines), GRAVITY_M_S2)
    assert table["diameter_m"].tolist() == [0.06, 0.06, 0.1]
    assert table["sinkage_m"].tolist() == [0.01, 0.02, 0.02]
    assert table["pressure_pa"].tolist() == [8e3, 20e3, 42e3]
    assert table["pressure_sd_pa"].iloc[1:].tolist() == pytest.approx([1e3, 4e3 / math.sqrt(2.0)])
    assert table["n_tests"].tolist() == [1, 1, 2]


@pytest.mark.parametrize(
    ("row", "message"),
    [
        ("0.5,25,1,,0.6,15", r"line 2: sinkage_m is 15; allowed: 0 to the wheel's radius, 0\.058 m, downwards"),
        ("0.5,25,1,,0.6,-0.02", r"line 2: sinkage_m is -0\.02; allowed: 0 to the wheel's radius"),
        ("50,25,1,,0.6,0.02", r"line 2: slip is 50; allowed: from -1 \(locked\) to below 1 .*; a share, not per cent"),
        ("1,25,1,,0.6,0.02", "line 2: slip is 1; allowed: from -1"),
        ("-1.2,25,-9,,-0.6,0.02", r"line 2: slip is -1\.2; allowed: from -1"),
        ("0.5,2.5,1,,0.6,0.02", r"line 2: load_n is 2\.5; allowed: within 25 % of wheel\.load_n, 24\.5 N"),
        ("0.5,25,970,,0.6,0.02", r"line 2: drawbar_pull_n is 970; allowed: up to 50 either way"),
        ("0.5,25,1,,600,0.02", r"line 2: torque_n_m is 600; allowed: up to 2\.9 either way"),
        (
            "-0.2,25,7.3,0.4,,0.015",
            r"line 2: drawbar_pull_n is 7\.3; allowed: negative of a braked wheel \(slip -0\.2\): forces of",
        ),
        ("0.5,25,1,,-0.6,0.02", r"line 2: torque_n_m is -0\.6; allowed: positive of a driven wheel \(slip 0\.5\): forces of"),
        ("0.5,25,1,-0.1,0.6,0.02", r"line 2: drawbar_pull_sd_n is -0\.1; allowed: zero to 25"),
        ("0.5,25,1,300,0.6,0.02", r"line 2: drawbar_pull_sd_n is 300; allowed: zero to 25"),
        ("0.5,,1,,0.6,0.02", r"line 2: load_n is ''; allowed: a number\."),
        ("0.5,25,one,,0.6,0.02", r"line 2: drawbar_pull_n is 'one'; allowed: a number, or nothing"),
        ("0.5,25,inf,,0.6,0.02", r"line 2: drawbar_pull_n is 'inf'; allowed: a number"),
        ("0.5,25,1,,0.6", r"line 2: number of cells is 5; allowed: 6, as in line 1"),
    ],
)
def test_a_wheels_row_that_cannot_be_meant_is_refused_with_its_line(written, row, message):
    with pytest.raises(CalibrationError, match=rf"tests\.csv, {message}") as refusal:
        read_wheel(written(HEAD, row), RADIUS_M, LOAD_N)
    assert "\n" not in str(refusal.value)


@pytest.mark.parametrize("row", ["-0.001,25,0.9,,,", "-0.2,25,3.0,2.0,,", "0.01,25,,,-0.05,"])
def test_a_sign_within_the_scatter_is_no_fault(written, row):
    assert len(read_wheel(written(HEAD, row), RADIUS_M, LOAD_N)) == 1


@pytest.mark.parametrize(
    ("lines", "message"),
    [
        (
            ["slip,load_n,sinkage_mm", "0,25,15"],
            r"line 1: column 'sinkage_mm' is unknown; allowed: slip, load_n, .*; all in SI units",
        ),
        (["slip,sinkage_m", "0,0.015"], r"line 1: column 'load_n' is missing; allowed: slip, load_n"),
        (["slip,load_n,sinkage_m,slip", "0,25,0.015,0"], r"line 1: column 'slip' is there 2 times; allowed: once"),
        (["slip,load_n", "0,25"], r": measured quantities is none; allowed: at least one column of drawbar_pull_n"),
        (["slip,load_n,sinkage_m"], r": number of rows is 0; allowed: a line of column names, and a row at least"),
        (["# nothing"], r": number of rows is 0"),
    ],
)
def test_a_wheels_file_without_its_columns_is_refused(written, lines, message):
    with pytest.raises(CalibrationError, match=message):
        read_wheel(written(*lines), RADIUS_M, LOAD_N)


def test_a_file_that_is_not_there_is_refused_in_one_line(tmp_path):
    with pytest.raises(CalibrationError, match=r"none\.csv: cannot be read"):
        read_wheel(tmp_path / "none.csv", RADIUS_M, LOAD_N)


@pytest.mark.parametrize(
    ("row", "message"),
    [
        ("60,0.01,8e3,", r"diameter_m is 60; allowed: 0\.001 to 2, in metres"),
        ("0.06,10,8e3,", r"sinkage_m is 10; allowed: 0 to the plate's diameter, 0\.06 m"),
        ("0.06,0.01,-8e3,", r"pressure_pa is -8000; allowed: zero or more"),
        ("0.06,0.01,7.7,", r"pressure_pa is 7\.7; allowed: 98\.1 to 1e\+07 at this sinkage, in pascals"),
        ("0.06,0.01,7.7e9,", r"pressure_pa is 7\.7e\+09; allowed: 98\.1 to 1e\+07"),
        ("0.06,0.01,8e3,-1", r"pressure_sd_pa is -1; allowed: zero to 8000"),
    ],
)
def test_a_plates_row_that_cannot_be_meant_is_refused(written, row, message):
    with pytest.raises(CalibrationError, match=rf"tests\.csv, line 2: {message}"):
        read_plates(written(PLATES, row), GRAVITY_M_S2)


def test_a_curve_may_begin_with_nothing_but_not_end_in_kilopascals(written):
    assert len(read_plates(written(PLATES, "0.06,0,0,", "0.06,0.001,2,", "0.06,0.02,19e3,"), GRAVITY_M_S2)) == 3
    with pytest.raises(CalibrationError, match=r"line 3: pressure_pa is 35; allowed: 196"):
        read_plates(written(PLATES, "0.1,0.01,13.6,", "0.1,0.02,35,"), GRAVITY_M_S2)


def test_the_deviations_column_has_its_word_before_the_unit():
    names = [sd_name(name) for name in ("load_n", "torque_n_m", "sinkage_m", "pressure_pa", "drawbar_ratio")]
    assert names == ["load_sd_n", "torque_sd_n_m", "sinkage_sd_m", "pressure_sd_pa", "drawbar_ratio_sd"]


def sections(**changes):
    """Sections wheel and plate with changed keys; changes : dotted key with _ for the dot -> value."""
    study = copy.deepcopy(defaults(Study))
    for key, value in changes.items():
        *parents, last = key.split("__")
        target = study
        for parent in parents:
            target = target[parent]
        target[last] = value
    return study["wheel"], study["plate"], GRAVITY_M_S2


def test_the_studys_own_files_are_sound():
    wheel, plates = str(EXAMPLES / "cmu_wheel.csv"), str(EXAMPLES / "cmu_plates.csv")
    named = {"wheel__measured__file": wheel, "wheel__measured__source": "a", "plate__measured__file": plates}
    named |= {"plate__measured__source": "b", "wheel__handbook__internal_friction_angle_deg": 29.0}
    assert checked_files(*sections(**named)) == [wheel, plates]
    assert checked_files(*sections()) == []


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"wheel__measured__file": "a.csv"}, r"wheel\.measured\.source is None; allowed: a text that says where a\.csv comes from"),
        ({"plate__measured__source": "a"}, r"plate\.measured\.file is None; allowed: a file, as there is a source"),
        ({"plate__measured__compared_m": [0.02, 0.01]}, r"plate\.measured\.compared_m is \[0\.02, 0\.01\]; allowed: a lower"),
        (
            {"wheel__handbook__internal_friction_angle_deg": 30.0},
            r"wheel\.handbook\.plates is measured; allowed: measured with plate\.measured\.file, or simulated",
        ),
        (
            {
                "wheel__handbook__internal_friction_angle_deg": 30.0,
                "wheel__handbook__plates": "simulated",
                "plate__diameters_m": [],
            },
            r"wheel\.handbook\.plates is simulated; allowed",
        ),
    ],
)
def test_sections_that_do_not_fit_together_are_refused(changes, message):
    with pytest.raises(CalibrationError, match=message):
        checked_files(*sections(**changes))


@pytest.mark.skipif(not SHARED.is_dir(), reason="the published tests are not there")
def test_the_example_files_are_the_means_of_the_published_tests(tmp_path):
    """The conversion of docs/guides/wheel.md, and what the example files round of it."""
    runs, plates = pd.read_csv(SHARED / "single-wheel.csv"), pd.read_csv(SHARED / "plate-sinkage.csv")
    runs["sinkage_m"] = 1e-3 * runs["sinkage_mm"]
    runs[["slip", "load_n", "drawbar_pull_n", "sinkage_m"]].to_csv(tmp_path / "wheel.csv", index=False)
    converted = {"diameter_m": "plate_diameter_mm", "sinkage_m": "sinkage_mm", "pressure_pa": "pressure_kpa"}
    factors = {"diameter_m": 1e-3, "sinkage_m": 1e-3, "pressure_pa": 1e3}
    pd.DataFrame({new: factors[new] * plates[old] for new, old in converted.items()}).to_csv(tmp_path / "plates.csv", index=False)
    whole, example = (read_wheel(folder, RADIUS_M, LOAD_N) for folder in (tmp_path / "wheel.csv", EXAMPLES / "cmu_wheel.csv"))
    for name, step in (("load_n", 0.01), ("drawbar_pull_n", 0.01), ("sinkage_m", 1e-4)):
        for column in (name, sd_name(name)):
            assert example[column].to_numpy() == pytest.approx(whole[column].to_numpy(), abs=0.51 * step)
    pressures = read_plates(tmp_path / "plates.csv", GRAVITY_M_S2)
    both = read_plates(EXAMPLES / "cmu_plates.csv", GRAVITY_M_S2).merge(pressures, on=["diameter_m", "sinkage_m"])
    assert len(both) == 12
    for column in ("pressure_pa", "pressure_sd_pa"):
        assert both[f"{column}_x"].to_numpy() == pytest.approx(both[f"{column}_y"].to_numpy(), abs=0.51, nan_ok=True)
