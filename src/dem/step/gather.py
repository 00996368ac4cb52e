"""Gather and scatter of grain pairs: records at scattered places into the rows of the work buffer, and back.

These are the plain versions; `dem.step.vectors` has their twins in vector code.
"""

import numpy as np

from dem.jit import lean_jit
from dem.layout import BLOCK as B
from dem.layout import (
    FORCE,
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
from dem.lists.grid import nearest_image


@lean_jit
def store_separation(x, y, z, R_sum, q, b):
    """Put one pair's separation and R_sum^2 - d^2 into the work buffer: computed in float64, then rounded."""
    b[q] = x
    b[B + q] = y
    b[2 * B + q] = z
    b[3 * B + q] = R_sum * R_sum - (x * x + y * y + z * z)


@lean_jit
def store_velocities(motion, i, j, q, b, elastic):
    """Put one pair's relative velocity and sum of spin velocities into the work buffer; motion records begin at i and j.

    elastic : None for type A; anything else for type C, which needs the spin velocity of j as well.
    """
    b[4 * B + q] = motion[i + U[VX]] - motion[j + U[VX]]
    b[5 * B + q] = motion[i + U[VY]] - motion[j + U[VY]]
    b[6 * B + q] = motion[i + U[VZ]] - motion[j + U[VZ]]
    b[7 * B + q] = motion[i + U[UX]] + motion[j + U[UX]]
    b[8 * B + q] = motion[i + U[UY]] + motion[j + U[UY]]
    b[9 * B + q] = motion[i + U[UZ]] + motion[j + U[UZ]]
    if elastic is not None:
        for t in range(3):
            b[(SECOND_SPIN + t) * B + q] = motion[j + U[UX + t]]


@lean_jit
def gather_pairs(grains, first, second, n, b, elastic):
    """Fill the work buffer for n pairs."""
    place = grains.place
    for q in range(n):
        i = np.uint64(first[q] * PLACE)
        j = np.uint64(second[q] * PLACE)
        x = place[i] - place[j]
        y = place[i + U[1]] - place[j + U[1]]
        z = place[i + U[2]] - place[j + U[2]]
        store_separation(x, y, z, place[i + U[RADIUS]] + place[j + U[RADIUS]], q, b)
        store_velocities(grains.motion, np.uint64(first[q] * MOTION), np.uint64(second[q] * MOTION), q, b, elastic)


@lean_jit
def gather_periodic_pairs(grains, period, frequency, first, second, n, b, elastic):
    """As `gather_pairs`, with separations to the nearest periodic image; frequency is 1/period, 0 where not periodic."""
    place = grains.place
    for q in range(n):
        i = np.uint64(first[q] * PLACE)
        j = np.uint64(second[q] * PLACE)
        x = place[i] - place[j]
        y = place[i + U[1]] - place[j + U[1]]
        z = place[i + U[2]] - place[j + U[2]]
        x = nearest_image(x, period[0], frequency[0])
        y = nearest_image(y, period[1], frequency[1])
        z = nearest_image(z, period[2], frequency[2])
        store_separation(x, y, z, place[i + U[RADIUS]] + place[j + U[RADIUS]], q, b)
        store_velocities(grains.motion, np.uint64(first[q] * MOTION), np.uint64(second[q] * MOTION), q, b, elastic)


@lean_jit
def gather_at_wall(grains, velocity, first, n, b, places):
    """Of n grains that may touch a wall of this velocity (3,): centres and radii, and their motion relative to the wall.

    places : (at least 3 BLOCK + n,) float64, rows x, y, z, radius of BLOCK values. `dem.walls` makes separations of them.
    """
    for q in range(n):
        o, i = np.uint64(first[q] * PLACE), np.uint64(first[q] * MOTION)
        places[q] = grains.place[o]
        places[B + q] = grains.place[o + U[1]]
        places[2 * B + q] = grains.place[o + U[2]]
        places[3 * B + q] = grains.place[o + U[RADIUS]]
        b[4 * B + q] = grains.motion[i + U[VX]] - velocity[0]
        b[5 * B + q] = grains.motion[i + U[VY]] - velocity[1]
        b[6 * B + q] = grains.motion[i + U[VZ]] - velocity[2]
        b[7 * B + q] = grains.motion[i + U[UX]]
        b[8 * B + q] = grains.motion[i + U[UY]]
        b[9 * B + q] = grains.motion[i + U[UZ]]


@lean_jit
def scatter_at_wall(loads, first, n, b):
    """Add the loads of n wall contacts to their grains."""
    for q in range(n):
        i = np.uint64(first[q] * LOAD)
        for t in range(3):
            loads[i + U[t]] += b[(FORCE + t) * B + q]
            loads[i + U[QX + t]] += b[(TWIST + t) * B + q]
        loads[i + U[RESIST]] += b[RESISTANCE * B + q]


@lean_jit
def scatter_pairs(loads, first, second, n, b, elastic):
    """Add the loads of n pairs to their grains; with type C the torques on i and j differ."""
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
        if elastic is not None:
            qx, qy, qz = b[TWIST_J * B + q], b[(TWIST_J + 1) * B + q], b[(TWIST_J + 2) * B + q]
        loads[j] -= fx
        loads[j + U[1]] -= fy
        loads[j + U[2]] -= fz
        loads[j + U[QX]] += qx
        loads[j + U[QY]] += qy
        loads[j + U[QZ]] += qz
        loads[j + U[RESIST]] += resist
