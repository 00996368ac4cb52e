"""Step 1: soils from values and from laboratory files."""

from pathlib import Path

import numpy as np
import pytest

from virtual_soil.calibration.errors import CalibrationError
from virtual_soil.calibration.noise import student
from virtual_soil.campaign.soils import laboratory_files, measure_soil

EXAMPLE = Path(__file__).parents[2] / "config/soils/example/example.yaml"

VALUES = """
cohesion_pa: {value: 24.0, source: book}
friction_angle_deg: {value: 26.6, source: book, standard_uncertainty: 1.5}
angle_of_repose_deg: {value: 30.0, source: book}
"""


def write(folder, text, name="sand.yaml"):
    path = folder / name
    path.write_text(text)
    return path


def test_values_are_taken_over_with_their_source(tmp_path):
    table = measure_soil(write(tmp_path, VALUES)).set_index("property")
    assert table.loc["friction_angle", ["value", "standard_uncertainty", "unit", "source", "soil"]].tolist() == [
        26.6, 1.5, "deg", "book", "sand",
    ]  # fmt: skip
    assert np.isnan(table.loc["cohesion", "standard_uncertainty"])


@pytest.mark.parametrize(
    ("strength", "prefixes", "slope"), [("peak", ("", "peak_"), 0.7), ("plateau", ("",), 0.6), ("steady", ("steady_",), 0.6)]
)
def test_laboratory_shear_tests_and_heaps_give_values_with_errors(tmp_path, strength, prefixes, slope):
    rows = ["test,normal_stress_pa,displacement_m,force_n"]
    for k, p in enumerate((10e3, 20e3, 40e3, 80e3)):
        for step in range(21):
            peak = 0.7 if step == 4 else min(0.15 * step, 0.6)
            rows.append(f"{k},{p},{step * 1e-4},{(50 + peak * p) * 0.0036}")
    write(tmp_path, "\n".join(rows), "shear.csv")
    write(tmp_path, "angle_of_repose_deg\n29.0\n31.0\n30.0\n", "heaps.csv")
    text = f"""
direct_shear_csv: {{file: shear.csv, shear_area_m2: 0.0036, strength: {strength}}}
repose_csv: {{file: heaps.csv}}
"""
    table = measure_soil(write(tmp_path, text)).set_index("property")
    names = [f"{prefix}{name}" for prefix in prefixes for name in ("cohesion", "friction_angle")]
    assert sorted(table.index) == sorted([*names, "angle_of_repose"])
    for prefix in prefixes:
        assert table.loc[f"{prefix}cohesion", "value"] == pytest.approx(50.0)
        assert np.tan(np.radians(table.loc[f"{prefix}friction_angle", "value"])) == pytest.approx(slope)
    assert table["strength"].to_dict() == {**dict.fromkeys(names, strength), "angle_of_repose": ""}
    assert table.loc["angle_of_repose", ["value", "standard_uncertainty"]].tolist() == pytest.approx(
        [30.0, student(2) / np.sqrt(3)]
    )


def test_a_dry_sands_intercept_may_lie_below_zero_by_its_own_error_but_not_by_more(tmp_path):
    def sheared(offset, scatter):
        loads = np.array([1e3, 2e3, 3e3, 4e3])
        forces = 0.6 * loads - offset + scatter * np.array([1.0, -1.0, -1.0, 1.0])
        rows = [f"{k},{p},{x},{f}" for k, (p, f) in enumerate(zip(loads, forces, strict=True)) for x in (0.0, 1.0)]
        write(tmp_path, "\n".join(["test,normal_stress_pa,displacement_m,force_n", *rows]), "shear.csv")
        text = "direct_shear_csv: {file: shear.csv, shear_area_m2: 1.0}\nangle_of_repose_deg: {value: 30.0, source: book}\n"
        return measure_soil(write(tmp_path, text)).set_index("property").loc["cohesion"]

    row = sheared(offset=100.0, scatter=60.0)
    assert -2 * row["standard_uncertainty"] < row["value"] < 0
    with pytest.raises(CalibrationError, match="cohesion_pa is -3.*within two standard errors of zero"):
        sheared(offset=400.0, scatter=20.0)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (VALUES.replace("24.0", "-1.0"), "cohesion_pa is -1.0; allowed: zero or more"),
        (VALUES.replace("26.6", "95.0"), "friction_angle_deg is 95.0; allowed: above 0 and below 90 deg"),
        (VALUES.replace("30.0", "thirty"), "angle_of_repose_deg.value is 'thirty'; allowed: a number"),
        (VALUES.replace(", source: book}", "}", 1), "cohesion_pa.source is missing"),
        (VALUES + "colour: grey\n", r"keys \['colour'\] is unknown"),
        ("{}", "sand.yaml is no response; allowed: at least one of angle_of_repose_deg"),
        (
            VALUES.replace("26.6", "0.46"),
            "friction_angle_deg is 0.46; allowed: usually 1 to 75 deg; if it is meant, add `insist: true`",
        ),
        (VALUES.replace("30.0", "80.0"), "angle_of_repose_deg is 80; allowed: usually 1 to 75 deg"),
        (
            VALUES.replace("source: book}", "source: book, insist: maybe}", 1),
            "cohesion_pa.insist is 'maybe'; allowed: true or false",
        ),
        ("direct_shear_csv: {file: ../outside.csv, shear_area_m2: 1}", "file is ../outside.csv; allowed: a file beside"),
    ],
)
def test_an_impossible_soil_is_refused_with_key_value_and_what_is_allowed(tmp_path, text, message):
    with pytest.raises(CalibrationError, match=message):
        measure_soil(write(tmp_path, text))


