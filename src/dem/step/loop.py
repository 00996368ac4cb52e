"""The time loop: the only place where the kernels meet."""

import math
from typing import NamedTuple

import numpy as np

from dem.bodies import carry_glued, fastest_body, geometry_ahead, move_bodies, sum_forces
from dem.clumps.motion import collect_loads
from dem.jit import inline_jit, jit, lean_jit
from dem.layout import PLACE
from dem.ledger import Ledger, book_step, note_step
from dem.lists.blocks import common_constants
from dem.lists.grid import is_sound
from dem.lists.history import carry_history, save_history
from dem.lists.pairs import find_pairs
from dem.lists.slabs import cut_contacts, used_slabs
from dem.lists.storage import STALE, copy_list
from dem.lists.surfaces import find_surface_pairs, prune_surfaces
from dem.meshes.contacts import GRAIN_BEHIND, TOO_MANY
from dem.poses import fastest_surface, sum_torques, turn_bodies, turn_glued
from dem.step import schedule
from dem.step.motion import fastest_grain

#: Reason for which `advance` returned.
FINISHED, PAIRS_FULL, SURFACE_PAIRS_FULL, CONTACTS_FULL, BLEW_UP, TRIANGLES_FULL, BEHIND = range(7)

#: Square of the inner list's cutoff over skin and displacement of the fastest grain in a step. A larger cutoff lasts longer but
#: includes more pairs that do not touch; at the square root of the displacement both cost about the same.
UPKEEP = 1.44
#: Few grains are near surfaces: the inner list of surfaces lasts about this number of steps.
SURFACE_PRUNE_STEPS = 20.0
#: Cutoffs of the inner lists in skins: minimum for pairs, minimum for surfaces, maximum for both.
MIN_CUTOFF, MIN_SURFACE_CUTOFF, MAX_CUTOFF = 5e-4, 0.1, 0.3

#: Entries of the pace: bounds on the displacement of grains and of bodies since the last pruning (m), cutoffs of the inner lists
#: (m), largest speed of grains and bodies (m/s).
TRAVEL, BODY_TRAVEL, CUTOFF, SURFACE_CUTOFF, SPEED, BODY_SPEED, PACE = range(7)


class Limits(NamedTuple):
    """Number of steps, skin of the outer lists (m), speed above which the state is worthless (m/s)."""

    n_steps: int
    skin: float
    speed: float


class Outputs(NamedTuple):
    """mean_force, mean_torque (bodies, 3): means in N and N m of the grains on each body. ledger: None, or books every step."""

    mean_force: np.ndarray
    mean_torque: np.ndarray
    ledger: Ledger | None


@lean_jit
def advance(state, scene, lists, model, scratch, limits, outputs):
    """Advance everything by limits.n_steps. Overwrites state, scene, lists and outputs.

    Returns (reason, steps done, outer rebuilds, inner prunings). The reasons that end in FULL ask for a longer list; the state is
    then consistent and the call can be repeated with the remaining steps. BLEW_UP: something moves faster than limits.speed, or has
    no sensible position, BEHIND: a grain is behind the surface of a solid mesh; the state is worthless.
    """
    run = schedule.Run(state, scene, lists, model, scratch)
    pace = scratch.pace
    begin(run, pace)
    reason, done, n_rebuilds, n_prunings = FINISHED, 0, 0, 0
    clear_all(outputs.mean_force)
    clear_all(outputs.mean_torque)
    clear_all(scratch.speeds)
    common_constants(state, lists.pairs.contacts, model)
    while done < limits.n_steps:
        if is_due(pace):
            reason, rebuilt = refresh_lists(run, pace, limits.skin)
            n_rebuilds += rebuilt
            if reason != FINISHED:
                break
            n_prunings += 1
        plan = next_plan(run, pace, limits.n_steps - done, outputs.ledger is None and scene.clumps is None)
        note_step(run, outputs.ledger)
        geometry_ahead(scene, model.step_s, scratch.geometry[: plan.n_steps])
        schedule.steps(plan, run, scratch.threads)
        sum_forces(scene, scratch.force, used_slabs(lists.pairs.outer.slab))
        sum_torques(scene.rigid, scene.surfaces, scratch.torque, used_slabs(lists.pairs.outer.slab))
        carry_glued(state.grains, state.loads, scene)
        turn_glued(scene.rigid, state.grains, state.loads, scene)
        collect_loads(model.access.vector, state.grains, state.loads, scene.clumps)
        book_step(run, outputs.ledger)
        add_to(outputs.mean_force, scene.bodies.force)
        add_torques(outputs.mean_torque, scene.rigid)
        if not plan.moves:
            schedule.move_all(run, scene.clumps, scratch.threads)
        follow(run, pace, plan.n_steps)
        done += plan.n_steps
        if max(pace[SPEED], pace[BODY_SPEED]) > limits.speed:
            reason = BLEW_UP
            break
    save_all(lists, scratch.threads)
    lists.age[0] += pace[TRAVEL]
    divide(outputs.mean_force, max(done, 1))
    divide(outputs.mean_torque, max(done, 1))
    return reason, done, n_rebuilds, n_prunings


