"""The contact stage: BLOCK contacts at a time, branch-free, so that LLVM vectorises it.

One call turns relative positions and velocities (work buffer, see `dem.layout`) into loads: force on i, Q on i, rolling
resistance of both grains, and Q on j where the rolling law gives both grains different torques (else Q on j is that on i).
Walls go through the same stage as a "grain" j of zero radius, infinite mass and no spin.

The lever arm of grain i is r_i d / (r_i + r_j): the contact point divides the overlap, so angular momentum is conserved exactly.
"""

import math

from dem.contact.laws.mindlin import slip
from dem.contact.model import (
    Touch,
    acting_damping,
    attracted,
    deformation,
    n_constants,
    n_history,
    normal_force,
    read,
    remember,
    resistance,
    rolling_force,
    shrink,
    tangential_damping,
    tangential_limit,
    tangential_stiffness,
    touches,
)
from dem.jit import lean_jit
from dem.layout import (
    APPROACH,
    ARM,
    DAMPING,
    FORCE,
    GAP,
    GEOMETRY,
    INV_ARM2,
    INV_R_SUM,
    NORMAL,
    PUSH,
    RESISTANCE,
    SEPARATION,
    SHARE,
    SLIDING,
    SPIN_SUM,
    STIFFNESS,
    TWIST,
    TWIST_J,
)
from dem.layout import BLOCK as B


@lean_jit
def contact_stage(n, b, c, h, laws):
    """Loads of n contacts.

    Two short loops instead of a long one: a processor overlaps the operations of several contacts only while they fit into its
    instruction window.

    Parameters
    ----------
    n : contacts in the block. b : work buffer. c : their constants. h : their history, which is updated.
    laws : `dem.contact.model.Laws`; its types select the code.
    """
    normal_loop(n, b, c, h, laws)
    tangential_loop(n, b, c, h, laws, laws.separate)


@lean_jit
def normal_loop(n, b, c, h, laws):
    """Lever arm, relative velocity of the surfaces, stiffness and damping, normal force (zero where the law does not act)."""
    one, zero, tiny = laws.numbers.one, laws.numbers.zero, laws.numbers.tiny
    row_n = GEOMETRY
    row_t = row_n + n_constants(laws.normal)
    for q in range(n):
        inv_R_sum = c[INV_R_SUM * B + q]
        ax = b[SEPARATION * B + q] * inv_R_sum
        ay = b[(SEPARATION + 1) * B + q] * inv_R_sum
        az = b[(SEPARATION + 2) * B + q] * inv_R_sum
        gap = b[GAP * B + q]
        scaled_gap = gap * inv_R_sum
        arm2 = one - scaled_gap * inv_R_sum  # from the gap R_sum^2 - d^2, which was rounded only once
        inv_arm = one / math.sqrt(arm2)
        inv_arm2 = inv_arm * inv_arm
        # read here for laws that need it, and again below: the order of reading decides how sums are rounded
        early = read(laws.normal, c, row_n * B + q)
        distance = scaled_gap / (one + arm2 * inv_arm)
        touching = touches(early, gap, distance, h, q, zero)
        remember(early, touching, h, q, one, zero)
        overlap, root, fourth_root = deformation(early, distance, tiny)
        vx = b[APPROACH * B + q]
        vy = b[(APPROACH + 1) * B + q]
        vz = b[(APPROACH + 2) * B + q]
        ux = b[SPIN_SUM * B + q]
        uy = b[(SPIN_SUM + 1) * B + q]
        uz = b[(SPIN_SUM + 2) * B + q]
        v_a = vx * ax + vy * ay + vz * az
        normal = read(laws.normal, c, row_n * B + q)
        f_n = normal_force(normal, overlap, root, fourth_root, v_a * inv_arm)
        net = attracted(normal, f_n, distance, root, fourth_root)
        net = net if touching else zero
        f_n = f_n if touching else zero
        away = v_a * inv_arm2
        b[ARM * B + q] = ax
        b[(ARM + 1) * B + q] = ay
        b[(ARM + 2) * B + q] = az
        tangential = read(laws.tangential, c, row_t * B + q)
        b[STIFFNESS * B + q] = tangential_stiffness(tangential, root)
        b[SLIDING * B + q] = vx - away * ax + ay * uz - az * uy
        b[(SLIDING + 1) * B + q] = vy - away * ay + az * ux - ax * uz
        b[(SLIDING + 2) * B + q] = vz - away * az + ax * uy - ay * ux
        b[DAMPING * B + q] = tangential_damping(tangential, fourth_root)
        b[INV_ARM2 * B + q] = inv_arm2
        b[PUSH * B + q] = net * inv_arm
        b[NORMAL * B + q] = f_n


