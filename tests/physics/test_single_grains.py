"""Laws of nature for one or two grains, through the public API: closed forms of ../../docs and Chung & Ooi 2011."""

import math

import numpy as np
import pytest

import dem
from dem.layout import UY, VX

GLASS = {"density_kg_m3": 2800.0, "poisson_ratio": 0.2, "shear_modulus_pa": 4.8e10 / 2.4}
ALUMINIUM = {"density_kg_m3": 2699.0, "poisson_ratio": 0.3, "shear_modulus_pa": 7e10 / 2.6}
ALUMINIUM_OXIDE = {"density_kg_m3": 4000.0, "poisson_ratio": 0.23, "shear_modulus_pa": 3.8e11 / 2.46}
#: A wall so stiff that it stands for a rigid one.
RIGID = {"density_kg_m3": 1.0, "poisson_ratio": 0.0, "shear_modulus_pa": 1e22}


def world(grain, radius, *, e=1.0, mu_s=0.0, mu_r=0.0, walls=(), gravity=(0.0, 0.0, 0.0), step=0.01, **settings):
    materials = {"grain": dem.Material(**grain)}
    if walls:
        materials["rigid"] = dem.Material(**{**RIGID, "density_kg_m3": 1e22})
    touch = dem.Interaction(restitution=e, static_friction=mu_s, rolling_friction=mu_r)
    return dem.Simulation(
        materials=materials, interactions={("grain", other): touch for other in materials}, walls=walls, gravity_m_s2=gravity,
        smallest_radius_m=radius, time_step_rayleigh_ratio=step, precision=settings.pop("precision", "float64"), **settings,
    )  # fmt: skip


def ground():
    return dem.Box(name="ground", material="rigid", low_m=(-100.0, -100.0, 0.0), high_m=(100.0, 100.0, 0.0))


def impact(simulation):
    """Largest overlap over the radius and duration of the contact, stepping until the grains part."""
    largest, duration = 0.0, 0.0
    for _ in range(100000):
        simulation.advance(1)
        overlap = simulation.largest_overlap_ratio()
        if overlap > 0:
            duration += simulation.time_step_s
        elif duration:
            break
        largest = max(largest, overlap)
    return largest, duration


def test_two_glass_spheres_collide_as_hertz_says():
    """Chung & Ooi 2011, test 1: delta_max 274.11 um and 40.339 us."""
    r = 0.01
    simulation = world(GLASS, r, step=0.005)
    simulation.add_grains([(-1.0001 * r, 0, 0), (1.0001 * r, 0, 0)], r, "grain", velocities_m_s=[(10, 0, 0), (-10, 0, 0)])
    largest, duration = impact(simulation)
    assert largest * r == pytest.approx(274.11e-6, rel=2e-3)
    assert duration == pytest.approx(40.339e-6, rel=2e-2)
    assert simulation.grains.velocities_m_s[:, 0] == pytest.approx([-10, 10], rel=1e-3)


def test_a_sphere_hits_a_rigid_wall_as_hertz_says():
    """Chung & Ooi 2011, test 2: F_max 11 369.9 N, 731.66 us."""
    r, v = 0.1, 0.2
    simulation = world(ALUMINIUM, r, walls=[ground()], step=0.002)
    simulation.add_grains([(0, 0, 1.00001 * r)], r, "grain", velocities_m_s=(0, 0, -v))
    forces = []
    while simulation.grains.velocities_m_s[0, 2] < 0.999 * v and len(forces) < 20000:
        simulation.advance(1)
        forces.append(-simulation.mean_wall_forces_n["ground"][2])
    assert max(forces) == pytest.approx(11369.9, rel=1e-3)
    contact_time = np.count_nonzero(forces) * simulation.time_step_s
    assert contact_time == pytest.approx(731.66e-6, rel=5e-2)  # the loop stops just before the last, weakest part


