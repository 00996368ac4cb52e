"""Peak and steady strength on curves whose strengths are known."""

import numpy as np
import pytest

from dem.experiments.strength import MEAN_FACTOR, N_BLOCKS, CurveError, peak, steady

STRAIN = np.linspace(0.02, 4.0, 200)
P = np.full(200, 1000.0)


def curve(noise=0.0, seed=0, drift=0.0):
    """A peak of 800 Pa at a strain of 0.5, and 500 Pa from a strain of 2 on, with correlated noise."""
    rng = np.random.default_rng(seed)
    shape = np.where(STRAIN < 0.5, STRAIN / 0.5, np.clip(1.0 - (STRAIN - 0.5), 0.0, 1.0))
    tau = 500.0 + 300.0 * shape - 500.0 * (STRAIN < 0.5) * (1 - STRAIN / 0.5) + drift * np.maximum(STRAIN - 2.0, 0.0)
    return tau + noise * np.convolve(rng.standard_normal(203), np.full(4, 0.5), mode="valid")


def test_peak_and_steady_strength_are_two_numbers():
    highest, last = peak(STRAIN, curve(), P), steady(STRAIN, curve(), P)
    assert highest.shear_stress_pa == pytest.approx(800.0, rel=0.05)
    assert highest.position == pytest.approx(0.5, abs=0.1)
    assert last.shear_stress_pa == pytest.approx(500.0)
    assert last.normal_stress_pa == highest.normal_stress_pa == 1000.0


@pytest.mark.parametrize("n", [60, 100, 200])
def test_the_peak_does_not_depend_on_how_long_the_test_goes_on(n):
    highest = peak(STRAIN[:n], curve(10.0)[:n], P[:n])
    assert highest.shear_stress_pa == peak(STRAIN, curve(10.0), P).shear_stress_pa


def test_without_a_peak_the_highest_mean_is_near_the_steady_strength():
    """The highest of 200 samples with a noise of 10 % would lie three standard deviations above."""
    rng = np.random.default_rng(2)
    ratios = [peak(STRAIN, 500.0 + 50.0 * rng.standard_normal(200), P).shear_stress_pa / 500.0 for _ in range(50)]
    assert np.mean(ratios) < 1.1


def test_the_steady_strengths_error_is_that_of_repeated_curves():
    found = [steady(STRAIN, curve(25.0, seed), P) for seed in range(300)]
    ratios = np.array([one.shear_stress_pa / one.normal_stress_pa for one in found])
    stated = np.sqrt(np.mean([one.stress_ratio_se**2 for one in found])) / MEAN_FACTOR
    assert stated == pytest.approx(ratios.std(), rel=0.15)
    inside = np.mean([abs(r - 0.5) < 2 * one.stress_ratio_se for r, one in zip(ratios, found, strict=True)])
    assert 0.92 < inside < 0.98
    assert np.mean([one.steady for one in found]) > 0.9


@pytest.mark.parametrize(("noise", "drift"), [(2.0, 40.0), (2.0, -40.0), (60.0, 150.0)])
def test_a_strength_that_still_changes_is_not_steady(noise, drift):
    assert np.mean([steady(STRAIN, curve(noise, seed, drift), P).steady for seed in range(50)]) < 0.1


def test_blocks_have_students_factor():
    """The factor belongs to the number of blocks: 2 standard errors of the mean of five values, four degrees of freedom."""
    rng = np.random.default_rng(3)
    means = rng.standard_normal((20000, N_BLOCKS))
    inside = np.abs(means.mean(axis=1)) < 2 * MEAN_FACTOR * means.std(axis=1, ddof=1) / np.sqrt(N_BLOCKS)
    assert inside.mean() == pytest.approx(0.9545, abs=0.005)


@pytest.mark.parametrize(
    ("columns", "message"),
    [
        ((STRAIN[:5], P[:5], P[:5]), "the curve has 5 samples; allowed: at least 20"),
        ((STRAIN, P[:50], P), r"shear stress has shape \(50,\)"),
        ((STRAIN, np.where(STRAIN > 3, np.nan, P), P), "shear stress is nan in sample"),
        ((STRAIN[::-1], P, P), "does not grow after sample 0"),
        (([], [], []), "the curve has no samples"),
        ((STRAIN, P, 0.0 * P), "normal stress is 0 in sample 0; allowed: above zero"),
        ((np.append(STRAIN[:199], 400.0), P, P), "leave gaps"),
    ],
)
def test_what_is_no_curve_is_refused(columns, message):
    with pytest.raises(CurveError, match=message):
        steady(*columns)


def test_a_curve_read_by_hand_has_its_highest_sample_as_peak():
    highest = peak([0.0, 1.0, 2.0], [0.0, 7.0, 5.0], [10.0, 10.0, 10.0])
    assert (highest.shear_stress_pa, highest.position) == (7.0, 1.0)
