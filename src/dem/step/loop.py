"""The time loop: the only place where the kernels meet."""

import math
from typing import NamedTuple

import numpy as np

from dem.bodies import (
    carry_glued,
    fastest_body,
    geometry_ahead,
    give_forces,
    move_bodies,
    sort_by_slab,
    sum_forces,
    wait_for_bodies,
)
from dem.clumps.motion import collect_loads
from dem.jit import inline_jit, lean_jit
from dem.layout import GrainArrays
from dem.ledger import Ledger, book_step, note_step
from dem.lists.allowance import MOST_INNER, Terms, allow_inner, allow_outer, look
from dem.lists.blocks import common_constants
from dem.lists.grid import is_sound
from dem.lists.history import carry_history, save_history
from dem.lists.pairs import find_pairs
from dem.lists.slabs import SLABS, cut_contacts, used_slabs
from dem.lists.storage import STALE, copy_list
from dem.lists.surfaces import find_surface_pairs, prune_surfaces
from dem.meshes.contacts import GRAIN_BEHIND, TOO_MANY
from dem.poses import fastest_surface, give_torques, keep_turning, poses_ahead, sum_torques, turn_bodies, turn_glued
from dem.step import schedule
from dem.step.motion import fastest_grain, heaviest_grain

#: Reason for which `advance` returned.
FINISHED, PAIRS_FULL, SURFACE_PAIRS_FULL, CONTACTS_FULL, BLEW_UP, TRIANGLES_FULL, BEHIND = range(7)

#: Displacements of bodies, as the allowances of grains (see `dem.lists.allowance`): least and most in the inner list, and the outer
#: one, all in skins.
LEAST_BODY, MOST_BODY, OUTER_BODY = 0.05, 0.25, 0.5
#: What a slab has spent is a bound on the share of its inner allowance that any of its grains has used up since the last look at
#: them, its rate the largest share that one used up in the last step. Entries of the pace: the largest rate, below 0 where the
#: inner lists must be made anew; terms of the inner allowances; number of slabs that have chosen contacts again since then, and of
#: those that must; bound on the displacement of bodies since surfaces were pruned, and their allowance (m); largest speed of bodies
#: (m/s); mass of the heaviest grain (kg).
RATE, DURATION, FOR_ALL, AGAIN, MARKED, BODY_TRAVEL, BODY_LEFT, BODY_SPEED, HEAVIEST, PACE = range(10)

#: If more than this share of a slab's grains need another allowance, all grains get one. A slab is looked at so early that steps
#: can be fused to the end, if these use up less than the second share: looking at a slab takes a hundredth of a step of a large
#: bed, less than what steps gain that are made at once. Grains so fast that they exceed the share would be looked at always.
MANY, FUSED_SHARE = 1.0 / 16.0, 0.8

#: See `steady_steps`.
STEADY = 0.5


class Limits(NamedTuple):
    """Number of steps; skin and largest allowance of a grain in the outer lists (m); largest speed of a sensible state (m/s)."""

    n_steps: int
    skin: float
    allowance: float
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
    # members wait for the loads of their clumps, and the ledger books complete loads
    moves = outputs.ledger is None and scene.clumps is None and not wait_for_bodies(scene.bodies, scene.glued)
    begin(run, pace, moves)
    reason, done, n_rebuilds, n_prunings = FINISHED, 0, 0, 0
    clear_all(outputs.mean_force)
    clear_all(outputs.mean_torque)
    clear_all(scratch.used)
    common_constants(state, lists.pairs.contacts, model)
    while done < limits.n_steps:
        if are_lists_due(run, pace, moves):
            reason, rebuilt = refresh_lists(run, pace, limits)
            n_rebuilds += rebuilt
            n_prunings += 1
        elif pace[MARKED] > 0.0 and not choose_again(run, pace):
            reason = CONTACTS_FULL
        elif pace[BODY_TRAVEL] > pace[BODY_LEFT]:
            reason = refresh_surfaces(run, pace, limits.skin)
        if reason != FINISHED:
            break
        plan = next_plan(run, pace, limits.n_steps - done, moves)
        note_step(run, outputs.ledger)
        geometry_ahead(scene, model.step_s, scratch.geometry[: plan.n_steps])
        poses_ahead(scene.rigid, scene.bodies, model.step_s, scratch.ahead, plan.n_steps)
        schedule.steps(plan, run, scratch.threads)
        sum_forces(scene, scratch.force, used_slabs(lists.pairs.outer.slab))
        sum_torques(scene.rigid, scene.surfaces, scratch.torque, used_slabs(lists.pairs.outer.slab))
        if not plan.moves:
            schedule.take_all_loads(run)
            carry(run)
        give_loads(run)
        collect_loads(model.access.vector, state.grains, state.loads, scene.clumps)
        book_step(run, outputs.ledger)
        add_to(outputs.mean_force, scene.bodies.force)
        add_torques(outputs.mean_torque, scene.rigid)
        divide(scene.bodies.force, plan.n_steps)
        if not plan.moves:
            schedule.move_all(run, scene.clumps, scratch.threads)
        follow(run, pace, plan.n_steps)
        if plan.moves:
            carry(run)
        done += plan.n_steps
        if pace[BODY_SPEED] > limits.speed or is_too_fast(run, limits):
            reason = BLEW_UP
            break
    save_all(lists, scratch.threads)
    divide(outputs.mean_force, max(done, 1))
    divide(outputs.mean_torque, max(done, 1))
    return reason, done, n_rebuilds, n_prunings


