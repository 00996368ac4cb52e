"""Angle of a drum's surface, measured on surfaces and series that are known."""

import math

import numpy as np
import pytest

from dem.measure.drum import N_BLOCKS, NOTHING, angles_of, steady_angle, surface_angle_deg, turning_points

X = (np.arange(40) + 0.5) / 20.0 - 1.0


def plane(angle_deg, level):
    """A plane surface at a distance from the axis, where it is in the drum."""
    slope = math.tan(math.radians(angle_deg))
    height = slope * X + level * math.hypot(1.0, slope)
    return np.where(np.hypot(X, height) < 1.0, height, np.nan)


@pytest.mark.parametrize("level", [0.0, -0.3])
@pytest.mark.parametrize("angle_deg", [-20.0, 0.0, 25.0, 60.0])
def test_a_plane_surface_has_its_angle_whatever_the_fill(angle_deg, level):
    assert surface_angle_deg(X, plane(angle_deg, level)) == pytest.approx(angle_deg, abs=1e-9)


def test_a_surface_that_bends_near_the_shell_has_the_angle_of_its_middle_half():
    """The chord at a level of -0.3 under 30 degrees has its middle at x = 0.15, and half a length of 0.954."""
    height = plane(30.0, -0.3)
    along = (X - 0.15) / math.cos(math.radians(30.0))
    bent = np.where(np.abs(along) > 0.5 * 0.954, height + 0.5 * (np.abs(along) - 0.477), height)
    assert surface_angle_deg(X, bent) == pytest.approx(30.0, abs=1e-9)


def test_too_few_heights_or_none_in_the_drum_have_no_angle():
    assert math.isnan(surface_angle_deg(X, np.where(np.abs(X) < 0.1, 0.0, np.nan)))
    assert math.isnan(surface_angle_deg(X, np.full(40, 1.5)))
    assert math.isnan(surface_angle_deg([], []))


def test_avalanches_run_between_the_upper_and_the_lower_angle():
    turns = np.linspace(0.0, 2.0, 801)
    phase = (10.0 * turns) % 1.0
    saw = 28.0 + np.where(phase < 0.9, 4.0 * phase / 0.9, 40.0 * (1.0 - phase))
    early = np.where(turns < 0.5, 60.0, saw)  # before the surface is in its steady state
    found = steady_angle(turns, early, 0.5)
    assert found.upper_deg == pytest.approx(32.0, abs=0.2)
    assert found.lower_deg == pytest.approx(28.0, abs=0.2)
    assert found.mean_deg == pytest.approx(30.0, abs=0.1)
    assert 13 <= found.n_avalanches <= 15


def test_small_fluctuations_on_the_way_are_no_turning_points():
    values = [0.0, 3.0, 2.5, 6.0, 5.5, 1.0, 1.4, 0.2, 5.0, 0.0]
    assert turning_points(np.array(values), 1.0) == ([6.0, 5.0], [0.2])


def test_a_steady_flow_has_both_angles_within_two_scatters_of_its_mean():
    noise = np.random.default_rng(1).normal(30.0, 0.5, 2000)
    found = steady_angle(np.linspace(0.0, 1.0, 2000), noise, 0.0)
    assert found.scatter_deg == pytest.approx(0.5, rel=0.05)
    assert 30.0 < found.upper_deg < 30.0 + 2.0 * 0.5
    assert 30.0 - 2.0 * 0.5 < found.lower_deg < 30.0


def test_the_error_is_that_of_the_mean_over_blocks_of_a_series_with_a_memory():
    """Means of many series scatter by the error that each of them states, also where neighbours are alike."""
    rng, n = np.random.default_rng(3), 800
    series = np.apply_along_axis(np.convolve, 1, rng.normal(size=(200, n + 9)), np.ones(10), mode="valid")
    found = [steady_angle(np.arange(n, dtype=float), one, 0.0) for one in series]
    assert 0.7 < np.mean([one.error_deg for one in found]) / np.std([one.mean_deg for one in found]) < 1.3


def test_too_few_looks_tell_nothing_and_missing_angles_do_not_count():
    turns = np.arange(2.0 * N_BLOCKS)
    assert steady_angle(turns[1:], turns[1:], 0.0) == NOTHING
    assert steady_angle([], [], 0.0) == NOTHING
    known = steady_angle(turns, np.full(len(turns), 20.0), 0.0)
    some = np.insert(np.full(len(turns), 20.0), 5, np.nan)
    assert steady_angle(np.arange(len(some)), some, 0.0).mean_deg == known.mean_deg == 20.0


def test_every_rate_has_its_own_looks():
    looks = [(0.01, 0.1, 20.0), (0.01, 0.2, 24.0), (0.05, 0.1, 30.0)]
    names = ("froude_number", "turns", "x_ratio", "height_ratio")
    rows = np.concatenate([np.column_stack([np.full((40, 2), look[:2]), X, plane(look[2], 0.0)]) for look in looks])
    history = dict(zip(names, rows.T, strict=True))
    turns, angles = angles_of(history, 0.01)
    assert turns.tolist() == [0.1, 0.2]
    assert angles == pytest.approx([20.0, 24.0])
    assert angles_of(history, 0.05)[1] == pytest.approx([30.0])
    assert len(angles_of(history, 0.02)[1]) == 0