@lean_jit
def begin(run, pace):
    """Set the pace before the first step: inner lists are due."""
    pace[TRAVEL], pace[BODY_TRAVEL], pace[CUTOFF], pace[SURFACE_CUTOFF] = 0.0, 0.0, -1.0, -1.0
    bodies, rigid = run.scene.bodies, run.scene.rigid
    pace[SPEED], pace[BODY_SPEED] = fastest_grain(run.state.grains), fastest_surface(rigid, bodies, fastest_body(bodies))


@lean_jit
def clear(values):
    """Set a one-dimensional array to zero."""
    for k in range(values.shape[0]):
        values[k] = 0


@lean_jit
def clear_all(values):
    """Set a two-dimensional array to zero."""
    for k in range(values.shape[0]):
        clear(values[k])


@lean_jit
def add_to(total, part):
    """Add an array to another."""
    for w in range(total.shape[0]):
        for t in range(3):
            total[w, t] += part[w, t]


@inline_jit
def add_torques(total, rigid):
    """Add the torques on bodies to a total; rigid : None, or `dem.poses.Rigid`."""
    if rigid is not None:
        add_to(total, rigid.poses.torque)


@lean_jit
def divide(total, n):
    """Divide an array by a number."""
    for w in range(total.shape[0]):
        for t in range(3):
            total[w, t] /= n


@inline_jit
def is_due(pace):
    """True if the inner lists could miss a contact."""
    return 2.0 * pace[TRAVEL] > pace[CUTOFF] or pace[TRAVEL] + pace[BODY_TRAVEL] > pace[SURFACE_CUTOFF]


@inline_jit
def next_plan(run, pace, n_left, each_alone):
    """Number of steps to fuse, at most n_left, and whether grains move within them; each_alone: no ledger, no clumps."""
    # loads on glued grains go to their bodies, those on members to their clumps, and the ledger books complete loads: then all
    # grains wait for all loads
    moves = run.scene.glued.grain.shape[0] == 0 and each_alone
    if not moves or run.scene.rigid is not None or is_driven(run.scene.bodies):
        return schedule.Plan(1, moves)
    speed, body_speed = pace[SPEED], pace[BODY_SPEED]
    of_pairs = 0.5 * pace[CUTOFF] - pace[TRAVEL]
    of_surfaces = 0.5 * (pace[SURFACE_CUTOFF] - pace[TRAVEL] - pace[BODY_TRAVEL])
    displacement = max(speed, 0.5 * (speed + body_speed)) * run.model.step_s
    n = steps_within(min(of_pairs, of_surfaces), displacement, used_slabs(run.lists.pairs.outer.slab))
    return schedule.Plan(min(n_left, n), moves)


@lean_jit
def is_driven(bodies):
    """True if a force drives any body."""
    for w in range(bodies.driven.shape[0]):
        for t in range(3):
            if bodies.driven[w, t] > 0:
                return True
    return False