@pytest.mark.parametrize("e", [0.5, 0.7, 0.9, 1.0])
def test_the_rebound_is_near_the_restitution_asked_for(e):
    """Chung & Ooi 2011, test 3. The linear spring's beta is off for a Hertz contact: less than 0.04 from e = 0.5 on."""
    r, v = 2.5e-3, 3.9
    simulation = world(ALUMINIUM_OXIDE, r, e=e, walls=[ground()], step=0.005)
    simulation.add_grains([(0, 0, 1.0001 * r)], r, "grain", velocities_m_s=(0, 0, -v))
    simulation.advance(2000)
    assert simulation.grains.velocities_m_s[0, 2] / v == pytest.approx(e, abs=0.04 if e < 1 else 1e-4)


@pytest.mark.parametrize("degrees", [45, 60, 75])
def test_gross_sliding_gives_the_tangential_restitution_of_coulomb(degrees):
    """Chung & Ooi 2011, test 4, where the contact slides throughout: e_t = 1 - mu (1 + e) / tan(theta)."""
    r, v, mu = 2.5e-3, 3.9, 0.092
    theta = math.radians(degrees)
    simulation = world(ALUMINIUM_OXIDE, r, e=0.98, mu_s=mu, walls=[ground()], step=0.005)
    simulation.add_grains([(0, 0, 1.0001 * r)], r, "grain", velocities_m_s=(v * math.sin(theta), 0, -v * math.cos(theta)))
    simulation.advance(2000)
    after = simulation.grains
    e_n = after.velocities_m_s[0, 2] / (v * math.cos(theta))
    expected = 1 - mu * (1 + e_n) / math.tan(theta)
    assert after.velocities_m_s[0, 0] / (v * math.sin(theta)) == pytest.approx(expected, abs=2e-3)
    spin = 5 * mu * (1 + e_n) * v * math.cos(theta) / (2 * r)
    assert after.angular_velocities_rad_s[0, 1] == pytest.approx(spin, rel=3e-3)


@pytest.mark.parametrize(("degrees", "e_t"), [(5, 0.948), (10, 0.687), (15, 0.624), (20, 0.616), (25, 0.634), (30, 0.684)])
def test_sticking_impacts_follow_the_published_curve(degrees, e_t):
    """Chung & Ooi 2011, test 4, digitised from Kharaz et al. 2001."""
    r, v = 2.5e-3, 3.9
    theta = math.radians(degrees)
    simulation = world(ALUMINIUM_OXIDE, r, e=0.98, mu_s=0.092, walls=[ground()], step=0.005)
    simulation.add_grains([(0, 0, 1.0001 * r)], r, "grain", velocities_m_s=(v * math.sin(theta), 0, -v * math.cos(theta)))
    simulation.advance(2000)
    assert simulation.grains.velocities_m_s[0, 0] / (v * math.sin(theta)) == pytest.approx(e_t, abs=0.03)


def test_spheres_whose_surfaces_do_not_slip_exchange_no_spin():
    """Chung & Ooi 2011, test 7: head-on with spins such that the surfaces roll on each other."""
    r = 0.01
    simulation = world(GLASS, r, mu_s=0.4, step=0.02)
    simulation.add_grains(
        [(-1.0001 * r, 0, 0), (1.0001 * r, 0, 0)], r, "grain",
        velocities_m_s=[(0.2, 0, 0), (-0.2, 0, 0)], angular_velocities_rad_s=[(0, 0, 5), (0, 0, -5)],
    )  # fmt: skip
    simulation.advance(5000)
    assert simulation.grains.velocities_m_s[0, 0] < 0
    assert simulation.grains.angular_velocities_rad_s[:, 2] == pytest.approx([5, -5], rel=1e-9)


def on_ground(mu_s, mu_r, velocity, gravity=(0.0, 0.0, -9.81), **settings):
    """One soft-ish grain resting on the ground."""
    r = 1e-3
    grain = {"density_kg_m3": 2500.0, "poisson_ratio": 0.2, "shear_modulus_pa": 1e7}
    simulation = world(grain, r, e=0.5, mu_s=mu_s, mu_r=mu_r, walls=[ground()], gravity=gravity, step=0.1, **settings)
    simulation.add_grains([(0, 0, r * (1 - 1e-5))], r, "grain")
    simulation.run(0.05)
    simulation._state.grains.motion[VX : VX + 3] += velocity
    return simulation


