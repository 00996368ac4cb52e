"""Hertz normal contact with the dashpot of EDEM's Hertz-Mindlin model.

Symbols: delta overlap, positive when grains touch; R_star, m_star, E_star effective radius, mass, Young's modulus;
v_n normal component of the relative velocity of i against j along n, which points from j to i; e restitution.

    F_n = 4/3 E* sqrt(R*) delta^(3/2) - 2 sqrt(5/6) beta sqrt(S_n m*) v_n,   S_n = 2 E* sqrt(R* delta),
    beta = -ln e / sqrt(ln^2 e + pi^2)

Source: Tsuji, Tanaka, Ishida 1992 (Powder Technol. 71, 239) in the form of EDEM's user guide. Limits: beta belongs to a linear
spring, so at low e the rebound is not exactly e; the dashpot may pull for a moment at separation, as EDEM's does.
"""

import math

from dem.jit import jit

#: 2 sqrt(5/6), from S_n being the tangent stiffness of a delta^(3/2) spring.
DASHPOT_FACTOR = 2.0 * math.sqrt(5.0 / 6.0)


def damping_ratio(restitution: float) -> float:
    """Dashpot ratio beta (dimensionless, 0 for e = 1)."""
    log_e = math.log(restitution)
    return -log_e / math.hypot(log_e, math.pi)


def effective_young_modulus(shear_modulus_i, poisson_i, shear_modulus_j, poisson_j) -> float:
    """E* in Pa: 1/E* = (1 - nu_i^2)/E_i + (1 - nu_j^2)/E_j with E = 2 G (1 + nu)."""
    return 1.0 / ((1.0 - poisson_i) / (2.0 * shear_modulus_i) + (1.0 - poisson_j) / (2.0 * shear_modulus_j))


@jit
def stiffness(E_star, R_star):
    """k_n in N m^(-3/2), so that the spring force is k_n delta^(3/2)."""
    return 4.0 / 3.0 * E_star * math.sqrt(R_star)


@jit
def damping(E_star, R_star, m_star, beta):
    """c_n in kg s^-1 m^(-1/4), so that the dashpot force is c_n delta^(1/4) v_n."""
    return DASHPOT_FACTOR * beta * math.sqrt(2.0 * E_star * math.sqrt(R_star) * m_star)


@jit
def normal_force(overlap, root, fourth_root, v_n, k_n, c_n):
    """Force in N that pushes i away from j; root and fourth_root are those of the overlap."""
    return k_n * root * overlap - c_n * fourth_root * v_n
