"""The contact stage: BLOCK contacts at a time, branch-free, so that LLVM vectorises it.

One call turns relative positions and velocities (work buffer, see `dem.layout`) into loads: on leaving, the buffer's rows hold
force on i (0-2), Q_t on both grains (3-5), rolling resistance (6) and, for type C, the rolling moment on i (10-12).
Walls go through the same stage as a "grain" j of zero radius, infinite mass and no spin.

The lever arm of grain i is r_i d / (r_i + r_j): the contact point divides the overlap, so angular momentum is conserved exactly.
"""

import math

from dem.contact.hertz import normal_force
from dem.contact.mindlin import slip_factor
from dem.contact.rolling import plastic_factor
from dem.jit import jit
from dem.layout import BLOCK as B
from dem.layout import C_N, C_T, HISTORY, K_N, K_T, MU_R, MU_S, R_STAR, R_SUM


@jit
def contact_stage(n, b, c, dt, one, zero, tiny):
    """Loads of n contacts with type A rolling.

    Parameters
    ----------
    n : contacts in the block. b : work buffer. c : contact block (constants and history; the history is updated).
    dt, one, zero, tiny : time step and constants in the contact precision (a plain literal would promote to float64).
    """
    for q in range(n):
        gap = b[3 * B + q]
        R_sum = c[R_SUM * B + q]
        d2 = R_sum * R_sum - gap
        inv_d = one / math.sqrt(d2)
        d = d2 * inv_d
        touching = one if gap > zero else zero
        overlap = max(gap / (R_sum + d), tiny)
        nx = b[q] * inv_d
        ny = b[B + q] * inv_d
        nz = b[2 * B + q] * inv_d
        root = math.sqrt(overlap)
        fourth_root = math.sqrt(root)
        vx = b[4 * B + q]
        vy = b[5 * B + q]
        vz = b[6 * B + q]
        arm = d / R_sum
        ux = b[7 * B + q] * arm
        uy = b[8 * B + q] * arm
        uz = b[9 * B + q] * arm
        v_n = vx * nx + vy * ny + vz * nz
        tx = vx - v_n * nx + ny * uz - nz * uy
        ty = vy - v_n * ny + nz * ux - nx * uz
        tz = vz - v_n * nz + nx * uy - ny * ux
        f_n = normal_force(overlap, root, fourth_root, v_n, c[K_N * B + q], c[C_N * B + q])
        sx = c[HISTORY * B + q]
        sy = c[(HISTORY + 1) * B + q]
        sz = c[(HISTORY + 2) * B + q]
        s_n = sx * nx + sy * ny + sz * nz
        sx += tx * dt - s_n * nx
        sy += ty * dt - s_n * ny
        sz += tz * dt - s_n * nz
        S_t = c[K_T * B + q] * root
        D_t = c[C_T * B + q] * fourth_root
        fx = S_t * sx + D_t * tx
        fy = S_t * sy + D_t * ty
        fz = S_t * sz + D_t * tz
        push = max(f_n, zero)
        slip = slip_factor(math.sqrt(fx * fx + fy * fy + fz * fz), c[MU_S * B + q] * push, one, tiny)
        fx *= slip
        fy *= slip
        fz *= slip
        inv_S = touching / S_t
        sticks = slip >= one
        c[HISTORY * B + q] = sx * touching if sticks else (fx - D_t * tx) * inv_S
        c[(HISTORY + 1) * B + q] = sy * touching if sticks else (fy - D_t * ty) * inv_S
        c[(HISTORY + 2) * B + q] = sz * touching if sticks else (fz - D_t * tz) * inv_S
        f_n *= touching
        fx *= touching
        fy *= touching
        fz *= touching
        b[q] = f_n * nx - fx
        b[B + q] = f_n * ny - fy
        b[2 * B + q] = f_n * nz - fz
        b[3 * B + q] = arm * (ny * fz - nz * fy)
        b[4 * B + q] = arm * (nz * fx - nx * fz)
        b[5 * B + q] = arm * (nx * fy - ny * fx)
        b[6 * B + q] = push * touching * c[MU_R * B + q]
        b[13 * B + q] = S_t
        b[14 * B + q] = nx
        b[15 * B + q] = ny
        b[16 * B + q] = nz


@jit
def rolling_stage(n, b, c, dt, one, tiny):
    """Elastic-plastic rolling moments of n contacts, after `contact_stage`, which leaves mu_r F_n, S_t and n in the buffer."""
    for q in range(n):
        nx = b[14 * B + q]
        ny = b[15 * B + q]
        nz = b[16 * B + q]
        wx = b[10 * B + q] * dt + c[(HISTORY + 3) * B + q]
        wy = b[11 * B + q] * dt + c[(HISTORY + 4) * B + q]
        wz = b[12 * B + q] * dt + c[(HISTORY + 5) * B + q]
        w_n = wx * nx + wy * ny + wz * nz
        wx -= w_n * nx
        wy -= w_n * ny
        wz -= w_n * nz
        R_star = c[R_STAR * B + q]
        k_r = b[13 * B + q] * R_star * R_star
        limit = b[6 * B + q] * R_star
        factor = plastic_factor(k_r * math.sqrt(wx * wx + wy * wy + wz * wz), limit, one, tiny)
        wx *= factor
        wy *= factor
        wz *= factor
        c[(HISTORY + 3) * B + q] = wx
        c[(HISTORY + 4) * B + q] = wy
        c[(HISTORY + 5) * B + q] = wz
        b[10 * B + q] = -k_r * wx
        b[11 * B + q] = -k_r * wy
        b[12 * B + q] = -k_r * wz
