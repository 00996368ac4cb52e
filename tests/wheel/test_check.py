"""Comparisons under the wheel: pairs, errors, verdicts and the page; the tests that are repeated with the wheel's grains."""

import math

import numpy as np
import pandas as pd
import pytest
from made_up_runs import rows

from virtual_soil.calibration.errors import CalibrationError
from virtual_soil.calibration.noise import student
from virtual_soil.campaign.experiments.registry import RESPONSES
from virtual_soil.campaign.sections import Study
from virtual_soil.campaign.settings import defaults
from virtual_soil.campaign.study import StudyError, check_config, experiment_settings, simulated
from virtual_soil.campaign.tables import check_table as checked
from virtual_soil.wheel.check import AGREES, DIFFERS, NOT_RUN, UNDECIDED, check_table, run_rows, test_row, verdict
from virtual_soil.wheel.check_page import summary, write_page
from virtual_soil.wheel.check_runs import changed_wheel, changes_of, check_any, check_changes, said
from virtual_soil.wheel.check_tests import asked, check_tests, members, reference_of, stresses_pa, tests, tests_of
from virtual_soil.wheel.soil import engine_settings

test_row.__test__ = False  # not of pytest
tests.__test__ = tests_of.__test__ = False
CHECK = defaults(Study)["wheel_check"]
WHEEL = defaults(Study)["wheel"]


@pytest.mark.parametrize(
    ("difference", "error", "expected"),
    [
        (0.9, 0.4, (True, AGREES)),  # significant, and too small to matter
        (0.9, 0.49, (False, AGREES)),
        (-0.1, 0.49, (False, AGREES)),
        (0.1, 0.51, (False, UNDECIDED)),  # an error as large as the limit would not have shown
        (1.1, 0.6, (False, UNDECIDED)),
        (-1.1, 0.5, (True, DIFFERS)),
        (5.0, math.nan, (False, UNDECIDED)),
        (math.nan, math.nan, (False, NOT_RUN)),
    ],
)
def test_a_difference_matters_if_it_is_larger_than_its_error_and_than_the_limit(difference, error, expected):
    assert verdict(difference, error, 1.0) == expected


def runs(ratio, seeds=(1, 2), sinkage=0.02, error=0.002):
    """Runs of one change; ratio : drawbar pull over load on each bed."""
    n = len(seeds)
    columns = {"drawbar_ratio": list(ratio), "drawbar_ratio_error": [error] * n, "sinkage_m": [sinkage] * n}
    columns |= {"sinkage_error_m": [1e-4] * n, "traction_coefficient": [0.3] * n, "traction_coefficient_error": [0.001] * n}
    return rows("wheel", seed=list(seeds), solid_fraction=[0.55] * n, **columns)


def found(tables, **changes):
    """Row of the drawbar pull by change."""
    words = dict.fromkeys(tables, ("before", "after"))
    return {
        row["comparison"]: row for row in run_rows("sand", tables, CHECK | changes, words) if row["quantity"] == "drawbar_ratio"
    }


def test_runs_are_paired_by_the_seed_of_their_bed():
    base, slow = runs([0.10, 0.20]), runs([0.31, 0.21], seeds=(2, 1))  # in another order
    row = found({"base": base, "slower": slow})["slower"]
    assert row["difference"] == pytest.approx(0.11)
    assert row["pairs_sd"] == pytest.approx(0.0, abs=1e-12)
    assert row["block_error"] == row["difference_error"] == pytest.approx(0.002)
    assert (row["verdict"], row["significant"]) == (DIFFERS, True)
    broken = slow.assign(drawbar_ratio=[np.nan, 0.21])
    alone = found({"base": base, "slower": broken})["slower"]
    assert (alone["n_base"], alone["base"], alone["difference"]) == (1, 0.10, pytest.approx(0.11))
    none = found({"base": base, "slower": slow.assign(drawbar_ratio=np.nan)})["slower"]
    assert (none["verdict"], none["n_changed"]) == (NOT_RUN, 0)