@lean_jit
def tangential_loop(n, b, c, h, laws, separate):
    """Tangential force of spring and dashpot, rolling; force, Q and rolling resistance. separate : `laws.separate`."""
    numbers = laws.numbers
    dt, one, zero, tiny = numbers.dt, numbers.one, numbers.zero, numbers.tiny
    row_t = GEOMETRY + n_constants(laws.normal)
    row_r = row_t + n_constants(laws.tangential)
    history_t = n_history(laws.normal)
    history_r = history_t + n_history(laws.tangential)
    for q in range(n):
        ax = b[ARM * B + q]
        ay = b[(ARM + 1) * B + q]
        az = b[(ARM + 2) * B + q]
        S_t = b[STIFFNESS * B + q]
        tx = b[SLIDING * B + q]
        ty = b[(SLIDING + 1) * B + q]
        tz = b[(SLIDING + 2) * B + q]
        push = b[PUSH * B + q]
        pressing = max(b[NORMAL * B + q], zero)
        tangential = read(laws.tangential, c, row_t * B + q)
        limit = tangential_limit(tangential, b[NORMAL * B + q], zero)
        o = history_t * B + q
        sx = h[o]
        sy = h[o + B]
        sz = h[o + 2 * B]
        inv_arm2 = b[INV_ARM2 * B + q]
        turned = (sx * ax + sy * ay + sz * az) * inv_arm2
        sx += tx * dt - turned * ax
        sy += ty * dt - turned * ay
        sz += tz * dt - turned * az
        factor = slip(S_t * S_t * (sx * sx + sy * sy + sz * sz), limit, one, tiny)
        sx *= factor
        sy *= factor
        sz *= factor
        h[o] = sx
        h[o + B] = sy
        h[o + 2 * B] = sz
        D_t = acting_damping(tangential, b[DAMPING * B + q], factor, one, zero)
        fx = S_t * sx + D_t * tx
        fy = S_t * sy + D_t * ty
        fz = S_t * sz + D_t * tz
        factor = shrink(tangential, fx * fx + fy * fy + fz * fz, limit, one, tiny)
        fx *= factor
        fy *= factor
        fz *= factor
        b[FORCE * B + q] = push * ax - fx
        b[(FORCE + 1) * B + q] = push * ay - fy
        b[(FORCE + 2) * B + q] = push * az - fz
        qx = ay * fz - az * fy
        qy = az * fx - ax * fz
        qz = ax * fy - ay * fx
        rolling = read(laws.rolling, c, row_r * B + q)
        if separate is None:
            b[RESISTANCE * B + q] = resistance(rolling, pressing)
        else:
            p_i = c[SHARE * B + q]
            touch = Touch(ax, ay, az, inv_arm2, S_t, pressing, p_i)
            rx, ry, rz = rolling_force(rolling, q, b, h, history_r * B + q, touch, numbers)
            qx -= p_i * rx
            qy -= p_i * ry
            qz -= p_i * rz
            b[TWIST_J * B + q] = qx + rx
            b[(TWIST_J + 1) * B + q] = qy + ry
            b[(TWIST_J + 2) * B + q] = qz + rz
            b[RESISTANCE * B + q] = zero
        b[TWIST * B + q] = qx
        b[(TWIST + 1) * B + q] = qy
        b[(TWIST + 2) * B + q] = qz
