"""Bodies that turn: turntable, drum, a loaded wheel, free rotation, and the same world 16 times as large.

A sphere that rolls on a table of rate Omega circles at 2/7 Omega (Weckesser 1997, Am. J. Phys. 65, 736). In a drum it rests where
tan(theta) = mu_r. A free body of moments 1, 2, 3 leaves its middle axis with the e-folding rate Omega sqrt(1/3).
"""

import math
from typing import cast

import numpy as np
from scipy.spatial.transform import Rotation

import dem
from dem import shapes, solids
from virtual_soil.verification.bodies_scene import (
    HALF_M,
    OVERLAP_M,
    RIGID_BODY,
    WEIGHT_N,
    body,
    check,
    on,
    vee,
)
from virtual_soil.verification.check import Check
from virtual_soil.verification.rest import GRAVITY_M_S2, RADIUS_M, TIME_STEP_S
from virtual_soil.verification.scene import record


def checks() -> list[Check]:
    """Run all cases of bodies that turn."""
    return [*turntable(), *drum(), *spinning_wheel(), *free_body(), world_times_sixteen()]


def turntable() -> list[Check]:
    """A sphere rolls on a table that turns at Omega: it circles at 2/7 Omega, here with a period of pi seconds over 10."""
    rate, found = 70.0, []
    quarter = 2.0 * math.pi / (2.0 / 7.0 * rate)
    box = dem.Box(low_m=(-HALF_M, -HALF_M, 0.0), high_m=(HALF_M, HALF_M, 0.0))
    for name, shape in (("box", box), ("disc of triangles", solids.cylinder(0.1, 0.01, position_m=(0.0, 0.0, -0.005)))):
        simulation = on([body(shape, angular_velocity_rad_s=(0.0, 0.0, rate))], restitution=1.0)
        v, radius = 0.2, 0.2 / (2.0 / 7.0 * rate)
        # rolling: v + w x (-r z) = Omega x c, with the sphere's centre at (0, radius) relative to the centre of its circle
        place = np.array([0.01, 0.005, RADIUS_M - OVERLAP_M])
        velocity, under = np.array([v, 0.0, 0.0]), np.cross([0.0, 0.0, rate], place * (1, 1, 0))
        spin = np.cross([0.0, 0.0, 1.0], velocity - under) / (RADIUS_M - OVERLAP_M)
        simulation.add_grains(place, RADIUS_M, "grain", velocity, spin)
        looks = 40
        run = record(simulation, looks, round(quarter / TIME_STEP_S / looks))
        centre, size = circle_through(run.positions_m[:, 0, :2])
        angles = np.unwrap(np.arctan2(*(run.positions_m[:, 0, :2] - centre).T[::-1]))
        turning = abs(np.polyfit(run.times_s, angles, 1)[0])
        away = np.linalg.norm(run.positions_m[:, 0, :2] - centre, axis=1)
        case = f"sphere on a turning table ({name})"
        found += [
            check(case, "rate of its circle over Omega", "-", RIGID_BODY, 2.0 / 7.0, turning / rate, 1e-3),
            check(case, "radius of its circle", "m", RIGID_BODY, radius, size, 2e-3 * radius),
            check(case, "change of the radius over it", "-", RIGID_BODY, 0.0, np.ptp(away) / size, 2e-3),
        ]
    return found


def circle_through(points: np.ndarray) -> tuple[np.ndarray, float]:
    """Centre (2,) and radius of the circle that fits points (n, 2) best (Kasa's method)."""
    terms = np.column_stack([2.0 * points, np.ones(len(points))])
    x, y, rest = np.linalg.lstsq(terms, (points**2).sum(axis=1), rcond=None)[0]
    return np.array([x, y]), math.sqrt(rest + x * x + y * y)