def test_one_bed_has_the_error_of_its_block_averages():
    row = found({"base": runs([0.10], seeds=(1,)), "stiffer": runs([0.13], seeds=(1,))})["stiffer"]
    assert row["difference_error"] == pytest.approx(0.002 * math.sqrt(2.0))
    assert math.isnan(row["pairs_sd"])
    assert row["verdict"] == DIFFERS


def test_the_scatter_of_beds_is_pooled_over_changes_on_beds_of_their_own():
    """Differences of 0.03 on beds that scatter by 0.02: blocks alone would call it significant."""
    base = runs([0.10, 0.10])
    tables = {"base": base, "finer_grains": runs([0.11, 0.15]), "wider_bed": runs([0.10, 0.10]), "slower": runs([0.13, 0.13])}
    by_change = found(tables)
    sd = 0.02 * math.sqrt(2.0)
    assert by_change["finer_grains"]["pairs_sd"] == pytest.approx(sd)
    pooled = student(2) * math.sqrt((sd**2 + 0.0) / 2.0) / math.sqrt(2.0)
    for name in ("finer_grains", "wider_bed"):
        assert by_change[name]["difference_error"] == pytest.approx(pooled)
    assert by_change["finer_grains"]["verdict"] == UNDECIDED
    assert by_change["slower"]["verdict"] == DIFFERS  # on the base's beds, which agree among themselves
    assert by_change["slower"]["difference_error"] == pytest.approx(0.002)


def test_limits_are_the_configurations():
    tables = {"base": runs([0.10, 0.10]), "slower": runs([0.13, 0.13], sinkage=0.0225)}
    assert found(tables, drawbar_ratio_limit=0.05)["slower"]["verdict"] == AGREES
    words = {"slower": ("a", "b")}
    for limit, expected in ((0.1, DIFFERS), (0.2, AGREES)):
        sinkage = next(row for row in run_rows("sand", tables, CHECK | {"sinkage_limit_ratio": limit}, words) if row["unit"] == "m")
        assert sinkage["limit"] == pytest.approx(limit * 0.02)
        assert sinkage["verdict"] == expected


REFERENCE = {"response": "angle_of_repose", "column": "angle_of_repose_deg", "unit": "deg", "limit": 2.0}
REFERENCE |= {"value": 30.0, "error": 0.3, "n": 10, "known": "simulated"}


@pytest.mark.parametrize(("mean", "expected"), [(30.5, AGREES), (33.0, DIFFERS)])
def test_the_page_says_first_what_differs(tmp_path, mean, expected):
    angles = [mean - 0.5, mean, mean + 0.5]
    heaps = pd.DataFrame({"point_id": ["p"] * 3, "angle_of_repose_deg": angles, "angle_bound_deg": [np.nan] * 3})
    tables = {"base": runs([0.10, 0.10]), "slower": runs([0.10, 0.10])}
    words = {"runs": {"slower": ("v 0.1", "v 0.05")}, "sand": {"repose": ("grains of 0.05 mm", "grains of 2 mm")}}
    settings = {"repose": {"estimator": "profile"}}
    table = check_table(tables, {"sand": {"repose": heaps}}, {"sand": [REFERENCE]}, words, settings, CHECK)
    table = checked(table, "wheel_check", "made up")
    (angle,) = table[table["comparison"] == "wheel_grains"].to_dict("records")
    assert angle["changed"] == pytest.approx(mean)
    assert angle["changed_error"] == pytest.approx(student(2) * 0.5 / math.sqrt(3.0))
    assert angle["verdict"] == expected
    write_page(table, {"sand": ["confirmed", "matches"]}, "0.3", tmp_path / "page.md")
    page = (tmp_path / "page.md").read_text(encoding="utf-8")
    first = page.split("\n\n")[0]
    if expected == DIFFERS:
        assert first.startswith("🔴 **1 of 4 differences are larger than their errors and than what matters**:")
        assert "- tests with the wheel's grains, angle of repose +3.00 ± 0.72 ° (limit 2.00 °)" in page.split("\n\n")[1]
    else:
        assert first.startswith("🟢 No difference of 4")
    assert "| slower wheel | F_DP/W | 0.100 ± 0.001 (2) | 0.100 ± 0.001 (2) | +0.000 ± 0.002 | 0.000 | 0.020 | 🟢 agrees |" in page


