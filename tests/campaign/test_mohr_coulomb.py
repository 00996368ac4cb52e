"""The strength line of Equation 1."""

import numpy as np
import pandas as pd
import pytest

from virtual_soil.calibration.errors import CalibrationError
from virtual_soil.campaign.experiments.mohr_coulomb import fit_line
from virtual_soil.campaign.experiments.shear.measure import reduce

STRESSES = np.array([100.0, 200.0, 400.0, 800.0])


def test_exact_strengths_give_back_cohesion_and_friction_angle():
    line = fit_line(STRESSES, 30.0 + STRESSES * np.tan(np.radians(32.0)))
    assert line.cohesion_pa == pytest.approx(30.0)
    assert line.friction_angle_deg == pytest.approx(32.0)
    assert line.r_squared == pytest.approx(1.0)
    assert line.cohesion_se_pa == pytest.approx(0.0, abs=1e-9)


def test_the_stated_errors_cover_the_truth_as_often_as_they_should():
    """With 5 % scatter the true values lie within two standard errors in about 95 % of repeats (t with 14 degrees: 93.5 %)."""
    rng = np.random.default_rng(1)
    p = np.repeat(STRESSES, 4)
    true = 30.0 + p * np.tan(np.radians(32.0))
    lines = [fit_line(p, true * (1 + 0.05 * rng.standard_normal(16))) for _ in range(800)]
    covered = np.mean([abs(line.cohesion_pa - 30.0) < 2 * line.cohesion_se_pa for line in lines])
    assert 0.90 < covered < 0.97
    covered = np.mean([abs(line.friction_angle_deg - 32.0) < 2 * line.friction_angle_se_deg for line in lines])
    assert 0.90 < covered < 0.97


@pytest.mark.parametrize("repeats", [1, 10])
def test_strengths_that_scatter_give_back_what_they_scatter_about(repeats):
    """Scatter of 10 % of the strength: weights by each test's own strength would give 294 Pa and 39.4 degrees, with repeats."""
    rng = np.random.default_rng(1)
    p = np.repeat([150.0, 300.0, 600.0, 1500.0], repeats)
    true = 300.0 + p * np.tan(np.radians(40.0))
    lines = [fit_line(p, true * (1 + 0.1 * rng.standard_normal(len(p)))) for _ in range(2000)]
    slopes = [np.tan(np.radians(line.friction_angle_deg)) for line in lines]
    for values, expected in (([line.cohesion_pa for line in lines], 300.0), (slopes, np.tan(np.radians(40.0)))):
        assert abs(np.mean(values) - expected) < 3.0 * np.std(values) / len(lines) ** 0.5


def test_a_line_through_wild_strengths_settles():
    """Its weights would swing between two lines, of 73 Pa and another, were they to follow the line all the way."""
    p, tau = np.array([220.0, 450.0, 960.0, 2900.0]), np.array([520.0, 180.0, 290.0, 4840.0])
    line = fit_line(p, tau)
    expected = np.maximum(line.cohesion_pa + p * np.tan(np.radians(line.friction_angle_deg)), 0.5 * tau)
    slope, cohesion = np.polyfit(p, tau, 1, w=1.0 / expected)
    assert line.cohesion_pa == pytest.approx(cohesion, rel=1e-6)
    assert np.tan(np.radians(line.friction_angle_deg)) == pytest.approx(slope, rel=1e-6)


def strength_table(runs, strength, normal_stress):
    return reduce("strength", runs, {"strength": strength, "normal_stress": normal_stress})


def shear_rows(fidelity="campaign", status="done", stresses=STRESSES):
    return pd.DataFrame(
        {
            "point_id": "p", "fidelity": fidelity, "purposes": "grid", "radius_m": 50e-6, "status": status,
            "normal_stress_pa": stresses, "plane_normal_stress_pa": 1.1 * stresses, "peak_plane_normal_stress_pa": 1.2 * stresses,
            "plateau_shear_stress_pa": 0.66 * stresses, "peak_shear_stress_pa": 0.96 * stresses,
        }
    )  # fmt: skip


@pytest.mark.parametrize(
    ("strength", "normal_stress", "slope"),
    [("plateau", "plane", 0.6), ("plateau", "applied", 0.66), ("peak", "plane", 0.8), ("peak", "applied", 0.96)],
)
def test_strength_and_normal_stress_are_those_that_were_asked_for(strength, normal_stress, slope):
    row = strength_table(shear_rows(), strength, normal_stress).iloc[0]
    assert np.tan(np.radians(row["friction_angle_deg"])) == pytest.approx(slope)
    assert row["radius_m"] == 50e-6


def test_failed_tests_do_not_count_and_a_point_with_too_few_left_is_not_in_the_table():
    good = shear_rows()
    failed = shear_rows(status="failed").assign(plateau_shear_stress_pa=np.nan)
    assert strength_table(pd.concat([good, failed]), "plateau", "plane")["n_runs"].tolist() == [4]
    few = shear_rows(fidelity="reference", stresses=STRESSES[:2])
    assert strength_table(pd.concat([good, few]), "plateau", "plane")["fidelity"].tolist() == ["campaign"]
    nothing = strength_table(failed, "plateau", "plane")
    assert nothing.empty
    assert list(nothing.columns) == list(strength_table(good, "plateau", "plane").columns)


@pytest.mark.parametrize("p", [np.array([1.0, 1.0, 2.0]), np.array([1.0, np.nan, 2.0])])
def test_too_few_stresses_and_missing_values_are_refused(p):
    with pytest.raises(CalibrationError):
        fit_line(p, p)
