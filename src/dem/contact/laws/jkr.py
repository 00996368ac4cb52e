"""Adhesive contact of elastic spheres (JKR) with the dashpot of the Hertz contact: it holds beyond zero overlap, until tear-off.

Symbols: a contact radius in m; w work of adhesion of the pair in J/m2; the others as in `dem.contact.laws.hertz`.

    delta = a^2/R* - sqrt(2 pi w a / E*),   F = 4 E* a^3 / (3 R*) - sqrt(8 pi w E* a^3)

One curve serves all contacts, in units of the pull-off force F_c = 3/2 pi w R*, the contact radius at tear-off
a_f = (pi w R*^2 / (8 E*))^(1/3) and the gap at tear-off delta_f = 3 a_f^2 / R*:

    y^4 - 4 y = 3 x,   F / F_c = (y^6 - 6 y^3) / 9,   x = delta / delta_f >= -1,   y = sqrt(a / a_f) >= 1

In s = sqrt(1 + x) it is (y - 1)^2 (y^2 + 2 y + 3) = 3 s^2. Start: a rational function of s that has the right first two terms at
either end and is within 4e-4 between; then one step of Halley's method (error of F below 1e-11 of the larger of F_c and F).
Deformations count in units of that at tear-off, a_f^2 / R*: forces then are polynomials of y, and no division is needed for x.
Grains feel nothing until they touch; contacts then hold to x = -1, wherever they are torn.
Sliding and rolling see the repulsive part 4 E* a^3 / (3 R*), as EDEM's "positive repulsive part": a contact without load slides at
4 mu_s F_c. The tangential spring and both dashpots see the contact radius a in place of sqrt(R* delta).
Source: Johnson, Kendall, Roberts 1971 (Proc. R. Soc. A 324, 301).
Limits: LAMMPS tears at the smallest force (delta = -a_c^2 / (3 R*)), here it is the theory's turning point -delta_f.
"""

import math
from typing import NamedTuple

from dem.contact.laws import hertz
from dem.jit import lean_jit
from dem.layout import BLOCK as B

#: Coefficients of the start a / a_f = 1 + s (sqrt(2) + A s + sqrt(3) C s^2) / (1 + B s + C s^2): its ends are exact, A, B and C
#: were fitted to the curve.
START_A, START_B, START_C = 1.10528, 0.665548, 0.0540786

#: Least u = y - 1 in the slope: closer to tear-off float32 does not tell y from 1, and the start is right.
LEAST_U = 1e-7

#: y at first touch (x = 0).
Y_TOUCH = 4.0 ** (1.0 / 3.0)

#: Least a_f / R*: a pair without adhesion is one with a tear-off gap of 3e-12 R*, which gives Hertz's force within rounding.
LEAST_RATIO = 1e-6


class Jkr(NamedTuple):
    """Constants of a contact.

    Spring (N) and dashpot (kg/s) of a Hertz contact whose deformation counts in units of that at tear-off, a_f^2 / R* (`scale`);
    inverse of the gap at tear-off (1/m); `least` as in `dem.contact.laws.hertz.Hertz`. No more of them: the compiler gathers four
    values as a vector, and the loop is then none.
    """

    k_n: float
    c_n: float
    inv_gap: float
    least: float


PARAMETERS = Jkr
PROPERTIES = ("restitution", "work_of_adhesion_j_m2")
COLUMNS = ("E_star", "w")
CONSTANTS = ("k_n", "c_n", "inv_gap")
#: 1 if the grains have touched since they were last apart (the sign is that of the pair's order).
HISTORY = ("touched",)
# the repulsive part is that of a Hertz contact of the same radius
spring_force = hertz.spring_force
normal_force = hertz.normal_force
WORDS = {
    "words": "JKR adhesive contact with the dashpot of EDEM's Hertz-Mindlin model; grains that touched hold until they are torn "
    "off. Sliding and rolling are limited by the repulsive part 4 E* a^3 / (3 R*).",
    "equation": "d = a^2/R* - sqrt(2 pi w a/E*), F_n = 4 E* a^3/(3 R*) - sqrt(8 pi w E* a^3) + dashpot, pull-off force "
    f"3/2 pi w R*, w = 2 gamma work of adhesion in J/m2, a contact radius; {hertz.PAIR}",
}


