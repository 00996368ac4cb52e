"""Motion of clumps: loads of the members summed, centre and orientation moved by one step, members put in their places.

Translation is that of grains. Rotation: the angular momentum L is kicked by the torque, then the orientation turns about the
principal axes 3, 2, 1, 2, 3 in sequence by L_k dt / I_k, half of it outside ("no squish": Miller et al. 2002, J. Chem. Phys. 116,
8649). Symplectic, reversible, of second order, without iteration. The tangent of half an angle is taken as half the angle, which is
of second order too and makes every turn a rotation without any trigonometric function.

Rolling resistance of type A brakes the angular momentum: the torques mu_r F_n r of all contacts (r radius of the member) add up and
act against L; they may stop the clump's spin within a step but not reverse it. For a sphere, and for a spin about a principal axis,
that is against the spin, as `dem.contact.laws.rolling_a` has it; in general L and spin differ in direction. Type C acts by its
torques on the members.
"""

import math

import numpy as np

from dem.clumps import members, vectors
from dem.clumps.records import BLOCK as B
from dem.clumps.records import (
    BRAKE,
    CENTRE,
    FORCE,
    INV_MASS,
    INV_MOMENTS,
    MOMENTUM,
    QUATERNION,
    ROTATION,
    SPIN,
    TORQUE,
    VELOCITY,
)
from dem.contact.laws.rolling_a import braked
from dem.jit import inline_jit, jit, lean_jit
from dem.layout import MOTION, PLACE, RADIUS, UX, VX, VY, VZ

#: Stands in for the square of no angular momentum.
TINY = 1e-200


@inline_jit
def collect_loads(vector, grains, loads, clumps):
    """Sum the loads of all members for their clumps, and clear them. clumps : None, or Clumps."""
    if clumps is not None:
        sum_loads(vector, grains, loads, clumps)


@inline_jit
def sum_loads(vector, grains, loads, clumps):
    """As `dem.clumps.members.sum_members`; vector : see `dem.layout.Access`."""
    if vector is None:
        members.sum_members(grains, loads, clumps, 0, clumps.begin.shape[0] - 1)
    else:
        vectors.sum_members(grains, loads, clumps)


@inline_jit
def place_all(vector, grains, clumps):
    """As `dem.clumps.members.place_members`; vector : see `dem.layout.Access`."""
    if vector is None:
        return members.place_members(grains, clumps, 0, clumps.begin.shape[0] - 1)
    else:  # noqa: RET505  # see `dem.step.schedule.integrate`
        return vectors.place_members(grains, clumps)


