"""Work that may run side by side: slabs of grains and their contacts (see `dem.lists.slabs.cut_slabs`), and groups of slabs.

A slab's grains move as soon as their loads are complete, while they are still in the cache; with many slabs several steps are made
of a few slabs before the next ones are fetched.
Every function comes twice, for one thread and for several; both do the same work in the same order per grain, so results have
the same bytes for any number of threads.
"""

from typing import NamedTuple

import numpy as np

from dem.contact.stage import contact_stage
from dem.jit import inline_jit, jit, lean_jit, parallel_jit, prange
from dem.layout import BLOCK, SECOND_SPIN
from dem.lists.blocks import in_block
from dem.lists.history import save_history
from dem.lists.pairs import prune_slab
from dem.lists.slabs import used_slabs
from dem.step import gather as plain
from dem.step import motion, vectors
from dem.walls import push, separate

#: Neighbouring slabs are done in turn, in so many groups that may run side by side if their numbers are both even or both odd.
GROUPS = 16

#: Most and fewest steps that are made at once: as many as leave slabs enough for FEWEST_GROUPS groups that do not meet then, see
#: `group_step`. Where that would be fewer, grains stay in the third-level cache, and steps are made one by one.
STEPS_AT_ONCE, LEAST_AT_ONCE, FEWEST_GROUPS = 8, 5, 4

#: With that many slabs the grains come from memory: those of the next slab to come are asked for while a slab's contacts are
#: computed, so many blocks before the contacts at the same place in their slab need them.
BLOCKS_AHEAD = 3


class WallSteps(NamedTuple):
    """What steps made at once need of the walls.

    geometry (steps, walls, 7): where they are in each step; force (SLABS, walls, 3): what the grains of each slab exert, summed
    over the steps; places (groups side by side, 4 BLOCK) float64, scratch.
    """

    geometry: np.ndarray
    force: np.ndarray
    places: np.ndarray


@inline_jit
def gather(grains, period, frequency, first, second, n, buffer, options, elastic):
    """Fill the work buffer for n pairs, by the code that the options ask for."""
    if options.vector_code:
        if options.periodic:
            vectors.gather_periodic_pairs(grains, period, frequency, first, second, n, buffer, elastic)
        else:
            vectors.gather_pairs(grains, first, second, n, buffer, elastic)
    else:
        if options.periodic:
            plain.gather_periodic_pairs(grains, period, frequency, first, second, n, buffer, elastic)
        else:
            plain.gather_pairs(grains, first, second, n, buffer, elastic)


@inline_jit
def scatter(loads, first, second, n, buffer, options, elastic):
    """Add the loads in the work buffer to the grains, by the code that the options ask for."""
    if options.vector_code:
        vectors.scatter_pairs(loads, first, second, n, buffer, elastic)
    else:
        plain.scatter_pairs(loads, first, second, n, buffer, elastic)


@inline_jit
def gather_at_wall(grains, velocity, first, n, buffer, places, options):
    """Fill the work buffer and `places` for n grains that may touch a wall, by the code that the options ask for."""
    if options.vector_code:
        vectors.gather_at_wall(grains, velocity, first, n, buffer, places)
    else:
        plain.gather_at_wall(grains, velocity, first, n, buffer, places)


@inline_jit
def scatter_at_wall(loads, first, n, buffer, options):
    """Add the loads of n wall contacts to their grains, by the code that the options ask for."""
    if options.vector_code:
        vectors.scatter_at_wall(loads, first, n, buffer)
    else:
        plain.scatter_at_wall(loads, first, n, buffer)


