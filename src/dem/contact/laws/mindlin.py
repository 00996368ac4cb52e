"""Tangential contact: a spring with history, a dashpot and Coulomb's limit (Mindlin, no-slip stiffness).

Symbols: s elongation of the tangential spring since the grains touched (m), v_t relative tangential velocity of the surfaces.

    F_t = S_t s + 2 sqrt(5/6) beta sqrt(S_t m*) v_t,   S_t = 8 G* sqrt(R* delta),   S_t |s| <= mu_s F_n,   |F_t| <= mu_s F_n

The force on grain i is -F_t. The contact slips where the spring alone reaches Coulomb's limit: then s is shortened to it. The
dashpot cannot take the force beyond the limit either. The spring turns with the contact: its part along the normal is dropped.
Source: Mindlin 1949; EDEM's user guide, and the limit on the spring as in the contact models that EDEM ships as examples.
Not shortened so that spring and dashpot together give the limit (Silbert et al. 2001, Phys. Rev. E 64, 051302): with a strong
dashpot that stretches the spring backwards as soon as two grains touch, and fast slip is then braked by up to 15 % too little.
"""

import math

from dem.contact.laws.hertz import DASHPOT_FACTOR
from dem.jit import jit


def effective_shear_modulus(shear_modulus_i, poisson_i, shear_modulus_j, poisson_j) -> float:
    """G* in Pa: 1/G* = (2 - nu_i)/G_i + (2 - nu_j)/G_j."""
    return 1.0 / ((2.0 - poisson_i) / shear_modulus_i + (2.0 - poisson_j) / shear_modulus_j)


@jit
def stiffness(G_star, R_star):
    """k_t in N m^(-3/2), so that S_t = k_t sqrt(delta)."""
    return 8.0 * G_star * math.sqrt(R_star)


@jit
def damping(G_star, R_star, m_star, beta):
    """c_t in kg s^-1 m^(-1/4), so that the dashpot force is c_t delta^(1/4) v_t."""
    return DASHPOT_FACTOR * beta * math.sqrt(8.0 * G_star * math.sqrt(R_star) * m_star)


@jit
def slip(trial2, limit, one, tiny):
    """By how much a force of squared magnitude `trial2` must shrink to obey Coulomb; 1 when it does.

    A reciprocal root: processors estimate it far faster than they take a root and divide.
    """
    return min(one, limit * (one / math.sqrt(trial2 + tiny * tiny)))
