"""Cost of generality: the base set compared with distributed radii, two materials, type C, float64 contacts, adhesion and dimers.

    python benchmarks/variants.py

One thread, the states of `engine.py`, alternating windows of all variants. The dimers have as many spheres of the same size as the
base set. The last line is JSON.
"""

import json
from dataclasses import replace

import numpy as np
from engine import QUICK_G, SETUP, STATES, WINDOW_STEPS, base_set, lifted, measure, prepare, window

from dem import Clump, Factory, Simulation, TubeRegion
from dem.experiments import angle_of_repose
from dem.experiments.soil import Engine

SOIL = base_set(QUICK_G)
N_WINDOWS = 12
#: Chooses the code; the states are made without adhesion, so that all variants do the same work.
ADHESIVE_STRESS_PA = 0.1


def two_materials() -> dict[str, Simulation]:
    """Create the base set with half of the grains of a second material with the same properties."""
    half = SETUP.n_particles // 2
    simulation = angle_of_repose.build(SOIL, replace(SETUP, n_particles=half), Engine(), seed=1)
    for other in ("plate", "tube"):
        simulation.set_interaction("plate", other, SOIL.interaction())
    top = float((simulation.grains.positions_m[:, 2] + simulation.grains.radii_m).max())
    region = TubeRegion(radius_m=simulation.wall("tube").radius_m, bottom_m=top)
    simulation.add_factory(Factory(n_grains=half, region=region, sizes=SOIL.sizes, material="plate", seed=2))
    return lifted(simulation, STATES[:2])


def dimers() -> dict[str, Simulation]:
    """Create as many spheres of the same size as the base set has, two by two."""
    shape = Clump.preset("dimer")
    soil = replace(SOIL, radius_m=SOIL.radius_m / shape.smallest_ratio, shape=shape)
    setup = replace(SETUP, n_particles=round(SETUP.n_particles / shape.n_spheres))
    return lifted(angle_of_repose.build(soil, setup, Engine(), seed=1), STATES[:2])


def main() -> None:
    """Measure and print the speeds."""
    ready = {
        "base set": prepare(SOIL, STATES[:2]),
        "radii spread by 10 %": prepare(replace(SOIL, radius_sd_ratio=0.1), STATES[:2]),
        "two materials": two_materials(),
        "type C": prepare(SOIL, STATES[:2], rolling_model="type_c"),
        "float64 contacts": prepare(SOIL, STATES[:2], precision="float64"),
        "pull-off force": prepare(replace(SOIL, adhesive_stress_pa=ADHESIVE_STRESS_PA), STATES[:2]),
        "JKR": prepare(replace(SOIL, adhesive_stress_pa=ADHESIVE_STRESS_PA), STATES[:2], adhesion="jkr"),
        "dimers": dimers(),
    }
    engines = {
        name: {state: lambda s=simulation: window(s, WINDOW_STEPS) for state, simulation in by_state.items()}
        for name, by_state in ready.items()
    }
    speeds, costs = measure(engines, N_WINDOWS), {}
    for state, by_name in speeds.items():
        base = np.array(by_name["base set"])
        costs[state] = {name: round(float(np.median(base / np.array(samples))), 3) for name, samples in by_name.items()}
        for name, samples in by_name.items():
            print(f"{state:16s} {name:22s} {np.median(samples):6.1f} M grain-steps/s   cost {costs[state][name]:.2f}")
    print(json.dumps({"cost over the base set": costs}))


if __name__ == "__main__":
    main()