@lean_jit
def steps_within(max_displacement, displacement, used):
    """Number of steps to fuse so that no grain moves more than `max_displacement` (m) before the last of them.

    The speeds are known only afterwards: each step is assumed to double the displacement of the step before, the first being
    `displacement`. If a grain gains more speed in these few steps, a contact that it makes then acts some steps late.
    """
    most = schedule.max_steps(used)
    k = 1
    while k < most and k * 2.0 * displacement <= max_displacement:
        k += 1
    return k


@inline_jit
def follow(run, pace, n_steps):
    """Move the bodies by the steps that were made, and add up the displacements."""
    dt = run.model.step_s
    used = used_slabs(run.lists.pairs.outer.slab)
    for k in range(n_steps):
        body_speed, speed = move_bodies(run.scene, dt), largest(run.scratch.speeds[k], used)
        turn_bodies(run.scene.rigid, run.state.grains, run.scene, dt)
        body_speed = fastest_surface(run.scene.rigid, run.scene.bodies, body_speed)
        pace[TRAVEL] += speed * dt
        pace[BODY_TRAVEL] += body_speed * dt
        run.lists.age[1] += body_speed * dt
        run.lists.age[2] += speed * dt
        pace[SPEED], pace[BODY_SPEED] = speed, body_speed


@lean_jit
def largest(speeds, used):
    """Largest of the first `used` speeds."""
    speed = 0.0
    for s in range(used):
        speed = max(speed, speeds[s])
    return speed


@lean_jit
def cutoffs(displacement, body_displacement, skin):
    """Cutoff (m) of the inner lists of pairs and surfaces, for the displacement of the fastest grain and body in a step (m)."""
    of_pairs = max(math.sqrt(UPKEEP * displacement * skin), MIN_CUTOFF * skin)
    of_surfaces = max(1.1 * SURFACE_PRUNE_STEPS * (displacement + body_displacement), MIN_SURFACE_CUTOFF * skin)
    return min(of_pairs, MAX_CUTOFF * skin), min(of_surfaces, MAX_CUTOFF * skin)


@lean_jit
def refresh_lists(run, pace, skin):
    """Save the contacts' history, rebuild the outer lists if a pair could be missing, and prune. Returns (reason, rebuilds)."""
    lists, model, dt, age = run.lists, run.model, run.model.step_s, run.lists.age
    age[0] += pace[TRAVEL]
    pace[TRAVEL], pace[BODY_TRAVEL] = 0.0, 0.0
    pace[CUTOFF], pace[SURFACE_CUTOFF] = cutoffs(pace[SPEED] * dt, pace[BODY_SPEED] * dt, skin)
    n_rebuilds = 0
    save_all(lists, run.scratch.threads)
    rigid = run.scene.rigid
    if are_old(rigid, age, pace, skin) and age[0] < STALE:
        age[0] = largest_displacement(run.state.grains, lists.origin)  # the bound adds up the fastest grain of every step
    if are_old(rigid, age, pace, skin):
        reason = rebuild(run, skin)
        if reason != FINISHED:
            return reason, n_rebuilds
        n_rebuilds = 1
    elif surfaces_are_old(rigid, age, pace, skin):
        reason = rebuild_surfaces(run, skin)
        if reason != FINISHED:
            return reason, n_rebuilds
    if not schedule.prune(run.state, lists.pairs, pace[CUTOFF] + model.reach_m, model, run.scratch.threads):
        clear(lists.pairs.contacts.count)
        return CONTACTS_FULL, n_rebuilds
    cutoff = pace[SURFACE_CUTOFF] + model.reach_m
    listed = prune_surfaces(run.state, run.scene.surfaces, run.scene.rigid, lists, cutoff, model, run.scratch.near)
    return reason_of(run.scene.rigid, listed), n_rebuilds


@inline_jit
def reason_of(rigid, listed):
    """Reason for the end, by what `dem.meshes.contacts.list_near` found. rigid : None, or `dem.poses.Rigid`."""
    if rigid is None:
        return FINISHED
    else:  # noqa: RET505  # numba prunes the branch of a missing type only in this form
        return TRIANGLES_FULL if listed == TOO_MANY else BEHIND if listed == GRAIN_BEHIND else FINISHED


