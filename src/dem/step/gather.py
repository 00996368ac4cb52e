"""Gather and scatter of contacts: records at scattered positions into the rows of the work buffer, and back.

These are the plain versions; `dem.step.vectors` has their twins in vector code.
"""

import numpy as np

from dem.jit import lean_jit
from dem.layout import (
    APPROACH,
    FORCE,
    GAP,
    LOAD,
    MOTION,
    PLACE,
    QX,
    QY,
    QZ,
    RADIUS,
    RESIST,
    RESISTANCE,
    SECOND_SPIN,
    SEPARATION,
    SPIN_SUM,
    TWIST,
    TWIST_J,
    UX,
    UY,
    UZ,
    VX,
    VY,
    VZ,
    U,
)
from dem.layout import BLOCK as B
from dem.lists.grid import nearest


@lean_jit
def store_separation(x, y, z, R_sum, q, b):
    """Write one pair's separation and R_sum^2 - d^2 into the work buffer: computed in float64, then rounded."""
    b[SEPARATION * B + q] = x
    b[(SEPARATION + 1) * B + q] = y
    b[(SEPARATION + 2) * B + q] = z
    b[GAP * B + q] = R_sum * R_sum - (x * x + y * y + z * z)


@lean_jit
def store_velocities(motion, i, j, q, b, spins):
    """Write one pair's relative velocity and sum of spin velocities into the work buffer; motion records begin at i and j.

    spins : None, or anything else for laws that also need the spin velocity of j.
    """
    b[APPROACH * B + q] = motion[i + U[VX]] - motion[j + U[VX]]
    b[(APPROACH + 1) * B + q] = motion[i + U[VY]] - motion[j + U[VY]]
    b[(APPROACH + 2) * B + q] = motion[i + U[VZ]] - motion[j + U[VZ]]
    b[SPIN_SUM * B + q] = motion[i + U[UX]] + motion[j + U[UX]]
    b[(SPIN_SUM + 1) * B + q] = motion[i + U[UY]] + motion[j + U[UY]]
    b[(SPIN_SUM + 2) * B + q] = motion[i + U[UZ]] + motion[j + U[UZ]]
    if spins is not None:
        for t in range(3):
            b[(SECOND_SPIN + t) * B + q] = motion[j + U[UX + t]]


@lean_jit
def gather_pairs(grains, first, second, n, b, access):
    """Fill the work buffer for n pairs; access : see `dem.layout.Access`."""
    place = grains.place
    for q in range(n):
        i = np.uint64(first[q] * PLACE)
        j = np.uint64(second[q] * PLACE)
        x = nearest(place[i] - place[j], 0, access.images)
        y = nearest(place[i + U[1]] - place[j + U[1]], 1, access.images)
        z = nearest(place[i + U[2]] - place[j + U[2]], 2, access.images)
        store_separation(x, y, z, place[i + U[RADIUS]] + place[j + U[RADIUS]], q, b)
        store_velocities(grains.motion, np.uint64(first[q] * MOTION), np.uint64(second[q] * MOTION), q, b, access.spins)


@lean_jit
def gather_at_surface(grains, velocity, first, n, b, places):
    """Centres and radii of n grains near a surface of this velocity (3,), and their motion relative to it.

    places : (at least 3 BLOCK + n,) float64, rows x, y, z, radius of BLOCK values. `dem.shapes` turns them into separations.
    """
    for q in range(n):
        o, i = np.uint64(first[q] * PLACE), np.uint64(first[q] * MOTION)
        places[q] = grains.place[o]
        places[B + q] = grains.place[o + U[1]]
        places[2 * B + q] = grains.place[o + U[2]]
        places[3 * B + q] = grains.place[o + U[RADIUS]]
        b[APPROACH * B + q] = grains.motion[i + U[VX]] - velocity[0]
        b[(APPROACH + 1) * B + q] = grains.motion[i + U[VY]] - velocity[1]
        b[(APPROACH + 2) * B + q] = grains.motion[i + U[VZ]] - velocity[2]
        b[SPIN_SUM * B + q] = grains.motion[i + U[UX]]
        b[(SPIN_SUM + 1) * B + q] = grains.motion[i + U[UY]]
        b[(SPIN_SUM + 2) * B + q] = grains.motion[i + U[UZ]]


@lean_jit
def scatter_at_surface(loads, first, n, b):
    """Add the loads of n contacts with a surface to their grains."""
    for q in range(n):
        i = np.uint64(first[q] * LOAD)
        for t in range(3):
            loads[i + U[t]] += b[(FORCE + t) * B + q]
            loads[i + U[QX + t]] += b[(TWIST + t) * B + q]
        loads[i + U[RESIST]] += b[RESISTANCE * B + q]


@lean_jit
def scatter_pairs(loads, first, second, n, b, spins):
    """Add the loads of n pairs to their grains; spins : None if the torques on i and j are equal."""
    for q in range(n):
        i = np.uint64(first[q] * LOAD)
        j = np.uint64(second[q] * LOAD)
        fx, fy, fz = b[FORCE * B + q], b[(FORCE + 1) * B + q], b[(FORCE + 2) * B + q]
        qx, qy, qz = b[TWIST * B + q], b[(TWIST + 1) * B + q], b[(TWIST + 2) * B + q]
        resist = b[RESISTANCE * B + q]
        loads[i] += fx
        loads[i + U[1]] += fy
        loads[i + U[2]] += fz
        loads[i + U[QX]] += qx
        loads[i + U[QY]] += qy
        loads[i + U[QZ]] += qz
        loads[i + U[RESIST]] += resist
        if spins is not None:
            qx, qy, qz = b[TWIST_J * B + q], b[(TWIST_J + 1) * B + q], b[(TWIST_J + 2) * B + q]
        loads[j] -= fx
        loads[j + U[1]] -= fy
        loads[j + U[2]] -= fz
        loads[j + U[QX]] += qx
        loads[j + U[QY]] += qy
        loads[j + U[QZ]] += qz
        loads[j + U[RESIST]] += resist
