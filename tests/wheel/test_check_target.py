"""The target `check_wheel_soil`: what it plans, what it refuses, and a toy from a calibration to its page."""

import math

import pandas as pd
import pytest
from made_up_runs import rows
from test_wheel_target import SUBMIT, TOY, calibration, planned, snakemake

from virtual_soil.campaign.tables import read_table

#: One case, calibrated by its angle of repose alone, with heaps of few grains.
HEAPS = {
    "experiments": ["repose"],
    "soils": ["silica_barco_sand"],
    "optimise": {"cases": [{"case": "sand", "soil": "silica_barco_sand", "weights": {"angle_of_repose": 1.0}}]},
    "repose": {"n_particles": 120, "tube_diameter_ratio": 5.0},
    "twins": {},
}
NONE = dict.fromkeys(
    ("finer_grains_factor", "speed_factor", "stiffness_factor", "width_factor", "wheel_static_friction", "wheel_rolling_friction"),
    None,
)


@pytest.fixture
def study(tmp_path, monkeypatch):
    """Folder of a toy study that is calibrated, whose heaps have 30 +- 0.2 deg at the optimum."""
    for name, section in HEAPS.items():
        monkeypatch.setitem(TOY, name, section)
    monkeypatch.setitem(TOY, "wheel_check", {})
    calibration(tmp_path / "results/toy/calibration.parquet")
    told(tmp_path, n_seeds=[10])
    return tmp_path


def told(folder, **changes):
    """Write the table of a made-up verification."""
    values = {"case": ["sand"], "response": ["angle_of_repose"], "unit": ["deg"], "prediction": ["confirmed"], "match": ["matches"]}
    values |= {"simulated": [30.0], "simulated_se": [0.2], "predicted": [31.0], "predicted_se": [0.4]} | changes
    rows("verification", **values).to_parquet(folder / "results/toy/verification.parquet")


def test_beds_are_prepared_anew_only_for_changes_of_the_bed(study):
    result = snakemake(study, "-n", "check_wheel_soil", wheel_check={"bed_seeds": [1, 2], "test_seeds": [1, 2, 3]})
    text = result.stdout + result.stderr
    assert result.returncode == 0, text
    jobs = planned(text)
    expected = {"prepare_bed": 2, "lower_wheel": 2, "drive_wheel": 2, "prepare_changed_bed": 6}
    expected |= {"lower_changed_wheel": 12, "drive_changed_wheel": 12}
    expected |= {"simulate_wheel_tests": 3, "measure_wheel_tests": 1, "check_report": 1}
    assert {name: jobs.get(name) for name in expected} == expected
    assert not {"simulate", "verify", "calibrate", "wheel_report"} & set(jobs)
    beds = "8 beds of 1 900 to 4 690 grains"  # the finer ones
    runs = "14 lowerings of the wheel, 14 runs of the wheel"
    assert f"check_wheel_soil (not part of `all`): {beds}, {runs}, 3 tests of the calibration: about " in text


def test_a_bed_of_finer_grains_asks_for_more_memory(study):
    kernels = study / "results/toy/wheel/kernels.txt"
    kernels.parent.mkdir(parents=True, exist_ok=True)
    kernels.touch()
    cluster = ("--executor", "cluster-generic", "--cluster-generic-submit-cmd", SUBMIT, "--jobs", "9", "--keep-going")
    snakemake(study, *cluster, "check_wheel_soil", wheel_check=NONE | {"finer_grains_factor": 4.0, "bed_seeds": [1]})
    asked = dict(line.split(" ", 1) for line in (study / "asked.txt").read_text().splitlines())
    (minutes, memory), (more_minutes, more_memory) = (
        map(int, asked[rule].split()) for rule in ("prepare_bed", "prepare_changed_bed")
    )
    assert more_memory > memory
    assert more_minutes > minutes


def test_a_change_without_effect_is_refused_before_a_bed_is_prepared(study):
    result = snakemake(study, "-n", "check_wheel_soil", wheel_check={"wheel_static_friction": 0.5})
    assert result.returncode != 0
    assert "wheel_check.wheel_static_friction is 0.5; allowed: another value than" in result.stdout + result.stderr


def test_a_toy_is_checked_from_the_calibration_to_its_page(study):
    few = NONE | {"width_factor": 1.1, "slip": 0.5, "bed_seeds": [1], "test_seeds": [1, 2, 3]}
    result = snakemake(study, "-c1", "check_wheel_soil", wheel_check=few)
    logs = "\n".join(path.read_text() for path in study.glob("logs/toy/wheel/**/*.log"))
    assert result.returncode == 0, result.stderr[-3000:] + logs
    table = read_table(str(study / "results/toy/wheel_check.parquet"), "wheel_check").set_index(["comparison", "quantity"])
    assert list(dict.fromkeys(table.index.get_level_values(0))) == ["wider_bed", "wheel_grains"]
    sinkage = table.loc[("wider_bed", "sinkage_m")]
    assert (sinkage["n_base"], sinkage["n_changed"]) == (1, 1)
    assert sinkage["difference_error"] == sinkage["block_error"]
    assert math.isnan(sinkage["pairs_sd"])
    assert sinkage["changed_setting"] == "wheel.bed.width_ratio 2.75"
    beds = [pd.read_parquet(study / f"results/toy/wheel/sand/{bed}/bed.parquet") for bed in ("1", "check/wider_bed/1")]
    assert beds[1]["n_particles"][0] == pytest.approx(1.1 * beds[0]["n_particles"][0], rel=0.05)
    assert [bed["solid_fraction"][0] for bed in beds] == [sinkage[f"{side}_solid_fraction"] for side in ("base", "changed")]
    heaps = read_table(str(study / "results/toy/wheel/sand/check/tests/repose.parquet"), "repose")
    assert heaps["radius_m"].tolist() == pytest.approx([1e-3] * 3)
    angle = table.loc[("wheel_grains", "angle_of_repose_deg")]
    assert (angle["base"], angle["base_from"], angle["n_changed"]) == (30.0, "simulated", 3)
    assert angle["changed"] == pytest.approx(heaps["angle_of_repose_deg"].mean())
    page = (study / "results/toy/wheel_check.md").read_text(encoding="utf-8")
    assert page[0] in "🔴🟡🟢"
    assert "One bed each" in page
    again = snakemake(study, "-n", "check_wheel_soil", wheel_check=few)
    assert "Nothing to be done" in again.stdout + again.stderr
