"""The time loop: the only place where the kernels meet."""

import math
from typing import NamedTuple

import numpy as np

from dem import motion, pairs, vectors
from dem.contact.block import contact_stage, rolling_stage
from dem.jit import jit
from dem.layout import BLOCK, GRAIN, N_HISTORY, ROWS
from dem.motion import carry_glued
from dem.neighbours import (
    carry_history,
    find_pairs,
    find_wall_pairs,
    frequencies,
    is_sound,
    prune_pairs,
    prune_walls,
    save_history,
)
from dem.walls import gather_walls, move_walls, scatter_walls

#: A bound that stands for lists that must be remade (m; finite, because kernels may assume that no value is infinite).
LISTS_STALE = 1e30

#: Why `advance` came back.
FINISHED, PAIRS_FULL, WALL_PAIRS_FULL, BLEW_UP = 0, 1, 2, 3

#: The inner list is remade about every so many steps ...
PRUNE_STEPS = 20.0
#: ... but reaches at least this fraction of the skin, and at most that.
LEAST_REACH, MOST_REACH = 0.0125, 0.3


class OuterList(NamedTuple):
    """Rows of partners with their contact history: row (n, 2) begin and end, partner (capacity), history (capacity, N_HISTORY)."""

    row: np.ndarray
    partner: np.ndarray
    history: np.ndarray


class Contacts(NamedTuple):
    """The inner list: grain i, grain or wall j, entry of the outer list, and the contact blocks."""

    first: np.ndarray
    second: np.ndarray
    slot: np.ndarray
    block: np.ndarray


class Options(NamedTuple):
    """Which code runs: vector code or its plain twin, type C rolling, nearest images."""

    vector_code: bool
    elastic_rolling: bool
    periodic: bool


class Constants(NamedTuple):
    """Numbers in the contact precision: time step, one, zero, a tiny positive number."""

    dt: float
    one: float
    zero: float
    tiny: float


@jit
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


@jit
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


@jit
def contact_loads(n, buffer, c, constants, options):
    """Turn the work buffer's separations and velocities into loads."""
    contact_stage(n, buffer, c, constants.dt, constants.one, constants.zero, constants.tiny)
    if options.elastic_rolling:
        rolling_stage(n, buffer, c, constants.dt, constants.one, constants.zero, constants.tiny)


@jit
def pair_forces(grains, loads, contacts, m, period, frequency, buffer, constants, options):
    """Loads of all grain-grain contacts."""
    for k0 in range(0, m, BLOCK):
        n = min(k0 + BLOCK, m) - k0
        first = contacts.first[k0 : k0 + n]
        second = contacts.second[k0 : k0 + n]
        gather(grains, period, frequency, first, second, n, buffer, options)
        contact_loads(n, buffer, contacts.block[k0 * ROWS : (k0 + BLOCK) * ROWS], constants, options)
        scatter(loads, first, second, n, buffer, options)


@jit
def wall_forces(grains, loads, walls, contacts, m, buffer, constants, options):
    """Loads of all grain-wall contacts; `walls.force` is set to this step's forces of the grains on each wall."""
    walls.force[:] = 0.0
    for k0 in range(0, m, BLOCK):
        n = min(k0 + BLOCK, m) - k0
        first = contacts.first[k0 : k0 + n]
        second = contacts.second[k0 : k0 + n]
        gather_walls(grains, walls, first, second, n, buffer)
        contact_loads(n, buffer, contacts.block[k0 * ROWS : (k0 + BLOCK) * ROWS], constants, options)
        scatter_walls(loads, walls, first, second, n, buffer)


@jit
def rebuild(grains, period, walls, skin, pair_list, wall_pairs, spare, wall_spare):
    """Remake both outer lists, carrying history. Returns FINISHED, or why not (then nothing has changed)."""
    if not is_sound(grains):
        return BLEW_UP
    if find_pairs(grains, period, skin, spare.row, spare.partner) < 0:
        return PAIRS_FULL
    if find_wall_pairs(grains, walls, skin, wall_spare.row, wall_spare.partner) < 0:
        return WALL_PAIRS_FULL
    carry_history(pair_list, spare, True)
    carry_history(wall_pairs, wall_spare, False)
    copy_list(spare, pair_list)
    copy_list(wall_spare, wall_pairs)
    return FINISHED