@inline_jit
def are_old(rigid, age, pace, skin):
    """True if the outer lists could miss a pair, or a grain at a surface, within the cutoff of the inner lists.

    rigid : None, or `dem.poses.Rigid`; then surfaces have an age of their own.
    """
    if rigid is None:
        return 2.0 * age[0] + pace[CUTOFF] > skin or age[0] + age[1] + pace[SURFACE_CUTOFF] > skin
    else:  # noqa: RET505  # numba prunes the branch of a missing type only in this form
        return 2.0 * age[0] + pace[CUTOFF] > skin


@inline_jit
def surfaces_are_old(rigid, age, pace, skin):
    """True if the outer list of surfaces must be rebuilt alone: a turning rim moves farther than the grains of a bed at rest."""
    if rigid is None:
        return False
    else:  # noqa: RET505  # see `are_old`
        return age[1] + age[2] + pace[SURFACE_CUTOFF] > skin


@jit
def largest_displacement(grains, origin):
    """Largest distance in m of any grain from its position in `origin`."""
    largest = 0.0
    for i in range(origin.shape[0]):
        d2 = 0.0
        for a in range(3):
            d2 += (grains.place[PLACE * i + a] - origin[i, a]) ** 2
        largest = max(largest, d2)
    return math.sqrt(largest)


@lean_jit
def rebuild(run, skin):
    """Rebuild both outer lists, carrying history. Returns FINISHED, or a reason (then nothing has changed)."""
    grains, scene, pairs, surfaces = run.state.grains, run.scene, run.lists.pairs, run.lists.surfaces
    if not is_sound(grains):
        return BLEW_UP
    cutoff = skin + run.model.reach_m
    n_pairs = find_pairs(grains, scene.clumps, scene.period, run.model.access.images, cutoff, pairs.spare)
    if n_pairs < 0:
        return PAIRS_FULL
    images = run.model.access.images
    if find_surface_pairs(grains, scene.surfaces, scene.rigid, images, cutoff, surfaces.spare) < 0:
        return SURFACE_PAIRS_FULL
    carry_history(pairs.outer, pairs.spare, True)
    carry_history(surfaces.outer, surfaces.spare, False)
    copy_list(pairs.spare, pairs.outer)
    copy_list(surfaces.spare, surfaces.outer)
    cut_contacts(pairs.outer, n_pairs, pairs.contacts.begin)
    start_anew(grains, run.lists)
    return FINISHED


@lean_jit
def rebuild_surfaces(run, skin):
    """As `rebuild`, of the outer list of surfaces alone."""
    grains, scene, surfaces, age = run.state.grains, run.scene, run.lists.surfaces, run.lists.age
    if not is_sound(grains):
        return BLEW_UP
    cutoff, images = skin + run.model.reach_m, run.model.access.images
    if find_surface_pairs(grains, scene.surfaces, scene.rigid, images, cutoff, surfaces.spare) < 0:
        return SURFACE_PAIRS_FULL
    carry_history(surfaces.outer, surfaces.spare, False)
    copy_list(surfaces.spare, surfaces.outer)
    age[1], age[2] = 0.0, 0.0
    return FINISHED


@lean_jit
def start_anew(grains, lists):
    """Note the positions at a rebuild."""
    clear(lists.age)
    for i in range(lists.origin.shape[0]):
        for a in range(3):
            lists.origin[i, a] = grains.place[PLACE * i + a]


@lean_jit
def save_all(lists, threads):
    """Write the history of all contacts back to the outer lists, and forget the contacts."""
    schedule.save(lists.pairs.contacts, lists.pairs.outer.history, threads)
    save_at_surfaces(lists.surfaces)


@lean_jit
def save_at_surfaces(neighbours):
    """Write the history of all contacts at surfaces back to the outer list, and forget the contacts."""
    for part in range(neighbours.contacts.count.shape[0]):
        save_history(part, neighbours.contacts, neighbours.outer.history)
