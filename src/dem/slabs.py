"""Work that may run side by side: slabs of grains and their contacts (see `dem.neighbours.cut_slabs`), and groups of slabs.

A slab's grains move as soon as their loads are complete, while they are still in the cache.
Every function comes twice, for one thread and for several; both do the same work in the same order per grain, so results have
the same bytes for any number of threads.
"""

from dem import motion, pairs, vectors
from dem.contact.block import contact_stage
from dem.jit import jit, lean_jit, parallel_jit, prange
from dem.layout import BLOCK
from dem.neighbours import prune_slab, save_history, used_slabs

#: Neighbouring slabs are done in turn, in so many groups that may run side by side if their numbers are both even or both odd.
GROUPS = 16

#: With so many slabs the grains no longer stay in the second-level cache from step to step: those of the following slab are then
#: asked for while this one's contacts are computed, so many blocks before the contacts at the same place in their slab need them.
PREFETCH_SLABS, BLOCKS_AHEAD = 5, 3


@lean_jit
def gather(grains, period, frequency, first, second, n, buffer, options, elastic):
    """Fill the work buffer for n pairs, by the code that the options ask for."""
    if options.vector_code:
        if options.periodic:
            vectors.gather_periodic_pairs(grains, period, frequency, first, second, n, buffer, elastic)
        else:
            vectors.gather_pairs(grains, first, second, n, buffer, elastic)
    else:
        if options.periodic:
            pairs.gather_periodic_pairs(grains, period, frequency, first, second, n, buffer, elastic)
        else:
            pairs.gather_pairs(grains, first, second, n, buffer, elastic)


@lean_jit
def scatter(loads, first, second, n, buffer, options, elastic):
    """Add the loads in the work buffer to the grains, by the code that the options ask for."""
    if options.vector_code:
        vectors.scatter_pairs(loads, first, second, n, buffer, elastic)
    else:
        pairs.scatter_pairs(loads, first, second, n, buffer, elastic)


@lean_jit
def gather_at_wall(grains, velocity, first, n, buffer, places, options):
    """Fill the work buffer and `places` for n grains that may touch a wall, by the code that the options ask for."""
    if options.vector_code:
        vectors.gather_at_wall(grains, velocity, first, n, buffer, places)
    else:
        pairs.gather_at_wall(grains, velocity, first, n, buffer, places)


@lean_jit
def scatter_at_wall(loads, first, n, buffer, options):
    """Add the loads of n wall contacts to their grains, by the code that the options ask for."""
    if options.vector_code:
        vectors.scatter_at_wall(loads, first, n, buffer)
    else:
        pairs.scatter_at_wall(loads, first, n, buffer)


