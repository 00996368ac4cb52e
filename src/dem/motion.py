"""Moving the grains by one step: symplectic Euler, which is velocity Verlet with velocities half a step behind.

m dv/dt = F + m g,  (2/5) m du/dt = Q (u = radius x angular velocity). Source: Allen & Tildesley, Computer Simulation of Liquids.
"""

import math

import numpy as np

from dem.contact.rolling import braked
from dem.jit import exact_jit, jit, lean_jit
from dem.layout import FREE, INVERSE_MASS, LOAD, MOTION, PLACE, QX, QY, QZ, RESIST, UX, UY, UZ, VX, VY, VZ, U


@exact_jit
def put(grains, i, value, change):
    """Set the number at i of the motion records to value + change, and keep what is rounded off there."""
    grains.motion[i] = value + change
    grains.remainder[i] = change - (grains.motion[i] - value)


@lean_jit
def integrate(grains, loads, which, gravity, dt, zero):
    """Advance the grains of the numbers `which` by dt, clear their loads, return the largest speed (m/s)."""
    place, motion, remainder = grains
    fastest = 0.0
    gx, gy, gz = gravity[0] * dt, gravity[1] * dt, gravity[2] * dt
    for k in range(which.shape[0]):
        o = np.uint64(which[k] * PLACE)
        i = np.uint64(which[k] * MOTION)
        a = np.uint64(which[k] * LOAD)
        kick = remainder[i + U[INVERSE_MASS]] * dt
        free = remainder[i + U[FREE]]
        twist = 2.5 * kick
        dvx = kick * loads[a] + free * gx + remainder[i]
        dvy = kick * loads[a + U[1]] + free * gy + remainder[i + U[VY]]
        dvz = kick * loads[a + U[2]] + free * gz + remainder[i + U[VZ]]
        dux = twist * loads[a + U[QX]] + remainder[i + U[UX]]
        duy = twist * loads[a + U[QY]] + remainder[i + U[UY]]
        duz = twist * loads[a + U[QZ]] + remainder[i + U[UZ]]
        ux, uy, uz = motion[i + U[UX]], motion[i + U[UY]], motion[i + U[UZ]]
        share = braked(ux + dux, uy + duy, uz + duz, twist * loads[a + U[RESIST]])
        put(grains, i + U[UX], ux, dux - share * (ux + dux))
        put(grains, i + U[UY], uy, duy - share * (uy + duy))
        put(grains, i + U[UZ], uz, duz - share * (uz + duz))
        put(grains, i, motion[i], dvx)
        put(grains, i + U[VY], motion[i + U[VY]], dvy)
        put(grains, i + U[VZ], motion[i + U[VZ]], dvz)
        vx, vy, vz = motion[i], motion[i + U[VY]], motion[i + U[VZ]]
        place[o] += vx * dt
        place[o + U[1]] += vy * dt
        place[o + U[2]] += vz * dt
        fastest = max(fastest, vx * vx + vy * vy + vz * vz)
        for t in range(LOAD):
            loads[a + U[t]] = zero
    return math.sqrt(fastest)


@lean_jit
def carry_glued(grains, loads, walls, glued, carrier):
    """Hand the loads on grains glued to a wall over to that wall, and give them its velocity."""
    for k in range(glued.shape[0]):
        w = carrier[k]
        i = MOTION * glued[k]
        a = LOAD * glued[k]
        for t in range(3):
            walls.force[w, t] += loads[a + t]
            put(grains, i + VX + t, 0.0, walls.velocity[w, t])
            put(grains, i + UX + t, 0.0, 0.0)


@lean_jit
def velocity(grains, i):
    """Velocity or spin velocity component in m/s that stands at i of the motion records, with all its digits."""
    return float(grains.motion[i]) + float(grains.remainder[i])


@jit
def kinetic_energy(grains):
    """Translational and rotational kinetic energy of all free grains, in J."""
    translation, rotation = 0.0, 0.0
    for i in range(0, grains.motion.shape[0], MOTION):
        if grains.remainder[i + INVERSE_MASS] > 0.0:
            mass = 1.0 / float(grains.remainder[i + INVERSE_MASS])
            for t in range(3):
                translation += 0.5 * mass * velocity(grains, i + VX + t) ** 2
                rotation += 0.2 * mass * velocity(grains, i + UX + t) ** 2
    return translation, rotation
