"""Work that may run side by side: slabs of contacts (see `dem.neighbours.cut_slabs`) and stretches of grains.

Every function comes twice, for one thread and for several; both do the same work in the same order per grain, so results have
the same bytes for any number of threads.
"""

from dem import motion, pairs, vectors
from dem.contact.block import contact_stage, rolling_stage
from dem.jit import jit, lean_jit, parallel_jit, prange
from dem.layout import BLOCK, GRAIN, HISTORY, LOAD, ROWS
from dem.neighbours import SLABS, prune_slab, save_slab

#: Grains are integrated in so many stretches, each a whole number of STRETCH_UNIT grains.
STRETCHES = 32
STRETCH_UNIT = vectors.LANES


@lean_jit
def gather(grains, period, frequency, first, second, n, buffer, options):
    """Fill the work buffer for n pairs, by the code that the options ask for."""
    if options.vector_code:
        if options.periodic:
            vectors.gather_periodic_pairs(grains, period, frequency, first, second, n, buffer)
        else:
            vectors.gather_pairs(grains, first, second, n, buffer)
        if options.elastic_rolling:
            vectors.gather_rolling(grains, first, second, n, buffer)
    else:
        if options.periodic:
            pairs.gather_periodic_pairs(grains, period, frequency, first, second, n, buffer)
        else:
            pairs.gather_pairs(grains, first, second, n, buffer)
        if options.elastic_rolling:
            pairs.gather_rolling(grains, first, second, n, buffer)


@lean_jit
def scatter(loads, first, second, n, buffer, options):
    """Add the loads in the work buffer to the grains, by the code that the options ask for."""
    if options.vector_code:
        if options.elastic_rolling:
            vectors.scatter_rolling(loads, first, second, n, buffer)
        else:
            vectors.scatter_pairs(loads, first, second, n, buffer)
    elif options.elastic_rolling:
        pairs.scatter_rolling(loads, first, second, n, buffer)
    else:
        pairs.scatter_pairs(loads, first, second, n, buffer)


@lean_jit
def gather_at_wall(grains, velocity, first, n, buffer, places, options):
    """Fill the work buffer and `places` for n grains that may touch a wall, by the code that the options ask for."""
    if options.vector_code:
        vectors.gather_at_wall(grains, velocity, first, n, buffer, places)
    else:
        pairs.gather_at_wall(grains, velocity, first, n, buffer, places)
    if options.elastic_rolling:  # a wall does not spin: differences are sums
        for q in range(n):
            for t in range(3):
                buffer[(10 + t) * BLOCK + q] = buffer[(7 + t) * BLOCK + q]


@lean_jit
def scatter_at_wall(loads, first, n, buffer, options):
    """Add the loads of n wall contacts to their grains, by the code that the options ask for."""
    if options.vector_code:
        vectors.scatter_at_wall(loads, first, n, buffer)
    else:
        pairs.scatter_at_wall(loads, first, n, buffer)


@lean_jit
def contact_loads(n, k0, buffer, contacts, constants, options):
    """Turn the work buffer's separations and velocities into loads of the n contacts from number k0 on."""
    c = contacts.common if contacts.alike[0] else contacts.block[k0 * ROWS : (k0 + BLOCK) * ROWS]
    h = contacts.block[k0 * ROWS + HISTORY * BLOCK : (k0 + BLOCK) * ROWS]
    contact_stage(n, buffer, c, h, constants.dt, constants.one, constants.zero, constants.tiny, constants.least)
    if options.elastic_rolling:
        rolling_stage(n, buffer, c, h, constants.dt, constants.one, constants.zero, constants.tiny)


@lean_jit
def slab_forces(s, grains, loads, contacts, period, frequency, buffer, constants, options):
    """Loads of the contacts of one slab."""
    begin = contacts.begin[s]
    end = begin + contacts.count[s]
    for k0 in range(begin, end, BLOCK):
        n = min(k0 + BLOCK, end) - k0
        first = contacts.first[k0 : k0 + n]
        second = contacts.second[k0 : k0 + n]
        gather(grains, period, frequency, first, second, n, buffer, options)
        contact_loads(n, k0, buffer, contacts, constants, options)
        scatter(loads, first, second, n, buffer, options)


@lean_jit
def pair_forces(grains, loads, contacts, period, frequency, buffers, constants, options):
    """Loads of all grain-grain contacts: first the slabs of even number, then the others."""
    for parity in range(2):
        for k in range(SLABS // 2):
            slab_forces(2 * k + parity, grains, loads, contacts, period, frequency, buffers[0], constants, options)


@parallel_jit
def pair_forces_threads(grains, loads, contacts, period, frequency, buffers, constants, options):
    """As `pair_forces`, on several threads."""
    for parity in range(2):
        for k in prange(SLABS // 2):
            slab_forces(2 * k + parity, grains, loads, contacts, period, frequency, buffers[k], constants, options)


@jit
def prune(grains, period, frequency, periodic, outer, reach, contacts, pair_table, n_materials, material):
    """Copy the pairs that may touch from the outer list into the contact blocks; says whether there was room for all."""
    for s in range(SLABS):
        prune_slab(s, grains, period, frequency, periodic, outer, reach, contacts, pair_table, n_materials, material)
    return contacts.count.min() >= 0


@parallel_jit
def prune_threads(grains, period, frequency, periodic, outer, reach, contacts, pair_table, n_materials, material):
    """As `prune`, on several threads."""
    for s in prange(SLABS):
        prune_slab(s, grains, period, frequency, periodic, outer, reach, contacts, pair_table, n_materials, material)
    return contacts.count.min() >= 0


@jit
def save(contacts, history):
    """Write all contact history back to the outer list, and forget the contacts."""
    for s in range(SLABS):
        save_slab(s, contacts, history)


@parallel_jit
def save_threads(contacts, history):
    """As `save`, on several threads."""
    for s in prange(SLABS):
        save_slab(s, contacts, history)


@lean_jit
def integrate_stretch(k, grains, loads, gravity, dt, zero, options):
    """Advance one stretch of grains; returns the largest speed (m/s)."""
    n = grains.shape[0] // GRAIN
    units = (n + STRETCH_UNIT - 1) // STRETCH_UNIT
    begin = min(k * units // STRETCHES * STRETCH_UNIT, n)
    end = min((k + 1) * units // STRETCHES * STRETCH_UNIT, n)
    some_grains, some_loads = grains[GRAIN * begin : GRAIN * end], loads[LOAD * begin : LOAD * end]
    if options.vector_code:
        return vectors.integrate(some_grains, some_loads, gravity, dt, zero)
    return motion.integrate(some_grains, some_loads, gravity, dt, zero)


@lean_jit
def integrate(grains, loads, gravity, dt, zero, speeds, options):
    """Advance all grains; returns the largest speed (m/s). speeds : (STRETCHES,) scratch."""
    if options.vector_code:
        return vectors.integrate(grains, loads, gravity, dt, zero)
    return motion.integrate(grains, loads, gravity, dt, zero)


@parallel_jit
def integrate_threads(grains, loads, gravity, dt, zero, speeds, options):
    """As `integrate`, on several threads."""
    for k in prange(STRETCHES):
        speeds[k] = integrate_stretch(k, grains, loads, gravity, dt, zero, options)
    return speeds.max()