@inline_jit
def contact_loads(n, k0, buffer, contacts, constants, elastic):
    """Turn the work buffer's separations and velocities into loads of the n contacts from number k0 on, all in one block."""
    c = contacts.common[0] if contacts.alike[0] else contacts.constants[k0 // BLOCK, k0 % BLOCK :]
    h = contacts.history[k0 // BLOCK, k0 % BLOCK :]
    contact_stage(n, buffer, c, h, constants.dt, constants.one, constants.zero, constants.tiny, constants.least, elastic)


@inline_jit
def wall_forces(s, step, grains, loads, walls, contacts, wall_steps, buffer, places, constants, options, elastic):
    """Loads of the contacts with walls of the grains of slab s; see `slab_forces`."""
    n_walls = walls.kind.shape[0]
    for w in range(n_walls):
        part = s * n_walls + w
        k, end = contacts.begin[part], contacts.begin[part] + contacts.count[part]
        while k < end:
            n = in_block(k, end)
            first = contacts.first[k : k + n]
            gather_at_wall(grains, walls.velocity[w], first, n, buffer, places, options)
            separate(walls.kind[w], wall_steps.geometry[step, w], places, n, buffer)
            if options.elastic_rolling:
                buffer[SECOND_SPIN * BLOCK : (SECOND_SPIN + 3) * BLOCK] = 0.0  # a wall does not spin
            contact_loads(n, k, buffer, contacts, constants, elastic)
            scatter_at_wall(loads, first, n, buffer, options)
            push(wall_steps.force[s, w], n, buffer)
            k += n


@lean_jit
def slab_forces(
    s, step, coming, grains, loads, contacts, walls, wall_contacts, wall_steps, outer, period, frequency, buffer, places,
    constants, options, elastic,
):  # fmt: skip
    """Loads of the contacts of one slab in one of the steps made at once.

    coming : the slab whose grains are asked for meanwhile, s for none; elastic : None or else, as
    `dem.contact.stage.contact_stage` has it.
    """
    wall_forces(s, step, grains, loads, walls, wall_contacts, wall_steps, buffer, places, constants, options, elastic)
    begin, count = contacts.begin[s], contacts.count[s]
    end = begin + count
    following = outer.order[outer.slab[coming] : outer.slab[coming + 1]]
    asked = 0
    for k0 in range(begin, end, BLOCK):
        n = min(k0 + BLOCK, end) - k0
        if options.vector_code and coming != s:
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
def most_steps(used):
    """How many steps can be made at once with so many slabs: a group that meets no other in n steps has at least 2 n - 1."""
    n = min(STEPS_AT_ONCE, (used // FEWEST_GROUPS + 1) // 2)
    return n if n >= LEAST_AT_ONCE else 1


@lean_jit
def groups_of(used):
    """How many groups so many slabs are done in: 1 or an even number; with several steps at once a multiple of 4 (two threads)."""
    n = most_steps(used)
    return min(GROUPS, used) if n == 1 else min(GROUPS, used // (2 * n - 1) // 4 * 4)


@lean_jit
def coming_slab(k, step, begin, end, odd):
    """The slab that the next contacts of a group from slab begin to end need from memory, after slab k of a step; k for none."""
    if step == 0 or k >= end + step - 1:
        return k + 1
    if odd and k == begin - step:  # the way back through the slabs that the even group before has left
        return k - 1
    return k


@lean_jit
def group_step(
    g, n_steps, moves, grains, loads, contacts, walls, wall_contacts, wall_steps, outer, period, frequency, gravity, buffer, places,
    speeds, constants, options,
):  # fmt: skip
    """Loads of one group of slabs and, if `moves`, the motion of the grains that wait for no other load, n_steps times.

    A slab's grains have all their loads when its own contacts and those of the slab before are done (for the first slab, across a
    periodic face, the last). The first slab of an even group waits for the odd group before, which then moves it.
    Of several steps, an even group leaves out one more slab at either end in each: these depend on the neighbours, and the odd
    groups, coming later, do them. Along the slabs each step follows the one before at a distance of one slab, so a slab comes from
    memory once for all of them (time skewing; Wonnacott 2000, 14th Int. Parallel and Distributed Processing Symposium).
    """
    used = used_slabs(outer.slab)
    groups = groups_of(used)
    if g >= groups:
        return
    begin, end = g * used // groups, (g + 1) * used // groups
    odd = g % 2
    for front in range(begin, end + (2 * n_steps - 1) * odd):
        for step in range(n_steps):
            wider = step if odd else -step
            k = front - step
            s = k % used
            if begin - wider <= k < end + wider:
                coming = coming_slab(k, step, begin, end, odd) % used if most_steps(used) > 1 else s
                if options.elastic_rolling:
                    slab_forces(
                        s, step, coming, grains, loads, contacts, walls, wall_contacts, wall_steps, outer, period, frequency,
                        buffer, places, constants, options, True,
                    )  # fmt: skip
                else:
                    slab_forces(
                        s, step, coming, grains, loads, contacts, walls, wall_contacts, wall_steps, outer, period, frequency,
                        buffer, places, constants, options, None,
                    )  # fmt: skip
            if moves and (used == 1 or begin - wider + 1 - odd <= k < end + wider + odd):
                move_slab(s, grains, loads, outer, gravity, speeds[step], constants, options)


@lean_jit
def steps(
    n_steps, moves, grains, loads, contacts, walls, wall_contacts, wall_steps, outer, period, frequency, gravity, buffers, speeds,
    constants, options,
):  # fmt: skip
    """Loads of all contacts and, if `moves`, the motion of all grains, n_steps times: first the groups of even number."""
    for parity in range(2):
        for k in range((groups_of(used_slabs(outer.slab)) + 1) // 2):
            group_step(
                2 * k + parity, n_steps, moves, grains, loads, contacts, walls, wall_contacts, wall_steps, outer, period, frequency,
                gravity, buffers[0], wall_steps.places[0], speeds, constants, options,
            )  # fmt: skip


@parallel_jit
def steps_threads(
    n_steps, moves, grains, loads, contacts, walls, wall_contacts, wall_steps, outer, period, frequency, gravity, buffers, speeds,
    constants, options,
):  # fmt: skip
    """As `steps`, on several threads."""
    for parity in range(2):
        for k in prange((groups_of(used_slabs(outer.slab)) + 1) // 2):
            group_step(
                2 * k + parity, n_steps, moves, grains, loads, contacts, walls, wall_contacts, wall_steps, outer, period, frequency,
                gravity, buffers[k], wall_steps.places[k], speeds, constants, options,
            )  # fmt: skip


@lean_jit
def move(grains, loads, outer, gravity, speeds, constants, options):
    """Advance all grains by one step."""
    for s in range(used_slabs(outer.slab)):
        move_slab(s, grains, loads, outer, gravity, speeds[0], constants, options)


@parallel_jit
def move_threads(grains, loads, outer, gravity, speeds, constants, options):
    """As `move`, on several threads."""
    for s in prange(used_slabs(outer.slab)):
        move_slab(s, grains, loads, outer, gravity, speeds[0], constants, options)


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