def test_a_bad_number_in_a_laboratory_file_is_named_with_its_line(tmp_path):
    write(tmp_path, "angle_of_repose_deg\n29.0\n31;0\n", "heaps.csv")
    text = VALUES.replace("angle_of_repose_deg:", "# ") + "repose_csv: {file: heaps.csv}\n"
    with pytest.raises(CalibrationError, match=r"heaps.csv, line 3, column 'angle_of_repose_deg': '31;0'"):
        measure_soil(write(tmp_path, text))


@pytest.mark.parametrize(
    ("points", "message"),
    [
        ([(1e3, 1e3), (2e3, 1e3), (3e3, 1e3)], r"shear.csv: \(normal stress, strength\) in Pa is .* differ clearly"),
        ([(1e5, 1.0), (1e5 + 1e-5, 2.0), (1e5 + 2e-5, 3.0)], r"shear.csv: number of distinct normal stresses is 1; .* are one"),
        ([(1e3, 1e3), (2e3, 2e3)], "shear.csv: number of distinct normal stresses is 2; allowed: at least 3"),
        (
            [(1e3, -1e3), (2e3, 2e3), (3e3, 3e3)],
            "shear.csv: peak shear strength of test '0' is -1000 Pa; allowed: .* units and signs",
        ),
        ([(1e12, 1e3), (2e3, 2e3), (3e3, 3e3)], "shear.csv: normal stress of test '0' is 1e"),
    ],
)
def test_shear_tests_that_make_no_line_are_refused(tmp_path, points, message):
    rows = [f"{k},{p!r},{x},{f!r}" for k, (p, f) in enumerate(points) for x in (0.0, 1.0)]
    write(tmp_path, "\n".join(["test,normal_stress_pa,displacement_m,force_n", *rows]), "shear.csv")
    text = "direct_shear_csv: {file: shear.csv, shear_area_m2: 1.0}\nangle_of_repose_deg: {value: 30.0, source: book}\n"
    with pytest.raises(CalibrationError, match=message):
        measure_soil(write(tmp_path, text))


def test_skipped_rows_are_counted_in_the_method(tmp_path):
    write(tmp_path, "Angle of repose [deg];note\n29,5;dry\n;\n30,5;dry\n", "heaps.csv")
    text = VALUES.replace("angle_of_repose_deg:", "# ") + "repose_csv: {file: heaps.csv}\n"
    row = measure_soil(write(tmp_path, text)).set_index("property").loc["angle_of_repose"]
    assert row["value"] == 30.0
    assert row["method"] == "mean of 2 heaps, 1 empty rows skipped"


def test_the_example_is_read_and_says_that_it_is_synthetic():
    table = measure_soil(EXAMPLE).set_index("property")
    assert [path.name for path in laboratory_files(EXAMPLE)] == ["shear_box.csv"]
    assert table["source"].str.contains("synthetic").all()
    assert (
        abs(table.loc["cohesion", "value"] - 800.0) < 2 * table.loc["cohesion", "standard_uncertainty"]
    )  # it was made with 800 Pa
    assert table.loc["friction_angle", "value"] == pytest.approx(34.0, abs=1.5)