@jit
def copy_list(source, target):
    """Copy an outer list into another that is at least as long."""
    m = 0
    for i in range(source.row.shape[0]):
        target.row[i, 0], target.row[i, 1] = source.row[i, 0], source.row[i, 1]
        m = max(m, source.row[i, 1])
    for k in range(m):
        target.partner[k] = source.partner[k]
        for t in range(N_HISTORY):
            target.history[k, t] = source.history[k, t]


@jit
def farthest(grains, origin):
    """Longest way in m of any grain from its place in `origin`."""
    most = 0.0
    for i in range(origin.shape[0]):
        way = 0.0
        for a in range(3):
            way += (grains[GRAIN * i + a] - origin[i, a]) ** 2
        most = max(most, way)
    return math.sqrt(most)


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
    buffer,
    constants,
    dt,
    skin,
    speed_limit,
    n_steps,
    options,
    origin,
    list_age,
    mean_force,
):
    """Advance everything by n_steps of dt.

    Overwrites grains, walls and the lists; `mean_force` (walls, 3) receives the mean force of the grains on each wall.
    `origin` (n, 3) keeps where the grains were when the outer lists were made, `list_age` the bound on any grain's way and the
    walls' way since then (m); LISTS_STALE in the first asks for new lists.
    Returns (reason, steps done, outer rebuilds, inner prunings). The reasons PAIRS_FULL and WALL_PAIRS_FULL ask for a longer list;
    the state is then consistent and the call can be repeated with the remaining steps. BLEW_UP: something moves faster than
    speed_limit, or is out of any sensible place, and the state is worthless.
    """
    frequency = frequencies(period)
    m = 0
    m_walls = 0
    n_rebuilds = 0
    n_prunings = 0
    travel = 0.0  # bound on any grain's or wall's way since the last pruning
    reach = -1.0
    fastest = 0.0
    reason = FINISHED
    done = 0
    mean_force[:] = 0.0
    for _ in range(n_steps):
        if 2.0 * travel > reach:
            list_age[0] += travel
            travel = 0.0
            save_history(contacts, m, pair_list.history)
            save_history(wall_contacts, m_walls, wall_pairs.history)
            m = 0
            m_walls = 0
            reach = min(max(2.2 * fastest * dt * PRUNE_STEPS, LEAST_REACH * skin), MOST_REACH * skin)
            if 2.0 * list_age[0] + reach > skin and list_age[0] < LISTS_STALE:
                list_age[0] = max(farthest(grains, origin), list_age[1])  # the bound adds up the fastest grain of every step
            if 2.0 * list_age[0] + reach > skin:
                reason = rebuild(grains, period, walls, skin, pair_list, wall_pairs, spare, wall_spare)
                if reason != FINISHED:
                    break
                n_rebuilds += 1
                list_age[:] = 0.0
                for i in range(origin.shape[0]):
                    for a in range(3):
                        origin[i, a] = grains[GRAIN * i + a]
            m = prune_pairs(
                grains, period, frequency, options.periodic, pair_list, reach, contacts, pair_table, n_materials, material
            )
            m_walls = prune_walls(grains, walls, wall_pairs, reach, wall_contacts, pair_table, n_materials, material)
            n_prunings += 1
        pair_forces(grains, loads, contacts, m, period, frequency, buffer, constants, options)
        wall_forces(grains, loads, walls, wall_contacts, m_walls, buffer, constants, options)
        carry_glued(grains, loads, walls, glued, carrier)
        mean_force += walls.force
        wall_speed = move_walls(walls, dt)
        if options.vector_code:
            fastest = vectors.integrate(grains, loads, gravity, dt, constants.zero) + wall_speed
        else:
            fastest = motion.integrate(grains, loads, gravity, dt, constants.zero) + wall_speed
        travel += fastest * dt
        list_age[1] += wall_speed * dt
        done += 1
        if fastest > speed_limit:
            reason = BLEW_UP
            break
    save_history(contacts, m, pair_list.history)
    save_history(wall_contacts, m_walls, wall_pairs.history)
    list_age[0] += travel
    mean_force /= max(done, 1)
    return reason, done, n_rebuilds, n_prunings