@lean_jit
def move_clumps(vector, grains, clumps, gravity, dt):
    """Move every clump by dt with the loads that `collect_loads` has summed, and its members.

    Returns the largest share of an allowance that a member uses up.
    """
    n = clumps.begin.shape[0] - 1
    for k in range(0, n, B):
        v, in_block = clumps.blocks[k // B], min(B, n - k)
        kick_block(in_block, v, gravity, dt)
        turn_block(in_block, v, dt)
        rotate_block(in_block, v)
    return place_all(vector, grains, clumps)


@lean_jit
def kick_block(n, v, gravity, dt):
    """Kick velocity and angular momentum of the n clumps of one block by their loads, and displace the centres.

    This loop and the next two could be one: as with the contact stage, a processor overlaps more of short ones.
    """
    gx, gy, gz = gravity[0] * dt, gravity[1] * dt, gravity[2] * dt
    for q in range(n):
        kick = dt * v[INV_MASS * B + q]
        vx = v[VELOCITY * B + q] + kick * v[FORCE * B + q] + gx
        vy = v[(VELOCITY + 1) * B + q] + kick * v[(FORCE + 1) * B + q] + gy
        vz = v[(VELOCITY + 2) * B + q] + kick * v[(FORCE + 2) * B + q] + gz
        v[VELOCITY * B + q] = vx
        v[(VELOCITY + 1) * B + q] = vy
        v[(VELOCITY + 2) * B + q] = vz
        v[CENTRE * B + q] += vx * dt
        v[(CENTRE + 1) * B + q] += vy * dt
        v[(CENTRE + 2) * B + q] += vz * dt
        lx = v[MOMENTUM * B + q] + dt * v[TORQUE * B + q]
        ly = v[(MOMENTUM + 1) * B + q] + dt * v[(TORQUE + 1) * B + q]
        lz = v[(MOMENTUM + 2) * B + q] + dt * v[(TORQUE + 2) * B + q]
        keep = 1.0 - braked(lx, ly, lz, dt * v[BRAKE * B + q], 1.0, TINY)
        v[MOMENTUM * B + q] = keep * lx
        v[(MOMENTUM + 1) * B + q] = keep * ly
        v[(MOMENTUM + 2) * B + q] = keep * lz


@inline_jit
def turn_about(n, v, axis, second, third, time):
    """Turn the n clumps of one block about a principal axis; second, third : the next ones, in cyclic order.

    `SPIN` holds the angular momenta in the body frame. Quaternions grow: they keep their direction, `rotate_block` their norm.
    """
    for q in range(n):
        l2, l3 = v[(SPIN + second) * B + q], v[(SPIN + third) * B + q]
        t = 0.5 * time * v[(SPIN + axis) * B + q] * v[(INV_MOMENTS + axis) * B + q]  # tangent of half the angle
        norm = 1.0 / (1.0 + t * t)
        cos, sin = (1.0 - t * t) * norm, 2.0 * t * norm
        v[(SPIN + second) * B + q], v[(SPIN + third) * B + q] = cos * l2 + sin * l3, cos * l3 - sin * l2
        w, x = v[QUATERNION * B + q], v[(QUATERNION + 1 + axis) * B + q]
        y, z = v[(QUATERNION + 1 + second) * B + q], v[(QUATERNION + 1 + third) * B + q]
        v[QUATERNION * B + q], v[(QUATERNION + 1 + axis) * B + q] = w - x * t, x + w * t
        v[(QUATERNION + 1 + second) * B + q], v[(QUATERNION + 1 + third) * B + q] = y + z * t, z - y * t


@lean_jit
def turn_block(n, v, dt):
    """Turn the n clumps of one block; `SPIN` then holds the angular momenta in the body frame."""
    for q in range(n):
        lx, ly, lz = v[MOMENTUM * B + q], v[(MOMENTUM + 1) * B + q], v[(MOMENTUM + 2) * B + q]
        v[SPIN * B + q] = v[ROTATION * B + q] * lx + v[(ROTATION + 3) * B + q] * ly + v[(ROTATION + 6) * B + q] * lz
        v[(SPIN + 1) * B + q] = v[(ROTATION + 1) * B + q] * lx + v[(ROTATION + 4) * B + q] * ly + v[(ROTATION + 7) * B + q] * lz
        v[(SPIN + 2) * B + q] = v[(ROTATION + 2) * B + q] * lx + v[(ROTATION + 5) * B + q] * ly + v[(ROTATION + 8) * B + q] * lz
    turn_about(n, v, 2, 0, 1, 0.5 * dt)
    turn_about(n, v, 1, 2, 0, 0.5 * dt)
    turn_about(n, v, 0, 1, 2, dt)
    turn_about(n, v, 1, 2, 0, 0.5 * dt)
    turn_about(n, v, 2, 0, 1, 0.5 * dt)


@lean_jit
def rotate_block(n, v):
    """Set the rotations of the n clumps of one block; `SPIN` becomes the angular velocities in space."""
    for q in range(n):
        w, x = v[QUATERNION * B + q], v[(QUATERNION + 1) * B + q]
        y, z = v[(QUATERNION + 2) * B + q], v[(QUATERNION + 3) * B + q]
        shrink = 1.0 / math.sqrt(w * w + x * x + y * y + z * z)
        v[QUATERNION * B + q], v[(QUATERNION + 1) * B + q] = shrink * w, shrink * x
        v[(QUATERNION + 2) * B + q], v[(QUATERNION + 3) * B + q] = shrink * y, shrink * z
    for q in range(n):
        w, x = v[QUATERNION * B + q], v[(QUATERNION + 1) * B + q]
        y, z = v[(QUATERNION + 2) * B + q], v[(QUATERNION + 3) * B + q]
        r11, r12, r13 = w * w + x * x - y * y - z * z, 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)
        r21, r22, r23 = 2.0 * (x * y + w * z), w * w - x * x + y * y - z * z, 2.0 * (y * z - w * x)
        r31, r32, r33 = 2.0 * (x * z - w * y), 2.0 * (y * z + w * x), w * w - x * x - y * y + z * z
        v[ROTATION * B + q], v[(ROTATION + 1) * B + q], v[(ROTATION + 2) * B + q] = r11, r12, r13
        v[(ROTATION + 3) * B + q], v[(ROTATION + 4) * B + q], v[(ROTATION + 5) * B + q] = r21, r22, r23
        v[(ROTATION + 6) * B + q], v[(ROTATION + 7) * B + q], v[(ROTATION + 8) * B + q] = r31, r32, r33
        w1 = v[SPIN * B + q] * v[INV_MOMENTS * B + q]
        w2 = v[(SPIN + 1) * B + q] * v[(INV_MOMENTS + 1) * B + q]
        w3 = v[(SPIN + 2) * B + q] * v[(INV_MOMENTS + 2) * B + q]
        v[SPIN * B + q] = r11 * w1 + r12 * w2 + r13 * w3
        v[(SPIN + 1) * B + q] = r21 * w1 + r22 * w2 + r23 * w3
        v[(SPIN + 2) * B + q] = r31 * w1 + r32 * w2 + r33 * w3


