"""The contact stage: BLOCK contacts at a time, branch-free, so that LLVM vectorises it.

One call turns relative positions and velocities (work buffer, see `dem.layout`) into loads: force on i, Q on i, rolling
resistance of both grains (nothing with type C), and with type C Q on j; with type A that is Q on i.
Walls go through the same stage as a "grain" j of zero radius, infinite mass and no spin.

The lever arm of grain i is r_i d / (r_i + r_j): the contact point divides the overlap, so angular momentum is conserved exactly.
"""

import math

from dem.contact.hertz import normal_force
from dem.contact.mindlin import slip
from dem.contact.rolling import plastic_factor
from dem.jit import lean_jit
from dem.layout import (
    ARM,
    C_N,
    C_T,
    D_T,
    FORCE,
    INV_R_I,
    INV_R_J,
    INV_R_SUM,
    K_N,
    K_T,
    MU_R,
    MU_S,
    NORMAL,
    R_STAR,
    RESISTANCE,
    TWIST,
    TWIST_J,
)
from dem.layout import BLOCK as B


@lean_jit
def contact_stage(n, b, c, h, dt, one, zero, tiny, least):
    """Loads of n contacts with type A rolling.

    Three short loops instead of a long one: a processor works on several contacts' chains of operations at a time only while they
    fit into its window.

    Parameters
    ----------
    n : contacts in the block. b : work buffer. c : their pair constants. h : their history, which is updated.
    dt, one, zero, tiny : time step and constants in the contact precision (a plain literal would promote to float64).
    least : smallest normal force; zero where contacts must not pull, else far below any force.
    """
    normal_loop(n, b, c, one, zero, tiny, least)
    tangential_loop(n, b, c, h, dt, one, zero, tiny)
    load_loop(n, b, c, zero)


@lean_jit
def normal_loop(n, b, c, one, zero, tiny, least):
    """Unit normal, relative velocity of the surfaces, stiffness and damping, normal force (zero without touch)."""
    for q in range(n):
        x = b[q]
        y = b[B + q]
        z = b[2 * B + q]
        gap = b[3 * B + q]
        inv_R_sum = c[INV_R_SUM * B + q]
        d2 = x * x + y * y + z * z
        inv_d = one / math.sqrt(d2)
        arm = d2 * inv_d * inv_R_sum
        overlap = max(gap * inv_R_sum / (one + arm), tiny)  # from the gap R_sum^2 - d^2, which was rounded only once
        root = math.sqrt(overlap)
        fourth_root = math.sqrt(root)
        nx = x * inv_d
        ny = y * inv_d
        nz = z * inv_d
        vx = b[4 * B + q]
        vy = b[5 * B + q]
        vz = b[6 * B + q]
        ux = b[7 * B + q] * arm
        uy = b[8 * B + q] * arm
        uz = b[9 * B + q] * arm
        v_n = vx * nx + vy * ny + vz * nz
        f_n = normal_force(overlap, root, fourth_root, v_n, c[K_N * B + q], c[C_N * B + q], least)
        b[q] = nx
        b[B + q] = ny
        b[2 * B + q] = nz
        b[3 * B + q] = c[K_T * B + q] * root
        b[4 * B + q] = vx - v_n * nx + ny * uz - nz * uy
        b[5 * B + q] = vy - v_n * ny + nz * ux - nx * uz
        b[6 * B + q] = vz - v_n * nz + nx * uy - ny * ux
        b[D_T * B + q] = c[C_T * B + q] * fourth_root
        b[ARM * B + q] = arm
        b[NORMAL * B + q] = f_n if gap > zero else zero


@lean_jit
def tangential_loop(n, b, c, h, dt, one, zero, tiny):
    """Tangential force of spring and dashpot, in place of the surfaces' velocity."""
    for q in range(n):
        nx = b[q]
        ny = b[B + q]
        nz = b[2 * B + q]
        S_t = b[3 * B + q]
        tx = b[4 * B + q]
        ty = b[5 * B + q]
        tz = b[6 * B + q]
        D_t = b[D_T * B + q]
        limit = c[MU_S * B + q] * max(b[NORMAL * B + q], zero)
        sx = h[q]
        sy = h[B + q]
        sz = h[2 * B + q]
        s_n = sx * nx + sy * ny + sz * nz
        sx += tx * dt - s_n * nx
        sy += ty * dt - s_n * ny
        sz += tz * dt - s_n * nz
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
        b[4 * B + q] = fx * factor
        b[5 * B + q] = fy * factor
        b[6 * B + q] = fz * factor


@lean_jit
def load_loop(n, b, c, zero):
    """Force, Q and rolling resistance of normal and tangential force."""
    for q in range(n):
        nx = b[q]
        ny = b[B + q]
        nz = b[2 * B + q]
        fx = b[4 * B + q]
        fy = b[5 * B + q]
        fz = b[6 * B + q]
        arm = b[ARM * B + q]
        f_n = b[NORMAL * B + q]
        b[FORCE * B + q] = f_n * nx - fx
        b[(FORCE + 1) * B + q] = f_n * ny - fy
        b[(FORCE + 2) * B + q] = f_n * nz - fz
        b[TWIST * B + q] = arm * (ny * fz - nz * fy)
        b[(TWIST + 1) * B + q] = arm * (nz * fx - nx * fz)
        b[(TWIST + 2) * B + q] = arm * (nx * fy - ny * fx)
        b[RESISTANCE * B + q] = max(f_n, zero) * c[MU_R * B + q]


@lean_jit
def rolling_stage(n, b, c, h, dt, one, zero, tiny):
    """Elastic-plastic rolling moments of n contacts, after `contact_stage`: type C in place of type A."""
    half = one / (one + one)
    for q in range(n):
        nx = b[q]
        ny = b[B + q]
        nz = b[2 * B + q]
        S_t = b[3 * B + q]
        turn_i = half * dt * c[INV_R_I * B + q]  # of u_i = (sum + difference) / 2
        turn_j = half * dt * c[INV_R_J * B + q]
        both, differ = turn_i - turn_j, turn_i + turn_j
        wx = b[7 * B + q] * both + b[10 * B + q] * differ + h[3 * B + q]
        wy = b[8 * B + q] * both + b[11 * B + q] * differ + h[4 * B + q]
        wz = b[9 * B + q] * both + b[12 * B + q] * differ + h[5 * B + q]
        w_n = wx * nx + wy * ny + wz * nz
        wx -= w_n * nx
        wy -= w_n * ny
        wz -= w_n * nz
        R_star = c[R_STAR * B + q]
        limit = b[RESISTANCE * B + q] / (S_t * R_star)  # of the angle: mu_r F_n R* over k_r = S_t R*^2
        factor = plastic_factor(wx * wx + wy * wy + wz * wz, limit, one, tiny)
        wx *= factor
        wy *= factor
        wz *= factor
        h[3 * B + q] = wx
        h[4 * B + q] = wy
        h[5 * B + q] = wz
        k_r = S_t * R_star * R_star
        k_i = k_r * c[INV_R_I * B + q]
        k_j = k_r * c[INV_R_J * B + q]
        b[TWIST_J * B + q] = b[TWIST * B + q] + k_j * wx
        b[(TWIST_J + 1) * B + q] = b[(TWIST + 1) * B + q] + k_j * wy
        b[(TWIST_J + 2) * B + q] = b[(TWIST + 2) * B + q] + k_j * wz
        b[TWIST * B + q] -= k_i * wx
        b[(TWIST + 1) * B + q] -= k_i * wy
        b[(TWIST + 2) * B + q] -= k_i * wz
        b[RESISTANCE * B + q] = zero
