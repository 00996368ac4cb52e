"""Work that can run in parallel: slabs of grains and their contacts (see `dem.lists.slabs.cut_slabs`), and groups of slabs.

A slab's grains move as soon as their loads are complete, while they are still in the cache; with many slabs several steps of a few
slabs are made before the next ones are fetched. Results are the same bytes for any number of threads: every grain's work is done
in the same order.
"""

from typing import NamedTuple

import numpy as np

from dem.bodies import Carried, Scene, push, take_loads
from dem.clumps.motion import move_clumps
from dem.contact.model import Model
from dem.contact.stage import contact_stage
from dem.jit import apart_jit, inline_jit, jit, lean_jit
from dem.layout import BLOCK, SECOND_SPIN, State
from dem.lists.blocks import in_block
from dem.lists.history import save_history
from dem.lists.pairs import prune_slab
from dem.lists.slabs import used_slabs
from dem.lists.storage import Lists
from dem.loops import spread
from dem.meshes.contacts import Near, locate_contacts, separate_all
from dem.poses import Ahead, rigid_at, rub, wrench
from dem.step import gather as plain
from dem.step import motion, vectors

#: Neighbouring slabs are processed in sequence, in this number of groups. All even groups may run in parallel, then all odd ones.
GROUPS = 16

#: Maximum and minimum number of fused steps: as many as leave enough slabs for FEWEST_GROUPS independent groups, see
#: `group_step`. If that is fewer than the minimum, grains stay in the third-level cache and steps are made one by one.
STEPS_AT_ONCE, LEAST_AT_ONCE, FEWEST_GROUPS = 8, 5, 4

#: Prefetch distance, in blocks of contacts: the grains of large beds come from memory, so those of the next slab are prefetched
#: while the contacts of a slab are computed.
BLOCKS_AHEAD = 3


class Scratch(NamedTuple):
    """Working memory.

    buffers (groups in parallel, BUFFER x BLOCK), places (groups in parallel, 4 BLOCK) float64; used (steps, SLABS): largest share
    of an allowance that a grain of each slab uses up in each fused step; spent, rate, marks (SLABS,): see `dem.step.loop`;
    geometry (steps, surfaces, RECORD): surfaces in each fused step; force and torque (SLABS, surfaces, 3): of each slab's grains,
    summed over the steps. ahead: None, or poses in each fused step. carried: loads of glued grains, summed over the steps. pace:
    see `dem.step.loop`. near: None, or for meshes. threads: None for one.
    """

    buffers: np.ndarray
    places: np.ndarray
    used: np.ndarray
    spent: np.ndarray
    rate: np.ndarray
    marks: np.ndarray
    geometry: np.ndarray
    force: np.ndarray
    torque: np.ndarray
    ahead: Ahead | None
    carried: Carried
    pace: np.ndarray
    near: Near | None
    threads: bool | None


class Run(NamedTuple):
    """All that a step reads and writes."""

    state: State
    scene: Scene
    lists: Lists
    model: Model
    scratch: Scratch


class Plan(NamedTuple):
    """Number of fused steps, and whether grains move as soon as their loads are complete."""

    n_steps: int
    moves: bool


@inline_jit
def gather_pairs(vector, grains, first, second, n, b, access):
    """Fill the work buffer for n pairs."""
    if vector is None:
        plain.gather_pairs(grains, first, second, n, b, access)
    else:
        vectors.gather_pairs(grains, first, second, n, b, access)


@inline_jit
def scatter_pairs(vector, loads, first, second, n, b, spins):
    """Add the loads in the work buffer to the grains of n pairs."""
    if vector is None:
        plain.scatter_pairs(loads, first, second, n, b, spins)
    else:
        vectors.scatter_pairs(loads, first, second, n, b, spins)


@inline_jit
def gather_at_surface(vector, grains, velocity, first, n, b, places):
    """Fill the work buffer and `places` for n grains near a surface."""
    if vector is None:
        plain.gather_at_surface(grains, velocity, first, n, b, places)
    else:
        vectors.gather_at_surface(grains, velocity, first, n, b, places)


@inline_jit
def scatter_at_surface(vector, loads, first, n, b):
    """Add the loads of n contacts with a surface to their grains."""
    if vector is None:
        plain.scatter_at_surface(loads, first, n, b)
    else:
        vectors.scatter_at_surface(loads, first, n, b)


@inline_jit
def prefetch(vector, grains, loads, which):
    """Prefetch grains; plain code has no such instruction."""
    if vector is not None:
        vectors.prefetch(grains, loads, which)


@inline_jit
def integrate(vector, grains, loads, which, gravity, dt, zero):
    """Advance the grains of the numbers `which` by dt; returns the largest share of an allowance that is used up."""
    if vector is None:
        return motion.integrate(grains, loads, which, gravity, dt, zero)
    else:  # noqa: RET505  # numba prunes the branch of a missing type only in this form
        return vectors.integrate(grains, loads, which, gravity, dt, zero)


@inline_jit
def clear_second_spin(b, spins):
    """A surface does not spin."""
    if spins is not None:
        b[SECOND_SPIN * BLOCK : (SECOND_SPIN + 3) * BLOCK] = 0.0


