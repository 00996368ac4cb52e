"""Where each quantity stands in the flat arrays that the kernels share.

All arrays are one-dimensional with constant offsets: LLVM then proves that rows do not overlap and vectorises to full width.

place record (float64, PLACE values each): position, radius.
motion record (contact precision, MOTION values each): velocity, zero, spin velocity u = radius x angular velocity, zero. Using u
    instead of the angular velocity makes every torque equation independent of the grain's radius: (2/5) m du/dt = Q, with
    Q = torque / radius. Contacts and places see this velocity.
remainder record (contact precision, MOTION values each): what the motion record had to round off, to be added at the next step;
    instead of the zeros inverse mass and gravity flag (1 free, 0 carried by a wall).
load record (contact precision, LOAD values each): force, zero, Q, rolling resistance (the largest |Q| that opposes spin).
material pairs (float64, one row of five per ordered pair): see PAIR_E and its neighbours.
contact constants (contact precision, one row of CONSTANTS x BLOCK values per block of BLOCK contacts): see INV_R_SUM and its
    neighbours; where all grains are alike, one block serves all contacts.
contact history (contact precision, one row of 3 or 6 x BLOCK values per block): tangential spring, with type C rolling spring too.
work buffer (contact precision, one block): what the gather stage writes, and the loads that the contact stage makes of it.
"""

from typing import NamedTuple

import numpy as np

BLOCK = 256

PLACE = 4
X, Y, Z, RADIUS = range(PLACE)

MOTION = 8
VX, VY, VZ, INVERSE_MASS, UX, UY, UZ, FREE = range(MOTION)
#: Where a motion record's velocity and spin velocity stand.
SPEEDS = (VX, VY, VZ, UX, UY, UZ)

LOAD = 8
FX, FY, FZ = range(3)
QX, QY, QZ, RESIST = range(4, LOAD)

CONSTANTS = 8
INV_R_SUM, K_N, C_N, K_T, C_T, MU_S, MU_R, ROLLING_SHARE = range(CONSTANTS)

#: Rows of the work buffer. On entry to the contact stage: separation (0-2), R_sum^2 - d^2 (3), relative velocity (4-6),
#: u_i + u_j (7-9), u_j (10-12, type C only). On leaving: force on i, Q on j (type C), Q on i, rolling resistance.
BUFFER = 18
SECOND_SPIN, FORCE, TWIST_J, TWIST, RESISTANCE = 10, 4, 10, 13, 16
#: Between the loops of the contact stage: lever arm over the grain's radius, d / R_sum along the normal (0-2), tangential stiffness
#: (3), relative velocity of the surfaces (4-6), and these: tangential damping, normal force over the lever arm and as it is. The
#: arm's inverse square stays for type C.
D_T, PUSH, NORMAL, INV_ARM2 = 13, 14, 15, 17

#: Columns of the table of material pairs: E* and G* (Pa), dashpot ratio, static and rolling friction.
PAIR_E, PAIR_G, PAIR_BETA, PAIR_MU_S, PAIR_MU_R = range(5)

#: Unsigned constants: a signed computed index would cost a sign test per access.
U = tuple(np.uint64(k) for k in range(16))


class GrainArrays(NamedTuple):
    """The grains' records, flat: place (n PLACE,) float64, motion and remainder (n MOTION,) in the contact precision.

    Small records, each within a cache line, and half the memory of velocities in float64 where contacts take float32. Motion and
    remainder together hold a velocity to 48 bits then (compensated summation: Kahan 1965), so that no small change is lost.
    Contacts see its first 24, as the grains' places do, so that both move alike. Limit: the relative velocity of two grains that
    move together at v is good to 2^-24 v.
    """

    place: np.ndarray
    motion: np.ndarray
    remainder: np.ndarray


#: Bytes of a page of memory. A processor takes a load for one of what was just stored if both stand at the same place in a page,
#: and waits: arrays that are walked through side by side begin at different places, a quarter of a page apart.
PAGE = 4096


def aligned_zeros(n: int, dtype, quarter: int = 0) -> np.ndarray:
    """(n,) zeros that begin at a quarter (0 to 3) of a page, so at a cache line: vector loads do not straddle two."""
    width = np.dtype(dtype).itemsize
    skip = quarter * PAGE // 4
    memory = np.zeros(n * width + PAGE + skip, np.uint8)
    start = -memory.ctypes.data % PAGE + skip
    return memory[start : start + n * width].view(dtype)
