"""Hertz contact with a constant pull-off force: adhesion of stiff grains (DMT), or a capillary bridge that ends with the contact.

Symbols: w work of adhesion of the pair in J/m2 (twice the surface energy gamma of one surface); R_star effective radius; the others
as in `dem.contact.laws.hertz`.

    F_n = Hertz(delta) - F_c while delta > 0,   F_c = 2 pi w R*

Sliding and rolling see the repulsive part F_n + F_c: a contact without load slides at mu_s F_c. (LAMMPS limits it by F_n + 2 F_c,
so one surface energy gives another cohesion there: c or the adhesive stress carries over, not gamma.)
Moist grains: the attraction of a liquid bridge at contact is 4 pi gamma_l R* cos(theta) whatever its volume, so w = 2 gamma_l
cos(theta), gamma_l the liquid's surface tension, theta the contact angle. Limit: this law ends with the contact; the
stretch of a bridge is left out.
Source: Derjaguin, Muller, Toporov 1975 (J. Colloid Interface Sci. 53, 314); liquid: Willett et al. 2000 (Langmuir 16, 9396).
"""

import math
from typing import NamedTuple

from dem.contact.laws import hertz
from dem.jit import lean_jit
from dem.layout import BLOCK as B


class PullOff(NamedTuple):
    """Constants of a contact: spring and dashpot, pull-off force in N; `least` as in `dem.contact.laws.hertz.Hertz`."""

    k_n: float
    c_n: float
    F_c: float
    least: float


PARAMETERS = PullOff
PROPERTIES = ("restitution", "work_of_adhesion_j_m2")
COLUMNS = ("E_star", "w")
CONSTANTS = ("k_n", "c_n", "F_c")
HISTORY = ()
# the repulsive part, and when it acts, are those of the Hertz contact
touches = hertz.touches
remember = hertz.remember
scale = hertz.scale
deformation = hertz.deformation
spring_force = hertz.spring_force
normal_force = hertz.normal_force
torn_energy = hertz.torn_energy
reach = hertz.reach
WORDS = {
    "words": "Hertz spring with the dashpot of EDEM's Hertz-Mindlin model, and a constant pull-off force while grains touch (DMT). "
    "Sliding and rolling are limited by the repulsive part F_n + F_c.",
    "equation": f"{hertz.WORDS['equation']}; less F_c = 2 pi w R*, w = 2 gamma work of adhesion in J/m2",
}


def column_values(a, b, interaction):
    """Values of COLUMNS for two materials: E* in Pa, work of adhesion in J/m2."""
    return (*hertz.column_values(a, b, interaction), interaction.work_of_adhesion_j_m2)


@lean_jit
def pull_off_force(w, R_star):
    """F_c in N, positive."""
    return 2.0 * math.pi * w * R_star


def work_of_adhesion(pull_off_n, R_star):
    """Work of adhesion in J/m2 of a pair with this pull-off force."""
    return pull_off_n / (2.0 * math.pi * R_star)


def read(law, c, o):
    """Constants of the contact whose first value stands at o."""
    return PullOff(c[o], c[o + B], c[o + 2 * B], law.least)


def write(law, raw, p, c, o, pair):
    """Turn the pair's columns, from p on in raw, into constants from o on."""
    E_star = raw[p]
    c[o] = hertz.stiffness(E_star, pair.R_star)
    c[o + B] = hertz.damping_constant(E_star, pair.R_star, pair.m_star, pair.beta)
    c[o + 2 * B] = pull_off_force(raw[p + B], pair.R_star)


def attracted(law, f_n, overlap, root, fourth_root):
    """Normal force in N, from its repulsive part f_n."""
    return f_n - law.F_c


def normal_energy(law, overlap, root):
    """Energy in J of the spring and of the attraction: the integral of k_n delta^(3/2) - F_c."""
    return (0.4 * (law.k_n * root * overlap) - law.F_c) * overlap
