"""Momentum and energy of a bed: what it holds, and whether what acted on it adds up."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from dem import Simulation
from dem.experiments.soil import Soil


class Content(NamedTuple):
    """Of the grains that are not glued: mass in kg, momentum (3,) in kg m/s, kinetic and potential energy (of z = 0) in J."""

    mass_kg: float
    momentum: np.ndarray
    kinetic_j: float
    potential_j: float


def content(simulation: Simulation, soil: Soil, glued: np.ndarray) -> Content:
    """What the free grains have now; glued : numbers of the grains (of clumps, whole ones) that belong to a body."""
    grains = soil.wholes(simulation.grains)
    free = np.ones(len(grains), bool)
    free[glued] = False
    mass = 4.0 / 3.0 * math.pi * soil.density_kg_m3 * grains.radii_m[free] ** 3
    g_m_s2 = -simulation.gravity_m_s2[2]
    return Content(
        mass_kg=float(mass.sum()),
        momentum=mass @ grains.velocities_m_s[free],
        kinetic_j=simulation.kinetic_energy_j,
        potential_j=g_m_s2 * float(mass @ grains.positions_m[free, 2]),
    )


def momentum_residual(
    before: Content, after: Content, gravity_m_s2: Sequence[float], duration_s: float, impulses: list
) -> np.ndarray:
    """Residual (3,) in N s of the grains' momentum balance; impulses : what they did to each body, (3,) in N s."""
    gained = after.mass_kg * np.asarray(gravity_m_s2) * duration_s - np.sum(impulses, axis=0)
    return after.momentum - before.momentum - gained
