"""The time loop: the only place where the kernels meet."""

import math
from typing import NamedTuple

import numpy as np

from dem import ledger as energy
from dem.jit import jit, lean_jit
from dem.layout import BLOCK, PLACE
from dem.lists.blocks import common_constants
from dem.lists.grid import frequencies, is_sound
from dem.lists.history import carry_history, save_history
from dem.lists.pairs import find_pairs
from dem.lists.slabs import cut_contacts, slab_numbers, used_slabs
from dem.lists.surfaces import find_wall_pairs, prune_walls
from dem.step import schedule
from dem.step.motion import carry_glued, fastest_grain
from dem.walls import fastest_wall, later, move_walls

#: A bound that stands for lists that must be remade (m; finite, because kernels may assume that no value is infinite).
LISTS_STALE = 1e30

#: Why `advance` came back.
FINISHED, PAIRS_FULL, WALL_PAIRS_FULL, CONTACTS_FULL, BLEW_UP = range(5)

#: Square of the reach of the pairs' inner list over skin and way of the fastest grain in a step. Farther, and it lasts longer but
#: holds more pairs that do not touch; at the square root of the way both cost about the same.
UPKEEP = 1.44
#: Few grains are near walls: the inner list of walls lasts about so many steps.
WALL_PRUNE_STEPS = 20.0
#: Reach in skins: of the pairs' inner list at least, of the walls' at least, of both at most.
LEAST_REACH, LEAST_WALL_REACH, MOST_REACH = 5e-4, 0.1, 0.3


class OuterList(NamedTuple):
    """Rows of partners with their contact history: row (n, 2) begin and end; owner, partner (capacity), history (capacity, 3 or 6).

    order (n,) and slab (SLABS + 1,): the grains in cell order and where its slabs begin (pairs only).
    """

    row: np.ndarray
    owner: np.ndarray
    partner: np.ndarray
    history: np.ndarray
    order: np.ndarray
    slab: np.ndarray


class Contacts(NamedTuple):
    """The inner list: grain i, grain or wall j, entry of the outer list, and the blocks of constants and history (see `layout`).

    Slab s has count[s] contacts from begin[s] on; in the list for walls, slab s has count[p] with wall w, p = s x walls + w.
    alike (1,): whether all contacts have the pair constants in `common` (1, CONSTANTS x BLOCK), and `constants` are not used.
    """

    first: np.ndarray
    second: np.ndarray
    slot: np.ndarray
    constants: np.ndarray
    history: np.ndarray
    begin: np.ndarray
    count: np.ndarray  # type: ignore[assignment]  # hides a tuple's own count(), which nobody needs here
    common: np.ndarray
    alike: np.ndarray


class Options(NamedTuple):
    """Which code runs: vector code or its plain twin, type C rolling, nearest images."""

    vector_code: bool
    elastic_rolling: bool
    periodic: bool


class Constants(NamedTuple):
    """Time step in float64; in the contact precision: time step, one, zero, a tiny positive number, the smallest normal force."""

    step: float
    dt: float
    one: float
    zero: float
    tiny: float
    least: float


@jit
def save_with_walls(contacts, history):
    """Write the history of all contacts with walls back to the outer list, and forget the contacts."""
    for part in range(contacts.count.shape[0]):
        save_history(part, contacts, history)


@jit
def rebuild(grains, period, walls, skin, pair_list, wall_pairs, spare, wall_spare, contacts):
    """Remake both outer lists, carrying history. Returns FINISHED, or why not (then nothing has changed)."""
    if not is_sound(grains):
        return BLEW_UP
    n_pairs = find_pairs(grains, period, skin, spare.row, spare.owner, spare.partner, spare.order, spare.slab)
    if n_pairs < 0:
        return PAIRS_FULL
    if find_wall_pairs(grains, walls, skin, wall_spare.row, wall_spare.owner, wall_spare.partner) < 0:
        return WALL_PAIRS_FULL
    carry_history(pair_list, spare, True)
    carry_history(wall_pairs, wall_spare, False)
    copy_list(spare, pair_list)
    copy_list(wall_spare, wall_pairs)
    cut_contacts(pair_list.row, pair_list.order, pair_list.slab, n_pairs, contacts.begin)
    return FINISHED


@jit
def copy_list(source, target):
    """Copy an outer list into another that is at least as long."""
    m = 0
    for i in range(source.row.shape[0]):
        target.row[i, 0], target.row[i, 1] = source.row[i, 0], source.row[i, 1]
        m = max(m, source.row[i, 1])
    target.order[:] = source.order
    target.slab[:] = source.slab
    for k in range(m):
        target.owner[k] = source.owner[k]
        target.partner[k] = source.partner[k]
        target.history[k] = source.history[k]


