"""Sum of the members' loads for their clumps, and the members' places; `dem.clumps.vectors` has the twins in vector code."""

import math

import numpy as np

from dem.clumps.records import BLOCK as B
from dem.clumps.records import BRAKE, CENTRE, FORCE, ROTATION, SPIN, TORQUE, VELOCITY
from dem.jit import lean_jit
from dem.layout import LOAD, MOTION, PLACE, QX, QY, QZ, RADIUS, RESIST, USE, UX, UY, UZ, VY, VZ, U


@lean_jit
def sum_members(grains, loads, clumps, start, end):
    """Sum force, torque about the centre and brake of clumps start to end: F, rho x F + r Q, r times the rolling resistance."""
    place, begin, grain = grains.place, clumps.begin, clumps.grain
    zero = loads.dtype.type(0.0)
    for c in range(start, end):
        v, q = clumps.blocks[c // B], c % B
        cx, cy, cz = v[CENTRE * B + q], v[(CENTRE + 1) * B + q], v[(CENTRE + 2) * B + q]
        fx, fy, fz, tx, ty, tz, brake = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        for k in range(begin[c], begin[c + 1]):
            o, a = np.uint64(grain[k] * PLACE), np.uint64(grain[k] * LOAD)
            x, y, z, r = place[o] - cx, place[o + U[1]] - cy, place[o + U[2]] - cz, place[o + U[RADIUS]]
            px, py, pz = float(loads[a]), float(loads[a + U[1]]), float(loads[a + U[2]])
            fx += px
            fy += py
            fz += pz
            tx += y * pz - z * py + r * loads[a + U[QX]]
            ty += z * px - x * pz + r * loads[a + U[QY]]
            tz += x * py - y * px + r * loads[a + U[QZ]]
            brake += r * loads[a + U[RESIST]]
            for t in range(LOAD):
                loads[a + U[t]] = zero
        v[FORCE * B + q], v[(FORCE + 1) * B + q], v[(FORCE + 2) * B + q] = fx, fy, fz
        v[TORQUE * B + q], v[(TORQUE + 1) * B + q], v[(TORQUE + 2) * B + q] = tx, ty, tz
        v[BRAKE * B + q] = brake


@lean_jit
def place_members(grains, clumps, start, end):
    """Give the members of clumps start to end their places and velocities.

    Returns the largest share of an allowance that is used up.
    """
    place, motion, _ = grains
    begin, grain, arm = clumps.begin, clumps.grain, clumps.arm
    number, largest2 = motion.dtype.type, 0.0
    for c in range(start, end):
        v, q = clumps.blocks[c // B], c % B
        cx, cy, cz = v[CENTRE * B + q], v[(CENTRE + 1) * B + q], v[(CENTRE + 2) * B + q]
        vx, vy, vz = v[VELOCITY * B + q], v[(VELOCITY + 1) * B + q], v[(VELOCITY + 2) * B + q]
        wx, wy, wz = v[SPIN * B + q], v[(SPIN + 1) * B + q], v[(SPIN + 2) * B + q]
        r11, r12, r13 = v[ROTATION * B + q], v[(ROTATION + 1) * B + q], v[(ROTATION + 2) * B + q]
        r21, r22, r23 = v[(ROTATION + 3) * B + q], v[(ROTATION + 4) * B + q], v[(ROTATION + 5) * B + q]
        r31, r32, r33 = v[(ROTATION + 6) * B + q], v[(ROTATION + 7) * B + q], v[(ROTATION + 8) * B + q]
        for k in range(begin[c], begin[c + 1]):
            o, i = np.uint64(grain[k] * PLACE), np.uint64(grain[k] * MOTION)
            a1, a2, a3, r = arm[k, 0], arm[k, 1], arm[k, 2], arm[k, 3]
            x = r11 * a1 + r12 * a2 + r13 * a3
            y = r21 * a1 + r22 * a2 + r23 * a3
            z = r31 * a1 + r32 * a2 + r33 * a3
            place[o], place[o + U[1]], place[o + U[2]] = cx + x, cy + y, cz + z
            x, y, z = vx + wy * z - wz * y, vy + wz * x - wx * z, vz + wx * y - wy * x
            motion[i], motion[i + U[VY]], motion[i + U[VZ]] = number(x), number(y), number(z)
            motion[i + U[UX]], motion[i + U[UY]], motion[i + U[UZ]] = number(r * wx), number(r * wy), number(r * wz)
            use = float(motion[i + U[USE]])
            largest2 = max(largest2, (x * x + y * y + z * z) * use * use)
    return math.sqrt(largest2)
