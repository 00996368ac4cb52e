"""Tangential contact as in LIGGGHTS' `tangential history`: Mindlin's spring, limited by itself, and a dashpot while it sticks.

Symbols, stiffness and dashpot are those of `dem.contact.laws.mindlin`; only the limit differs:

    S_t |s| > mu_s |F_n|:   s is shortened to it,   F_t = S_t s              (slips: no dashpot)
    else                    F_t = S_t s + 2 sqrt(5/6) beta sqrt(S_t m*) v_t   (sticks: no limit)

So a contact that has just closed brakes a fast slip by more than mu_s F_n, as its spring is still short, and friction acts where
the normal force pulls.
Source: LIGGGHTS 3.8.0, tangential_model_history.h (https://github.com/CFDEMproject/LIGGGHTS-PUBLIC).
"""

from typing import NamedTuple

from dem.contact.laws.mindlin import (
    COLUMNS,
    CONSTANTS,
    HISTORY,
    PROPERTIES,
    column_values,
    reach,
    tangential_damping,
    tangential_energy,
    tangential_stiffness,
    write,
)
from dem.layout import BLOCK as B

__all__ = [
    "COLUMNS",
    "CONSTANTS",
    "HISTORY",
    "PROPERTIES",
    "column_values",
    "reach",
    "tangential_damping",
    "tangential_energy",
    "tangential_stiffness",
    "write",
]


class MindlinLiggghts(NamedTuple):
    """Constants of a contact: spring, dashpot, coefficient of static friction."""

    k_t: float
    c_t: float
    mu_s: float


PARAMETERS = MindlinLiggghts
WORDS = {
    "words": "Mindlin spring with history (no slip), Coulomb limit on the spring alone, dashpot while it sticks (LIGGGHTS).",
    "equation": "F_t = S_t s + 2 sqrt(5/6) b sqrt(S_t m*) s' while S_t |s| <= mu_s |F_n|, else mu_s |F_n|; S_t = 8 G* sqrt(R* d); "
    "s elongation",
}


def read(law, c, o):
    """Constants of the contact whose first value stands at o."""
    return MindlinLiggghts(c[o], c[o + B], c[o + 2 * B])


def tangential_limit(law, f_n, zero):
    """Largest force in N of the spring under the normal force f_n, of either sign."""
    return law.mu_s * abs(f_n)


def acting_damping(law, D_t, stuck, one, zero):
    """Force over velocity in kg/s of the dashpot: it acts where the spring was not shortened, stuck = 1."""
    return D_t if stuck >= one else zero


def shrink(law, force2, limit, one, tiny):
    """Factor by which the force of spring and dashpot is shortened: it is not."""
    return one
