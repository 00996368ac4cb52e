"""Time of one step by stage: each kernel of the loop is timed separately on the state of a running simulation.

    python benchmarks/step.py

The paper's base set at rest in its tube, during the lift, and as a heap at rest; vector code, one thread. Stages are repeated many
times on a frozen state; the best of several windows counts. The time of list updates is divided by the steps between two updates.
The last line is JSON.
"""

import json
import time

import numpy as np
from engine import QUICK_G, STATES, base_set, prepare

from dem import walls
from dem.jit import jit
from dem.layout import BLOCK, GrainArrays, aligned_zeros
from dem.lists import blocks, grid, surfaces
from dem.step import loop, schedule, vectors
from dem.step.motion import carry_glued

REPEATS, WINDOWS, STEPS = 300, 7, 4000


@jit
def gather(n, grains, contacts, buffer):
    """Gather all pairs n times."""
    for _ in range(n):
        for k0 in range(0, contacts.count[0] - BLOCK + 1, BLOCK):
            vectors.gather_pairs(grains, contacts.first[k0 : k0 + BLOCK], contacts.second[k0 : k0 + BLOCK], BLOCK, buffer, None)


@jit
def contact(n, grains, contacts, buffer, constants):
    """Run the gather and contact stages of all pairs n times."""
    for _ in range(n):
        for k0 in range(0, contacts.count[0] - BLOCK + 1, BLOCK):
            vectors.gather_pairs(grains, contacts.first[k0 : k0 + BLOCK], contacts.second[k0 : k0 + BLOCK], BLOCK, buffer, None)
            schedule.contact_loads(BLOCK, k0, buffer, contacts, constants, None)


@jit
def scatter(n, loads, contacts, buffer):
    """Scatter all pairs n times."""
    for _ in range(n):
        for k0 in range(0, contacts.count[0] - BLOCK + 1, BLOCK):
            vectors.scatter_pairs(loads, contacts.first[k0 : k0 + BLOCK], contacts.second[k0 : k0 + BLOCK], BLOCK, buffer, None)


@jit
def wall(n, grains, loads, wall_arrays, contacts, buffer, constants, options, dt, glued, carrier):
    """Wall contacts and the walls' motion n times."""
    n_walls = wall_arrays.kind.shape[0]
    wall_steps = schedule.WallSteps(np.empty((1, n_walls, 7)), np.zeros((1, n_walls, 3)), np.empty((1, 4 * BLOCK)))
    for _ in range(n):
        walls.later(wall_arrays, dt, wall_steps.geometry)
        schedule.wall_forces(
            0, 0, grains, loads, wall_arrays, contacts, wall_steps, buffer, wall_steps.places[0], constants, options, None
        )
        loop.sum_wall_forces(wall_arrays, wall_steps.force, 1)
        carry_glued(grains, loads, wall_arrays, glued, carrier)
        walls.move_walls(wall_arrays, dt)


@jit
def integrate(n, grains, loads, which, gravity, dt, zero):
    """Integrate the motion n times."""
    for _ in range(n):
        vectors.integrate(grains, loads, which, gravity, dt, zero)


@jit
def prune(n, grains, period, frequency, outer, reach, contacts, pair_table, n_materials, material):
    """Save the springs and prune the lists n times."""
    for _ in range(n):
        schedule.save(contacts, outer.history)
        schedule.prune(grains, period, frequency, False, outer, reach, contacts, pair_table, n_materials, material)


@jit
def rebuild(n, grains, period, wall_arrays, skin, pair_list, wall_pairs, spare, wall_spare, contacts):
    """Rebuild the outer lists n times."""
    for _ in range(n):
        loop.rebuild(grains, period, wall_arrays, skin, pair_list, wall_pairs, spare, wall_spare, contacts)


def copied(values: np.ndarray, quarter: int) -> np.ndarray:
    """Copy an array with the same alignment within a memory page as the simulation's own."""
    copy = aligned_zeros(values.size, values.dtype, quarter)
    copy[:] = values
    return copy


