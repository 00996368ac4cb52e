"""Estimators of wheels, plates, cones and surfaces on series with known answers."""

import numpy as np
import pytest

from dem.experiments.surface import height_map, layer_solid_fraction
from dem.measure.blocks import block_means, mean_and_error, ratio_and_error
from dem.measure.penetration import bekker, cone_gradient, power_law, pressure_at, sinkage_from
from dem.measure.wheel import rut, slip_of, steady


def series(n=1000, **values):
    """A run of 1 s after 0.5 s of lowering."""
    time = np.concatenate([np.linspace(-0.5, 0.0, 50), np.arange(1, n + 1) / n])
    columns = {"drawbar_pull_n": 5.0, "torque_n_m": 0.6, "sinkage_m": 0.02}
    columns |= {"vertical_force_n": 25.0, "speed_m_s": 0.1, "rim_rate_rad_s": 4.0}
    return {"time_s": time} | {name: np.broadcast_to(value, time.shape) for name, value in (columns | values).items()}


def test_means_are_those_of_the_last_stretch_and_ratios_theirs():
    time = series()["time_s"]
    found = steady(series(drawbar_pull_n=np.where(time > 0.6, 5.0, 1e3)), 0.05)
    assert (found.drawbar_pull_n, found.torque_n_m, found.sinkage_m, found.load_n) == pytest.approx((5.0, 0.6, 0.02, 25.0))
    assert found.drawbar_ratio == pytest.approx(0.2)
    assert found.traction_coefficient == pytest.approx(0.6 / (25.0 * 0.05))
    assert found.efficiency == pytest.approx(5.0 * 0.1 / (0.6 * 4.0))
    assert found.power_balance_w == pytest.approx(0.6 * 4.0 - 0.5)
    assert found.slip == pytest.approx(0.5)
    assert found.n_samples == 400
    assert found.drawbar_pull_error_n == found.drawbar_ratio_error == 0.0


def test_the_error_is_the_scatter_of_the_mean_whatever_the_sampling():
    rng, means, errors = np.random.default_rng(1), [], []
    for _ in range(300):
        noise = np.repeat(rng.normal(0.0, 1.0, 105), 10)  # ten samples are one: independent ones would say a third of the error
        found = steady(series(drawbar_pull_n=5.0 + noise), 0.05)
        means.append(found.drawbar_pull_n)
        errors.append(found.drawbar_pull_error_n)
    assert np.mean(means) == pytest.approx(5.0, abs=0.05)
    assert np.sqrt(np.mean(np.square(errors))) == pytest.approx(np.std(means), rel=0.15)
    assert np.std(means) == pytest.approx(1.0 / np.sqrt(40.0), rel=0.15)


def test_a_sinkage_that_still_grows_is_seen():
    found = steady(series(sinkage_m=0.02 + 0.01 * np.maximum(series()["time_s"], 0.0)), 0.05)
    assert found.sinkage_drift_m == pytest.approx(0.01 * 0.4 * 0.8, rel=0.01)


def test_a_run_without_travel_has_no_means():
    lowered = {name: values[:50] for name, values in series().items()}
    with pytest.raises(ValueError, match="travel of the wheel is 0 s"):
        steady(lowered, 0.05)
    short = {name: values[:53] for name, values in series().items()}
    with pytest.raises(ValueError, match="number of samples is 2; allowed: at least 5"):
        steady(short, 0.05)


def test_slips_of_driven_locked_and_skidding_wheels():
    assert slip_of([0.1, 0.1, 0.1, 0.0], [0.2, 0.0, 0.08, 0.1]) == pytest.approx([0.5, -1.0, -0.2, 1.0])


def test_a_ratio_of_correlated_series_is_exact():
    load = 1.0 + np.random.default_rng(1).normal(0.0, 0.3, 100)
    assert ratio_and_error(0.3 * load, load) == pytest.approx((0.3, 0.0), abs=1e-12)
    assert np.isnan(ratio_and_error(load, 0.0 * load)).all()


def test_blocks_are_the_last_samples_of_equal_number():
    assert block_means([9.0, 1.0, 3.0, 5.0, 7.0], 2) == pytest.approx([2.0, 6.0])
    assert mean_and_error([1.0, 3.0], 2) == pytest.approx((2.0, 1.0))