def drum() -> list[Check]:
    """A sphere in a drum that turns: type A, rests at tan(theta) = mu_r and spins at Omega R / r."""
    radius, rate, found = 0.05, 2.0, []
    sides = 360
    ripple = math.pi / sides  # angle between a side and the arc at its ends
    tube = dem.Tube(radius_m=radius, bottom_m=-0.1, top_m=0.1)
    facets = solids.tube(radius, 0.2, sides)
    for name, shape, mu_r, slack in (
        ("tube", tube, 0.1, 0.0), ("tube", tube, 0.0, 0.0), (f"{sides} facets", facets, 0.1, ripple),
    ):  # fmt: skip
        wall = body(shape, "drum", angular_velocity_rad_s=(0.0, 0.0, rate))
        simulation = on([wall], friction=(0.5, mu_r), gravity_m_s2=(0.0, -GRAVITY_M_S2, 0.0))
        angle = math.atan(mu_r)
        reach = radius - RADIUS_M + OVERLAP_M
        place = (reach * math.sin(angle), -reach * math.cos(angle), 0.0)
        simulation.add_grains(place, RADIUS_M, "grain", angular_velocities_rad_s=(0.0, 0.0, rate * radius / RADIUS_M))
        simulation.run(0.5)
        run = record(simulation, 50, round(0.25 / TIME_STEP_S / 50))
        x, y = run.positions_m[:, 0, 0].mean(), run.positions_m[:, 0, 1].mean()
        spin = run.spins_rad_s[:, 0, 2].mean() * RADIUS_M / (rate * radius)
        case, tolerance = f"sphere in a turning drum ({name}), µr = {mu_r:g}", 2e-3 + slack
        torque = simulation.mean_wall_torques_n_m["drum"][2] / (WEIGHT_N * radius)
        found += [
            check(case, "angle", "rad", RIGID_BODY, angle, math.atan2(x, -y), tolerance),
            check(case, "spin times r over Omega R", "-", RIGID_BODY, 1.0, spin, 5e-3 + slack),
            check(case, "torque on the drum over weight and radius", "-", RIGID_BODY, -math.sin(angle), torque, tolerance),
        ]
    return found


def spinning_wheel() -> list[Check]:
    """A wheel under a load spins over a sphere in a rough groove below its axle: F = mu W forwards, T = mu W R."""
    radius, mu, load, sides, rate = 0.02, 0.4, 0.05, 720, 5.0
    drive = dem.Drive(axis=2, applied_force_n=-load, mass_kg=load / GRAVITY_M_S2, damping_kg_s=2.0)
    shape = solids.wheel(radius, 0.01, sides=sides, position_m=(0.0, 0.0, radius + 3.0 * RADIUS_M))
    wheel = body(shape, "wheel", drives=(drive,), angular_velocity_rad_s=(0.0, rate, 0.0))
    rough = dem.Interaction(restitution=0.5, static_friction=10.0, rolling_friction=0.0)
    simulation = on([], friction=(mu, 0.0), gravity_m_s2=(0.0, 0.0, 0.0))
    simulation.set_interaction("grain", "grain", rough)
    simulation.add_wall(dem.Body(name="groove", material="grain", shape=vee(math.radians(30.0))))
    simulation.add_wall(wheel)
    simulation.add_grains((0.0, 0.0, 2.0 * RADIUS_M), RADIUS_M, "grain")
    simulation.run(0.3)
    simulation.advance(round(20 * 2.0 * math.pi / sides / rate / simulation.time_step_s))
    force, torque = simulation.mean_wall_forces_n, simulation.mean_wall_torques_n_m["wheel"]
    case = "loaded wheel spins over one held sphere"
    return [
        check(case, "load carried over load", "-", RIGID_BODY, 1.0, force["wheel"][2] / load, 2e-3),
        check(case, "pull over load", "-", RIGID_BODY, mu, force["wheel"][0] / load, 2e-3),
        check(case, "torque over load and radius", "-", RIGID_BODY, -mu, torque[1] / (load * radius), 2e-3),
        check(case, "force on the groove over load", "-", RIGID_BODY, -mu, force["groove"][0] / load, 2e-3),
    ]