@inline_jit
def contact_loads(n, k0, buffer, contacts, laws):
    """Turn the work buffer's separations and velocities into loads of the n contacts from number k0 on, all in one block."""
    c = contacts.common[0] if contacts.alike[0] else contacts.constants[k0 // BLOCK, k0 % BLOCK :]
    h = contacts.history[k0 // BLOCK, k0 % BLOCK :]
    contact_stage(n, buffer, c, h, laws)


@apart_jit
def surface_forces(s, geometry, grains, loads, contacts, surfaces, rigid, velocity, workspace, access, laws):
    """Loads of the contacts with surfaces of the grains of slab s.

    geometry (surfaces, RECORD): the surfaces now. rigid : None, or `dem.poses.Rigid`. velocity (bodies, 3). workspace : buffer,
    places, force and torque (surfaces, 3), and what meshes need.
    """
    buffer, places, force, torque, near = workspace
    n_surfaces = surfaces.kind.shape[0]
    for w in range(n_surfaces):
        part = s * n_surfaces + w
        k, end = contacts.begin[part], contacts.begin[part] + contacts.count[part]
        locate_contacts(rigid, part, w, surfaces, grains, contacts, near, access.images)
        while k < end:
            n = in_block(k, end)
            first = contacts.first[k : k + n]
            gather_at_surface(access.vector, grains, velocity[surfaces.body[w]], first, n, buffer, places)
            separate_all(rigid, near, k, surfaces, w, geometry[w], places, n, buffer)
            clear_second_spin(buffer, access.spins)
            rub(rigid, surfaces.body[w], places, n, buffer, access)
            contact_loads(n, k, buffer, contacts, laws)
            scatter_at_surface(access.vector, loads, first, n, buffer)
            push(force[w], n, buffer)
            wrench(rigid, surfaces.body[w], torque[w], places, n, buffer, access.images)
            k += n


@apart_jit
def pair_forces(s, coming, grains, loads, contacts, buffer, access, laws):
    """Loads of the contacts between grains of slab s; coming : numbers of grains to prefetch meanwhile."""
    begin, count = contacts.begin[s], contacts.count[s]
    end = begin + count
    prefetched = 0
    for k0 in range(begin, end, BLOCK):
        n = min(k0 + BLOCK, end) - k0
        until = coming.shape[0] * min(k0 - begin + BLOCKS_AHEAD * BLOCK, count) // count
        prefetch(access.vector, grains, loads, coming[prefetched:until])
        prefetched = until
        first = contacts.first[k0 : k0 + n]
        second = contacts.second[k0 : k0 + n]
        gather_pairs(access.vector, grains, first, second, n, buffer, access)
        contact_loads(n, k0, buffer, contacts, laws)
        scatter_pairs(access.vector, loads, first, second, n, buffer, access.spins)


@inline_jit
def slab_forces(s, step, coming, run, thread):
    """Loads of the contacts of slab s in one of the fused steps; coming : the slab to prefetch meanwhile, s for none.

    The functions that this calls take only what they read: all of `run`, by value, would cost as much as their work.
    """
    state, scene, lists, model, scratch = run
    grains, loads, outer, buffer = state.grains, state.loads, lists.pairs.outer, scratch.buffers[thread]
    workspace = buffer, scratch.places[thread], scratch.force[s], scratch.torque[s], scratch.near
    surface_forces(
        s,
        scratch.geometry[step],
        grains,
        loads,
        lists.surfaces.contacts,
        scene.surfaces,
        rigid_at(scene.rigid, scratch.ahead, step),
        scene.bodies.velocity,
        workspace,
        model.access,
        model.laws,
    )
    following = outer.order[outer.slab[coming] : outer.slab[coming + 1] if coming != s else outer.slab[coming]]
    pair_forces(s, following, grains, loads, lists.pairs.contacts, buffer, model.access, model.laws)


@inline_jit
def move_slab(s, step, run):
    """Advance the grains of one slab; used[step, s] becomes the largest share of an allowance that is used up."""
    outer, model, state = run.lists.pairs.outer, run.model, run.state
    take_loads(s, run.scene.glued, state.loads, run.scratch.carried)
    which = outer.order[outer.slab[s] : outer.slab[s + 1]]
    run.scratch.used[step, s] = integrate(
        model.access.vector, state.grains, state.loads, which, run.scene.gravity, model.step_s, model.laws.numbers.zero
    )


@lean_jit
def max_steps(used):
    """Maximum number of fused steps with `used` slabs: a group that meets no other in n steps has at least 2 n - 1."""
    n = min(STEPS_AT_ONCE, (used // FEWEST_GROUPS + 1) // 2)
    return n if n >= LEAST_AT_ONCE else 1


@lean_jit
def groups_of(used):
    """Number of groups of `used` slabs: 1 or an even number; with fused steps a multiple of 4 (two threads)."""
    n = max_steps(used)
    return min(GROUPS, used) if n == 1 else min(GROUPS, used // (2 * n - 1) // 4 * 4)


@lean_jit
def coming_slab(k, step, begin, end, odd):
    """The slab to prefetch after slab k of a step, in a group from slab begin to end; k for none."""
    if step == 0 or k >= end + step - 1:
        return k + 1
    if odd and k == begin - step:  # backwards through the slabs that the even group before has left out
        return k - 1
    return k


@inline_jit
def group_step(g, plan, run, thread):
    """Loads of one group of slabs and, if `plan.moves`, the motion of the grains whose loads are complete, plan.n_steps times.

    A slab's grains have all their loads when its own contacts and those of the slab before are done (for the first slab, across a
    periodic face, the last). The first slab of an even group waits for the odd group before, which then moves it.
    Of fused steps, an even group leaves out one more slab at either end in each: these depend on the neighbours, and the odd
    groups, coming later, do them. Along the slabs each step follows the one before at a distance of one slab, so a slab comes from
    memory once for all of them (time skewing; Wonnacott 2000, 14th Int. Parallel and Distributed Processing Symposium).
    """
    used = used_slabs(run.lists.pairs.outer.slab)
    groups = groups_of(used)
    if g >= groups:
        return
    begin, end = g * used // groups, (g + 1) * used // groups
    odd = g % 2
    for front in range(begin, end + (2 * plan.n_steps - 1) * odd):
        for step in range(plan.n_steps):
            wider = step if odd else -step
            k = front - step
            s = k % used
            if begin - wider <= k < end + wider:
                coming = coming_slab(k, step, begin, end, odd) % used if max_steps(used) > 1 else s
                slab_forces(s, step, coming, run, thread)
            if plan.moves and (used == 1 or begin - wider + 1 - odd <= k < end + wider + odd):
                move_slab(s, step, run)


@inline_jit
def every_other_group(k, task):
    """Work on group 2 k, or on the one after; task : parity, plan, run."""
    parity, plan, run = task
    group_step(2 * k + parity, plan, run, k % run.scratch.buffers.shape[0])


@inline_jit
def move_one(s, run):
    """Advance the grains of slab s by one step; run : in a tuple."""
    move_slab(s, 0, run[0])


@inline_jit
def prune_one(s, task):
    """Copy the pairs of slab s that may touch; task : the arguments of `prune`."""
    state, lists, model = task
    prune_slab(s, state, lists, model)


@inline_jit
def save_one(s, task):
    """Save the history of the contacts of slab s; task : the arguments of `save`."""
    contacts, history = task
    save_history(s, contacts, history)


on_groups, on_slabs_moving, on_slabs_pruned, on_slabs_saved = map(spread, (every_other_group, move_one, prune_one, save_one))


@lean_jit
def move_with_clumps(run, clumps):
    """Advance clumps, then the grains that are no members; the largest share of an allowance counts as that of every slab."""
    state, model, gravity = run.state, run.model, run.scene.gravity
    of_members = move_clumps(model.access.vector, state.grains, clumps, gravity, model.step_s)
    zero = model.laws.numbers.zero
    of_others = integrate(model.access.vector, state.grains, state.loads, clumps.others, gravity, model.step_s, zero)
    for s in range(used_slabs(run.lists.pairs.outer.slab)):
        run.scratch.used[0, s] = max(of_members, of_others)


@inline_jit
def steps(plan, run, threads):
    """Loads of all contacts and, if `plan.moves`, the motion of all grains, plan.n_steps times: first the even groups.

    threads : None for one thread (also below).
    """
    for parity in range(2):
        on_groups(threads, (groups_of(used_slabs(run.lists.pairs.outer.slab)) + 1) // 2, (parity, plan, run))


@lean_jit
def take_all_loads(run):
    """Take the loads on all glued grains, where the grains have not moved."""
    for s in range(used_slabs(run.lists.pairs.outer.slab)):
        take_loads(s, run.scene.glued, run.state.loads, run.scratch.carried)


@inline_jit
def move_all(run, clumps, threads):
    """Advance clumps and all grains by one step; clumps : None, or `run.scene.clumps`."""
    if clumps is None:
        move(run, threads)
    else:
        move_with_clumps(run, clumps)


@inline_jit
def move(run, threads):
    """Advance all grains by one step."""
    on_slabs_moving(threads, used_slabs(run.lists.pairs.outer.slab), (run,))


@jit
def prune(state, lists, model, threads):
    """Copy the pairs that may touch from the outer list into the contact blocks; False if the capacity is too small."""
    on_slabs_pruned(threads, used_slabs(lists.pairs.outer.slab), (state, lists, model))
    return lists.pairs.contacts.count.min() >= 0


@jit
def prune_again(marks, state, lists, model):
    """As `prune`, for the marked slabs alone (SLABS,), whose contacts' history is saved first."""
    enough = True
    for s in range(used_slabs(lists.pairs.outer.slab)):
        if marks[s] > 0:
            save_history(s, lists.pairs.contacts, lists.pairs.outer.history)
            prune_slab(s, state, lists, model)
            enough &= lists.pairs.contacts.count[s] >= 0
    return enough


@lean_jit
def save(contacts, history, threads):
    """Write all contact history back to the outer list, and forget the contacts."""
    on_slabs_saved(threads, used_slabs(contacts.begin), (contacts, history))
