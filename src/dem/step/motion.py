"""Moving the grains by one step: symplectic Euler, which is velocity Verlet with velocities half a step behind.

m dv/dt = F + m g,  (2/5) m du/dt = Q (u = radius x angular velocity). Source: Allen & Tildesley, Computer Simulation of Liquids.
"""

import math

import numpy as np

from dem.contact.laws.rolling_a import braked
from dem.jit import exact_jit, jit, lean_jit
from dem.layout import FREE, INVERSE_MASS, LOAD, MOTION, PLACE, QX, QY, QZ, RESIST, USE, UX, UY, UZ, VX, VY, VZ, U


@exact_jit
def rounded_sum(value, change):
    """Sum of two numbers of one precision, and what it had to round off."""
    total = value + change
    return total, change - (total - value)


@lean_jit
def integrate(grains, loads, which, gravity, dt, zero):
    """Advance the grains of the numbers `which` by dt, clear their loads.

    Returns the largest share of an allowance that is used up.
    """
    place, motion, remainder = grains
    number = motion.dtype.type  # a plain number would promote to float64
    largest, one, tiny, step, twist_step = zero, number(1.0), number(1e-30), number(dt), number(2.5 * dt)
    gx, gy, gz = number(gravity[0] * dt), number(gravity[1] * dt), number(gravity[2] * dt)
    for k in range(which.shape[0]):
        o = np.uint64(which[k] * PLACE)
        i = np.uint64(which[k] * MOTION)
        a = np.uint64(which[k] * LOAD)
        kick = remainder[i + U[INVERSE_MASS]] * step
        twist = remainder[i + U[INVERSE_MASS]] * twist_step
        free = remainder[i + U[FREE]]
        vx, vy, vz = motion[i], motion[i + U[VY]], motion[i + U[VZ]]
        ux, uy, uz = motion[i + U[UX]], motion[i + U[UY]], motion[i + U[UZ]]
        dvx = kick * loads[a] + free * gx + remainder[i]
        dvy = kick * loads[a + U[1]] + free * gy + remainder[i + U[VY]]
        dvz = kick * loads[a + U[2]] + free * gz + remainder[i + U[VZ]]
        dux = twist * loads[a + U[QX]] + remainder[i + U[UX]]
        duy = twist * loads[a + U[QY]] + remainder[i + U[UY]]
        duz = twist * loads[a + U[QZ]] + remainder[i + U[UZ]]
        share = braked(ux + dux, uy + duy, uz + duz, twist * loads[a + U[RESIST]], one, tiny)
        vx, rest_vx = rounded_sum(vx, dvx)
        vy, rest_vy = rounded_sum(vy, dvy)
        vz, rest_vz = rounded_sum(vz, dvz)
        ux, rest_ux = rounded_sum(ux, dux - share * (ux + dux))
        uy, rest_uy = rounded_sum(uy, duy - share * (uy + duy))
        uz, rest_uz = rounded_sum(uz, duz - share * (uz + duz))
        motion[i], motion[i + U[VY]], motion[i + U[VZ]] = vx, vy, vz
        motion[i + U[UX]], motion[i + U[UY]], motion[i + U[UZ]] = ux, uy, uz
        remainder[i], remainder[i + U[VY]], remainder[i + U[VZ]] = rest_vx, rest_vy, rest_vz
        remainder[i + U[UX]], remainder[i + U[UY]], remainder[i + U[UZ]] = rest_ux, rest_uy, rest_uz
        place[o] += vx * dt
        place[o + U[1]] += vy * dt
        place[o + U[2]] += vz * dt
        use = motion[i + U[USE]]
        largest = max(largest, (vx * vx + vy * vy + vz * vz) * use * use)
        for t in range(LOAD):
            loads[a + U[t]] = zero
    return math.sqrt(largest)


@lean_jit
def velocity(grains, i):
    """Velocity or spin velocity component in m/s that stands at i of the motion records, with all its digits."""
    return float(grains.motion[i]) + float(grains.remainder[i])


@jit
def fastest_grain(grains, which):
    """Speed in m/s of the fastest among the grains of the numbers `which`."""
    fastest = 0.0
    for k in range(which.shape[0]):
        i, speed2 = MOTION * which[k], 0.0
        for t in range(3):
            speed2 += float(grains.motion[i + VX + t]) ** 2
        fastest = max(fastest, speed2)
    return math.sqrt(fastest)


@lean_jit
def heaviest_grain(grains):
    """Mass of the heaviest grain in kg, 0 without free ones."""
    lightest = 0.0
    for i in range(0, grains.motion.shape[0], MOTION):
        inverse = float(grains.remainder[i + INVERSE_MASS])
        if inverse > 0.0 and (lightest == 0.0 or inverse < lightest):
            lightest = inverse
    return 1.0 / lightest if lightest > 0.0 else 0.0


@jit
def kinetic_energy(grains):
    """Translational and rotational kinetic energy of all free grains, in J; members of clumps are not free."""
    translation, rotation = 0.0, 0.0
    for i in range(0, grains.motion.shape[0], MOTION):
        if grains.remainder[i + FREE] > 0.0:
            mass = 1.0 / float(grains.remainder[i + INVERSE_MASS])
            for t in range(3):
                translation += 0.5 * mass * velocity(grains, i + VX + t) ** 2
                rotation += 0.2 * mass * velocity(grains, i + UX + t) ** 2
    return translation, rotation
