"""Result of one run of either code, and our own code's loop over samples."""

import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

import dem


@dataclass(frozen=True, kw_only=True)
class Run:
    """Curves and cost of a run.

    Attributes
    ----------
    times_s : (k,) of the samples. values : quantity -> (k,). n_grains : at the start. grain_steps : steps, summed over the grains
    that were there. n_steps, time_step_s : of the run. wall_s, processor_s : of the time loop on one thread, without set-up; other
    jobs of the machine lengthen the first.
    """

    times_s: np.ndarray
    values: dict[str, np.ndarray]
    n_grains: int
    grain_steps: float
    n_steps: int
    time_step_s: float
    wall_s: float
    processor_s: float


def steps_per_sample(sample_s: float, time_step_s: float) -> int:
    """Number of steps from one sample to the next.

    Raises
    ------
    ValueError : it is not whole, so that the codes would be sampled at other times.
    """
    steps = sample_s / time_step_s
    if round(steps) < 1 or abs(steps - round(steps)) > 1e-6 * steps:
        raise ValueError(f"sample_s is {sample_s}; allowed: a whole multiple of time_step_s = {time_step_s}.")
    return round(steps)


def grain_steps(n_grains: np.ndarray, steps: int) -> float:
    """Steps summed over the grains; n_grains (k,) at samples `steps` apart."""
    return float(steps * 0.5 * (n_grains[1:] + n_grains[:-1]).sum())


def sampled(
    simulation: dem.Simulation, look: Callable[[dem.Simulation], dict[str, float]], duration_s: float, sample_s: float
) -> Run:
    """Run our code and sample it.

    Parameters
    ----------
    look : quantities of the simulation now, "grains" among them. duration_s, sample_s : whole numbers of steps.
    """
    steps = steps_per_sample(sample_s, simulation.time_step_s)
    times, rows, n_grains = [0.0], [look(simulation)], simulation.n_grains
    simulation.advance(1)  # not timed: it loads the kernels
    wall_s = processor_s = 0.0
    for k in range(1, round(duration_s / sample_s) + 1):
        begin, begin_processor = time.perf_counter(), time.process_time()
        simulation.advance(k * steps - simulation.n_steps)
        wall_s += time.perf_counter() - begin
        processor_s += time.process_time() - begin_processor
        times.append(simulation.time_s)
        rows.append(look(simulation))
    values = {name: np.array([row[name] for row in rows]) for name in rows[0]}
    return Run(
        times_s=np.array(times),
        values=values,
        n_grains=n_grains,
        grain_steps=grain_steps(values["grains"], steps),
        n_steps=simulation.n_steps,
        time_step_s=simulation.time_step_s,
        wall_s=wall_s,
        processor_s=processor_s,
    )
