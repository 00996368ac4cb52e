"""Layout of the flat arrays that the kernels share.

All arrays are one-dimensional with constant offsets: LLVM then proves that rows do not overlap and vectorises to full width.

place record (float64, PLACE values each): position, radius.
motion record (contact precision, MOTION values each): velocity, time step over what is left of the inner allowance (USE, see
    `dem.lists.allowance`), spin velocity u = radius x angular velocity, zero. Using u instead of the angular velocity makes every
    torque equation independent of the grain's radius: (2/5) m du/dt = Q, with Q = torque / radius. Contacts and places see this
    velocity.
remainder record (contact precision, MOTION values each): rounding error of the motion record, added at the next step; instead of
    USE and the zero inverse mass and gravity flag (1 free, 0 moved by a body or a clump; members have their clump's mass).
load record (contact precision, LOAD values each): force, zero, Q, rolling resistance (the largest |Q| that opposes spin).
contact constants (contact precision, rows of BLOCK values, one set of rows per block of BLOCK contacts): geometry (INV_R_SUM,
    SHARE), then the constants of each law in use (see `dem.contact.model`). One block serves all contacts of identical grains.
contact history (contact precision, one set of rows per block): the histories of the laws in use, one after the other.
work buffer (contact precision, one block): written by the gather stage, turned into loads by the contact stage.
"""

from typing import NamedTuple

import numpy as np

BLOCK = 256

PLACE = 4
X, Y, Z, RADIUS = range(PLACE)

MOTION = 8
VX, VY, VZ, INVERSE_MASS, UX, UY, UZ, FREE = range(MOTION)
USE = INVERSE_MASS
#: Where a motion record's velocity and spin velocity stand.
SPEEDS = (VX, VY, VZ, UX, UY, UZ)

LOAD = 8
FX, FY, FZ = range(3)
QX, QY, QZ, RESIST = range(4, LOAD)

#: First rows of the contact constants: 1 / (r_i + r_j), and p_i = r_j / (r_i + r_j). The laws' constants follow.
INV_R_SUM, SHARE, GEOMETRY = range(3)

#: Rows of the work buffer on entry to the contact stage: separation (0-2), R_sum^2 - d^2, relative velocity (4-6), u_i + u_j (7-9),
#: u_j (10-12, only for laws with SEPARATE_SPINS).
SEPARATION, GAP, APPROACH, SPIN_SUM, SECOND_SPIN = 0, 3, 4, 7, 10
#: The same rows between the two loops of the contact stage: lever arm over the grain's radius, d / R_sum along the normal (0-2);
#: tangential stiffness; relative velocity of the surfaces (4-6). Then tangential damping, normal force over the lever arm, normal
#: force, inverse square of the lever arm.
ARM, STIFFNESS, SLIDING, DAMPING, PUSH, NORMAL, INV_ARM2 = 0, 3, 4, 13, 14, 15, 17
#: On leaving the contact stage: force on i (4-6), Q on j (10-12, only for laws with SEPARATE_SPINS, else that on i), Q on i
#: (13-15), rolling resistance of both grains.
FORCE, TWIST_J, TWIST, RESISTANCE = 4, 10, 13, 16
BUFFER = 18

#: Unsigned constants: a signed computed index would cost a sign test per access.
U = tuple(np.uint64(k) for k in range(16))


class GrainArrays(NamedTuple):
    """The grains' records, flat: place (n PLACE,) float64, motion and remainder (n MOTION,) in the contact precision.

    Each record lies within a cache line and takes half the memory of float64 where contacts are computed in float32. Motion and
    remainder together then hold a velocity to 48 bits (compensated summation: Kahan 1965), so that no small change is lost.
    Contacts and places both use the first 24 bits. Limit: the relative velocity of two grains that move together at v is accurate
    to 2^-24 v.
    """

    place: np.ndarray
    motion: np.ndarray
    remainder: np.ndarray


class Period(NamedTuple):
    """Length of each axis' period in m and its reciprocal, (3,) each; both 0 where an axis is not periodic."""

    length: np.ndarray
    frequency: np.ndarray


class State(NamedTuple):
    """The moving part: grains, index of each grain's material (n,), load records."""

    grains: GrainArrays
    material: np.ndarray
    loads: np.ndarray


class Access(NamedTuple):
    """Variants of gather and scatter, chosen by type when a kernel is compiled: None or not.

    vector : explicit vector code instead of plain numba. images : Period, for separations to nearest images.
    spins : the contact law needs the spin velocities of both grains and gives them different torques.
    """

    vector: bool | None
    images: Period | None
    spins: bool | None


#: Bytes of a page of memory. A load that has the same offset in its page as a recent store stalls (4K aliasing), so arrays that are
#: traversed together begin a quarter of a page apart.
PAGE = 4096


def aligned_zeros(n: int, dtype, quarter: int = 0) -> np.ndarray:
    """(n,) zeros that begin at a quarter (0 to 3) of a page, so at a cache line: vector loads do not straddle two."""
    width = np.dtype(dtype).itemsize
    skip = quarter * PAGE // 4
    memory = np.zeros(n * width + PAGE + skip, np.uint8)
    start = -memory.ctypes.data % PAGE + skip
    return memory[start : start + n * width].view(dtype)
