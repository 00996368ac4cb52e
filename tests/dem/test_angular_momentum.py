"""Angular momentum of a bed in a box and of a wheel that turns in it: what gravity, walls and motor gave it.

About the origin, step by step. Places are those at which the forces act and velocities half a step behind, so that x x v grows by
exactly x x F dt / m in a step, and the balance closes to the rounding of the contacts.
"""

import numpy as np

import dem
from dem import solids

MATERIAL = dem.Material(density_kg_m3=2500.0, poisson_ratio=0.2, shear_modulus_pa=1e6)
R_M, SIDES_M, WHEEL_R_M, LOAD_N = 1e-3, (0.030, 0.014), 0.008, 0.05


def box_of_grains(rolling_friction):
    """Grains that fall in a box under a wheel which a load presses down; a period far away, for the kernels of `test_readings`."""
    touch = dem.Interaction(restitution=0.5, static_friction=0.5, rolling_friction=rolling_friction)
    (x, y), inf = SIDES_M, np.inf
    corners = {"floor": ((-inf, -inf, -inf), (inf, inf, 0.0)), "left": ((-inf, -inf, -inf), (0.0, inf, inf))}
    corners |= {"right": ((x, -inf, -inf), (inf, inf, inf)), "front": ((-inf, -inf, -inf), (inf, 0.0, inf))}
    corners |= {"back": ((-inf, y, -inf), (inf, inf, inf))}
    walls = [
        dem.Box(name=name, material="soil", low_m=low, high_m=high, pivot_m=(0.0, 0.0, 0.0))
        for name, (low, high) in corners.items()
    ]
    simulation = dem.Simulation(
        materials={"soil": MATERIAL}, interactions={("soil", "soil"): touch}, walls=walls, smallest_radius_m=R_M,
        period_m=(0.0, 1.0, 0.0),
    )  # fmt: skip
    lattice = np.stack(np.meshgrid(np.arange(13), np.arange(6), np.arange(4), indexing="ij"), axis=-1).reshape(-1, 3)
    places = 2.2e-3 * lattice + np.random.default_rng(1).uniform(1.1e-3, 1.3e-3, (len(lattice), 3))
    simulation.add_grains(places, R_M, "soil")
    motion = dem.Motion(
        drives=(dem.Drive(axis=2, applied_force_n=-LOAD_N, mass_kg=0.005),), angular_velocity_rad_s=(0.0, 10.0, 0.0)
    )
    shape = solids.wheel(WHEEL_R_M, 0.008, sides=60, position_m=(0.4 * x, 0.5 * y, 0.0178))
    simulation.add_wall(dem.Body(name="wheel", material="soil", shape=shape, motion=motion))
    return simulation


def angular_momentum(grains):
    """Of the grains about the origin (3,)."""
    mass = MATERIAL.density_kg_m3 * 4.0 / 3.0 * np.pi * grains.radii_m**3
    orbit = mass[:, None] * np.cross(grains.positions_m, grains.velocities_m_s)
    return (orbit + (0.4 * mass * grains.radii_m**2)[:, None] * grains.angular_velocities_rad_s).sum(axis=0)


def residual_ratio(rolling_friction, n_steps=1500):
    """What the angular momentum about the origin misses over load, time and radius, and the motor's impulse in the same unit."""
    simulation = box_of_grains(rolling_friction)
    mass, dt = MATERIAL.density_kg_m3 * 4.0 / 3.0 * np.pi * R_M**3, simulation.time_step_s
    before, given, motor = angular_momentum(simulation.grains), np.zeros(3), 0.0
    for _ in range(n_steps):
        places = simulation.grains.positions_m
        pivots = {name: np.asarray(simulation.wall(name).pivot) for name in simulation.wall_names}
        simulation.advance(1)
        given += np.cross(mass * places, simulation.gravity_m_s2).sum(axis=0) * dt
        for name, pivot in pivots.items():
            force, torque = simulation.mean_wall_forces_n[name], simulation.mean_wall_torques_n_m[name]
            given -= (np.cross(pivot, force) + torque) * dt
        motor -= simulation.mean_wall_torques_n_m["wheel"][1] * dt
    scale = LOAD_N * n_steps * dt * WHEEL_R_M
    return np.linalg.norm(angular_momentum(simulation.grains) - before - given) / scale, motor / scale


def test_angular_momentum_of_grains_and_wheel_is_what_acted_on_them():
    residual, motor = residual_ratio(rolling_friction=0.0)
    assert residual < 1e-5
    assert motor > 0.005


def test_rolling_resistance_of_type_a_takes_angular_momentum_away():
    """It brakes each grain against space, without a torque on what the grain rolls on."""
    residual, _ = residual_ratio(rolling_friction=0.2)
    assert residual > 0.01
