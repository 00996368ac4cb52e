"""The contact stage: BLOCK contacts at a time, branch-free, so that LLVM vectorises it.

One call turns relative positions and velocities (work buffer, see `dem.layout`) into loads: force on i, Q on i, rolling
resistance of both grains (nothing with type C), and with type C Q on j; with type A that is Q on i.
Walls go through the same stage as a "grain" j of zero radius, infinite mass and no spin.

The lever arm of grain i is r_i d / (r_i + r_j): the contact point divides the overlap, so angular momentum is conserved exactly.
"""

import math

from dem.contact.laws.hertz import normal_force
from dem.contact.laws.mindlin import slip
from dem.jit import lean_jit
from dem.layout import BLOCK as B
from dem.layout import (
    C_N,
    C_T,
    D_T,
    FORCE,
    INV_ARM2,
    INV_R_SUM,
    K_N,
    K_T,
    MU_R,
    MU_S,
    NORMAL,
    PUSH,
    RESISTANCE,
    ROLLING_SHARE,
    SECOND_SPIN,
    TWIST,
    TWIST_J,
)


@lean_jit
def contact_stage(n, b, c, h, dt, one, zero, tiny, least, elastic):
    """Loads of n contacts.

    Two short loops instead of a long one: a processor works on several contacts' chains of operations at a time only while they
    fit into its window.

    Parameters
    ----------
    n : contacts in the block. b : work buffer. c : their pair constants. h : their history, which is updated.
    dt, one, zero, tiny : time step and constants in the contact precision (a plain literal would promote to float64).
    least : smallest normal force; zero where contacts must not pull, else far below any force.
    elastic : None for type A rolling, anything else for type C (the other branch is then not even compiled).
    """
    normal_loop(n, b, c, one, zero, tiny, least)
    tangential_loop(n, b, c, h, dt, one, zero, tiny, elastic)


@lean_jit
def normal_loop(n, b, c, one, zero, tiny, least):
    """Lever arm, relative velocity of the surfaces, stiffness and damping, normal force (zero without touch)."""
    for q in range(n):
        inv_R_sum = c[INV_R_SUM * B + q]
        ax = b[q] * inv_R_sum
        ay = b[B + q] * inv_R_sum
        az = b[2 * B + q] * inv_R_sum
        gap = b[3 * B + q]
        scaled_gap = gap * inv_R_sum
        arm2 = one - scaled_gap * inv_R_sum  # from the gap R_sum^2 - d^2, which was rounded only once
        inv_arm = one / math.sqrt(arm2)
        inv_arm2 = inv_arm * inv_arm
        overlap = max(scaled_gap / (one + arm2 * inv_arm), tiny)
        root = math.sqrt(overlap)
        fourth_root = math.sqrt(root)
        vx = b[4 * B + q]
        vy = b[5 * B + q]
        vz = b[6 * B + q]
        ux = b[7 * B + q]
        uy = b[8 * B + q]
        uz = b[9 * B + q]
        v_a = vx * ax + vy * ay + vz * az
        f_n = normal_force(overlap, root, fourth_root, v_a * inv_arm, c[K_N * B + q], c[C_N * B + q], least)
        f_n = f_n if gap > zero else zero
        away = v_a * inv_arm2
        b[q] = ax
        b[B + q] = ay
        b[2 * B + q] = az
        b[3 * B + q] = c[K_T * B + q] * root
        b[4 * B + q] = vx - away * ax + ay * uz - az * uy
        b[5 * B + q] = vy - away * ay + az * ux - ax * uz
        b[6 * B + q] = vz - away * az + ax * uy - ay * ux
        b[D_T * B + q] = c[C_T * B + q] * fourth_root
        b[INV_ARM2 * B + q] = inv_arm2
        b[PUSH * B + q] = f_n * inv_arm
        b[NORMAL * B + q] = f_n


@lean_jit
def tangential_loop(n, b, c, h, dt, one, zero, tiny, elastic):
    """Tangential force of spring and dashpot, rolling; force, Q and rolling resistance."""
    for q in range(n):
        ax = b[q]
        ay = b[B + q]
        az = b[2 * B + q]
        S_t = b[3 * B + q]
        tx = b[4 * B + q]
        ty = b[5 * B + q]
        tz = b[6 * B + q]
        D_t = b[D_T * B + q]
        push = b[PUSH * B + q]
        pressing = max(b[NORMAL * B + q], zero)
        limit = c[MU_S * B + q] * pressing
        sx = h[q]
        sy = h[B + q]
        sz = h[2 * B + q]
        inv_arm2 = b[INV_ARM2 * B + q]
        turned = (sx * ax + sy * ay + sz * az) * inv_arm2
        sx += tx * dt - turned * ax
        sy += ty * dt - turned * ay
        sz += tz * dt - turned * az
        factor = slip(S_t * S_t * (sx * sx + sy * sy + sz * sz), limit, one, tiny)
        sx *= factor
        sy *= factor
        sz *= factor
        h[q] = sx
        h[B + q] = sy
        h[2 * B + q] = sz
        fx = S_t * sx + D_t * tx
        fy = S_t * sy + D_t * ty
        fz = S_t * sz + D_t * tz
        factor = slip(fx * fx + fy * fy + fz * fz, limit, one, tiny)
        fx *= factor
        fy *= factor
        fz *= factor
        b[FORCE * B + q] = push * ax - fx
        b[(FORCE + 1) * B + q] = push * ay - fy
        b[(FORCE + 2) * B + q] = push * az - fz
        qx = ay * fz - az * fy
        qy = az * fx - ax * fz
        qz = ax * fy - ay * fx
        resistance = pressing * c[MU_R * B + q]
        if elastic is None:
            b[RESISTANCE * B + q] = resistance
        else:
            rx, ry, rz = rolling_force(q, b, c, h, ax, ay, az, S_t, inv_arm2, resistance, dt, one, tiny)
            p_i = c[ROLLING_SHARE * B + q]
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


@lean_jit
def rolling_force(q, b, c, h, ax, ay, az, S_t, inv_arm2, limit, dt, one, tiny):
    """Force of the rolling spring of contact q, at most `limit`; its length in h is renewed (type C, see `rolling`)."""
    p_i = c[ROLLING_SHARE * B + q]
    sx = h[3 * B + q] + dt * (p_i * b[7 * B + q] - b[SECOND_SPIN * B + q])
    sy = h[4 * B + q] + dt * (p_i * b[8 * B + q] - b[(SECOND_SPIN + 1) * B + q])
    sz = h[5 * B + q] + dt * (p_i * b[9 * B + q] - b[(SECOND_SPIN + 2) * B + q])
    turned = (sx * ax + sy * ay + sz * az) * inv_arm2
    sx -= turned * ax
    sy -= turned * ay
    sz -= turned * az
    factor = slip(S_t * S_t * (sx * sx + sy * sy + sz * sz), limit, one, tiny)
    sx *= factor
    sy *= factor
    sz *= factor
    h[3 * B + q] = sx
    h[4 * B + q] = sy
    h[5 * B + q] = sz
    return S_t * sx, S_t * sy, S_t * sz