@lean_jit
def contact_loads(n, k0, buffer, contacts, constants, elastic):
    """Turn the work buffer's separations and velocities into loads of the n contacts from number k0 on, all in one block."""
    c = contacts.common[0] if contacts.alike[0] else contacts.constants[k0 // BLOCK, k0 % BLOCK :]
    h = contacts.history[k0 // BLOCK, k0 % BLOCK :]
    contact_stage(n, buffer, c, h, constants.dt, constants.one, constants.zero, constants.tiny, constants.least, elastic)


@lean_jit
def slab_forces(s, grains, loads, contacts, outer, period, frequency, buffer, constants, options, elastic):
    """Loads of the contacts of one slab. elastic : None or else, as `dem.contact.block.contact_stage` has it."""
    begin, count = contacts.begin[s], contacts.count[s]
    end = begin + count
    used = used_slabs(outer.slab)
    following = outer.order[outer.slab[(s + 1) % used] : outer.slab[(s + 1) % used + 1]]
    asked = 0
    for k0 in range(begin, end, BLOCK):
        n = min(k0 + BLOCK, end) - k0
        if options.vector_code and used >= PREFETCH_SLABS:
            until = following.shape[0] * min(k0 - begin + BLOCKS_AHEAD * BLOCK, count) // count
            vectors.prefetch(grains, loads, following[asked:until])
            asked = until
        first = contacts.first[k0 : k0 + n]
        second = contacts.second[k0 : k0 + n]
        gather(grains, period, frequency, first, second, n, buffer, options, elastic)
        contact_loads(n, k0, buffer, contacts, constants, elastic)
        scatter(loads, first, second, n, buffer, options, elastic)


@lean_jit
def move_slab(s, grains, loads, outer, gravity, speeds, constants, options):
    """Advance the grains of one slab; speeds[s] becomes their largest speed (m/s)."""
    which = outer.order[outer.slab[s] : outer.slab[s + 1]]
    if options.vector_code:
        speeds[s] = vectors.integrate(grains, loads, which, gravity, constants.step, constants.zero)
    else:
        speeds[s] = motion.integrate(grains, loads, which, gravity, constants.step, constants.zero)


@lean_jit
def group_step(g, moves, grains, loads, contacts, outer, period, frequency, gravity, buffer, speeds, constants, options):
    """Loads of the contacts of one group of slabs and, if `moves`, the motion of the grains that wait for no other load.

    A slab's grains have all their loads when its own contacts and those of the slab before are done (and, across a periodic face,
    those of the first slab). The first slab of an even group waits for the odd group before, which then moves it.
    """
    used = used_slabs(outer.slab)
    groups = min(GROUPS, used)
    if g >= groups:
        return
    begin, end = g * used // groups, (g + 1) * used // groups
    for s in range(begin, end):
        if options.elastic_rolling:
            slab_forces(s, grains, loads, contacts, outer, period, frequency, buffer, constants, options, True)
        else:
            slab_forces(s, grains, loads, contacts, outer, period, frequency, buffer, constants, options, None)
        if moves and (s > begin or g % 2 == 1 or used == 1):
            move_slab(s, grains, loads, outer, gravity, speeds, constants, options)
    if moves and g % 2 == 1:
        move_slab(end % used, grains, loads, outer, gravity, speeds, constants, options)


@lean_jit
def step(moves, grains, loads, contacts, outer, period, frequency, gravity, buffers, speeds, constants, options):
    """Loads of all grain-grain contacts and, if `moves`, the motion of all grains: first the groups of even number."""
    for parity in range(2):
        for k in range(GROUPS // 2):
            group_step(
                2 * k + parity, moves, grains, loads, contacts, outer, period, frequency, gravity, buffers[0], speeds, constants,
                options,
            )  # fmt: skip


@parallel_jit
def step_threads(moves, grains, loads, contacts, outer, period, frequency, gravity, buffers, speeds, constants, options):
    """As `step`, on several threads."""
    for parity in range(2):
        for k in prange(GROUPS // 2):
            group_step(
                2 * k + parity, moves, grains, loads, contacts, outer, period, frequency, gravity, buffers[k], speeds, constants,
                options,
            )  # fmt: skip


@lean_jit
def move(grains, loads, outer, gravity, speeds, constants, options):
    """Advance all grains."""
    for s in range(used_slabs(outer.slab)):
        move_slab(s, grains, loads, outer, gravity, speeds, constants, options)


@parallel_jit
def move_threads(grains, loads, outer, gravity, speeds, constants, options):
    """As `move`, on several threads."""
    for s in prange(used_slabs(outer.slab)):
        move_slab(s, grains, loads, outer, gravity, speeds, constants, options)


@jit
def prune(grains, period, frequency, periodic, outer, reach, contacts, pair_table, n_materials, material):
    """Copy the pairs that may touch from the outer list into the contact blocks; says whether there was room for all."""
    for s in range(used_slabs(outer.slab)):
        prune_slab(s, grains, period, frequency, periodic, outer, reach, contacts, pair_table, n_materials, material)
    return contacts.count.min() >= 0


@parallel_jit
def prune_threads(grains, period, frequency, periodic, outer, reach, contacts, pair_table, n_materials, material):
    """As `prune`, on several threads."""
    for s in prange(used_slabs(outer.slab)):
        prune_slab(s, grains, period, frequency, periodic, outer, reach, contacts, pair_table, n_materials, material)
    return contacts.count.min() >= 0


@jit
def save(contacts, history):
    """Write all contact history back to the outer list, and forget the contacts."""
    for s in range(used_slabs(contacts.begin)):
        save_history(s, contacts, history)


@parallel_jit
def save_threads(contacts, history):
    """As `save`, on several threads."""
    for s in prange(used_slabs(contacts.begin)):
        save_history(s, contacts, history)
