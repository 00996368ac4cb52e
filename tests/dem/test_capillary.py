"""Liquid bridges in simulations: they form at touch, outlast the contact, break at their distance, and the ledger closes."""

import math
from itertools import pairwise

import numpy as np
import pytest

import dem

RADIUS, WORK, VOLUME = 50e-6, 0.1, 1e-3
R_STAR = RADIUS / 2
PULL_OFF, BREAKS = 2 * math.pi * WORK * R_STAR, 0.1 * R_STAR
GLASS = dem.Material(density_kg_m3=3000.0, poisson_ratio=0.2, shear_modulus_pa=5e7)
MASS = 3000.0 * 4 / 3 * math.pi * RADIUS**3


def scene(volume=VOLUME, restitution=1.0, **settings):
    """A simulation of one moist material, without gravity; all with an energy ledger, so that one kernel is compiled."""
    touch = dem.Interaction(
        restitution=restitution, static_friction=0.3, rolling_friction=0.1, work_of_adhesion_j_m2=WORK, bridge_volume_ratio=volume
    )
    return dem.Simulation(
        materials={"glass": GLASS}, interactions={("glass", "glass"): touch}, smallest_radius_m=RADIUS, adhesion="capillary",
        gravity_m_s2=(0.0, 0.0, 0.0), energy_ledger=True, **settings,
    )  # fmt: skip


def curve(simulation, first_m, last_m, n_steps=1000):
    """Gaps (n,) and forces (n,) in N of two grains that pass from one gap to another, fast enough not to be held."""
    speed = (last_m - first_m) / (n_steps * simulation.time_step_s)
    half = RADIUS + 0.5 * first_m
    places, apart = [(-half, 0.0, 0.0), (half, 0.0, 0.0)], np.array([(-0.5, 0.0, 0.0), (0.5, 0.0, 0.0)])
    simulation.add_grains(places, RADIUS, "glass", speed * apart)
    gaps, speeds = [], [speed]
    for _ in range(n_steps):
        gaps.append(np.ptp(simulation.grains.positions_m[:, 0]) - 2 * RADIUS)
        simulation.advance(1)
        velocities = simulation.grains.velocities_m_s[:, 0]
        speeds.append(velocities[1] - velocities[0])
    return np.array(gaps), 0.5 * MASS * np.array([after - before for before, after in pairwise(speeds)]) / simulation.time_step_s


def test_two_grains_drawn_apart_are_pulled_by_the_bridge_until_it_breaks():
    gaps, forces = curve(scene(time_step_rayleigh_ratio=1e-3), -0.02 * BREAKS, 1.2 * BREAKS)
    pulled = (gaps > 0) & (gaps < 0.998 * BREAKS)
    x = gaps[pulled] * math.sqrt(2 * R_STAR / (VOLUME * R_STAR**3))
    assert pulled.sum() > 700
    assert forces[pulled] == pytest.approx(-PULL_OFF / (1 + 1.05 * x + 2.5 * x**2), abs=2e-3 * PULL_OFF)
    assert (forces[gaps > 1.002 * BREAKS] == 0.0).all()


def test_grains_that_approach_feel_nothing_until_they_touch():
    gaps, forces = curve(scene(time_step_rayleigh_ratio=1e-3), BREAKS, -0.02 * BREAKS)
    assert abs(forces[gaps > 0]).max() < 1e-9 * PULL_OFF
    assert forces[gaps < 0].min() < -0.9 * PULL_OFF


def test_without_liquid_the_contact_ends_where_the_grains_part():
    gaps, forces = curve(scene(volume=0.0, time_step_rayleigh_ratio=1e-3), -0.02 * BREAKS, 0.2 * BREAKS)
    assert forces[gaps < 0].min() == pytest.approx(-PULL_OFF, rel=1e-2)
    assert (forces[gaps > 1e-3 * BREAKS] == 0.0).all()


def test_the_energy_ledger_closes_where_bridges_form_and_break():
    residuals = []
    for step in (0.1, 0.025):
        simulation = scene(volume=1e-2, restitution=0.7, time_step_rayleigh_ratio=step)
        rng = np.random.default_rng(2)
        lattice = np.stack(np.meshgrid(*[np.arange(3)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
        places = (lattice - 1.0) * 2.05 * RADIUS
        simulation.add_grains(places, RADIUS, "glass", -2000.0 * places + rng.normal(0.0, 0.2, places.shape))
        simulation.run(4e-4)
        residuals.append(abs(simulation.energies_j["residual"]) / simulation.energies_j["dissipated"])
        assert (
            simulation.energies_j["springs_remade"] < 0.1 * simulation.energies_j["dissipated"]
        )  # a bridge holds no tangential spring
    assert residuals[0] < 2e-3
    assert residuals[1] < 5e-4
