"""Tangential contact: a spring with history, a dashpot and Coulomb's limit (Mindlin, no-slip stiffness).

Symbols: s elongation of the tangential spring since the grains touched (m), v_t relative tangential velocity of the surfaces.

    F_t = S_t s + 2 sqrt(5/6) beta sqrt(S_t m*) v_t,   S_t = 8 G* sqrt(R* delta),   |F_t| <= mu_s F_n

The force on grain i is -F_t. When the limit is reached s is shortened so that the law gives the limit itself. The spring turns
with the contact: its part along the normal is dropped each step.
Source: Mindlin 1949; EDEM's user guide; history and limit as in Silbert et al. 2001 (Phys. Rev. E 64, 051302).
"""

import math

from dem.contact.hertz import DASHPOT_FACTOR
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
def slip(trial, limit, S_t, one, tiny):
    """By how much a trial force of magnitude `trial` must shrink to obey Coulomb (1 when it sticks), and 1 / S_t.

    Both come from one division, the slowest operation here.
    """
    magnitude = trial + tiny
    inverse = one / (magnitude * S_t)
    return min(one, limit * S_t * inverse), magnitude * inverse
