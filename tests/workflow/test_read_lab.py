"""What is understood of laboratory files is printed and drawn, before a study exists and in its report."""

import subprocess
import sys

import pytest
from campaign import ENVIRONMENT, ROOT

from virtual_soil.calibration.errors import CalibrationError
from virtual_soil.report.laboratory import draw_tests, laboratory_of
from virtual_soil.report.read_lab import read_lab

EXAMPLE = ROOT / "config" / "soils" / "example" / "example.yaml"


def test_a_soil_file_is_printed_with_its_tests_and_drawn(tmp_path):
    text = "\n".join(read_lab(EXAMPLE, None, tmp_path / "drawn"))
    assert "peak_friction_angle" in text
    assert "peak: c = 770 " in text
    assert len([line for line in text.splitlines() if line[:2].strip().isdigit()]) == 4
    assert "<svg" in (tmp_path / "drawn" / "example.svg").read_text()


def test_what_does_not_count_is_grey_and_what_counts_coloured(tmp_path):
    rows = [
        f"{k},{p},{x},{f * p}" for k, p in enumerate((10e3, 20e3, 40e3), 1) for x, f in ((0, 0), (1e-3, 1e-3), (2e-3, 2e-3), (0, 0))
    ]
    (tmp_path / "box.csv").write_text("\n".join(["test,normal_stress_pa,displacement_m,force_n", *rows]))
    (tmp_path / "clay.yaml").write_text("direct_shear_csv: {file: box.csv, shear_area_m2: 0.0036}\n")
    (tests,) = laboratory_of([str(tmp_path / "clay.yaml")]).values()
    assert [len(curve.shear) for curve in tests.curves] == [3, 3, 3]
    curves = draw_tests({"clay": tests}).axes[0].lines
    assert len(curves[0].get_xdata()) == 12  # all readings
    assert [len(line.get_xdata()) for line in curves[1::2]] == [3, 3, 3]


def test_an_ags_file_is_printed_and_its_strength_line_drawn(tmp_path):
    rows = [("GROUP", "SHBT"), ("HEADING", "LOCA_ID", "SHBT_TESN", "SHBT_NORM", "SHBT_PEAK"), ("UNIT", "", "", "kPa", "kPa")]
    rows += [("TYPE", "ID", "X", "0DP", "0DP"), *(("DATA", "BH1", f"s{k}", f"{50 * k}", f"{10 + 30 * k}") for k in (1, 2, 4))]
    (tmp_path / "site.ags").write_text("\n".join(",".join(f'"{cell}"' for cell in row) for row in rows))
    text = "\n".join(read_lab(tmp_path / "site.ags", None, tmp_path / "drawn"))
    assert "peak: c = 1e+04 +- " in text
    assert "phi = 30.96 +- " in text
    assert [line.split()[0] for line in text.splitlines() if line.startswith("s")] == ["s1", "s2", "s4"]
    picture = (tmp_path / "drawn" / "site.svg").read_text()
    assert "strength (kPa)" in picture
    assert "displacement (mm)" not in picture


def test_values_alone_have_nothing_to_draw(tmp_path):
    path = tmp_path / "sand.yaml"
    path.write_text("angle_of_repose_deg: {value: 30.0, source: book}\n")
    assert read_lab(path, None, tmp_path / "drawn") == ["angle_of_repose               30 deg   value"]
    assert laboratory_of([str(path)]) == {}
    assert not (tmp_path / "drawn").exists()


def test_a_file_alone_needs_the_area_of_its_box():
    box = EXAMPLE.with_name("shear_box.csv")
    with pytest.raises(CalibrationError, match="shear_area_m2 is None; allowed: a positive number: the file has forces"):
        read_lab(box, None)
    command = [sys.executable, "-m", "virtual_soil.report.read_lab", str(box)]
    result = subprocess.run(command, cwd=ROOT, env=ENVIRONMENT, capture_output=True, text=True, check=False)
    assert result.returncode == 1
    assert "Traceback" not in result.stderr
