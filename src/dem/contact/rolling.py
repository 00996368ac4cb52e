"""Rolling resistance, two models.

Type A, EDEM's: each grain feels a torque mu_r F_n R_i against its own spin. The torque may stop the spin within a step but not
reverse it ("clipped"), so a heap comes to true rest; unclipped it jitters for ever. Other codes use R* and the relative spin,
which halves the torque between equal spheres.

Type C, elastic-plastic (Ai, Chen, Rotter, Ooi 2011, Powder Technol. 206, 269, without viscous part): a rolling spring theta
with k_r = k_t sqrt(delta) R*^2, moment limited to mu_r F_n R*, opposite and equal on the two grains.
"""

import math

from dem.jit import jit


@jit
def braked(spin_x, spin_y, spin_z, largest_change, one, tiny):
    """Share of a spin velocity that rolling resistance takes away: `largest_change` of it, at most all (type A)."""
    return min(one, largest_change * (one / math.sqrt(spin_x * spin_x + spin_y * spin_y + spin_z * spin_z + tiny)))


@jit
def plastic_factor(angle2, limit, one, tiny):
    """By how much a rolling spring of squared angle `angle2` must shrink to stay below the limit; 1 when it does (type C)."""
    return min(one, limit * (one / math.sqrt(angle2 + tiny * tiny)))
