"""What a further measurement leaves of an uncertainty, against normal distributions of known correlation."""

import numpy as np
import pytest

from virtual_soil.calibration.further import further_error, halving_error, left_over


def test_a_further_measurement_leaves_what_it_does_not_tell():
    x, other = np.random.default_rng(7).normal(size=(2, 2000))
    assert left_over(x, 2.0 * x, 0.02) == pytest.approx(0.01, abs=2e-3)
    assert left_over(x, other, 0.2) == pytest.approx(1.0, abs=0.02)
    assert left_over(x, x, 1.0) == pytest.approx(np.sqrt(0.5), abs=0.02)  # as uncertain as the soils differ
    assert left_over(x, 0.6 * x + 0.8 * other, 0.5) == pytest.approx(np.sqrt(1.0 - 0.36 / 1.25), abs=0.02)
    assert left_over(x, np.ones_like(x), 1.0) == pytest.approx(1.0)
    assert left_over(np.ones_like(x), x, 1.0) == 1.0


def test_a_further_measurement_that_does_not_rise_with_the_quantity_tells_of_it_all_the_same():
    y = np.linspace(-1.0, 1.0, 2000)
    assert abs(np.corrcoef(y**2, y)[0, 1]) < 1e-9
    assert left_over(y**2, y, 0.01) < 0.05


def test_a_measurement_that_halves_the_uncertainty_is_found_with_its_error():
    x, other = np.random.default_rng(8).normal(size=(2, 2000))
    assert halving_error(x, 2.0 * x) == pytest.approx(2.0 / np.sqrt(3.0), rel=0.05)  # 1 - 4 / (4 + s^2) = 1/4
    whole = halving_error(x, 2.0 * x)
    assert halving_error(x, 2.0 * x, 0.6 * whole) == pytest.approx(0.8 * whole)
    assert np.isnan(halving_error(x, 2.0 * x, 1.01 * whole))
    assert np.isnan(halving_error(x, 0.6 * x + 0.8 * other))
    assert np.isnan(halving_error(x, np.ones_like(x)))


def test_no_measurement_is_sharper_than_half_of_what_matters():
    assert further_error(np.array([9.0, 11.0]), 0.02, 0.1) == pytest.approx(0.2)
    assert further_error(np.array([-1.0, 1.0]), 0.02, 0.1) == 0.05


def test_the_reading_has_the_measurements_error_too():
    x, error, z = np.repeat([-1.0, 1.0], 1000), 0.7, np.linspace(-8.0, 8.0, 4001)
    means = np.tanh((1.0 + error * z) / error**2)  # of x, after a reading of 1 + error z of a soil with x = 1
    variance = np.trapezoid((1.0 - means**2) * np.exp(-0.5 * z**2) / np.sqrt(2.0 * np.pi), z)
    assert left_over(x, x, error) == pytest.approx(np.sqrt(variance), abs=0.02)  # without the error: 0.22 less