def column_values(a, b, interaction):
    """Values of COLUMNS for two materials: E* in Pa, work of adhesion in J/m2."""
    return (*hertz.column_values(a, b, interaction), interaction.work_of_adhesion_j_m2)


@lean_jit
def radius_at_tear_off(E_star, w, R_star):
    """a_f in m."""
    return max((math.pi * w * R_star * R_star / (8.0 * E_star)) ** (1.0 / 3.0), LEAST_RATIO * R_star)


def reach(columns, R_star):
    """Gap in m up to which the law acts: delta_f."""
    return 3.0 * radius_at_tear_off(columns[0], columns[1], R_star) ** 2 / R_star


def work_of_adhesion(pull_off_n, R_star):
    """Work of adhesion in J/m2 of a pair with this pull-off force."""
    return pull_off_n / (1.5 * math.pi * R_star)


def read(law, c, o):
    """Constants of the contact whose first value stands at o."""
    return Jkr(c[o], c[o + B], c[o + 2 * B], law.least)


def scale(law, raw, p, R_star):
    """Fourth root of the deformation at tear-off, a_f^2 / R*, in m^(1/4)."""
    R = float(R_star)
    return math.sqrt(radius_at_tear_off(float(raw[p]), float(raw[p + B]), R) / math.sqrt(R))


def write(law, raw, p, c, o, pair):
    """Turn the pair's columns, from p on in raw, into constants from o on."""
    E_star = float(raw[p])
    R_star = float(pair.R_star)
    square = pair.scale * pair.scale
    c[o] = hertz.stiffness(E_star, R_star) * square * square * square
    c[o + B] = hertz.damping_constant(E_star, R_star, pair.m_star, pair.beta) * pair.scale
    c[o + 2 * B] = 1.0 / (3.0 * square * square)


def touches(law, gap, overlap, h, o, zero):
    """True if the contact acts: with an overlap, or not yet torn off."""
    return (gap > zero) | ((h[o] != zero) & (overlap * law.inv_gap > -type(zero)(1.0)))


def remember(law, touching, h, o, one, zero):
    """Note that the grains touch."""
    h[o] = one if touching else zero


@lean_jit
def relative_root(x, like):
    """Root y of the contact radius a over a_f at x = delta / delta_f, in the type of `like`."""
    number = type(like)
    one, two, three, six = number(1.0), number(2.0), number(3.0), number(6.0)
    s = math.sqrt(max(one + x, like))
    above = number(math.sqrt(2.0)) + s * (number(START_A) + number(math.sqrt(3.0) * START_C) * s)
    y = math.sqrt(one + s * above / (one + s * (number(START_B) + number(START_C) * s)))
    u, square = y - one, y * (y + two) + three
    residual = u * u * square - three * s * s
    slope = number(4.0) * max(u, number(LEAST_U)) * (square - y - two)
    return y - residual * slope / (slope * slope - six * residual * y * y)


def deformation(law, overlap, tiny):
    """As `dem.contact.laws.hertz.deformation`, in units of that at tear-off: y^4 and its roots."""
    fourth_root = relative_root(overlap * law.inv_gap, tiny)
    root = fourth_root * fourth_root
    return root * root, root, fourth_root


def attracted(law, f_n, overlap, root, fourth_root):
    """Normal force in N, from its repulsive part f_n = k_n y^6: the attraction is 6 k_n y^3."""
    return f_n - type(root)(6.0) * law.k_n * (root * fourth_root)


@lean_jit
def energy_along(y):
    """Integral of F dx / F_c over x up to y, from an arbitrary origin."""
    return 4.0 / 27.0 * (0.1 * y**10 - y**7 + 1.5 * y**4)


@lean_jit
def held_energy(law, y):
    """Energy in J at y relative to first touch; F_c = 9 k_n."""
    return 9.0 * law.k_n / law.inv_gap * (energy_along(y) - energy_along(Y_TOUCH))


def normal_energy(law, overlap, root):
    """Energy in J of the contact, zero at first touch."""
    return held_energy(law, math.sqrt(float(root)))


def torn_energy(law, h, o):
    """Energy in J that is lost where the contact has been torn off."""
    return held_energy(law, 1.0) if h[o] != 0.0 else 0.0