def free_body() -> list[Check]:
    """A body of moments 1, 2, 3 turns freely about its middle axis, until it leaves it."""
    moments = np.array([1.0, 2.0, 3.0]) * 1e-6
    rate, tilt = 30.0, 1e-6
    shape = solids.box((0.02, 0.01, 0.005), position_m=(0.0, 0.0, 0.1))
    free = dem.FreeTurn(moments_kg_m2=tuple(moments))
    simulation = on([body(shape, "top", angular_velocity_rad_s=(tilt * rate, rate, 0.0), turn=free)])
    growth, times, energy, momentum = [], [], [], []
    for _ in range(60):
        simulation.run(0.01)
        top = cast(dem.Mesh, simulation.wall("top"))
        turn = Rotation.from_quat(top.orientation, scalar_first=True).as_matrix()
        spin = turn.T @ top.angular_velocity_rad_s
        growth.append(math.hypot(spin[0], math.sqrt(3.0) * spin[2]) / rate)
        times.append(simulation.time_s)
        energy.append(0.5 * spin @ (moments * spin))
        momentum.append(turn @ (moments * spin))
    energies, momenta = np.array(energy), np.array(momentum)
    small = np.array(growth) < 0.05
    late = small & (np.array(times) > 0.15)
    slope = np.polyfit(np.array(times)[late], np.log(np.array(growth)[late]), 1)[0] / rate
    case = "free body, moments 1, 2, 3, about its middle axis"
    change = np.linalg.norm(momenta - momenta[0], axis=1).max() / np.linalg.norm(momenta[0])
    return [
        check(case, "change of angular momentum, relative", "-", "conservation", 0.0, change, 1e-12),
        check(case, "change of energy, relative", "-", "conservation", 0.0, np.abs(energies / energies[0] - 1.0).max(), 1e-6),
        check(case, "rate of leaving the axis over Omega", "-", "closed form (Euler)", math.sqrt(1.0 / 3.0), slope, 2e-3),
    ]


def stirred(scale: float) -> np.ndarray:
    """State after a wheel with grousers stirred grains, in a world of lengths times `scale`, times times its square root."""
    length, time = scale, math.sqrt(scale)
    material = dem.Material(density_kg_m3=2500.0, poisson_ratio=0.25, shear_modulus_pa=5e6 * scale)
    touch = dem.Interaction(restitution=0.5, static_friction=0.5, rolling_friction=0.1)
    wheel = solids.wheel(
        length * 8e-3, length * 6e-3, 6, length * 2e-3, length * 1e-3, 24, name="wheel", material="soil",
        position_m=(0.0, 0.0, length * 18e-3), velocity_m_s=(0.0, 0.0, -0.1 * length / time),
        angular_velocity_rad_s=(0.0, 20.0 / time, 0.0),
    )  # fmt: skip
    tray = solids.box((length * 0.02, length * 0.012, length * 0.06), solid=False, name="tray", material="soil")
    simulation = dem.Simulation(
        materials={"soil": material}, interactions={("soil", "soil"): touch}, walls=[tray], smallest_radius_m=length * 1e-3,
        precision="float64",
    )  # fmt: skip
    lattice = np.stack(np.meshgrid(*[np.arange(n) for n in (8, 5, 5)], indexing="ij"), axis=-1).reshape(-1, 3)
    places = ((lattice - (3.5, 2.0, 0.0)) * 2.2e-3 + (0.0, 0.0, -28e-3)) * length
    simulation.add_grains(places, length * 1e-3, "soil")
    simulation.advance(3000)
    simulation.add_wall(shapes.placed(wheel, [0.0, 0.0, length * -7e-3, 0.0, 0.0, 0.0, 0.0]))
    simulation.advance(4000)
    grains = simulation.grains
    mass = scale**3
    force = simulation.mean_wall_forces_n["wheel"] / (mass * length / time**2)
    torque = simulation.mean_wall_torques_n_m["wheel"] / (mass * length**2 / time**2)
    return np.concatenate(
        [
            (grains.positions_m / length).ravel(),
            (grains.velocities_m_s / (length / time)).ravel(),
            (grains.angular_velocities_rad_s * time).ravel(),
            force,
            torque,
        ]
    )


def world_times_sixteen() -> Check:
    """A wheel stirs grains in a world 16 times as large: every number is a power of two times the other's."""
    small, large = stirred(1.0), stirred(16.0)
    assert np.abs(small[-3:]).max() > 0.0
    case = "wheel with grousers in a tray of grains, world × 16"
    return check(case, "numbers that are not the same", "-", "dimensional analysis", 0, (small != large).sum())