def test_whoever_insists_may_have_unusual_numbers(tmp_path):
    text = VALUES.replace("value: 30.0, source: book", "value: 80.0, source: book, insist: true")
    assert measure_soil(write(tmp_path, text)).set_index("property").loc["angle_of_repose", "value"] == 80.0
    rows = [f"{k},{p},{x},{0.6 * p * 3600}" for k, p in enumerate((1e3, 2e3, 4e3)) for x in (0.0, 1.0)]
    write(tmp_path, "\n".join(["test,normal_stress_pa,displacement_m,force_n", *rows]), "shear.csv")
    area = "direct_shear_csv: {file: shear.csv, shear_area_m2: 3600}\n"
    with pytest.raises(CalibrationError, match="direct_shear_csv.shear_area_m2 is 3600; allowed: usually 0.0001 to 10 m2"):
        measure_soil(write(tmp_path, area))
    assert len(measure_soil(write(tmp_path, area.replace("}", ", insist: true}")))) == 4


@pytest.mark.parametrize(
    ("n", "slope", "said"), [(40, 0.0, "4 tests, steady"), (40, 0.02, "4 tests, steady; in 4 of them it still changes at the end")]
)
def test_a_laboratory_strength_that_still_changes_is_said_to(tmp_path, n, slope, said):
    rng = np.random.default_rng(1)
    rows = ["test,normal_stress_pa,displacement_m,force_n"]
    for k, p in enumerate((10e3, 20e3, 40e3, 80e3)):
        rows += [f"{k},{p},{1e-4 * i},{p * (0.6 + slope * i / 10 + 1e-3 * rng.standard_normal()) * 0.0036}" for i in range(n)]
    write(tmp_path, "\n".join(rows), "shear.csv")
    text = "direct_shear_csv: {file: shear.csv, shear_area_m2: 0.0036, strength: steady}\n"
    assert set(measure_soil(write(tmp_path, text))["method"]) == {f"direct shear, {said}"}


def test_a_curve_too_short_to_be_steady_is_refused(tmp_path):
    rows = [f"{k},{p},{x},{0.6 * p}" for k, p in enumerate((1e3, 2e3, 4e3)) for x in range(10)]
    write(tmp_path, "\n".join(["test,normal_stress_pa,displacement_m,force_n", *rows]), "shear.csv")
    text = "direct_shear_csv: {file: shear.csv, shear_area_m2: 1.0, strength: steady}\n"
    with pytest.raises(
        CalibrationError, match="shear.csv: test '0': the curve has 10 samples; .* or another `strength`: peak, plateau"
    ):
        measure_soil(write(tmp_path, text))
    with pytest.raises(CalibrationError, match="direct_shear_csv.strength is 'highest'; allowed: peak or plateau or steady"):
        measure_soil(write(tmp_path, text.replace("steady", "highest")))


@pytest.mark.parametrize(
    "text",
    [
        "cohesion_pa: {value: 1e3, source: book}",
        "cohesion_pa: {value: 30.0, source: book, standard_uncertainty: 1e3}",
        "direct_shear_csv: {file: shear.csv, shear_area_m2: 1e3}",
        "direct_shear_csv: {file: shear.csv, shear_area_m2: 0.0036, columns: {force: {header: F, factor: 1e3}}}",
        "repose_csv: {file: heaps.csv, columns: {angle_of_repose: {header: A, factor: 1e3}}}",
        "repose_test: {fill_height_m: 1e3}",
        "shear_test: {normal_stresses_pa: [1e3, 2e3, 4e3]}",
    ],
)
def test_every_number_of_a_soil_file_that_yaml_takes_for_a_text_is_refused_with_how_to_write_it(tmp_path, text):
    write(tmp_path, "test,normal_stress_pa,displacement_m,F\n1,1000,0.0,1.0\n1,1000,0.001,2.0\n", "shear.csv")
    write(tmp_path, "A\n29.0\n31.0\n", "heaps.csv")
    given = "" if text.startswith("cohesion_pa") else "cohesion_pa: {value: 30.0, source: book}\n"
    with pytest.raises(CalibrationError, match=r"\(YAML reads this as a text; write 1000 or 1\.0e\+3\)"):
        measure_soil(write(tmp_path, given + text))