@lean_jit
def begin(run, pace, moves):
    """Set the pace before the first step: inner lists are due. moves : whether grains move within the steps, with their bodies."""
    if run.scene.glued.grain.shape[0] > 0 and run.lists.age[0] < STALE:
        sort_by_slab(run.scene.glued, run.lists.pairs.outer, run.scratch.carried)
    if moves:
        carry(run)
    pace[RATE], pace[BODY_TRAVEL], pace[BODY_LEFT] = -1.0, 0.0, -1.0
    bodies, rigid = run.scene.bodies, run.scene.rigid
    pace[HEAVIEST] = heaviest_grain(run.state.grains)
    pace[BODY_SPEED] = fastest_surface(rigid, bodies, fastest_body(bodies))


@inline_jit
def carry(run):
    """Give glued grains the motion of their bodies."""
    carry_glued(run.state.grains, run.scene)
    turn_glued(run.scene.rigid, run.state.grains, run.scene)


@inline_jit
def give_loads(run):
    """Give bodies the loads on their glued grains."""
    give_forces(run.scratch.carried, run.scene)
    give_torques(run.scene.rigid, run.state.grains, run.scratch.carried, run.scene.glued)
    clear_all(run.scratch.carried.loads)


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


@lean_jit
def are_lists_due(run, pace, moves):
    """True if the inner lists must be made anew; marks slabs where it is enough that they choose their contacts again.

    Looks at the grains of slabs in which one may have used up its allowance, or will before fused steps end. moves : see `Plan`.
    """
    if pace[RATE] < 0.0:
        return True
    outer, scratch, used = run.lists.pairs.outer, run.scratch, used_slabs(run.lists.pairs.outer.slab)
    ahead = 2.0 * (schedule.max_steps(used) - 1) if moves else 0.0  # see `steps_within`
    for s in range(used):
        to_come = ahead * scratch.rate[s]
        if scratch.spent[s] + (to_come if to_come < FUSED_SHARE else 0.0) <= 1.0:
            continue
        which, terms = outer.order[outer.slab[s] : outer.slab[s + 1]], Terms(pace[DURATION], pace[FOR_ALL])
        n, n_near, scratch.rate[s] = look(which, run.state.grains, run.lists, run.model.step_s, run.model.reach_m, terms)
        scratch.spent[s] = 0.0
        if n > 0:  # its pairs are its own slab's and that before
            scratch.marks[s], scratch.marks[(s + used - 1) % used] = 1, 1
            pace[AGAIN] += 2.0
            pace[MARKED] += 2.0
        if n < 0 or n > MANY * which.shape[0] or pace[AGAIN] > used:
            return True
        if n_near > 0:
            pace[BODY_LEFT] = -1.0
    return False


@lean_jit
def choose_again(run, pace):
    """Have the marked slabs choose their contacts again; False if there is no space for them, and the lists must be made anew."""
    lists, marks = run.lists, run.scratch.marks
    enough = schedule.prune_again(marks, run.state, lists, run.model)
    clear(marks)
    pace[MARKED] = 0.0
    if not enough:
        save_all(lists, run.scratch.threads)
        pace[RATE] = -1.0
    return enough


