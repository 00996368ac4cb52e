"""Moving the grains by one step: symplectic Euler, which is velocity Verlet with velocities half a step behind.

m dv/dt = F + m g,  (2/5) m du/dt = Q (u = radius x angular velocity). Source: Allen & Tildesley, Computer Simulation of Liquids.
"""

import math

import numpy as np

from dem.contact.rolling import resist
from dem.jit import jit
from dem.layout import FREE, GRAIN, INVERSE_MASS, LOAD, RESIST, U


@jit
def integrate(grains, loads, gravity, dt, zero):
    """Advance all grains by dt, clear the loads, return the largest speed (m/s)."""
    fastest = 0.0
    gx, gy, gz = gravity[0] * dt, gravity[1] * dt, gravity[2] * dt
    for k in range(grains.shape[0] // GRAIN):
        i = np.uint64(k * GRAIN)
        a = np.uint64(k * LOAD)
        kick = grains[i + U[INVERSE_MASS]] * dt
        free = grains[i + U[FREE]]
        vx = grains[i + U[3]] + kick * loads[a] + free * gx
        vy = grains[i + U[4]] + kick * loads[a + U[1]] + free * gy
        vz = grains[i + U[5]] + kick * loads[a + U[2]] + free * gz
        twist = 2.5 * kick
        ux = grains[i + U[6]] + twist * loads[a + U[3]]
        uy = grains[i + U[7]] + twist * loads[a + U[4]]
        uz = grains[i + U[8]] + twist * loads[a + U[5]]
        keep = resist(ux, uy, uz, twist * loads[a + U[RESIST]])
        grains[i + U[6]] = ux * keep
        grains[i + U[7]] = uy * keep
        grains[i + U[8]] = uz * keep
        grains[i + U[3]] = vx
        grains[i + U[4]] = vy
        grains[i + U[5]] = vz
        grains[i] += vx * dt
        grains[i + U[1]] += vy * dt
        grains[i + U[2]] += vz * dt
        fastest = max(fastest, vx * vx + vy * vy + vz * vz)
        for t in range(LOAD):
            loads[a + U[t]] = zero
    return math.sqrt(fastest)


@jit
def carry_glued(grains, loads, walls, glued, carrier):
    """Hand the loads on grains glued to a wall over to that wall, and give them its velocity."""
    for k in range(glued.shape[0]):
        w = carrier[k]
        i = GRAIN * glued[k]
        a = LOAD * glued[k]
        for t in range(3):
            walls.force[w, t] += loads[a + t]
            grains[i + 3 + t] = walls.velocity[w, t]
            grains[i + 6 + t] = 0.0


@jit
def kinetic_energy(grains):
    """Translational and rotational kinetic energy of all free grains, in J."""
    translation, rotation = 0.0, 0.0
    for k in range(grains.shape[0] // GRAIN):
        i = k * GRAIN
        if grains[i + INVERSE_MASS] > 0.0:
            translation += 0.5 / grains[i + INVERSE_MASS] * (grains[i + 3] ** 2 + grains[i + 4] ** 2 + grains[i + 5] ** 2)
            rotation += 0.2 / grains[i + INVERSE_MASS] * (grains[i + 6] ** 2 + grains[i + 7] ** 2 + grains[i + 8] ** 2)
    return translation, rotation