@jit
def farthest(grains, origin):
    """Longest way in m of any grain from its place in `origin`."""
    most = 0.0
    for i in range(origin.shape[0]):
        way = 0.0
        for a in range(3):
            way += (grains.place[PLACE * i + a] - origin[i, a]) ** 2
        most = max(most, way)
    return math.sqrt(most)


@lean_jit
def steps_within(way, way_per_step, used):
    """How many steps so many slabs make at once while no grain goes farther than `way` (m) before the last of them.

    The speeds are known only afterwards: each step is reckoned to take twice the way of the step before. Should a grain gain more
    than that speed in these few steps, a contact that it makes then is felt by so many steps late.
    """
    most = schedule.most_steps(used)
    k = 1
    while k < most and k * 2.0 * way_per_step <= way:
        k += 1
    return k


@lean_jit
def sum_wall_forces(walls, force, used):
    """Set `walls.force` to the forces of the grains of all used slabs on each wall since the last call."""
    for w in range(force.shape[1]):
        for t in range(3):
            total = 0.0
            for s in range(used):
                total += force[s, w, t]
                force[s, w, t] = 0.0
            walls.force[w, t] = total


@jit
def refresh_lists(
    grains,
    material,
    walls,
    pair_list,
    wall_pairs,
    spare,
    wall_spare,
    contacts,
    wall_contacts,
    pair_table,
    n_materials,
    period,
    frequency,
    skin,
    reach,
    wall_reach,
    options,
    origin,
    list_age,
    parallel,
):
    """Save the contacts' history, rebuild the outer lists if a pair could be missing, and prune up to `reach` and `wall_reach`.

    Arguments as in `advance`. Returns (FINISHED or why not, outer rebuilds).
    """
    n_rebuilds = 0
    if parallel is None:
        schedule.save(contacts, pair_list.history)
    else:
        schedule.save_threads(contacts, pair_list.history)
    save_with_walls(wall_contacts, wall_pairs.history)
    if are_old(list_age, reach, wall_reach, skin) and list_age[0] < LISTS_STALE:
        list_age[0] = farthest(grains, origin)  # the bound adds up the fastest grain of every step
    if are_old(list_age, reach, wall_reach, skin):
        reason = rebuild(grains, period, walls, skin, pair_list, wall_pairs, spare, wall_spare, contacts)
        if reason != FINISHED:
            return reason, n_rebuilds
        n_rebuilds = 1
        list_age[:] = 0.0
        for i in range(origin.shape[0]):
            for a in range(3):
                origin[i, a] = grains.place[PLACE * i + a]
    if parallel is None:
        fits = schedule.prune(
            grains, period, frequency, options.periodic, pair_list, reach, contacts, pair_table, n_materials, material
        )
    else:
        fits = schedule.prune_threads(
            grains, period, frequency, options.periodic, pair_list, reach, contacts, pair_table, n_materials, material
        )
    if not fits:
        contacts.count[:] = 0
        return CONTACTS_FULL, n_rebuilds
    prune_walls(grains, walls, wall_pairs, slab_numbers(pair_list), wall_reach, wall_contacts, pair_table, n_materials, material)
    return FINISHED, n_rebuilds


@lean_jit
def reaches(grain_way, wall_way, skin):
    """Reach (m) of the inner lists of pairs and of walls, where the fastest grain and wall go so far in a step (m)."""
    of_pairs = max(math.sqrt(UPKEEP * grain_way * skin), LEAST_REACH * skin)
    of_walls = max(1.1 * WALL_PRUNE_STEPS * (grain_way + wall_way), LEAST_WALL_REACH * skin)
    return min(of_pairs, MOST_REACH * skin), min(of_walls, MOST_REACH * skin)


@lean_jit
def are_old(list_age, reach, wall_reach, skin):
    """Whether the outer lists could miss a pair, or a grain at a wall, within the reach of the inner lists."""
    return 2.0 * list_age[0] + reach > skin or list_age[0] + list_age[1] + wall_reach > skin