@lean_jit
def is_too_fast(run, limits):
    """True if a grain moves faster than limits.speed; looks at those of slabs whose bound does not tell."""
    outer, rate = run.lists.pairs.outer, run.scratch.rate
    for s in range(used_slabs(outer.slab)):
        if not rate[s] * MOST_INNER * limits.allowance <= limits.speed * run.model.step_s:
            if fastest_grain(run.state.grains, outer.order[outer.slab[s] : outer.slab[s + 1]]) > limits.speed:
                return True
    return False


@inline_jit
def next_plan(run, pace, n_left, moves):
    """Number of steps to fuse, at most n_left, and whether grains move within them, else they wait for all loads."""
    dt, used = run.model.step_s, used_slabs(run.lists.pairs.outer.slab)
    if not moves or schedule.max_steps(used) == 1 or not keep_turning(run.scene.rigid, run.scene.glued):
        return schedule.Plan(1, moves)
    of_pairs = steps_within(steps_left(run.scratch, used), 1.0, used)
    of_bodies = steps_within(pace[BODY_LEFT] - pace[BODY_TRAVEL], pace[BODY_SPEED] * dt, used)
    return schedule.Plan(max(1, min(n_left, of_pairs, of_bodies, steady_steps(run, pace[HEAVIEST]))), moves)


@lean_jit
def steps_left(scratch, used):
    """Number of steps for which the inner allowances last at the rates of the last step."""
    left = 1e30
    for s in range(used):
        if scratch.rate[s] > 0.0:
            left = min(left, (1.0 - scratch.spent[s]) / scratch.rate[s])
    return left


@lean_jit
def steady_steps(run, heaviest):
    """Number of steps for which every driven body may keep its velocity, as it is so much heavier than the grains that it touches.

    N contacts of stiffness k make a body of mass M swing with N k / M = w^2. Grains of mass m have k dt^2 / m < 0.3 where the step
    suits their overlaps, so N m n^2 / M < STEADY leaves (w n dt)^2 < 0.3 STEADY. heaviest : m in kg.
    """
    bodies, surfaces, count = run.scene.bodies, run.scene.surfaces, run.lists.surfaces.contacts.count
    n, n_surfaces = schedule.STEPS_AT_ONCE, surfaces.kind.shape[0]
    for w in range(n_surfaces):
        touching = 0
        for part in range(w, count.shape[0], n_surfaces):
            touching += count[part]
        for t in range(3):
            if bodies.driven[surfaces.body[w], t] > 0 and touching * heaviest > 0.0:
                n = min(n, int(math.sqrt(STEADY * bodies.mass[surfaces.body[w], t] / (touching * heaviest))))
    return n


@lean_jit
def steps_within(max_displacement, displacement, used):
    """Number of steps to fuse so that nothing moves more than `max_displacement` before the last of them.

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
        body_speed = move_bodies(run.scene, dt)
        turn_bodies(run.scene.rigid, run.state.grains, run.scene, dt)
        body_speed = fastest_surface(run.scene.rigid, run.scene.bodies, body_speed)
        add_up(run.scratch, k, used)
        pace[BODY_TRAVEL] += body_speed * dt
        run.lists.age[1] += body_speed * dt
        pace[BODY_SPEED] = body_speed
    pace[RATE] = largest(run.scratch.rate, used)


@lean_jit
def add_up(scratch, step, used):
    """Add what the grains of each slab have used up in one of the fused steps."""
    for s in range(used):
        scratch.rate[s] = scratch.used[step, s]
        scratch.spent[s] += scratch.used[step, s]


@lean_jit
def largest(shares, n):
    """Largest of the first n shares."""
    share = 0.0
    for s in range(n):
        share = max(share, shares[s])
    return share


@lean_jit
def allow_bodies(pace, dt, skin):
    """Set the allowance of bodies in the inner list of surfaces."""
    pace[BODY_TRAVEL] = 0.0
    pace[BODY_LEFT] = min(max(pace[BODY_SPEED] * dt * pace[DURATION], LEAST_BODY * skin), MOST_BODY * skin)


@lean_jit
def refresh_lists(run, pace, limits):
    """Save the contacts' history, rebuild the outer lists if a pair could be missing, and prune. Returns (reason, rebuilds)."""
    lists, model, dt, skin = run.lists, run.model, run.model.step_s, limits.skin
    n_rebuilds = 0
    save_all(lists, run.scratch.threads)
    pace[RATE], pace[AGAIN], pace[MARKED], terms = -1.0, 0.0, 0.0, Terms(0.0, 0.0)
    if lists.age[0] < STALE:
        pace[RATE], terms = allow_inner(run.state.grains, lists, dt, skin, model.reach_m)
    if pace[RATE] < 0.0:
        reason = rebuild(run, limits)
        if reason != FINISHED:
            return reason, n_rebuilds
        n_rebuilds = 1
        pace[RATE], terms = allow_inner(run.state.grains, lists, dt, skin, model.reach_m)
    pace[DURATION], pace[FOR_ALL] = terms
    for s in range(SLABS):
        run.scratch.spent[s], run.scratch.rate[s], run.scratch.marks[s] = 0.0, pace[RATE], 0
    if not schedule.prune(run.state, lists, model, run.scratch.threads):
        clear(lists.pairs.contacts.count)
        pace[RATE] = -1.0
        return CONTACTS_FULL, n_rebuilds
    return prune_at_surfaces(run, pace, skin), n_rebuilds


