"""The time loop: the only place where the kernels meet."""

import math
from typing import NamedTuple

import numpy as np

from dem.contact.block import contact_stage, rolling_stage
from dem.jit import jit
from dem.layout import BLOCK, GRAIN, INV_R_I, INV_R_J, LOAD, N_HISTORY, ROWS, U
from dem.layout import BLOCK as B
from dem.motion import carry_glued, integrate
from dem.neighbours import (
    carry_history,
    find_pairs,
    find_wall_pairs,
    frequencies,
    is_sound,
    nearest_image,
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


class Constants(NamedTuple):
    """Numbers in the contact precision: time step, one, zero, a tiny positive number."""

    dt: float
    one: float
    zero: float
    tiny: float


@jit
def store_separation(x, y, z, R_sum, q, b):
    """Put one pair's separation and R_sum^2 - d^2 into the work buffer: computed in float64, then rounded."""
    b[q] = x
    b[B + q] = y
    b[2 * B + q] = z
    b[3 * B + q] = R_sum * R_sum - (x * x + y * y + z * z)


@jit
def store_velocities(grains, i, j, q, b):
    """Put one pair's relative velocity and sum of spin velocities into the work buffer."""
    b[4 * B + q] = grains[i + U[3]] - grains[j + U[3]]
    b[5 * B + q] = grains[i + U[4]] - grains[j + U[4]]
    b[6 * B + q] = grains[i + U[5]] - grains[j + U[5]]
    b[7 * B + q] = grains[i + U[6]] + grains[j + U[6]]
    b[8 * B + q] = grains[i + U[7]] + grains[j + U[7]]
    b[9 * B + q] = grains[i + U[8]] + grains[j + U[8]]


@jit
def gather_pairs(grains, first, second, n, b):
    """Fill the work buffer for n pairs."""
    for q in range(n):
        i = np.uint64(first[q] * GRAIN)
        j = np.uint64(second[q] * GRAIN)
        x = grains[i] - grains[j]
        y = grains[i + U[1]] - grains[j + U[1]]
        z = grains[i + U[2]] - grains[j + U[2]]
        store_separation(x, y, z, grains[i + U[11]] + grains[j + U[11]], q, b)
        store_velocities(grains, i, j, q, b)


@jit
def gather_periodic_pairs(grains, period, frequency, first, second, n, b):
    """As `gather_pairs`, with separations to the nearest periodic image; frequency is 1/period, 0 where not periodic."""
    for q in range(n):
        i = np.uint64(first[q] * GRAIN)
        j = np.uint64(second[q] * GRAIN)
        x = grains[i] - grains[j]
        y = grains[i + U[1]] - grains[j + U[1]]
        z = grains[i + U[2]] - grains[j + U[2]]
        x = nearest_image(x, period[0], frequency[0])
        y = nearest_image(y, period[1], frequency[1])
        z = nearest_image(z, period[2], frequency[2])
        store_separation(x, y, z, grains[i + U[11]] + grains[j + U[11]], q, b)
        store_velocities(grains, i, j, q, b)


@jit
def gather_rolling(grains, first, second, n, b, c):
    """Add the relative angular velocity of n pairs to the work buffer."""
    for q in range(n):
        i = first[q] * GRAIN
        j = second[q] * GRAIN
        for t in range(3):
            b[(10 + t) * B + q] = grains[i + 6 + t] * c[INV_R_I * B + q] - grains[j + 6 + t] * c[INV_R_J * B + q]


@jit
def scatter_pairs(loads, first, second, n, b):
    """Add the loads of n pairs to their grains (type A)."""
    for q in range(n):
        i = np.uint64(first[q] * LOAD)
        j = np.uint64(second[q] * LOAD)
        fx, fy, fz = b[q], b[B + q], b[2 * B + q]
        qx, qy, qz = b[3 * B + q], b[4 * B + q], b[5 * B + q]
        resist = b[6 * B + q]
        loads[i] += fx
        loads[i + U[1]] += fy
        loads[i + U[2]] += fz
        loads[i + U[3]] += qx
        loads[i + U[4]] += qy
        loads[i + U[5]] += qz
        loads[i + U[6]] += resist
        loads[j] -= fx
        loads[j + U[1]] -= fy
        loads[j + U[2]] -= fz
        loads[j + U[3]] += qx
        loads[j + U[4]] += qy
        loads[j + U[5]] += qz
        loads[j + U[6]] += resist


@jit
def scatter_rolling(loads, first, second, n, b, c):
    """Add the loads of n pairs to their grains (type C: a moment, equal and opposite, instead of a resistance)."""
    for q in range(n):
        i = np.uint64(first[q] * LOAD)
        j = np.uint64(second[q] * LOAD)
        for t in range(3):
            f = b[t * B + q]
            twist = b[(3 + t) * B + q]
            moment = b[(10 + t) * B + q]
            loads[i + U[t]] += f
            loads[j + U[t]] -= f
            loads[i + U[3 + t]] += twist + moment * c[INV_R_I * B + q]
            loads[j + U[3 + t]] += twist - moment * c[INV_R_J * B + q]


@jit
def pair_forces(grains, loads, contacts, m, period, buffer, constants, elastic_rolling, periodic):
    """Loads of all grain-grain contacts."""
    frequency = frequencies(period)
    for k0 in range(0, m, BLOCK):
        n = min(k0 + BLOCK, m) - k0
        first = contacts.first[k0 : k0 + n]
        second = contacts.second[k0 : k0 + n]
        c = contacts.block[k0 * ROWS : (k0 + BLOCK) * ROWS]
        if periodic:
            gather_periodic_pairs(grains, period, frequency, first, second, n, buffer)
        else:
            gather_pairs(grains, first, second, n, buffer)
        if elastic_rolling:
            gather_rolling(grains, first, second, n, buffer, c)
            contact_stage(n, buffer, c, constants.dt, constants.one, constants.zero, constants.tiny)
            rolling_stage(n, buffer, c, constants.dt, constants.one, constants.tiny)
            scatter_rolling(loads, first, second, n, buffer, c)
        else:
            contact_stage(n, buffer, c, constants.dt, constants.one, constants.zero, constants.tiny)
            scatter_pairs(loads, first, second, n, buffer)


@jit
def wall_forces(grains, loads, walls, contacts, m, buffer, constants, elastic_rolling):
    """Loads of all grain-wall contacts; `walls.force` is set to this step's forces of the grains on each wall."""
    walls.force[:] = 0.0
    for k0 in range(0, m, BLOCK):
        n = min(k0 + BLOCK, m) - k0
        first = contacts.first[k0 : k0 + n]
        second = contacts.second[k0 : k0 + n]
        c = contacts.block[k0 * ROWS : (k0 + BLOCK) * ROWS]
        gather_walls(grains, walls, first, second, n, buffer, c, elastic_rolling)
        contact_stage(n, buffer, c, constants.dt, constants.one, constants.zero, constants.tiny)
        if elastic_rolling:
            rolling_stage(n, buffer, c, constants.dt, constants.one, constants.tiny)
        scatter_walls(loads, walls, first, second, n, buffer, c, elastic_rolling)


@jit
def rebuild(grains, period, walls, skin, pairs, wall_pairs, spare, wall_spare):
    """Remake both outer lists, carrying history. Returns FINISHED, or why not (then nothing has changed)."""
    if not is_sound(grains):
        return BLEW_UP
    if find_pairs(grains, period, skin, spare.row, spare.partner) < 0:
        return PAIRS_FULL
    if find_wall_pairs(grains, walls, skin, wall_spare.row, wall_spare.partner) < 0:
        return WALL_PAIRS_FULL
    carry_history(pairs, spare, True)
    carry_history(wall_pairs, wall_spare, False)
    copy_list(spare, pairs)
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
    pairs,
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
    elastic_rolling,
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
    periodic = period[0] > 0.0 or period[1] > 0.0 or period[2] > 0.0
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
            save_history(contacts, m, pairs.history)
            save_history(wall_contacts, m_walls, wall_pairs.history)
            m = 0
            m_walls = 0
            reach = min(max(2.2 * fastest * dt * PRUNE_STEPS, LEAST_REACH * skin), MOST_REACH * skin)
            if 2.0 * list_age[0] + reach > skin and list_age[0] < LISTS_STALE:
                list_age[0] = max(farthest(grains, origin), list_age[1])  # the bound adds up the fastest grain of every step
            if 2.0 * list_age[0] + reach > skin:
                reason = rebuild(grains, period, walls, skin, pairs, wall_pairs, spare, wall_spare)
                if reason != FINISHED:
                    break
                n_rebuilds += 1
                list_age[:] = 0.0
                for i in range(origin.shape[0]):
                    for a in range(3):
                        origin[i, a] = grains[GRAIN * i + a]
            m = prune_pairs(grains, period, pairs, reach, contacts, pair_table, n_materials, material)
            m_walls = prune_walls(grains, walls, wall_pairs, reach, wall_contacts, pair_table, n_materials, material)
            n_prunings += 1
        pair_forces(grains, loads, contacts, m, period, buffer, constants, elastic_rolling, periodic)
        wall_forces(grains, loads, walls, wall_contacts, m_walls, buffer, constants, elastic_rolling)
        carry_glued(grains, loads, walls, glued, carrier)
        mean_force += walls.force
        wall_speed = move_walls(walls, dt)
        fastest = integrate(grains, loads, gravity, dt, constants.zero) + wall_speed
        travel += fastest * dt
        list_age[1] += wall_speed * dt
        done += 1
        if fastest > speed_limit:
            reason = BLEW_UP
            break
    save_history(contacts, m, pairs.history)
    save_history(wall_contacts, m_walls, wall_pairs.history)
    list_age[0] += travel
    mean_force /= max(done, 1)
    return reason, done, n_rebuilds, n_prunings