@jit
def advance(
    grains,
    material,
    loads,
    walls,
    pair_list,
    wall_pairs,
    spare,
    wall_spare,
    contacts,
    wall_contacts,
    pair_table,
    n_materials,
    glued,
    carrier,
    gravity,
    period,
    buffers,
    speeds,
    constants,
    dt,
    skin,
    speed_limit,
    n_steps,
    options,
    origin,
    list_age,
    mean_force,
    parallel,
    ledger,
):
    """Advance everything by n_steps of dt.

    Overwrites grains, walls and the lists; `mean_force` (walls, 3) receives the mean force of the grains on each wall.
    `origin` (n, 3) keeps where the grains were when the outer lists were made, `list_age` the bound on any grain's way and the
    walls' way since then (m); LISTS_STALE in the first asks for new lists.
    `parallel` : None for one thread, anything else for numba's number of threads (the other branch is then not even compiled).
    `ledger` : None, or a `dem.ledger.Ledger` that books every step.
    Returns (reason, steps done, outer rebuilds, inner prunings). The reasons that end in FULL ask for a longer list; the state is
    then consistent and the call can be repeated with the remaining steps. BLEW_UP: something moves faster than speed_limit, or is
    out of any sensible place, and the state is worthless.
    """
    frequency = frequencies(period)
    n_rebuilds = 0
    n_prunings = 0
    travel, wall_travel = 0.0, 0.0  # bounds on the ways of the grains and the walls since the last pruning
    reach, wall_reach = -1.0, -1.0
    grain_speed, wall_speed = fastest_grain(grains), fastest_wall(walls)
    reason = FINISHED
    done = 0
    mean_force[:] = 0.0
    # loads on glued grains are the walls', and the ledger books complete loads: then all grains wait for all loads
    moves_at_once = glued.shape[0] == 0 and ledger is None
    is_driven = walls.kind.shape[0] > 0 and walls.drive_axis.max() >= 0
    n_walls = walls.kind.shape[0]
    wall_steps = schedule.WallSteps(
        np.empty((schedule.STEPS_AT_ONCE, n_walls, 7)),
        np.zeros((speeds.shape[1], n_walls, 3)),
        np.empty((buffers.shape[0], 4 * BLOCK)),
    )
    speeds[:] = 0.0
    common_constants(grains, contacts, pair_table, n_materials, material)
    while done < n_steps:
        if 2.0 * travel > reach or travel + wall_travel > wall_reach:
            list_age[0] += travel
            travel, wall_travel = 0.0, 0.0
            reach, wall_reach = reaches(grain_speed * dt, wall_speed * dt, skin)
            reason, rebuilt = refresh_lists(
                grains, material, walls, pair_list, wall_pairs, spare, wall_spare, contacts, wall_contacts, pair_table, n_materials,
                period, frequency, skin, reach, wall_reach, options, origin, list_age, parallel,
            )  # fmt: skip
            n_rebuilds += rebuilt
            if reason != FINISHED:
                break
            n_prunings += 1
        used, at_once = used_slabs(pair_list.slab), 1
        if moves_at_once and not is_driven:
            left = min(0.5 * reach - travel, 0.5 * (wall_reach - travel - wall_travel))
            at_once = min(n_steps - done, steps_within(left, max(grain_speed, 0.5 * (grain_speed + wall_speed)) * dt, used))
        if ledger is not None:
            energy.note_step(grains, period, frequency, contacts, walls, wall_contacts, constants, ledger, options.elastic_rolling)
        later(walls, dt, wall_steps.geometry[:at_once])
        if parallel is None:
            schedule.steps(
                at_once, moves_at_once, grains, loads, contacts, walls, wall_contacts, wall_steps, pair_list, period, frequency,
                gravity, buffers, speeds, constants, options,
            )  # fmt: skip
        else:
            schedule.steps_threads(
                at_once, moves_at_once, grains, loads, contacts, walls, wall_contacts, wall_steps, pair_list, period, frequency,
                gravity, buffers, speeds, constants, options,
            )  # fmt: skip
        sum_wall_forces(walls, wall_steps.force, used)
        carry_glued(grains, loads, walls, glued, carrier)
        if ledger is not None:
            energy.book_step(grains, loads, contacts, walls, wall_contacts, gravity, dt, ledger)
        mean_force += walls.force
        if not moves_at_once:
            if parallel is None:
                schedule.move(grains, loads, pair_list, gravity, speeds, constants, options)
            else:
                schedule.move_threads(grains, loads, pair_list, gravity, speeds, constants, options)
        for k in range(at_once):
            wall_speed, grain_speed = move_walls(walls, dt), speeds[k, :used].max()
            travel += grain_speed * dt
            wall_travel += wall_speed * dt
            list_age[1] += wall_speed * dt
        done += at_once
        if max(grain_speed, wall_speed) > speed_limit:
            reason = BLEW_UP
            break
    schedule.save(contacts, pair_list.history)
    save_with_walls(wall_contacts, wall_pairs.history)
    list_age[0] += travel
    mean_force /= max(done, 1)
    return reason, done, n_rebuilds, n_prunings