@lean_jit
def refresh_surfaces(run, pace, skin):
    """As `refresh_lists`, of surfaces alone: a turning rim moves farther than the grains of a bed at rest. Returns a reason."""
    save_at_surfaces(run.lists.surfaces)
    return prune_at_surfaces(run, pace, skin)


@lean_jit
def prune_at_surfaces(run, pace, skin):
    """Rebuild the outer list of surfaces if an entry could be missing, and prune it. Returns a reason."""
    lists, scene = run.lists, run.scene
    allow_bodies(pace, run.model.step_s, skin)
    if lists.age[1] + pace[BODY_LEFT] > OUTER_BODY * skin:
        reason = rebuild_surfaces(run, skin)
        if reason != FINISHED:
            return reason
    cutoff = pace[BODY_LEFT] + 0.5 * run.model.reach_m
    return reason_of(
        scene.rigid, prune_surfaces(run.state, scene.surfaces, scene.rigid, lists, cutoff, run.model, run.scratch.near)
    )


@inline_jit
def reason_of(rigid, listed):
    """Reason for the end, by what `dem.lists.surfaces.prune_surfaces` found. rigid : None, or `dem.poses.Rigid`."""
    if rigid is None:
        return FINISHED
    else:  # noqa: RET505  # numba prunes the branch of a missing type only in this form
        return TRIANGLES_FULL if listed == TOO_MANY else BEHIND if listed == GRAIN_BEHIND else FINISHED


@lean_jit
def rebuild(run, limits):
    """Rebuild both outer lists, carrying history. Returns FINISHED, or a reason (then nothing has changed)."""
    grains, scene, lists, model = run.state.grains, run.scene, run.lists, run.model
    pairs, images = lists.pairs, model.access.images
    if not is_sound(grains):
        return BLEW_UP
    lists.age[0] = STALE  # the allowances are made before the lists that hold with them
    usual = allow_outer(grains, lists, model.step_s, limits.skin, limits.allowance)
    n_pairs = find_pairs(grains, scene.clumps, scene.period, images, lists.allowance, model.reach_m, usual, pairs.spare)
    if n_pairs < 0:
        return PAIRS_FULL
    reason = rebuild_surfaces(run, limits.skin)
    if reason != FINISHED:
        return reason
    carry_history(pairs.outer, pairs.spare, True)
    copy_list(pairs.spare, pairs.outer)
    cut_contacts(pairs.outer, n_pairs, pairs.contacts.begin)
    if scene.glued.grain.shape[0] > 0:
        sort_by_slab(scene.glued, pairs.outer, run.scratch.carried)
    lists.age[0] = 0.0
    return FINISHED


@lean_jit
def rebuild_surfaces(run, skin):
    """As `rebuild`, of the outer list of surfaces alone, for grains where they got their outer allowances."""
    grains, scene, lists, model = run.state.grains, run.scene, run.lists, run.model
    if not is_sound(grains):
        return BLEW_UP
    cutoff, images, surfaces = OUTER_BODY * skin + model.reach_m, model.access.images, lists.surfaces
    then = GrainArrays(lists.origin, grains.motion, grains.remainder)
    if find_surface_pairs(then, scene.surfaces, scene.rigid, images, lists.allowance, cutoff, surfaces.spare) < 0:
        return SURFACE_PAIRS_FULL
    carry_history(surfaces.outer, surfaces.spare, False)
    copy_list(surfaces.spare, surfaces.outer)
    lists.age[1] = 0.0
    return FINISHED


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
