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

from dem.bodies import carry_glued, geometry_ahead, move_bodies, sum_forces
from dem.jit import jit
from dem.layout import BLOCK, GrainArrays, aligned_zeros
from dem.lists import blocks, surfaces
from dem.lists.allowance import allow_inner
from dem.step import loop, schedule, vectors

REPEATS, WINDOWS, STEPS = 300, 7, 4000


@jit
def gather(n, grains, contacts, buffer, access):
    """Gather all pairs n times."""
    for _ in range(n):
        for k0 in range(0, contacts.count[0] - BLOCK + 1, BLOCK):
            vectors.gather_pairs(grains, contacts.first[k0 : k0 + BLOCK], contacts.second[k0 : k0 + BLOCK], BLOCK, buffer, access)


@jit
def contact(n, grains, contacts, buffer, model):
    """Run the gather and contact stages of all pairs n times."""
    for _ in range(n):
        for k0 in range(0, contacts.count[0] - BLOCK + 1, BLOCK):
            first, second = contacts.first[k0 : k0 + BLOCK], contacts.second[k0 : k0 + BLOCK]
            vectors.gather_pairs(grains, first, second, BLOCK, buffer, model.access)
            schedule.contact_loads(BLOCK, k0, buffer, contacts, model.laws)


@jit
def scatter(n, loads, contacts, buffer):
    """Scatter all pairs n times."""
    for _ in range(n):
        for k0 in range(0, contacts.count[0] - BLOCK + 1, BLOCK):
            vectors.scatter_pairs(loads, contacts.first[k0 : k0 + BLOCK], contacts.second[k0 : k0 + BLOCK], BLOCK, buffer, None)


@jit
def wall(n, run, dt):
    """Contacts with surfaces and the bodies' motion n times."""
    state, scene, scratch = run.state, run.scene, run.scratch
    workspace = scratch.buffers[0], scratch.places[0], scratch.force[0], scratch.torque[0], scratch.near
    for _ in range(n):
        geometry_ahead(run.scene, dt, run.scratch.geometry[:1])
        schedule.surface_forces(
            0, scratch.geometry[0], state.grains, state.loads, run.lists.surfaces.contacts, scene.surfaces, scene.rigid,
            scene.bodies.velocity, workspace, run.model.access, run.model.laws,
        )  # fmt: skip
        sum_forces(run.scene, run.scratch.force, 1)
        carry_glued(run.state.grains, run.state.loads, run.scene)
        move_bodies(run.scene, dt)


@jit
def integrate(n, grains, loads, which, gravity, dt, zero):
    """Integrate the motion n times."""
    for _ in range(n):
        vectors.integrate(grains, loads, which, gravity, dt, zero)


@jit
def prune(n, run, skin):
    """Save the springs, set the allowances and prune the lists n times."""
    for _ in range(n):
        schedule.save(run.lists.pairs.contacts, run.lists.pairs.outer.history, None)
        allow_inner(run.state.grains, run.lists, run.model.step_s, skin, run.model.reach_m)
        schedule.prune(run.state, run.lists, run.model, None)


@jit
def rebuild(n, run, limits):
    """Rebuild the outer lists n times."""
    for _ in range(n):
        loop.rebuild(run, limits)


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
    state, model, scratch, dt = s._state, s._runner.model, s._runner.scratch(), s.time_step_s
    pairs, at_surfaces = state.lists.pairs, state.lists.surfaces
    blocks.common_constants(state.view(), pairs.contacts, model)
    skin = s._runner.skin
    allow_inner(state.grains, state.lists, dt, skin, model.reach_m)
    schedule.prune(state.view(), state.lists, model, None)
    surfaces.prune_surfaces(state.view(), state.surfaces, None, state.lists, loop.LEAST_BODY * skin, model, None)
    *grains, loads = (copied(values, quarter) for quarter, values in enumerate((*state.grains, state.loads)))
    grains, buffer = GrainArrays(*grains), scratch.buffers[0]
    run = schedule.Run(state.view()._replace(grains=grains, loads=loads), state.scene(), state.lists, model, scratch)
    stages = {
        "gather": best_us(gather, grains, pairs.contacts, buffer, model.access),
        "contact": best_us(contact, grains, pairs.contacts, buffer, model),
        "scatter": best_us(scatter, loads, pairs.contacts, buffer),
        "walls": best_us(wall, run, dt * 1e-9),
        "integrate": best_us(integrate, grains, loads, pairs.outer.order, state.gravity, dt * 1e-9, model.laws.numbers.zero),
    }
    stages["contact"] -= stages["gather"]
    n_pairs, n_wall_contacts = int(pairs.contacts.count.sum()), int(at_surfaces.contacts.count.sum())
    stages["inner list"] = prunings * best_us(prune, run, skin)
    limits = loop.Limits(1, skin, s._runner.largest_allowance, s._runner.speed_limit)
    stages["outer list"] = rebuilds * best_us(rebuild, run, limits, repeats=REPEATS // 10)
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
