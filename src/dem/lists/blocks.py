"""Blocks of contacts: their order, and the pair constants that the contact stage reads."""

from dem.contact.laws import hertz, mindlin
from dem.jit import jit, lean_jit
from dem.layout import (
    BLOCK,
    C_N,
    C_T,
    INV_R_SUM,
    INVERSE_MASS,
    K_N,
    K_T,
    MOTION,
    MU_R,
    MU_S,
    PAIR_BETA,
    PAIR_E,
    PAIR_G,
    PAIR_MU_R,
    PAIR_MU_S,
    PLACE,
    RADIUS,
    ROLLING_SHARE,
)

#: Neighbouring contacts in a block should not share a grain, or their scatters wait for each other.
STRIDE = 16

#: The contacts of each wall begin at a multiple of this, at a cache line of float32: no vector of them straddles two.
LINE = 16


@lean_jit
def interleaved(q):
    """Position in the outer order of slot q of a full block."""
    return (q % STRIDE) * (BLOCK // STRIDE) + q // STRIDE


@jit
def interleave(values):
    """Reorder one block in place so that pairs of the same grain stand apart."""
    copy = values.copy()
    for q in range(BLOCK):
        values[q] = copy[interleaved(q)]


@jit
def common_constants(grains, contacts, pair_table, n_materials, material):
    """Set `contacts.alike`: whether all grains are of one size, mass and material; then fill `contacts.common`."""
    contacts.alike[0] = 0
    for i in range(1, material.shape[0]):
        if grains.place[PLACE * i + RADIUS] != grains.place[RADIUS] or material[i] != material[0]:
            return
        if grains.remainder[MOTION * i + INVERSE_MASS] != grains.remainder[INVERSE_MASS]:
            return
    if material.shape[0] == 0 or grains.remainder[INVERSE_MASS] == 0.0:
        return
    pair = pair_table[material[0] * n_materials + material[0]]
    for q in range(BLOCK):
        load_constants(contacts.common, q, pair, grains.place[RADIUS], grains.place[RADIUS], 2.0 * grains.remainder[INVERSE_MASS])
    finish_blocks(contacts.common, BLOCK)
    contacts.alike[0] = 1


@lean_jit
def load_constants(constants, q, pair, r_i, r_j, inverse_masses):
    """Raw material of contact q for `finish_blocks`: radii and the sum of the inverse masses.

    r_j = 0 stands for a wall (flat, infinitely heavy).
    """
    c, k = constants[q // BLOCK], q % BLOCK
    c[INV_R_SUM * BLOCK + k] = r_i
    c[ROLLING_SHARE * BLOCK + k] = r_j
    c[C_T * BLOCK + k] = inverse_masses
    c[K_N * BLOCK + k] = pair[PAIR_E]
    c[K_T * BLOCK + k] = pair[PAIR_G]
    c[C_N * BLOCK + k] = pair[PAIR_BETA]
    c[MU_S * BLOCK + k] = pair[PAIR_MU_S]
    c[MU_R * BLOCK + k] = pair[PAIR_MU_R]


@lean_jit
def in_block(k, end):
    """How many of the contacts from k to end stand in one block with k."""
    return min(end, (k // BLOCK + 1) * BLOCK) - k


@lean_jit
def finish_blocks(constants, n_contacts):
    """Turn radii, masses and moduli of all contacts into pair constants, whole blocks at a time."""
    for k0 in range(0, n_contacts, BLOCK):
        finish_block(constants[k0 // BLOCK], min(BLOCK, n_contacts - k0))


@lean_jit
def finish_block(c, n):
    """Pair constants of one block from what `load_constants` put there."""
    for q in range(n):
        r_i = c[INV_R_SUM * BLOCK + q]
        r_j = c[ROLLING_SHARE * BLOCK + q]
        flat = r_j == 0.0
        R_sum = r_i + r_j
        R_star = r_i if flat else r_i * r_j / R_sum
        m_star = 1 / c[C_T * BLOCK + q]
        E_star = c[K_N * BLOCK + q]
        G_star = c[K_T * BLOCK + q]
        beta = c[C_N * BLOCK + q]
        c[INV_R_SUM * BLOCK + q] = 1 / R_sum
        c[K_N * BLOCK + q] = hertz.stiffness(E_star, R_star)
        c[C_N * BLOCK + q] = hertz.damping(E_star, R_star, m_star, beta)
        c[K_T * BLOCK + q] = mindlin.stiffness(G_star, R_star)
        c[C_T * BLOCK + q] = mindlin.damping(G_star, R_star, m_star, beta)
        c[ROLLING_SHARE * BLOCK + q] = R_star / r_i
