"""Rolling resistance of type A, EDEM's: every contact brakes each of its grains against the grain's own spin.

    M_i = -mu_r F_n R_i w_i / |w_i|

The torque may stop the spin within a step but not reverse it ("clipped"), so a heap comes to true rest; unclipped it jitters for
ever. Other codes use R* and the relative spin, which halves the torque between equal spheres.
"""

import math
from typing import NamedTuple

from dem.jit import lean_jit


class RollingA(NamedTuple):
    """Constants of a contact: coefficient of rolling friction."""

    mu_r: float


PARAMETERS = RollingA
PROPERTIES = ("rolling_friction",)
COLUMNS = ("mu_r",)
CONSTANTS = ("mu_r",)
HISTORY = ()
#: A brake: the gather stage need not separate the spin velocities of the two grains.
SEPARATE_SPINS = False
WORDS = {
    "words": "Type A, as EDEM's standard rolling friction: every contact brakes each of its grains against the grain's own "
    "spin. The torque may stop a spin within a time step but never reverses it.",
    "equation": "M_i = -mu_r F_n R_i w_i / |w_i|",
}


def column_values(a, b, interaction):
    """Values of COLUMNS for two materials."""
    return (interaction.rolling_friction,)


def reach(columns, R_star):
    """Gap in m up to which the law acts: it needs contact."""
    return 0.0


def read(law, c, o):
    """Constants of the contact whose first value stands at o."""
    return RollingA(c[o])


def write(law, raw, p, c, o, pair):
    """Turn the pair's columns, from p on in raw, into constants from o on."""
    c[o] = raw[p]


def resistance(law, pressing):
    """Largest |Q| in N with which a contact resists rolling."""
    return law.mu_r * pressing


@lean_jit
def braked(spin_x, spin_y, spin_z, largest_change, one, tiny):
    """Share of a spin velocity that rolling resistance removes: `largest_change` of it, at most all."""
    return min(one, largest_change * (one / math.sqrt(spin_x * spin_x + spin_y * spin_y + spin_z * spin_z + tiny)))
