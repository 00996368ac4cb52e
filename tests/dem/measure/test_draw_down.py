"""Rates and slopes of a draw-down, measured on flows and surfaces that are known."""

import math

import numpy as np
import pytest

from dem.measure.draw_down import N_BLOCKS, slopes, steady_rate

LENGTH, SLOT, THICKNESS = 80.0, 16.0, 12.0


def wedges(left_deg, right_deg, unit_m=1.0):
    """Spheres of radius 1 below two planes that fall from the end walls to the edges of the slot."""
    rng = np.random.default_rng(5)
    places = rng.uniform([1.0, 0.0, 1.0], [LENGTH - 1.0, THICKNESS, 40.0], (60000, 3))
    run = np.minimum(places[:, 0], LENGTH - places[:, 0])
    tangent = np.tan(np.radians(np.where(places[:, 0] < 0.5 * LENGTH, left_deg, right_deg)))
    stays = places[places[:, 2] < (0.5 * (LENGTH - SLOT) - run) * tangent]
    return slopes(unit_m * stays, np.full(len(stays), unit_m), unit_m * LENGTH, unit_m * SLOT, unit_m * THICKNESS)


@pytest.mark.parametrize("unit_m", [1.0, 1.7e-3])
def test_planes_have_their_angles_whatever_the_unit(unit_m):
    found = wedges(25.0, 40.0, unit_m)
    assert found.left_deg == pytest.approx(25.0, abs=0.7)
    assert found.right_deg == pytest.approx(40.0, abs=0.7)
    assert found.angle_deg == pytest.approx(0.5 * (found.left_deg + found.right_deg))
    assert found.height_m == pytest.approx(
        unit_m * 28.0 * 0.5 * (math.tan(math.radians(25.0)) + math.tan(math.radians(40.0))), rel=0.15
    )


def test_the_scatter_tells_unlike_sides_from_like_ones():
    assert wedges(30.0, 30.0).scatter_deg < 1.5 < 5.0 < wedges(20.0, 35.0).scatter_deg


def test_grains_that_stand_along_a_wall_are_no_slope():
    """A stack of single grains along an end wall changes no angle."""
    places = np.random.default_rng(4).uniform([1.0, 0.0, 1.0], [LENGTH - 1.0, THICKNESS, 40.0], (20000, 3))
    stays = places[places[:, 2] < 0.6 * (np.abs(places[:, 0] - 0.5 * LENGTH) - 0.5 * SLOT)]
    y, z = (axis.ravel() for axis in np.meshgrid(np.arange(0.0, THICKNESS, 1.0), np.arange(1.0, 40.0)))
    stack = np.column_stack([np.full(len(y), 1.0), y, z])
    free, lined = (slopes(p, np.ones(len(p)), LENGTH, SLOT, THICKNESS) for p in (stays, np.concatenate([stays, stack])))
    assert lined.left_deg == pytest.approx(free.left_deg, abs=0.01)


def test_lengths_of_clumps_are_in_radii_of_equal_volume():
    """The bound of small spheres that belong to larger grains is that of the grains."""
    places = np.random.default_rng(4).uniform([1.0, 0.0, 1.0], [LENGTH - 1.0, THICKNESS, 40.0], (20000, 3))
    spheres = places[places[:, 2] < 0.6 * (np.abs(places[:, 0] - 0.5 * LENGTH) - 0.5 * SLOT)]
    found = slopes(spheres, np.full(len(spheres), 0.8), LENGTH, SLOT, THICKNESS, np.ones(len(spheres) // 2))
    assert found.bound_deg == pytest.approx(math.degrees(math.atan(6.0 / 28.0)))
    assert found.angle_deg == pytest.approx(math.degrees(math.atan(0.6)), abs=1.0)
    assert found.height_m == pytest.approx(28.0 * 0.6, rel=0.15)


def test_a_layer_too_thin_for_a_slope_has_a_bound_and_no_angle():
    found = wedges(5.0, 30.0)
    assert math.isnan(found.left_deg)
    assert math.isnan(found.angle_deg)
    assert found.bound_deg == pytest.approx(math.degrees(math.atan(6.0 / 28.0)))
    nothing = slopes(np.zeros((0, 3)), np.zeros(0), LENGTH, SLOT, THICKNESS)
    assert math.isnan(nothing.angle_deg)


def test_grains_that_wrap_round_the_period_are_seen_from_both_sides():
    """A surface does not depend on where the period is cut."""
    places = np.random.default_rng(2).uniform([1.0, 0.0, 1.0], [LENGTH - 1.0, THICKNESS, 40.0], (20000, 3))
    stays = places[places[:, 2] < np.abs(places[:, 0] - 0.5 * LENGTH) - 0.5 * SLOT]
    radii = np.ones(len(stays))
    moved = stays + [0.0, 5.0 * THICKNESS, 0.0]
    one, other = (slopes(grains, radii, LENGTH, SLOT, THICKNESS) for grains in (stays, moved))
    assert other.angle_deg == pytest.approx(one.angle_deg, abs=1e-6)
    assert one.angle_deg == pytest.approx(45.0, abs=1.0)


def test_the_steady_part_alone_gives_the_rate():
    """A slow beginning and a tail do not count, and a flow without fluctuations has no error."""
    time = np.linspace(0.0, 3.0, 301)
    mass = np.interp(time, [0.0, 0.5, 1.5, 3.0], [0.0, 1.0, 7.0, 10.0])
    assert steady_rate(time, mass) == pytest.approx((6.0, 0.0), abs=1e-9)


def test_the_error_is_that_of_the_mean_over_blocks_of_a_noisy_flow():
    """The rates of many flows scatter by the error that each of them states."""
    rng, n = np.random.default_rng(3), 400
    flows = rng.gamma(4.0, 1.0, (200, n)).cumsum(axis=1)
    found = np.array([steady_rate(np.arange(n, dtype=float), flow) for flow in flows])
    assert found[:, 0].mean() == pytest.approx(4.0, rel=0.02)
    assert 0.6 < found[:, 1].mean() / found[:, 0].std() < 1.4


def test_too_few_samples_give_no_rate():
    time = np.arange(N_BLOCKS, dtype=float)
    assert all(math.isnan(value) for value in steady_rate(time, time))
    assert all(math.isnan(value) for value in steady_rate([0.0, 1.0], [0.0, 0.0]))
    assert all(math.isnan(value) for value in steady_rate([], []))
