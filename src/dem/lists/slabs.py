"""Slabs: the grains in cell order, cut into layers whose contacts can be computed independently."""

import numpy as np

from dem.jit import jit, lean_jit, strict_jit
from dem.layout import BLOCK

#: Maximum number of slabs, and minimum number of grains per slab: a few slabs fit into the second-level cache.
SLABS = 128

GRAINS_PER_SLAB = 2000


@strict_jit
def cut_slabs(start, shape, reach, slab):
    """Cut the grains in cell order into slabs of whole layers of cells along x: slab s has the ranks slab[s] to slab[s + 1].

    reach : number of layers over which the largest grains have partners, and fewest layers of a slab. The pairs of a slab touch its
    own grains and the first layers of the next slab, which for the last one is slab 0, across a periodic face. The number of slabs
    is 1 or even: so those of even number share no grain, nor do those of odd number. It depends on the grains alone, not on the
    number of threads; unused slabs at the end are empty.
    """
    n, layers, area = start[-1], shape[0], shape[1] * shape[2]
    used = min(SLABS, n // GRAINS_PER_SLAB, layers // reach)
    used -= used % 2
    slab[:] = n
    slab[0] = 0
    layer = 0
    for s in range(1, used):
        layer += reach
        while start[layer * area] < n * s // used and layer < layers - (used - s) * reach:
            layer += 1
        slab[s] = start[layer * area]


def max_slabs(n_grains: int) -> int:
    """Maximum number of slabs of n_grains grains."""
    return max(1, min(SLABS, n_grains // GRAINS_PER_SLAB))


@lean_jit
def used_slabs(begin):
    """Number of slabs in use, one or an even number, from their first ranks: unused ones begin at the end."""
    used = 1
    while used < SLABS and begin[used] < begin[SLABS]:
        used += 1
    return used


@strict_jit
def cut_contacts(outer, n_entries, begin):
    """Set the first contact of each slab in the contact blocks: capacity in proportion to its entries, in whole blocks."""
    row, order, slab = outer.row, outer.order, outer.slab
    used = used_slabs(slab)
    capacity = begin[SLABS] // BLOCK - used
    for s in range(used):
        begin[s] = (row[order[slab[s]], 0] * capacity // max(n_entries, 1) + s) * BLOCK if slab[SLABS] > 0 else 0
    begin[used:SLABS] = begin[SLABS]


@jit
def slab_numbers(outer):
    """Slab of every grain (n,) int32, from the outer list of pairs; (0,) with a single slab."""
    used = used_slabs(outer.slab)
    numbers = np.empty(outer.order.shape[0] if used > 1 else 0, np.int32)
    for s in range(used if used > 1 else 0):
        for k in range(outer.slab[s], outer.slab[s + 1]):
            numbers[outer.order[k]] = s
    return numbers
