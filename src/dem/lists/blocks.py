"""Blocks of contacts: their order, and the constants that the contact stage reads."""

import numpy as np

from dem.contact.model import BETA, COMMON_COLUMNS, Equivalent, n_columns, n_constants, scale, write
from dem.jit import jit, lean_jit
from dem.layout import BLOCK, GEOMETRY, INV_R_SUM, INVERSE_MASS, MOTION, PLACE, RADIUS, SHARE, U

#: Neighbouring contacts in a block should not share a grain, or their scatters wait for each other.
STRIDE = 16

#: The contacts of each surface begin at a multiple of this, a cache line of float32: no vector of them straddles two.
LINE = 16

#: Rows of a block of pairs before `finish_block`: radii (r_j = 0 stands for a wall, flat and infinitely heavy) and the sum of the
#: inverse masses. The pair table's columns follow.
R_I, R_J, INVERSE_MASSES, RAW = range(4)


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


@lean_jit
def in_block(k, end):
    """Number of contacts from k to end that stand in one block with k."""
    return min(end, (k // BLOCK + 1) * BLOCK) - k


@lean_jit
def width_of_pairs(laws):
    """Number of columns of the pair table."""
    return COMMON_COLUMNS + n_columns(laws.normal) + n_columns(laws.tangential) + n_columns(laws.rolling)


@jit
def raw_blocks(n, constants, laws):
    """Scratch for n blocks of pairs, in the precision of their constants."""
    return np.ones((n, (RAW + width_of_pairs(laws)) * BLOCK), constants.dtype)


@lean_jit
def load_pair(raw, q, pair, radii, inverse_masses, laws):
    """Store radii, inverse masses and columns of pair q; `finish_block` turns them into constants."""
    raw[R_I * BLOCK + q] = radii[0]
    raw[R_J * BLOCK + q] = radii[1]
    raw[INVERSE_MASSES * BLOCK + q] = inverse_masses
    for t in range(width_of_pairs(laws)):
        raw[(RAW + t) * BLOCK + q] = pair[t]


@lean_jit
def load_pairs(first, second, grains, material, model, raw):
    """As `load_pair`, of the pairs of grains first and second (n,); column by column, as that is vector code."""
    place, remainder, table, n_materials = grains.place, grains.remainder, model.pair_table, np.uint64(model.n_materials)
    for q in range(first.shape[0]):
        i, j = np.uint64(first[q]), np.uint64(second[q])
        raw[R_I * BLOCK + q] = place[i * U[PLACE] + U[RADIUS]]
        raw[R_J * BLOCK + q] = place[j * U[PLACE] + U[RADIUS]]
        inverse_mass = remainder[i * U[MOTION] + U[INVERSE_MASS]] + remainder[j * U[MOTION] + U[INVERSE_MASS]]
        raw[INVERSE_MASSES * BLOCK + q] = inverse_mass
    for t in range(width_of_pairs(model.laws)):
        column = raw[(RAW + t) * BLOCK :]
        for q in range(first.shape[0]):
            i, j = np.uint64(first[q]), np.uint64(second[q])
            column[q] = table[np.uint64(material[i]) * n_materials + np.uint64(material[j]), t]


@lean_jit
def finish_block(raw, c, n, laws):
    """Constants of n contacts of one block."""
    column_n, row_n = RAW + COMMON_COLUMNS, GEOMETRY
    column_t, row_t = column_n + n_columns(laws.normal), row_n + n_constants(laws.normal)
    column_r, row_r = column_t + n_columns(laws.tangential), row_t + n_constants(laws.tangential)
    for q in range(n):
        r_i = raw[R_I * BLOCK + q]
        r_j = raw[R_J * BLOCK + q]
        flat = r_j == 0.0
        R_sum = r_i + r_j
        R_star = r_i if flat else r_i * r_j / R_sum
        m_star = 1 / raw[INVERSE_MASSES * BLOCK + q]
        c[INV_R_SUM * BLOCK + q] = 1 / R_sum
        c[SHARE * BLOCK + q] = R_star / r_i
        unit = scale(laws.normal, raw, column_n * BLOCK + q, R_star)
        pair = Equivalent(R_star, m_star, raw[(RAW + BETA) * BLOCK + q], unit)
        write(laws.normal, raw, column_n * BLOCK + q, c, row_n * BLOCK + q, pair)
        write(laws.tangential, raw, column_t * BLOCK + q, c, row_t * BLOCK + q, pair)
        write(laws.rolling, raw, column_r * BLOCK + q, c, row_r * BLOCK + q, pair)


@jit
def common_constants(state, contacts, model):
    """Set `contacts.alike`: 1 if all grains have one size, mass and material; then fill `contacts.common`."""
    grains, material = state.grains, state.material
    contacts.alike[0] = 0
    for i in range(1, material.shape[0]):
        if grains.place[PLACE * i + RADIUS] != grains.place[RADIUS] or material[i] != material[0]:
            return
        if grains.remainder[MOTION * i + INVERSE_MASS] != grains.remainder[INVERSE_MASS]:
            return
    if material.shape[0] == 0 or grains.remainder[INVERSE_MASS] == 0.0:
        return
    pair = model.pair_table[material[0] * model.n_materials + material[0]]
    raw, radii = raw_blocks(1, contacts.common, model.laws)[0], (grains.place[RADIUS], grains.place[RADIUS])
    for q in range(BLOCK):
        load_pair(raw, q, pair, radii, 2.0 * grains.remainder[INVERSE_MASS], model.laws)
    finish_block(raw, contacts.common[0], BLOCK, model.laws)
    contacts.alike[0] = 1
