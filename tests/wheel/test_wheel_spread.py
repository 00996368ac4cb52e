"""Noise of beds against spread of soils: standard deviations and intervals, emulator, what a further measurement would leave."""

import numpy as np
import pytest

from virtual_soil.calibration.errors import CalibrationError
from virtual_soil.wheel.spread import components, emulator, monomials

#: Nine soils: the optimum on five beds, the others on two.
SOILS = np.repeat(np.arange(9), [5, *[2] * 8])


def made_up(generator, soils_sd, beds_sd):
    """Runs on SOILS with known standard deviations about 3."""
    return 3.0 + soils_sd * generator.normal(size=9)[SOILS] + beds_sd * generator.normal(size=len(SOILS))


@pytest.mark.parametrize(("soils_sd", "beds_sd"), [(1.0, 0.5), (0.3, 1.0)])
def test_intervals_hold_the_true_standard_deviations_as_often_as_they_say(soils_sd, beds_sd):
    generator, n = np.random.default_rng(3), 300
    found = [components(made_up(generator, soils_sd, beds_sd), SOILS) for _ in range(n)]
    beds = np.mean([c.beds_low <= beds_sd <= c.beds_high for c in found])
    soils = np.mean([c.soils_low <= soils_sd <= c.soils_high for c in found])
    assert beds == pytest.approx(0.95, abs=0.04)  # 300 trials: a standard deviation of 0.013
    assert soils == pytest.approx(0.95, abs=0.05)
    assert np.mean([c.beds_sd**2 for c in found]) == pytest.approx(beds_sd**2, rel=0.1)


def test_soils_that_do_not_differ_have_intervals_that_begin_at_zero():
    generator = np.random.default_rng(1)
    found = [components(made_up(generator, 0.0, 1.0), SOILS) for _ in range(200)]
    assert np.mean([c.soils_low == 0.0 for c in found]) == pytest.approx(0.975, abs=0.035)
    assert {(c.n_soils, c.n_runs) for c in found} == {(9, 21)}
    assert all(c.beds_low < c.beds_sd < c.beds_high for c in found)


def test_the_closed_form_of_a_balanced_design():
    found = components([1.0, 3.0, 5.0, 7.0, 9.0, 11.0], [0, 0, 1, 1, 2, 2])
    assert found.mean == 6.0
    assert found.beds_sd == pytest.approx(np.sqrt(2.0))  # three squares of 2 over three degrees of freedom
    assert found.soils_sd == pytest.approx(np.sqrt(16.0 - 2.0 / 2.0))


@pytest.mark.parametrize(("soils", "message"), [([0, 0, 1, 1], "at least 3"), ([0, 1, 2, 3], "at least 2 for one soil")])
def test_too_few_soils_or_beds_are_refused(soils, message):
    with pytest.raises(CalibrationError, match=message):
        components([1.0, 2.0, 3.0, 4.0], soils)


def test_the_emulator_takes_the_degree_that_the_soils_support():
    generator = np.random.default_rng(5)
    unit = generator.random((12, 2))
    line, noise = 2.0 + 3.0 * unit[:, 0] - unit[:, 1], 0.01 * generator.normal(size=12)
    assert emulator(unit, line + noise, np.full(12, 2)).degree == 1
    curved = emulator(unit, line + 8.0 * unit[:, 0] * unit[:, 1] + noise, np.full(12, 2))
    assert curved.degree == 2
    assert curved.predict([[0.5, 0.5]])[0] == pytest.approx(2.0 + 1.5 - 0.5 + 2.0, abs=0.1)
    nothing = emulator(unit, generator.normal(size=12), np.full(12, 2))
    assert nothing.degree == 0
    assert nothing.loo_rmse > 0.5
    assert monomials(unit, 2).shape == (12, 6)
