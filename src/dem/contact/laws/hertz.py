"""Hertz normal contact with the dashpot of EDEM's Hertz-Mindlin model, and one that never pulls.

Symbols: delta overlap, positive when grains touch; R_star, m_star, E_star effective radius, mass, Young's modulus;
v_n normal component of the relative velocity of i against j along n, which points from j to i; e restitution.

    F_n = 4/3 E* sqrt(R*) delta^(3/2) - 2 sqrt(5/6) beta sqrt(S_n m*) v_n,   S_n = 2 E* sqrt(R* delta),
    beta = -ln e / sqrt(ln^2 e + pi^2)

Source: Tsuji, Tanaka, Ishida 1992 (Powder Technol. 71, 239) in the form of EDEM's user guide. This beta, that of a linear spring,
also gives exactly e with the dashpot above (Antypov & Elliott 2011, EPL 94, 50004). The price: just before separation the dashpot
pulls, the more the lower e is. Where the pull is cut off (F_n >= 0) the rebound is too fast: e = 0.32 where 0.2 was wanted.
`damping_ratio_without_pull` is the beta that then gives e again (Thornton, Cummins, Cleary 2013, Powder Technol. 233, 30).
"""

import math
from collections.abc import Callable
from typing import NamedTuple

from dem.jit import lean_jit
from dem.layout import BLOCK as B

#: 2 sqrt(5/6), from S_n being the tangent stiffness of a delta^(3/2) spring.
DASHPOT_FACTOR = 2.0 * math.sqrt(5.0 / 6.0)

#: Stands for no lower bound of the normal force (N).
NO_BOUND = -1e30


class Hertz(NamedTuple):
    """Constants of a contact: spring and dashpot; `least`: smallest normal force in N, the same for all contacts."""

    k_n: float
    c_n: float
    least: float


PARAMETERS = Hertz
PROPERTIES = ("restitution",)
COLUMNS = ("E_star",)
CONSTANTS = ("k_n", "c_n")
HISTORY = ()
PAIR = "E* = E/2/(1 - nu^2), E = 2 G (1 + nu); G* = G/2/(2 - nu); 1/R* = 1/R_1 + 1/R_2; 1/m* = 1/m_1 + 1/m_2"
WORDS = {
    "words": "Hertz spring with the dashpot of EDEM's Hertz-Mindlin model; it may pull for a moment at separation.",
    "equation": "F_n = 4/3 E* sqrt(R*) d^(3/2) + 2 sqrt(5/6) b sqrt(S_n m*) d', S_n = 2 E* sqrt(R* d), "
    f"b = -ln e / sqrt(ln^2 e + pi^2), d overlap, d' its rate; {PAIR}",
}


def damping_ratio(restitution: float) -> float:
    """Dashpot ratio beta (dimensionless, 0 for e = 1)."""
    log_e = math.log(restitution)
    return -log_e / math.hypot(log_e, math.pi)


def damping_ratio_without_pull(restitution: float) -> float:
    """Beta with which a contact that never pulls rebounds with e (dimensionless, 0 for e = 1)."""
    if restitution == 1.0:
        return 0.0
    from scipy.optimize import brentq  # imported here: it takes a third of the start-up time

    return brentq(lambda beta: rebound_without_pull(beta) - restitution, 0.0, 1.0 + 1.0 / math.sqrt(restitution), xtol=1e-12)


def rebound_without_pull(beta: float) -> float:
    """Rebound speed over impact speed of a contact with dashpot ratio beta that never pulls.

    In y = delta^(5/4) the damped Hertz contact is a linear oscillator (Antypov & Elliott 2011); it pushes until y' = -y / (2 beta).
    """
    if beta == 1.0:
        return math.exp(-2.0)
    angle = math.acos(beta) if beta < 1.0 else math.acosh(beta)
    return math.exp(-2.0 * beta * angle / math.sqrt(abs(1.0 - beta * beta)))


def effective_young_modulus(shear_modulus_i, poisson_i, shear_modulus_j, poisson_j) -> float:
    """E* in Pa: 1/E* = (1 - nu_i^2)/E_i + (1 - nu_j^2)/E_j with E = 2 G (1 + nu)."""
    return 1.0 / ((1.0 - poisson_i) / (2.0 * shear_modulus_i) + (1.0 - poisson_j) / (2.0 * shear_modulus_j))


def column_values(a, b, interaction):
    """Values of COLUMNS for two materials: E* in Pa."""
    moduli = (a.shear_modulus_pa, a.poisson_ratio, b.shear_modulus_pa, b.poisson_ratio)
    return (effective_young_modulus(*moduli),)


def reach(columns, R_star):
    """Gap in m up to which the law acts: it needs contact."""
    return 0.0


@lean_jit
def stiffness(E_star, R_star):
    """k_n in N m^(-3/2), so that the spring force is k_n delta^(3/2)."""
    return 4.0 / 3.0 * E_star * math.sqrt(R_star)


@lean_jit
def damping_constant(E_star, R_star, m_star, beta):
    """c_n in kg s^-1 m^(-1/4), so that the dashpot force is c_n delta^(1/4) v_n."""
    return DASHPOT_FACTOR * beta * math.sqrt(2.0 * E_star * math.sqrt(R_star) * m_star)


def work_of_adhesion(pull_off_n, R_star):
    """Work of adhesion in J/m2: nothing attracts."""
    return 0.0


def read(law, c, o):
    """Constants of the contact whose first value stands at o."""
    return Hertz(c[o], c[o + B], law.least)


def scale(law, raw, p, R_star):
    """Fourth root of the length in which `deformation` counts, in m^(1/4): it counts in m."""
    return 1.0


def write(law, raw, p, c, o, pair):
    """Turn the pair's columns, from p on in raw, into constants from o on."""
    E_star = raw[p]
    c[o] = stiffness(E_star, pair.R_star)
    c[o + B] = damping_constant(E_star, pair.R_star, pair.m_star, pair.beta)


def touches(law, gap, overlap, h, o, zero):
    """True if the contact acts; gap is positive with an overlap."""
    return gap > zero


def remember(law, touching, h, o, one, zero):
    """Nothing outlives a contact."""


def deformation(law, overlap, tiny):
    """Overlap in m of a Hertz contact with this contact's radius, its root and its fourth root."""
    positive = max(overlap, tiny)
    root = math.sqrt(positive)
    return positive, root, math.sqrt(root)


def spring_force(law, overlap, root):
    """Force in N of the spring alone; root is that of the overlap."""
    return law.k_n * root * overlap


def normal_force(law, overlap, root, fourth_root, v_n):
    """Force in N that pushes i away from j, at least `law.least`; root and fourth_root are those of the overlap."""
    return max(law.k_n * root * overlap - law.c_n * fourth_root * v_n, law.least)


def attracted(law, f_n, overlap, root, fourth_root):
    """Normal force in N, from its repulsive part f_n: nothing attracts."""
    return f_n


def normal_energy(law, overlap, root):
    """Energy in J of the spring: the integral of k_n delta^(3/2)."""
    return 0.4 * (law.k_n * root * overlap) * overlap


def torn_energy(law, h, o):
    """Energy in J that is lost where the contact has ended: none."""
    return 0.0


class Dashpot(NamedTuple):
    """A damping model: dashpot ratio as a function of the restitution, smallest normal force in N."""

    ratio: Callable[[float], float]
    least_force_n: float


#: Value of the setting `damping_model` -> dashpot.
DAMPING_MODELS = {"edem": Dashpot(damping_ratio, NO_BOUND), "no_pull": Dashpot(damping_ratio_without_pull, 0.0)}
