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
from typing import NamedTuple

from dem.contact.laws.hertz import DASHPOT_FACTOR
from dem.jit import lean_jit
from dem.layout import BLOCK as B


class Mindlin(NamedTuple):
    """Constants of a contact: spring, dashpot, coefficient of static friction."""

    k_t: float
    c_t: float
    mu_s: float


PARAMETERS = Mindlin
PROPERTIES = ("static_friction", "restitution")
COLUMNS = ("G_star", "mu_s")
CONSTANTS = ("k_t", "c_t", "mu_s")
#: Elongation of the tangential spring in m.
HISTORY = ("s_x", "s_y", "s_z")
WORDS = {
    "words": "Mindlin spring with history (no slip), dashpot, Coulomb limit.",
    "equation": "F_t = S_t s + 2 sqrt(5/6) b sqrt(S_t m*) s', S_t = 8 G* sqrt(R* d), |F_t| <= mu_s F_n; s elongation",
}


def effective_shear_modulus(shear_modulus_i, poisson_i, shear_modulus_j, poisson_j) -> float:
    """G* in Pa: 1/G* = (2 - nu_i)/G_i + (2 - nu_j)/G_j."""
    return 1.0 / ((2.0 - poisson_i) / shear_modulus_i + (2.0 - poisson_j) / shear_modulus_j)


def column_values(a, b, interaction):
    """Values of COLUMNS for two materials: G* in Pa, coefficient of static friction."""
    moduli = (a.shear_modulus_pa, a.poisson_ratio, b.shear_modulus_pa, b.poisson_ratio)
    return effective_shear_modulus(*moduli), interaction.static_friction


def reach(columns, R_star):
    """Gap in m up to which the law acts: it needs contact."""
    return 0.0


@lean_jit
def stiffness(G_star, R_star):
    """k_t in N m^(-3/2), so that S_t = k_t sqrt(delta)."""
    return 8.0 * G_star * math.sqrt(R_star)


@lean_jit
def damping_constant(G_star, R_star, m_star, beta):
    """c_t in kg s^-1 m^(-1/4), so that the dashpot force is c_t delta^(1/4) v_t."""
    return DASHPOT_FACTOR * beta * math.sqrt(8.0 * G_star * math.sqrt(R_star) * m_star)


def read(law, c, o):
    """Constants of the contact whose first value stands at o."""
    return Mindlin(c[o], c[o + B], c[o + 2 * B])


def write(law, raw, p, c, o, pair):
    """Turn the pair's columns, from p on in raw, into constants from o on."""
    G_star = raw[p]
    c[o] = stiffness(G_star, pair.R_star) * (pair.scale * pair.scale)
    c[o + B] = damping_constant(G_star, pair.R_star, pair.m_star, pair.beta) * pair.scale
    c[o + 2 * B] = raw[p + B]


def tangential_stiffness(law, root):
    """S_t in N/m; root is that of the overlap."""
    return law.k_t * root


def tangential_damping(law, fourth_root):
    """Force over velocity of the dashpot in kg/s; fourth_root is that of the overlap."""
    return law.c_t * fourth_root


def tangential_limit(law, f_n, zero):
    """Coulomb's limit in N under the normal force f_n; none where that pulls."""
    return law.mu_s * max(f_n, zero)


def acting_damping(law, D_t, stuck, one, zero):
    """Force over velocity in kg/s of the dashpot where `stuck` is the factor by which the spring was shortened: it always acts."""
    return D_t


def shrink(law, force2, limit, one, tiny):
    """Factor by which the force of spring and dashpot, of squared magnitude `force2`, is shortened to Coulomb's limit."""
    return slip(force2, limit, one, tiny)


def tangential_energy(law, S_t, s2):
    """Energy in J of the spring at squared elongation s2."""
    return 0.5 * S_t * s2


@lean_jit
def slip(trial2, limit, one, tiny):
    """Factor by which a force of squared magnitude `trial2` shrinks to obey Coulomb's limit; 1 if it obeys.

    A reciprocal root: processors estimate it far faster than a root and a division.
    """
    return min(one, limit * (one / math.sqrt(trial2 + tiny * tiny)))


@lean_jit
def flat(x, y, z, nx, ny, nz):
    """A vector without its part along the unit vector n."""
    along = x * nx + y * ny + z * nz
    return x - along * nx, y - along * ny, z - along * nz
