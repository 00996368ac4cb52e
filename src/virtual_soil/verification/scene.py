"""Shared by the cases: materials of the published tests, a rigid wall, and a simulation with a given time step."""

import math
from dataclasses import dataclass

import numpy as np

import dem


def elastic(density_kg_m3: float, young_modulus_pa: float, poisson_ratio: float) -> dem.Material:
    """Create a material from its Young's modulus, as in papers: G = E / (2 (1 + nu))."""
    return dem.Material(
        density_kg_m3=density_kg_m3, poisson_ratio=poisson_ratio, shear_modulus_pa=young_modulus_pa / (2.0 * (1.0 + poisson_ratio))
    )


#: Chung & Ooi 2011 (Granular Matter 13, 643): materials of their tests 1, 2 and 5 to 8, 3 and 4.
GLASS = elastic(2800.0, 4.8e10, 0.20)
ALUMINIUM = elastic(2699.0, 7.0e10, 0.30)
ALUMINIUM_OXIDE = elastic(4000.0, 3.8e11, 0.23)

#: Soft grains for the cases under gravity, whose results do not depend on the modulus: larger steps.
SOFT = elastic(2500.0, 2.4e7, 0.20)

#: Wall 1e11 times as stiff as any grain, so that E* = E / (1 - nu^2) and G* = G / (2 - nu) of the grain. Walls have no mass in the
#: engine; the high density only prevents the wall from limiting the time step, which is proportional to sqrt(density / modulus).
RIGID = dem.Material(density_kg_m3=1e22, poisson_ratio=0.0, shear_modulus_pa=1e22)

#: Unit roundoff of the contact arithmetic: maximum relative error of a number.
PRECISIONS = {"float64": 2.0**-53, "float32": 2.0**-24}

FLOOR = dem.Box(name="floor", material="rigid", low_m=(-10.0, -10.0, 0.0), high_m=(10.0, 10.0, 0.0))


def scene(
    grain: dem.Material,
    smallest_radius_m: float,
    time_step_s: float,
    *,
    restitution: float = 1.0,
    static_friction: float = 0.0,
    rolling_friction: float = 0.0,
    gravity_m_s2=(0.0, 0.0, 0.0),
    precision: str = "float64",
    **settings,
) -> dem.Simulation:
    """Create an empty simulation of one material, "grain", and "rigid" walls, with a time step in s instead of a ratio.

    settings : arguments of `dem.Simulation`. Raises ValueError for a time step above half the Rayleigh time.
    """
    touch = dem.Interaction(restitution=restitution, static_friction=static_friction, rolling_friction=rolling_friction)
    return dem.Simulation(
        materials={"grain": grain, "rigid": RIGID},
        interactions={("grain", "grain"): touch, ("grain", "rigid"): touch},
        smallest_radius_m=smallest_radius_m,
        time_step_rayleigh_ratio=time_step_s / dem.rayleigh_time(smallest_radius_m, grain),
        gravity_m_s2=gravity_m_s2,
        precision=precision,
        **settings,
    )


def mass_kg(material: dem.Material, radius_m):
    """Mass of solid spheres in kg; the result has the shape of radius_m."""
    return material.density_kg_m3 * 4.0 / 3.0 * math.pi * radius_m**3


@dataclass(frozen=True)
class History:
    """States of a run, one per sample: times_s (t,), positions_m, velocities_m_s, spins_rad_s (t, n, 3), floor_forces_n (t, 3).

    Velocities and spins lag the positions by half a step. The forces are means over the steps since the previous sample.
    """

    times_s: np.ndarray
    positions_m: np.ndarray
    velocities_m_s: np.ndarray
    spins_rad_s: np.ndarray
    floor_forces_n: np.ndarray


def record(simulation: dem.Simulation, n_looks: int, every_steps: int = 1) -> History:
    """Run n_looks times every_steps steps and store the state at the start and at every sample."""
    rows = []
    for look in range(n_looks + 1):
        if look:
            simulation.advance(every_steps)
        grains, force = simulation.grains, simulation.mean_wall_forces_n.get("floor", np.zeros(3))
        rows.append((simulation.time_s, grains.positions_m, grains.velocities_m_s, grains.angular_velocities_rad_s, force))
    return History(*(np.array(column) for column in zip(*rows, strict=True)))