def test_a_sliding_sphere_starts_to_roll_at_five_sevenths_of_its_speed():
    mu, v0 = 0.3, 0.1
    simulation = on_ground(mu, 0.0, (v0, 0, 0))
    stick = 2 * v0 / (7 * mu * 9.81)
    simulation.run(0.5 * stick)
    assert simulation.grains.velocities_m_s[0, 0] == pytest.approx(v0 - 0.5 * mu * 9.81 * stick, rel=0.02)
    simulation.run(2 * stick)
    assert simulation.grains.velocities_m_s[0, 0] == pytest.approx(5 / 7 * v0, rel=0.01)


def test_type_a_brakes_a_rolling_sphere_with_the_torque_mu_r_F_R():
    mu_r, v0, r = 0.01, 0.1, 1e-3
    simulation = on_ground(0.5, mu_r, (v0, 0, 0))
    simulation._state.grains.motion[UY] = v0  # rolling: spin velocity equals speed
    simulation.run(0.2)
    braked = 5 * mu_r * 9.81 / (7 * r) * 0.2 * r
    assert v0 - simulation.grains.velocities_m_s[0, 0] == pytest.approx(braked, rel=0.02)


@pytest.mark.parametrize("rolling_model", ["type_a", "type_c"])
@pytest.mark.parametrize(("mu_r", "stays"), [(0.15, False), (0.25, True)])
def test_on_an_incline_a_sphere_stays_if_rolling_friction_exceeds_the_slope(rolling_model, mu_r, stays):
    slope = math.atan(0.2)
    gravity = (9.81 * math.sin(slope), 0.0, -9.81 * math.cos(slope))
    simulation = on_ground(0.5, mu_r, (0, 0, 0), gravity, rolling_model=rolling_model)
    simulation.run(0.3)
    assert (abs(simulation.grains.velocities_m_s[0, 0]) < 1e-3) == stays


def test_without_rolling_friction_a_sphere_rolls_down_at_five_sevenths_of_gravity():
    slope = 0.2
    gravity = (9.81 * math.sin(slope), 0.0, -9.81 * math.cos(slope))
    simulation = on_ground(0.5, 0.0, (0, 0, 0), gravity)
    before = simulation.grains.velocities_m_s[0, 0]
    simulation.run(0.1)
    gained = simulation.grains.velocities_m_s[0, 0] - before
    assert gained == pytest.approx(5 / 7 * 9.81 * math.sin(slope) * 0.1, rel=0.01)


def test_an_isolated_cloud_keeps_its_momentum_and_angular_momentum():
    rng = np.random.default_rng(2)
    r = 1e-3
    grain = {"density_kg_m3": 2500.0, "poisson_ratio": 0.2, "shear_modulus_pa": 1e7}
    simulation = world(grain, 0.5 * r, e=0.7, mu_s=0.5, step=0.1)
    positions = np.stack(np.meshgrid(*[np.arange(4) * 2.05 * r] * 3), -1).reshape(-1, 3)
    radii = rng.uniform(0.5 * r, r, 64)
    centre = positions.mean(axis=0)
    simulation.add_grains(positions, radii, "grain", velocities_m_s=-20 * (positions - centre) + rng.normal(0, 0.02, (64, 3)))

    def momenta():
        now = simulation.grains
        mass = 4 / 3 * np.pi * 2500 * now.radii_m**3
        p = mass[:, None] * now.velocities_m_s
        spin = 0.4 * (mass * now.radii_m**2)[:, None] * now.angular_velocities_rad_s
        return p.sum(axis=0), (np.cross(now.positions_m, p) + spin).sum(axis=0), np.abs(p).sum(), np.abs(spin).sum()

    p0, l0, scale, _ = momenta()
    simulation.run(0.1)
    p1, l1, _, spun = momenta()
    assert spun > 1e-3 * scale * r  # the grains did touch and spin up
    assert np.abs(p1 - p0).max() < 1e-12 * scale
    assert np.abs(l1 - l0).max() < 1e-5 * scale * 8 * r
