"""Slabs: the grains in cell order, cut into layers whose contacts can be computed independently."""

import numpy as np

from dem.jit import jit, lean_jit, strict_jit
from dem.layout import BLOCK

#: Most slabs, and fewest grains that are worth a slab: what belongs to a few slabs stays in the second-level cache.
SLABS = 128

GRAINS_PER_SLAB = 2000


@strict_jit
def cut_slabs(start, shape, slab):
    """Cut the grains in cell order into slabs of whole layers of cells along x: slab s has the ranks slab[s] to slab[s + 1].

    The pairs of a slab touch its own grains and the first layer of the next slab, which for the last one is slab 0, across a
    periodic face. The number of slabs is 1 or even: so those of even number share no grain, nor do those of odd number. It depends
    on the grains alone, not on the number of threads; unused slabs at the end are empty.
    """
    n, layers, area = start[-1], shape[0], shape[1] * shape[2]
    used = min(SLABS, n // GRAINS_PER_SLAB, layers)
    used -= used % 2
    slab[:] = n
    slab[0] = 0
    layer = 0
    for s in range(1, used):
        layer += 1
        while start[layer * area] < n * s // used and layer < layers - (used - s):
            layer += 1
        slab[s] = start[layer * area]


def most_slabs(n_grains: int) -> int:
    """How many slabs so many grains can be cut into, at most."""
    return max(1, min(SLABS, n_grains // GRAINS_PER_SLAB))


@lean_jit
def used_slabs(begin):
    """How many slabs there are, one or an even number, from where they begin: unused ones begin at the end."""
    used = 1
    while used < SLABS and begin[used] < begin[SLABS]:
        used += 1
    return used


@strict_jit
def cut_contacts(row, order, slab, n_entries, begin):
    """Where each slab's contacts begin in the contact blocks: room in proportion to its entries, at a whole block."""
    used = used_slabs(slab)
    room = begin[SLABS] // BLOCK - used
    for s in range(used):
        begin[s] = (row[order[slab[s]], 0] * room // max(n_entries, 1) + s) * BLOCK if slab[SLABS] > 0 else 0
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
