"""The Gaussian process: planted functions, honest errors, points left out and points believed."""

from dataclasses import replace

import numpy as np
import pytest

from virtual_soil.calibration.errors import CalibrationError
from virtual_soil.calibration.gaussian_process import fit_process, left_out
from virtual_soil.calibration.space import Space

VARIABLES = ("radius_m", "static_friction", "rolling_friction")
RANGES = {"radius_m": (25e-6, 500e-6), "static_friction": (0.0, 1.7), "rolling_friction": (0.0, 0.3)}
SPACE = Space(VARIABLES, RANGES, {"radius_m": 0.0})


def planted(unit):
    """A smooth response over the unit cube, in degrees; the third variable does nothing."""
    return 20.0 + 15.0 * np.tanh(3.0 * unit[:, 1]) + 5.0 * unit[:, 0]


def fitted(n=48, noise=0.3):
    unit = SPACE.crowd(64)[:n]
    values = SPACE.values(unit)
    observed = planted(unit) + noise * np.random.default_rng(3).standard_normal(n)
    return fit_process("friction_angle", "deg", SPACE, np.column_stack(list(values.values())), observed, np.full(n, noise))


def test_a_smooth_function_is_predicted_within_the_stated_error():
    process, unit = fitted(), SPACE.crowd(512)[64:]
    mean, error = process.predict_with_error(SPACE.values(unit))
    inside = np.abs(mean - planted(unit)) < 2 * error
    assert inside.mean() > 0.85
    assert np.abs(mean - planted(unit)).max() < 2.0
    assert error.max() < 1.5  # honest, but not by claiming to know nothing


def test_a_variable_without_influence_gets_a_great_length():
    process = fitted()
    assert process.lengths[2] > 3 * process.lengths[1]


def test_pure_noise_is_a_constant_known_to_its_standard_error():
    n, noise = 40, 5.0
    unit = SPACE.crowd(64)[:n]
    observed = 10.0 + noise * np.random.default_rng(0).standard_normal(n)
    points = np.column_stack(list(SPACE.values(unit).values()))
    process = fit_process("cohesion", "Pa", SPACE, points, observed, np.full(n, noise))
    mean, error = process.predict_with_error(SPACE.values(np.full((1, 3), 0.5)))
    assert mean[0] == pytest.approx(observed.mean(), abs=0.5)
    assert error[0] == pytest.approx(noise / np.sqrt(n), rel=0.3)


def test_far_from_all_points_the_error_is_the_amplitude():
    unit = np.array([[0.01 * k, 0.01 * (k % 3), 0.01 * (k % 5)] for k in range(12)])
    process = fit_process(
        "cohesion", "Pa", SPACE, np.column_stack(list(SPACE.values(unit).values())), planted(unit), np.full(12, 0.1)
    )
    process = replace(process, lengths=(0.05, 0.05, 0.05))
    _, error = process.predict_with_error(SPACE.values(np.array([[1.0, 1.0, 1.0]])))
    assert error[0] >= 0.99 * process.amplitude


def test_an_error_left_out_is_that_of_a_process_without_the_point():
    process = fitted(n=20)
    predicted, error = left_out(process)
    at = dict(zip(VARIABLES, process.points[7], strict=True))
    values = SPACE.unit({name: np.delete(np.array(process.points).T[k], 7) for k, name in enumerate(VARIABLES)})
    assert len(values) == 19
    mean, spread = process.without(7).predict_with_error(at)
    assert (predicted[7], error[7]) == (pytest.approx(float(mean)), pytest.approx(float(spread)))
    assert process.without(7).n_points == 19
    residual = np.array(process.observed) - predicted
    assert process.cv_rmse == pytest.approx(np.sqrt((residual**2).mean()))


def test_believing_a_point_shrinks_the_error_there_and_moves_nothing():
    process = fitted(n=16)
    at = {"radius_m": 400e-6, "static_friction": 1.6, "rolling_friction": 0.02}
    before, error = process.predict_with_error(at)
    after, smaller = process.believing(at).predict_with_error(at)
    assert float(after) == pytest.approx(float(before), abs=1e-4)
    assert smaller < error


def test_with_and_without_errors_the_prediction_is_the_same():
    process = fitted(n=16)
    values = SPACE.values(SPACE.crowd(32))
    assert process.predict(values) == pytest.approx(process.predict_with_error(values)[0])


def test_an_impossible_value_gives_no_number():
    assert np.isnan(fitted(n=16).predict({"radius_m": -1e-6, "static_friction": 0.3, "rolling_friction": 0.1}))


def test_a_prediction_beyond_the_points_is_known_as_one():
    process = fitted()
    unit = SPACE.unit(dict(zip(VARIABLES, np.array(process.points).T, strict=True)))
    inside = {name: float(v[0]) for name, v in SPACE.values(unit.mean(axis=0, keepdims=True)).items()}
    assert process.surrounds(inside)
    assert not process.surrounds({**inside, "radius_m": 500e-6})


def test_too_few_points_are_refused():
    points = np.column_stack(list(SPACE.values(SPACE.crowd(4)).values()))
    with pytest.raises(CalibrationError, match="cohesion: number of points to fit is 4; allowed: more than the 4"):
        fit_process("cohesion", "Pa", SPACE, points, np.zeros(4), np.ones(4))


def test_a_process_is_shown_without_its_points():
    process = fitted(n=16)
    assert repr(process).startswith("GaussianProcess(friction_angle of radius_m, ")
    assert "16 points" in repr(process)
    assert len(repr(process)) < 150
    assert "<td>16</td>" in process._repr_html_()