def best_us(function, *arguments, repeats: int = REPEATS) -> float:
    """Time of one repeat in microseconds, best of several windows."""
    function(1, *arguments)
    times = []
    for _ in range(WINDOWS):
        start = time.perf_counter()
        function(repeats, *arguments)
        times.append((time.perf_counter() - start) / repeats)
    return 1e6 * min(times)


def counted_steps(simulation) -> tuple[float, float, float]:
    """Return (microseconds per step, rebuilds and prunings per step) over STEPS steps."""
    totals, kernel = np.zeros(3), loop.advance

    def counting(*arguments):
        reason, done, n_rebuilds, n_prunings = kernel(*arguments)
        totals[:] += done, n_rebuilds, n_prunings
        return reason, done, n_rebuilds, n_prunings

    loop.advance = counting
    try:
        start = time.perf_counter()
        simulation.advance(STEPS)
        step_us = 1e6 * (time.perf_counter() - start) / STEPS
    finally:
        loop.advance = kernel
    return step_us, totals[1] / totals[0], totals[2] / totals[0]


def profile(s) -> dict[str, float]:
    """Time of every stage in microseconds per step."""
    step_us, rebuilds, prunings = counted_steps(s)
    fastest = float(np.linalg.norm(s.grains.velocities_m_s, axis=1).max())
    reach, wall_reach = loop.reaches(fastest * s.time_step_s, 0.0, s._skin)
    frequency, n_materials, dt = grid.frequencies(s._period), len(s.materials), s.time_step_s
    constants = s._constants
    lists = (s._pair_table, n_materials, s._material)
    blocks.common_constants(s._grains, s._contacts, *lists)
    schedule.prune(s._grains, s._period, frequency, False, s._pairs, reach, s._contacts, *lists)
    surfaces.prune_walls(s._grains, s._walls, s._wall_pairs, np.empty(0, np.int32), wall_reach, s._wall_contacts, *lists)
    *grains, loads = (copied(values, quarter) for quarter, values in enumerate((*s._grains, s._loads)))
    grains, buffer = GrainArrays(*grains), s._buffers[0]
    on_walls = (s._walls, s._wall_contacts, buffer, constants, s._options)
    for_lists = (grains, s._period, s._walls, s._skin, s._pairs, s._wall_pairs, s._spare, s._wall_spare, s._contacts)
    stages = {
        "gather": best_us(gather, grains, s._contacts, buffer),
        "contact": best_us(contact, grains, s._contacts, buffer, constants),
        "scatter": best_us(scatter, loads, s._contacts, buffer),
        "walls": best_us(wall, grains, loads, *on_walls, dt * 1e-9, s._glued, s._carrier),
        "integrate": best_us(integrate, grains, loads, s._pairs.order, s._gravity, dt * 1e-9, constants.zero),
    }
    stages["contact"] -= stages["gather"]
    n_pairs, n_wall_contacts = int(s._contacts.count.sum()), int(s._wall_contacts.count.sum())
    one_pruning = best_us(prune, grains, s._period, frequency, s._pairs, reach, s._contacts, *lists)
    stages["inner list"] = prunings * one_pruning
    stages["outer list"] = rebuilds * best_us(rebuild, *for_lists, repeats=REPEATS // 10)
    return {
        **{name: round(value, 2) for name, value in stages.items()},
        "sum": round(sum(stages.values()), 2),
        "whole step": round(step_us, 2),
        "pairs": n_pairs,
        "wall contacts": n_wall_contacts,
        "steps per pruning": round(1 / max(prunings, 1e-9), 1),
        "steps per rebuild": round(1 / max(rebuilds, 1e-9), 1),
    }


def main() -> None:
    """Profile all states and print."""
    ready = prepare(base_set(QUICK_G), STATES)
    result = {state: profile(simulation) for state, simulation in ready.items()}
    for name in next(iter(result.values())):
        print(f"{name:20s}" + "".join(f"{result[state][name]:14}" for state in result))
    print(json.dumps({"unit": "microseconds per step of 3000 grains", "states": result}))


if __name__ == "__main__":
    main()
