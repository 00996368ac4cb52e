"""Rolling resistance, two models.

Type A, EDEM's: each grain feels a torque mu_r F_n R_i against its own spin. The torque may stop the spin within a step but not
reverse it ("clipped"), so a heap comes to true rest; unclipped it jitters for ever. Other codes use R* and the relative spin,
which halves the torque between equal spheres.

Type C, elastic-plastic (Ai, Chen, Rotter, Ooi 2011, Powder Technol. 206, 269, without viscous part): a rolling spring of angle
theta with k_r = S_t R*^2 (S_t: see `mindlin`), its moment limited to mu_r F_n R*, opposite and equal on both grains.
Written here with the spring's length s = R* theta and the rolling velocity v_r = R* (w_i - w_j), w an angular velocity:

    ds/dt = v_r = p_i u_i - p_j u_j,   p_i = R*/R_i = R_j/(R_i + R_j) = 1 - p_j,   u = R w
    S_t |s| <= mu_r F_n                (else s is shortened to it, as a tangential spring)
    Q_i = -p_i S_t s,   Q_j = p_j S_t s  (torque over radius)

On a wall p_i = 1. The spring turns with the contact: its part along the normal is dropped. So nothing resists twisting: a grain
that stands on a single other one may spin about the normal for ever.
"""

import math

from dem.jit import jit


@jit
def braked(spin_x, spin_y, spin_z, largest_change, one, tiny):
    """Share of a spin velocity that rolling resistance takes away: `largest_change` of it, at most all (type A)."""
    return min(one, largest_change * (one / math.sqrt(spin_x * spin_x + spin_y * spin_y + spin_z * spin_z + tiny)))