def test_the_law_and_the_pressure_of_a_plate_are_found():
    z = np.linspace(0.0, 0.03, 300)
    p = 8e5 * z**1.2
    law = power_law(z, p, 0.002, 0.025)
    assert (law.k_pa_m_n, law.n) == pytest.approx((8e5, 1.2), rel=1e-6)
    assert law.residual_ratio == pytest.approx(0.0, abs=1e-7)
    value, error = pressure_at(z, p, 0.02)
    assert value == pytest.approx(8e5 * 0.02**1.2, rel=2e-3)
    assert error < 1e-3 * value
    assert np.isnan(pressure_at(z, p, 0.031)[0])
    assert np.isnan(power_law(z, p, 0.04, 0.05).n)


def test_the_zero_of_sinkage_is_where_the_pressure_is_reached():
    depth, pressure = np.array([-2.0, -1.0, 0.0, 1.0]), np.array([0.0, 500.0, 1500.0, 900.0])
    assert sinkage_from(depth, pressure, 1000.0) == pytest.approx([-2.0, -1.0, 0.0, 1.0])
    assert sinkage_from(depth, pressure, 400.0) == pytest.approx([-1.0, 0.0, 1.0, 2.0])
    assert np.isnan(sinkage_from(depth, pressure, 2000.0)).all()


def test_equal_errors_of_the_pressure_do_not_bias_the_law():
    rng, z = np.random.default_rng(1), np.linspace(1e-3, 0.025, 400)
    found = [power_law(z, 8e5 * z + rng.normal(0.0, 700.0, z.shape), 0.002, 0.025).n for _ in range(50)]
    assert np.mean(found) == pytest.approx(1.0, abs=0.01)


def test_the_moduli_of_bekker_are_those_of_the_plates():
    laws = {d: power_law(z := np.linspace(1e-3, 0.03, 50), (2e3 / (0.5 * d) + 6e5) * z**1.1, 0.0, 1.0) for d in (0.06, 0.1)}
    assert bekker(laws, 0.01) == pytest.approx((1.1, 2e3, 6e5), rel=1e-6)
    assert np.isnan(bekker({0.06: laws[0.06]}, 0.01)).all()


def test_the_gradient_of_a_cone_is_its_slope_between_a_tenth_and_three_tenths():
    z = np.linspace(-0.01, 0.1, 2000)
    q = np.where(z < 0.008, 0.0, np.where(z < 0.031, 4e6 * z, 1e6))
    gradient, error = cone_gradient(z, q, 0.1)
    assert gradient == pytest.approx(4e6, rel=1e-9)
    assert error < 1e-3 * gradient
    noisy = cone_gradient(z, q + np.random.default_rng(1).normal(0.0, 2e3, z.shape), 0.1)
    assert abs(noisy[0] - 4e6) < 3.0 * noisy[1] < 4e5
    assert np.isnan(cone_gradient(z[::200], q[::200], 0.1)[0])


def test_the_map_has_the_highest_grain_of_each_cell_in_its_period():
    positions = [(0.1, 0.1, 1.0), (0.2, 0.1, 2.0), (1.9, 0.1, 3.0), (-0.1, 1.2, 4.0), (2.1, 0.9, 1.9)]
    heights = height_map(positions, [0.5, 0.25, 0.5, 0.5, 0.5], 2.0, 2.0, 1.0)
    assert heights[0, 0] == 2.4
    assert heights[1, 0] == 3.5
    assert heights[1, 1] == 4.5
    assert np.isnan(heights[0, 1])


def test_a_rut_is_the_change_of_the_surface_behind_the_wheel():
    before, after = np.full((4, 3), 10.0), np.full((4, 3), 10.0)
    after[:2, 1] = [8.0, 7.0]
    change, scatter = rut(before, after, slice(0, 2))
    assert change == pytest.approx([0.0, -2.5, 0.0])
    assert scatter == pytest.approx([0.0, 0.5, 0.0])


def test_the_solid_fraction_of_a_layer_takes_parts_of_spheres():
    centres = [(0.0, 0.0, 0.0), (0.0, 0.0, 5.0), (0.0, 0.0, 10.0)]
    volume = 4.0 / 3.0 * np.pi
    assert layer_solid_fraction(centres, np.ones(3), 4.0, 0.0, 10.0) == pytest.approx(2.0 * volume / 40.0)
    assert layer_solid_fraction(centres, np.ones(3), 4.0, 5.5, 9.0) == pytest.approx((5.0 / 32.0 * volume) / 14.0)
