"""Stresses along a rim: signs, closed forms, integrals; and the flow under a tool."""

import numpy as np
import pytest

from dem import Grains
from dem.measure.flow import plane_flow
from dem.measure.rim import N_BINS, integrated, rim_loads, rim_stress, steady_loads, theta_rad

R, B = 0.05, 0.04
AREA_M2 = R * B * 2.0 * np.pi / N_BINS


def contacts(theta, normal, shear):
    """A contact with a smooth rim at each angle, with forces towards the axle and along the rim."""
    theta, normal, shear = np.broadcast_arrays(np.asarray(theta, float), normal, shear)
    zero = np.zeros_like(theta)
    arms = R * np.stack([np.sin(theta), zero, -np.cos(theta)], axis=1)
    cos, sin = np.cos(theta), np.sin(theta)
    forces = np.stack([shear * cos - normal * sin, zero, normal * cos + shear * sin], axis=1)
    return arms, forces, np.cross(arms, forces)


def test_a_load_below_the_axle_is_normal_and_a_push_forwards_there_is_shear_that_the_motor_feels():
    """Force (1, 3) N at the lowest point; and at the foremost point a weight of 2 N, which turns the wheel forwards."""
    arms, torques = np.array([[1e-9, 0.0, -R], [R, 0.0, 0.0]]), np.array([[0.0, -R, 0.0], [0.0, 2.0 * R, 0.0]])
    forces = np.array([[1.0, 0.0, 3.0], [0.0, 0.0, -2.0]])
    loads = rim_loads(arms, forces, torques, np.zeros(2, int), 1)[0]
    lowest, foremost = N_BINS // 2, 3 * N_BINS // 4
    assert loads[lowest] == pytest.approx([3.0, 1.0, R], abs=1e-6)
    assert loads[foremost] == pytest.approx([0.0, -2.0, -2.0 * R])
    assert not np.delete(loads, [lowest, foremost], axis=0).any()


def test_stresses_are_loads_over_the_area_of_a_bin_with_the_error_of_block_means():
    theta = theta_rad()
    means = np.array([1.0, 1.0, 2.0, 3.0, 3.0])
    first = np.zeros(N_BINS, int)
    loads = np.stack([rim_loads(*contacts(theta, k * np.abs(theta), 0.5), first, 1)[0] for k in np.repeat(means, 4)])
    found = rim_stress(loads, R, B)
    assert found.theta_deg[[0, -1]] == pytest.approx([-177.5, 177.5])
    assert found.normal_stress_pa == pytest.approx(2.0 * np.abs(theta) / AREA_M2)
    assert found.normal_stress_error_pa == pytest.approx(np.abs(theta) / AREA_M2 * np.sqrt(1.0 / 5.0))
    assert found.shear_stress_pa == pytest.approx(0.5 / AREA_M2)
    assert found.shear_stress_error_pa == pytest.approx(0.0, abs=1e-9 / AREA_M2)


def test_stresses_add_up_to_the_forces_that_they_came_from():
    rng = np.random.default_rng(1)
    theta = rng.uniform(-0.6, 1.0, 4000)
    arms, forces, torques = contacts(theta, 1.0 + theta, 0.4)
    loads = rim_loads(arms, forces, torques, np.arange(4000) % 20, 20)
    found = integrated(rim_stress(loads, R, B), R, B)
    assert found["drawbar_pull_n"] == pytest.approx(forces[:, 0].sum() / 20, rel=2e-3)
    assert found["load_n"] == pytest.approx(forces[:, 2].sum() / 20, rel=2e-3)
    assert found["torque_n_m"] == pytest.approx(-torques[:, 1].sum() / 20, rel=1e-9)


def test_only_samples_of_the_steady_stretch_count_also_those_without_contacts():
    time = np.array([-1.0, 0.2, 0.5, 0.7, 0.8, 0.9, 1.0])
    arms, forces, torques = contacts(np.zeros(4), [1.0, 2.0, 4.0, 8.0], 0.0)
    rim = {"sample": np.array([1, 3, 3, 6]), "arms_m": arms, "forces_n": forces, "torques_n_m": torques}
    loads = steady_loads(rim, time)
    assert loads.sum(axis=1)[:, 0] == pytest.approx([6.0, 0.0, 0.0, 8.0])


def grains(positions):
    return Grains(positions, np.full_like(positions, 99.0), np.zeros_like(positions), np.full(len(positions), 1e-3))


def test_a_rigid_translation_is_the_same_displacement_and_velocity_everywhere():
    """Also of grains whose places are periods away."""
    rng = np.random.default_rng(2)
    rest = rng.uniform(0.0, (0.1, 0.04, 0.03), (500, 3)) + (0.2, -0.08, 0.0)
    begin, end = rest + (0.010, 0.0, -0.002), rest + (0.014, 0.0, -0.004)
    centre, period = np.array([0.05, 0.02, 0.04]), np.array([0.1, 0.04, 0.0])
    found = plane_flow(grains(rest), grains(begin), grains(end), 0.5, centre, 0.005, period)
    assert found["displacement_x_m"] == pytest.approx(0.012)
    assert found["displacement_z_m"] == pytest.approx(-0.003)
    assert found["velocity_x_m_s"] == pytest.approx(0.008)
    assert found["velocity_z_m_s"] == pytest.approx(-0.004)
    assert 80 < len(found["x_m"]) < 170  # a quarter of the width
    assert np.abs(found["x_m"]).max() <= 0.05
    assert found["z_m"].min() >= -0.04 - 0.004
