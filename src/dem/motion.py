"""Moving the grains by one step: symplectic Euler, which is velocity Verlet with velocities half a step behind.

m dv/dt = F + m g,  (2/5) m du/dt = Q (u = radius x angular velocity). Source: Allen & Tildesley, Computer Simulation of Liquids.
"""

import math

import numpy as np

from dem.contact.rolling import resist
from dem.jit import jit, lean_jit
from dem.layout import FREE, GRAIN, INVERSE_MASS, LOAD, QX, QY, QZ, RESIST, UX, UY, UZ, VX, VY, VZ, U


@lean_jit
def integrate(grains, loads, which, gravity, dt, zero):
    """Advance the grains of the numbers `which` by dt, clear their loads, return the largest speed (m/s)."""
    fastest = 0.0
    gx, gy, gz = gravity[0] * dt, gravity[1] * dt, gravity[2] * dt
    for k in range(which.shape[0]):
        i = np.uint64(which[k] * GRAIN)
        a = np.uint64(which[k] * LOAD)
        kick = grains[i + U[INVERSE_MASS]] * dt
        free = grains[i + U[FREE]]
        vx = grains[i + U[VX]] + kick * loads[a] + free * gx
        vy = grains[i + U[VY]] + kick * loads[a + U[1]] + free * gy
        vz = grains[i + U[VZ]] + kick * loads[a + U[2]] + free * gz
        twist = 2.5 * kick
        ux = grains[i + U[UX]] + twist * loads[a + U[QX]]
        uy = grains[i + U[UY]] + twist * loads[a + U[QY]]
        uz = grains[i + U[UZ]] + twist * loads[a + U[QZ]]
        keep = resist(ux, uy, uz, twist * loads[a + U[RESIST]])
        grains[i + U[UX]] = ux * keep
        grains[i + U[UY]] = uy * keep
        grains[i + U[UZ]] = uz * keep
        grains[i + U[VX]] = vx
        grains[i + U[VY]] = vy
        grains[i + U[VZ]] = vz
        grains[i] += vx * dt
        grains[i + U[1]] += vy * dt
        grains[i + U[2]] += vz * dt
        fastest = max(fastest, vx * vx + vy * vy + vz * vz)
        for t in range(LOAD):
            loads[a + U[t]] = zero
    return math.sqrt(fastest)


@lean_jit
def carry_glued(grains, loads, walls, glued, carrier):
    """Hand the loads on grains glued to a wall over to that wall, and give them its velocity."""
    for k in range(glued.shape[0]):
        w = carrier[k]
        i = GRAIN * glued[k]
        a = LOAD * glued[k]
        for t in range(3):
            walls.force[w, t] += loads[a + t]
            grains[i + VX + t] = walls.velocity[w, t]
            grains[i + UX + t] = 0.0


@jit
def kinetic_energy(grains):
    """Translational and rotational kinetic energy of all free grains, in J."""
    translation, rotation = 0.0, 0.0
    for k in range(grains.shape[0] // GRAIN):
        i = k * GRAIN
        if grains[i + INVERSE_MASS] > 0.0:
            translation += 0.5 / grains[i + INVERSE_MASS] * (grains[i + VX] ** 2 + grains[i + VY] ** 2 + grains[i + VZ] ** 2)
            rotation += 0.2 / grains[i + INVERSE_MASS] * (grains[i + UX] ** 2 + grains[i + UY] ** 2 + grains[i + UZ] ** 2)
    return translation, rotation