def test_the_page_says_what_is_not_decided():
    tables = {"base": runs([0.10], seeds=(1,), error=0.02), "slower": runs([0.11], seeds=(1,), error=0.02)}
    table = pd.DataFrame(run_rows("sand", tables, CHECK, {"slower": ("a", "b")}))
    text = summary(table)
    assert text.startswith("🟡 **Not all is decided**")
    assert "1 are **not decided**: their errors are too large to tell (slower wheel, F_DP/W)" in text


def test_one_setting_is_changed():
    for name, key, value in (("finer_grains", "grains_per_radius", 14.5 * 1.35), ("slower", "speed_m_s", 0.05)):
        other = changed_wheel(WHEEL, CHECK, name)
        assert other[key] == pytest.approx(value)
        assert {k: v for k, v in other.items() if k not in (key, "slips")} == {
            k: v for k, v in WHEEL.items() if k not in (key, "slips")
        }
    assert changed_wheel(WHEEL, CHECK, "wider_bed")["bed"]["width_ratio"] == pytest.approx(1.5 * 3.4)
    assert WHEEL["bed"]["width_ratio"] == 3.4
    assert changed_wheel(WHEEL, CHECK, "wheel_friction")["wheel_static_friction"] == 1.0
    assert changed_wheel(WHEEL, CHECK, "wheel_rolling")["wheel_rolling_friction"] == 1.0
    assert said(WHEEL, "slower", CHECK) == ("wheel.speed_m_s 0.1", "wheel.speed_m_s 0.05")
    assert changes_of(WHEEL, CHECK | {"speed_factor": None}) == [
        *("finer_grains", "stiffer", "wider_bed", "wheel_friction", "wheel_rolling")
    ]


def test_a_change_that_changes_nothing_is_refused():
    same, soft = CHECK | {"wheel_static_friction": 0.5}, WHEEL | {"shear_modulus_pa": None}
    assert "wheel_friction" not in changes_of(WHEEL, same)
    assert "stiffer" not in changes_of(soft, CHECK)
    with pytest.raises(CalibrationError, match=r"wheel_check.wheel_static_friction is 0.5; allowed: another value than wheel\."):
        check_changes(WHEEL, same, {}, {})
    with pytest.raises(CalibrationError, match=r"wheel_check.stiffness_factor is 2.0; allowed: null without wheel\.shear"):
        check_changes(soft, CHECK, {}, {})
    with pytest.raises(CalibrationError, match="comparisons is 0; allowed: a value of at least one of finer_grains_factor"):
        check_any([], [])


@pytest.mark.parametrize(
    ("key", "value"),
    [("speed_factor", 1.0), ("stiffness_factor", 1.0), ("finer_grains_factor", 0.5), ("test_seeds", [1, 2]), ("bed_seeds", [1, 1])],
)
def test_settings_without_a_comparison_are_refused(key, value):
    config = defaults(Study)
    config["wheel_check"][key] = value
    with pytest.raises(StudyError, match=f"wheel_check.{key}"):
        check_config(config)


def study(**changes):
    """The default study on its sand, and its optimum; changes : of sections."""
    config = defaults(Study)
    for name, section in changes.items():
        config[name] |= section
    config["engine"]["gravity_m_s2"] = 9.81
    return config


@pytest.fixture
def optimum(tmp_path):
    """Table of a calibration with grains of 40 um."""
    values = {"static_friction": [0.6], "rolling_friction": [0.12], "radius_m": [4e-5]}
    rows("calibration", case=["sand"], surrogate=["ours"], status=["converged"], **values).to_parquet(tmp_path / "c.parquet")
    return tmp_path / "c.parquet"


def job(config, optimum, experiment, **changes):
    """Study and rows of a repeated test; changes : of section `wheel`."""
    wheel = WHEEL | changes
    return tests(config, wheel, CHECK | {"test_seeds": [1, 2, 3]}, engine_settings(config, wheel), optimum, "sand", experiment)


