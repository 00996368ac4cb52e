"""Speed of the engine on the paper's base set, alone or compared with LIGGGHTS and LAMMPS.

    python benchmarks/engine.py --quick    # our engine only, under 45 s
    python benchmarks/engine.py            # compared with the installed peers (see benchmarks/README.md)

One thread. Every engine simulates the same grains at the same positions: a column at rest in its tube, the lift of the tube, and
the heap at rest. Time windows of the engines alternate, so that changes of the machine's speed affect all of them. The printed
values are medians over the windows in million grain-steps per second, including neighbour lists and walls. The last line is JSON.
"""

import argparse
import copy
import json
import platform
import time
from importlib.metadata import version

import numpy as np
from peers import Lammps, Liggghts

from dem import Simulation, compiled
from dem.experiments import angle_of_repose
from dem.experiments.soil import Engine, Soil

#: Shear modulus in Pa: the paper's for comparisons; a tenth of it for --quick, which reaches the states in a third of the steps.
PAPER_G, QUICK_G = 5e7, 5e6
SETUP = angle_of_repose.Setup(
    n_particles=3000,
    tube_diameter_ratio=15.0,
    plate_half_width_ratio=80.0,
    lift_speed_m_s=5e-3,
    max_time_s=0.7,
    scale_radius_m=50e-6,
)
FILL_S, LIFT_S = 0.09, 0.05
#: Maximum time in s until the filled column is considered at rest.
REST_S = 0.3
STATES = ("column at rest", "tube lifted", "heap at rest")
WINDOW_STEPS = 1000
#: Steps before timing: the arrays of a copied simulation are not aligned to cache lines until its grains are sorted in space.
WARM_UP_STEPS = 5000


def base_set(shear_modulus_pa: float) -> Soil:
    """The paper's base set."""
    return Soil(
        radius_m=50e-6,
        density_kg_m3=3000.0,
        poisson_ratio=0.2,
        shear_modulus_pa=shear_modulus_pa,
        static_friction=0.3,
        rolling_friction=0.1,
        restitution=0.5,
    )


def prepare(soil: Soil, states, **engine) -> dict[str, Simulation]:
    """Prepare one simulation per state, ready to continue; the step is 0.2 Rayleigh times."""
    return lifted(angle_of_repose.build(soil, SETUP, Engine(**engine), seed=1), states)


def lifted(simulation: Simulation, states) -> dict[str, Simulation]:
    """Prepare one simulation per state, from grains before their fall."""
    simulation.run(FILL_S)
    ready = {STATES[0]: copy.deepcopy(simulation)}
    ready[STATES[0]].run(REST_S, until=Simulation.is_static)
    simulation.move_wall("tube", (0.0, 0.0, SETUP.lift_speed_m_s))
    simulation.run(LIFT_S)
    ready[STATES[1]] = copy.deepcopy(simulation)
    if STATES[2] in states:
        simulation.run(SETUP.max_time_s, until=lambda s: angle_of_repose.tube_is_clear(s) and s.is_static())
        ready[STATES[2]] = simulation
    for state in ready.values():
        state.advance(WARM_UP_STEPS)
    return ready


def plain_twin(simulation: Simulation) -> Simulation:
    """Copy a simulation, to continue from the same state in plain numba."""
    twin = copy.deepcopy(simulation)
    compiled.ensure(vector_code=False, periodic=False)
    twin._runner.access = twin._runner.access._replace(vector=None)
    twin.advance(WARM_UP_STEPS)
    return twin


def window(simulation: Simulation, steps: int) -> float:
    """Million grain-steps per second over a number of steps."""
    start = time.perf_counter()
    simulation.advance(steps)
    return steps * simulation.n_grains / (time.perf_counter() - start) / 1e6


def measure(engines: dict, n_windows: int) -> dict[str, dict[str, list[float]]]:
    """Return {state: {engine: speeds}}, engines alternating; `engines` maps a name to {state: function that times a window}."""
    speeds = {state: {name: [] for name in engines} for state in next(iter(engines.values()))}
    for _ in range(n_windows):
        for state, by_engine in speeds.items():
            for name, samples in by_engine.items():
                samples.append(engines[name][state]())
    return speeds


def spread(samples) -> dict[str, float]:
    """Median, minimum and maximum of the windows."""
    return {name: round(float(value(samples)), 2) for name, value in (("median", np.median), ("least", np.min), ("most", np.max))}


def ratios(by_engine) -> dict[str, dict[str, float]]:
    """Ratio of our speed to each peer's, from consecutive windows of one state."""
    ours = np.array(by_engine["virtual-soil"])
    return {name: spread(ours / samples) for name, samples in by_engine.items() if not name.startswith("virtual-soil")}


def show(speeds) -> None:
    """Print a table: median and range of the windows, and the ratios to the peers with their range."""
    for state, by_engine in speeds.items():
        print(state)
        for name, samples in by_engine.items():
            print(f"  {name:24s} {np.median(samples):7.2f} M grain-steps/s   ({min(samples):.2f} to {max(samples):.2f})")
        for name, ratio in ratios(by_engine).items():
            print(f"  ratio to {name:15s} {ratio['median']:7.1f}   ({ratio['least']:.1f} to {ratio['most']:.1f})")


def main() -> None:
    """Measure and print the speeds."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="our own figures only")
    quick = parser.parse_args().quick
    start = time.perf_counter()
    states = STATES[:2] if quick else STATES
    ours = {"virtual-soil": prepare(base_set(QUICK_G if quick else PAPER_G), states)}
    if quick:
        ours["virtual-soil, plain numba"] = {state: plain_twin(s) for state, s in ours["virtual-soil"].items()}
    engines = {
        name: {state: lambda s=simulation: window(s, WINDOW_STEPS) for state, simulation in ready.items()}
        for name, ready in ours.items()
    }
    versions = {name: version(name) for name in ("virtual-soil", "numba", "numpy")}
    if not quick:
        for peer in (Liggghts(base_set(PAPER_G), SETUP), Lammps(base_set(PAPER_G), SETUP)):
            if peer.missing():
                print(f"{peer.name}: not installed; {peer.how_to_install}")
                continue
            for state in states:
                peer.start(state, ours["virtual-soil"][state])
            engines[peer.name] = {state: lambda p=peer, s=state: p.window(s) for state in states}
            versions[peer.name] = peer.version()
    speeds = measure(engines, n_windows=12 if quick else 8)
    show(speeds)
    result = {
        "unit": "million grain-steps per second, one thread; ratios: ours over a peer's",
        "shear_modulus_pa": QUICK_G if quick else PAPER_G,
        "machine": f"{platform.machine()}, {processor()}",
        "versions": versions,
        "speeds": {state: {name: spread(v) for name, v in by.items()} for state, by in speeds.items()},
        "ratios": {state: ratios(by) for state, by in speeds.items()},
        "seconds": round(time.perf_counter() - start, 1),
    }
    print(json.dumps(result))


def processor() -> str:
    """Name of the processor, if the system provides it."""
    try:
        with open("/proc/cpuinfo", encoding="utf-8") as file:
            return next(line.split(":")[1].strip() for line in file if line.startswith("model name"))
    except (OSError, StopIteration):
        return platform.processor()


if __name__ == "__main__":
    main()