@jit
def book_clumps(clumps, grains, gravity, dt, mean):
    """Kinetic energy before and after the kick by the summed loads, potential energy, loss of rolling (J).

    The brake acts during the kick: unlike a grain's, a clump's spin moves contacts, so the mean velocities include it.
    Fills `mean` of the members. As `dem.ledger.book_grains`; clumps : None, or Clumps.
    """
    before, after, potential, rolling = 0.0, 0.0, 0.0, 0.0
    if clumps is not None:
        for c in range(clumps.begin.shape[0] - 1):
            v = clumps.blocks[c // B, c % B :: B]
            mass = 1.0 / v[INV_MASS]
            to_space = rotation(v[QUATERNION : QUATERNION + 4])
            kicked_v, kicked_l = np.empty(3), np.empty(3)
            for t in range(3):
                kicked_v[t] = v[VELOCITY + t] + dt * (v[INV_MASS] * v[FORCE + t] + gravity[t])
                kicked_l[t] = v[MOMENTUM + t] + dt * v[TORQUE + t]
                before += 0.5 * mass * v[VELOCITY + t] ** 2
                after += 0.5 * mass * kicked_v[t] ** 2
                potential -= mass * gravity[t] * v[CENTRE + t]
            old_w, new_w = spin_of(v, to_space, v[MOMENTUM : MOMENTUM + 3]), spin_of(v, to_space, kicked_l)
            share = braked(kicked_l[0], kicked_l[1], kicked_l[2], dt * v[BRAKE], 1.0, TINY)
            new_w *= 1.0 - share
            mean_w = 0.5 * (old_w + new_w)
            for t in range(3):
                before += 0.5 * v[MOMENTUM + t] * old_w[t]
                after += 0.5 * (1.0 - share) * kicked_l[t] * new_w[t]
                rolling += share * kicked_l[t] * mean_w[t]
            note_members(clumps, c, grains, 0.5 * (v[VELOCITY : VELOCITY + 3] + kicked_v), mean_w, mean)
    return before, after, potential, rolling


@jit
def note_members(clumps, c, grains, v, w, mean):
    """Enter the motion of the members of clump c at velocity v and angular velocity w (3,) in `mean`."""
    centre = clumps.blocks[c // B, c % B :: B][CENTRE : CENTRE + 3]
    for k in range(clumps.begin[c], clumps.begin[c + 1]):
        o, i = clumps.grain[k] * PLACE, clumps.grain[k] * MOTION
        r = grains.place[o + RADIUS]
        x, y, z = grains.place[o] - centre[0], grains.place[o + 1] - centre[1], grains.place[o + 2] - centre[2]
        mean.motion[i + VX] = v[0] + w[1] * z - w[2] * y
        mean.motion[i + VY] = v[1] + w[2] * x - w[0] * z
        mean.motion[i + VZ] = v[2] + w[0] * y - w[1] * x
        for t in range(3):
            mean.motion[i + UX + t] = r * w[t]


@jit
def rotation(quaternion):
    """Rotation (3, 3) of a quaternion (w, x, y, z) of norm 1, as `dem.clumps.records.rotation_of`."""
    w, x, y, z = quaternion[0], quaternion[1], quaternion[2], quaternion[3]
    to_space = np.empty((3, 3))
    to_space[0, 0], to_space[0, 1], to_space[0, 2] = w * w + x * x - y * y - z * z, 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)
    to_space[1, 0], to_space[1, 1], to_space[1, 2] = 2.0 * (x * y + w * z), w * w - x * x + y * y - z * z, 2.0 * (y * z - w * x)
    to_space[2, 0], to_space[2, 1], to_space[2, 2] = 2.0 * (x * z - w * y), 2.0 * (y * z + w * x), w * w - x * x - y * y + z * z
    return to_space


@jit
def spin_of(v, to_space, momentum):
    """Angular velocity (3,) in space of the clump of values v at an angular momentum (3,)."""
    spin = np.zeros(3)
    for axis in range(3):
        along = 0.0
        for t in range(3):
            along += to_space[t, axis] * momentum[t]
        for t in range(3):
            spin[t] += to_space[t, axis] * (along * v[INV_MOMENTS + axis])
    return spin
