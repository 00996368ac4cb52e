"""Peak and plateau strength are read back from histories whose peak and plateau are known."""

import numpy as np
import pytest

from dem.measure.shear import HistoryError, strength

DISPLACEMENT_M = np.linspace(3.5e-6, 350e-6, 100)
NORMAL_PA = np.full(100, 1000.0)


def softening_stress(peak_pa, plateau_pa):
    """Rise as a parabola to the peak at 30 % of the displacement, then fall to the plateau, as a dense soil does."""
    part = DISPLACEMENT_M / DISPLACEMENT_M[-1]
    hump = peak_pa * (1.0 - ((part - 0.3) / 0.3) ** 2)
    return np.where(part < 0.3, hump, np.maximum(hump, plateau_pa))


def test_a_constant_stress_is_both_peak_and_plateau():
    result = strength(DISPLACEMENT_M, np.full(100, 640.0), NORMAL_PA, plateau_window=0.4)
    assert result.peak_shear_stress_pa == pytest.approx(640.0)
    assert result.plateau_shear_stress_pa == pytest.approx(640.0)
    assert result.plateau_shear_stress_sd_pa == pytest.approx(0.0, abs=1e-9)
    assert result.plane_normal_stress_pa == pytest.approx(1000.0)
    assert result.peak_plane_normal_stress_pa == pytest.approx(1000.0)


def test_a_smooth_peak_loses_one_percent_and_is_found_at_its_place():
    result = strength(DISPLACEMENT_M, softening_stress(900.0, 600.0), NORMAL_PA, plateau_window=0.4)
    assert 0.985 * 900.0 < result.peak_shear_stress_pa < 900.0
    assert result.peak_displacement_m == pytest.approx(0.3 * 350e-6, abs=4e-6)
    assert result.plateau_shear_stress_pa == pytest.approx(600.0)


@pytest.mark.parametrize("n_samples", [60, 100, 200])
def test_five_percent_of_noise_raises_the_peak_by_less_than_five_percent(n_samples):
    rng = np.random.default_rng(1)
    displacement = np.linspace(0.0, 1.0, n_samples)
    noisy = rng.normal(600.0, 30.0, (200, n_samples))
    peaks = [strength(displacement, run, np.ones(n_samples), 0.4).peak_shear_stress_pa for run in noisy]
    assert 600.0 < np.mean(peaks) < 1.05 * 600.0
    assert noisy.max(axis=1).mean() > 1.10 * 600.0


def test_one_wild_sample_is_not_the_peak():
    stress = softening_stress(900.0, 600.0)
    stress[80] = 3000.0
    result = strength(DISPLACEMENT_M, stress, NORMAL_PA, plateau_window=0.4)
    assert result.peak_shear_stress_pa < 900.0


def test_the_plateau_is_the_mean_over_the_last_part_of_the_displacement_and_not_of_the_samples():
    displacement = np.concatenate([np.linspace(0.0, 0.5, 80, endpoint=False), np.linspace(0.5, 1.0, 21)])
    stress = np.where(displacement < 0.5, 100.0, 700.0)
    normal = np.where(displacement < 0.5, 1.0, 990.0)
    result = strength(displacement, stress, normal, plateau_window=0.5)
    assert result.plateau_shear_stress_pa == pytest.approx(700.0)
    assert result.plane_normal_stress_pa == pytest.approx(990.0)


def test_the_plateau_is_an_average_over_the_noise():
    rng = np.random.default_rng(2)
    stress = softening_stress(900.0, 600.0) + rng.normal(0.0, 30.0, 100)
    result = strength(DISPLACEMENT_M, stress, NORMAL_PA, plateau_window=0.4)
    assert result.plateau_shear_stress_pa == pytest.approx(600.0, abs=3 * 30.0 / np.sqrt(40))
    assert result.plateau_shear_stress_sd_pa == pytest.approx(30.0, rel=0.35)


def test_peak_and_plateau_each_come_with_their_own_normal_stress():
    normal = np.where(DISPLACEMENT_M < 0.5 * DISPLACEMENT_M[-1], 1040.0, 980.0)
    result = strength(DISPLACEMENT_M, softening_stress(900.0, 600.0), normal, plateau_window=0.4)
    assert result.peak_plane_normal_stress_pa == pytest.approx(1040.0)
    assert result.plane_normal_stress_pa == pytest.approx(980.0)


def test_a_soil_that_only_hardens_peaks_at_the_end():
    result = strength(DISPLACEMENT_M, 600.0 * DISPLACEMENT_M / DISPLACEMENT_M[-1], NORMAL_PA, plateau_window=0.3)
    assert result.peak_displacement_m > 0.9 * DISPLACEMENT_M[-1]
    assert result.peak_shear_stress_pa > result.plateau_shear_stress_pa


@pytest.mark.parametrize("n_samples", [0, 1, 29])
def test_an_empty_or_short_history_is_refused(n_samples):
    with pytest.raises(HistoryError, match=f"displacement_m has {n_samples} samples; at least 30"):
        strength(DISPLACEMENT_M[:n_samples], NORMAL_PA[:n_samples], NORMAL_PA[:n_samples], 0.4)


@pytest.mark.parametrize("column", [0, 1, 2])
@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_a_value_that_is_not_finite_is_refused_by_column_and_sample(column, value):
    history = [DISPLACEMENT_M.copy(), softening_stress(900.0, 600.0), NORMAL_PA.copy()]
    history[column][17] = value
    name = ["displacement_m", "shear_stress_pa", "plane_normal_stress_pa"][column]
    with pytest.raises(HistoryError, match=f"^{name} is {value} in sample 17"):
        strength(*history, plateau_window=0.4)


def test_columns_of_different_length_are_refused():
    with pytest.raises(HistoryError, match=r"plane_normal_stress_pa has shape \(99,\)"):
        strength(DISPLACEMENT_M, NORMAL_PA, NORMAL_PA[:99], 0.4)


def test_a_displacement_that_stands_still_is_refused():
    displacement = DISPLACEMENT_M.copy()
    displacement[41] = displacement[40]
    with pytest.raises(HistoryError, match="does not grow after sample 40"):
        strength(displacement, NORMAL_PA, NORMAL_PA, 0.4)


@pytest.mark.parametrize("plateau_window", [0.0, -0.1, 1.1, np.nan])
def test_a_plateau_window_outside_its_range_is_refused(plateau_window):
    with pytest.raises(HistoryError, match="above 0 and at most 1 is allowed"):
        strength(DISPLACEMENT_M, NORMAL_PA, NORMAL_PA, plateau_window)


def test_a_plateau_of_a_few_samples_is_refused():
    with pytest.raises(HistoryError, match="holds 3 samples; at least 5"):
        strength(DISPLACEMENT_M, NORMAL_PA, NORMAL_PA, 0.025)
