"""Hertz contact with a liquid bridge that outlasts the contact (Willett): it pulls from first touch until it breaks.

Symbols: s gap in m; V volume of a bridge; w = 2 gamma_l cos(theta) in J/m2, gamma_l surface tension and theta contact angle of the
liquid; the others as in `dem.contact.laws.hertz`.

    F_n = Hertz(delta) - F_c / (1 + 1.05 x + 2.5 x^2),   F_c = 2 pi w R*,   x = s sqrt(2 R* / V),   s = max(-delta, 0)

With an overlap the pull is that of `dem.contact.laws.pull_off`, whatever the volume. The bridge breaks at s = V^(1/3), the distance
of a liquid that wets the grains. Sliding and rolling see the repulsive part: a bridge without contact resists neither.
V is given over R*^3, the same for all pairs of two materials. Grains feel nothing until they touch.
Source: Willett et al. 2000 (Langmuir 16, 9396); rupture: Lian, Thornton, Adams 1993 (J. Colloid Interface Sci. 161, 138).
Limits: small volumes (V / R*^3 up to some 0.01); the rupture distance's factor 1 + theta/2 is left out; no viscosity, and no
exchange of liquid.
"""

import math
from typing import NamedTuple

from dem.contact.laws import hertz, jkr, pull_off
from dem.jit import lean_jit
from dem.layout import BLOCK as B

#: Coefficients of Willett's fit.
LINEAR, SQUARE = 1.05, 2.5

#: sqrt(4 c - b^2) of the fit 1 + b x + c x^2.
ROOT = math.sqrt(4.0 * SQUARE - LINEAR**2)

#: Overlaps in m up to this stand for none (`dem.contact.model.TINY`): a stretched bridge has no dashpot, and presses nothing.
STRETCHED = 2e-18

#: Least V / R*^3: a bridge without liquid ends 1e-5 R* beyond contact.
LEAST_VOLUME = 1e-15


class Capillary(NamedTuple):
    """Constants of a contact.

    Spring and dashpot; F_c in N; sqrt(2 R* / V) in 1/m; 1 over the gap of rupture in 1/m; `least` as in
    `dem.contact.laws.hertz.Hertz`.
    """

    k_n: float
    c_n: float
    F_c: float
    inv_s: float
    inv_reach: float
    least: float


PARAMETERS = Capillary
PROPERTIES = ("restitution", "work_of_adhesion_j_m2", "bridge_volume_ratio")
COLUMNS = ("E_star", "w", "volume")
CONSTANTS = ("k_n", "c_n", "F_c", "inv_s", "inv_reach")
#: 1 if a bridge has formed and not yet broken (the sign is that of the pair's order).
HISTORY = ("touched",)
scale, deformation, spring_force, remember = hertz.scale, hertz.deformation, hertz.spring_force, jkr.remember
WORDS = {
    "words": "Hertz spring with the dashpot of EDEM's Hertz-Mindlin model, and the pull of a liquid bridge (Willett 2000), from "
    "first touch until it breaks. Sliding and rolling are limited by the repulsive part.",
    "equation": f"{hertz.WORDS['equation']}; less F_c/(1 + 1.05 x + 2.5 x^2), F_c = 2 pi w R*, x = s sqrt(2 R*/V), s gap, "
    "breaks at V^(1/3); w = 2 gamma_l cos(theta)",
}
work_of_adhesion = pull_off.work_of_adhesion


def column_values(a, b, interaction):
    """Values of COLUMNS for two materials: E* in Pa, w in J/m2, V over R*^3."""
    volume = max(interaction.bridge_volume_ratio, LEAST_VOLUME)
    return (*hertz.column_values(a, b, interaction), interaction.work_of_adhesion_j_m2, volume)


def reach(columns, R_star):
    """Gap in m up to which the law acts: V^(1/3)."""
    return R_star * columns[2] ** (1.0 / 3.0)


def read(law, c, o):
    """Constants of the contact whose first value stands at o."""
    return Capillary(c[o], c[o + B], c[o + 2 * B], c[o + 3 * B], c[o + 4 * B], law.least)


def write(law, raw, p, c, o, pair):
    """Turn the pair's columns, from p on in raw, into constants from o on."""
    E_star = raw[p]
    volume = float(raw[p + 2 * B])
    c[o] = hertz.stiffness(E_star, pair.R_star)
    c[o + B] = hertz.damping_constant(E_star, pair.R_star, pair.m_star, pair.beta)
    c[o + 2 * B] = pull_off.pull_off_force(raw[p + B], pair.R_star)
    c[o + 3 * B] = math.sqrt(2.0 / volume) / pair.R_star
    c[o + 4 * B] = 1.0 / (pair.R_star * volume ** (1.0 / 3.0))


def touches(law, gap, overlap, h, o, zero):
    """True if the contact acts: with an overlap, or with a bridge that has not broken."""
    return (gap > zero) | ((h[o] != zero) & (overlap * law.inv_reach > -type(zero)(1.0)))


def normal_force(law, overlap, root, fourth_root, v_n):
    """Repulsive part in N of the force that pushes i away from j; arguments as in `dem.contact.laws.hertz.normal_force`."""
    number = type(overlap)
    pressing = law.k_n * root * overlap - law.c_n * fourth_root * v_n
    return max(pressing if overlap > number(STRETCHED) else number(0.0), law.least)


def attracted(law, f_n, overlap, root, fourth_root):
    """Normal force in N, from its repulsive part f_n."""
    number = type(overlap)
    x = max(-overlap, number(0.0)) * law.inv_s
    return f_n - law.F_c / (number(1.0) + x * (number(LINEAR) + number(SQUARE) * x))


@lean_jit
def held_energy(law, gap):
    """Energy in J of a bridge over a gap, relative to first touch: the integral of the pull."""
    x = gap * law.inv_s
    return law.F_c / law.inv_s * (2.0 / ROOT) * (math.atan((2.0 * SQUARE * x + LINEAR) / ROOT) - math.atan(LINEAR / ROOT))


def normal_energy(law, overlap, root):
    """Energy in J of spring and bridge, zero at first touch."""
    delta = max(overlap, 0.0)
    return (0.4 * (law.k_n * root * delta) - law.F_c) * delta + held_energy(law, max(-overlap, 0.0))


def torn_energy(law, h, o):
    """Energy in J that is lost where the bridge has broken."""
    return held_energy(law, 1.0 / law.inv_reach) if h[o] != 0.0 else 0.0