@pytest.mark.parametrize("geometry", ["scaled", "fixed"])
@pytest.mark.parametrize("tube", [{}, {"tube_diameter_m": 2e-3, "fill_height_m": 2e-3, "lift_speed_m_s": 2e-3}])
def test_a_heap_of_the_wheels_grains_is_the_same_heap_but_larger_and_slower(optimum, geometry, tube):
    config = study(repose_test=tube, design={"geometry": geometry}, repose={"max_time_s": 1.0})
    repeated, found = job(config, optimum, "repose", gravity_m_s2="moon")
    assert [row["seed"] for row in found] == [1, 2, 3]
    row = found[0]
    assert (row["radius_m"], row["static_friction"], row["rolling_friction"]) == (0.002, 0.6, 0.12)
    assert row["shear_modulus_pa"] == 2e7
    calibrated = experiment_settings(config, simulated(config, row | {"radius_m": 4e-5, "shear_modulus_pa": 5e7}))
    settings = experiment_settings(repeated, simulated(repeated, row))
    lengths, gravities = 0.002 / 4e-5, 1.62 / 9.81
    powers = {"scale_radius_m": lengths, "lift_speed_m_s": math.sqrt(lengths * gravities)}
    powers["max_time_s"] = math.sqrt(lengths / gravities)
    for key, value in calibrated["setup"].items():
        expected = value * powers.get(key, 1.0) if isinstance(value, float) else value
        assert settings["setup"][key] == (pytest.approx(expected, rel=1e-6) if isinstance(value, float) else expected), key
    assert settings["engine"]["gravity_m_s2"] == 1.62
    assert settings["engine"]["stiffness_reduction"] == 1.0
    assert settings["engine"]["time_step_rayleigh_ratio"] == WHEEL["time_step_rayleigh_ratio"]


def test_shear_tests_have_the_stresses_under_the_wheel(optimum):
    pressure = 24.5 / (1.2 * 0.058 * 0.050)
    assert stresses_pa(WHEEL, CHECK) == pytest.approx([0.75 * pressure, pressure, 1.5 * pressure], rel=1e-3)
    repeated, found = job(study(), optimum, "plane_shear")
    assert sorted({row["normal_stress_pa"] for row in found}) == stresses_pa(WHEEL, CHECK)
    assert len(members((repeated, found), 2)) == 3
    assert stresses_pa(WHEEL, CHECK | {"normal_stresses_pa": [1e3, 2e3, 3e3]}) == [1e3, 2e3, 3e3]
    with pytest.raises(CalibrationError, match=r"wheel_check, with the wheel's grains: plane_shear: shear_modulus_pa is 2e\+06"):
        check_tests(job(study(), optimum, "plane_shear", shear_modulus_pa=2e6))


def test_what_goes_with_the_size_of_the_test_is_not_repeated():
    config = study()
    config["optimise"]["cases"][0]["weights"] = {
        "angle_of_repose": 1.0,
        "steady_friction_angle": 1.0,
        "discharge_rate": 1.0,
        "large_grains": 1,
    }
    assert set(asked(config, "sand")) == {"angle_of_repose", "steady_friction_angle"}
    config["material"]["adhesive_stress_pa"] = 10.0
    assert tests_of(config, "sand") == ["plane_shear"]


def test_the_calibration_says_what_it_simulated_else_what_it_predicted(tmp_path):
    path, response = str(tmp_path / "verification.parquet"), RESPONSES["angle_of_repose"]
    with pytest.raises(CalibrationError, match="run the target `all` of this study first"):
        reference_of(path, "sand", response, 2.0)
    values = {
        "prediction": ["confirmed"],
        "match": ["matches"],
        "response": ["angle_of_repose"],
        "simulated": [30.0],
        "predicted": [31.0],
    }
    values |= {"simulated_se": [0.2], "predicted_se": [0.4]}
    for n, known, value, error in ((10, "simulated", 30.0, 0.2), (0, "predicted", 31.0, 0.4)):
        rows("verification", case=["sand"], n_seeds=[n], **values).to_parquet(path)
        reference = reference_of(path, "sand", response, 2.0)
        assert (reference["known"], reference["value"], reference["error"], reference["n"]) == (known, value, error, n)
    with pytest.raises(CalibrationError, match="angle_of_repose of case regolith is there 0 times"):
        reference_of(path, "regolith", response, 2.0)
