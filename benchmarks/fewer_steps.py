"""Methods to reduce the number of steps: saved steps, and effect on angle of repose and strength.

    python benchmarks/fewer_steps.py [number of seeds]

The paper's base set (3000 grains) a hundred times softer, and its shear slice at 500 Pa. The number of steps is
independent of the machine's load. The last line is JSON.
"""

import json
import math
import sys
from dataclasses import replace

import numpy as np
from engine import PAPER_G, SETUP, base_set

from dem import Factory, TubeRegion
from dem.experiments import angle_of_repose, direct_shear, specimen
from dem.experiments.soil import Engine
from dem.experiments.state import State, steps_in
from dem.measure.heap import measure_heap
from dem.measure.shear import strength

SOIL = base_set(PAPER_G)
HEAP_ENGINE = Engine(stiffness_reduction=100.0, time_step_rayleigh_ratio=0.4)
SLICE = direct_shear.Setup(
    length_ratio=60.0,
    height_ratio=32.0,
    width_ratio=5.0,
    displacement_ratio=9.0,
    normal_stress_pa=500.0,
    inertial_number=5e-3,
    frame_static_friction=0.0,
    preparation_friction_ratio=0.3,
    scale_radius_m=50e-6,
)
#: Last fraction of the displacement, over which the plateau is averaged.
PLATEAU = 1.0 / 3.0
PORTIONS = 5


def angle_deg(grains) -> float:
    """Angle of repose from the profile, in degrees."""
    return measure_heap(grains.positions_m, grains.radii_m).angle_profile_deg


def heap(seed: int, engine: Engine, state=None) -> dict:
    """Steps and angle of one heap, and the changes of both if the simulation continues to the end of the time."""
    last = {}
    made = angle_of_repose.run(SOIL, SETUP, engine, seed, lambda s, stage: last.update(simulation=s), state=state)
    simulation = last["simulation"]
    rest = steps_in(SETUP.max_time_s - made.simulated_time_s, simulation)
    simulation.advance(rest)
    return {
        "steps": made.n_steps,
        "angle_deg": angle_deg(made.grains),
        "steps to the end": made.n_steps + rest,
        "angle at the end": angle_deg(simulation.grains),
    }


def poured(seed: int, engine: Engine) -> State:
    """Pour the same grains in successive portions instead of one loose column."""
    n = SETUP.n_particles // PORTIONS
    simulation = angle_of_repose.build(SOIL, replace(SETUP, n_particles=n), engine, seed)
    tube = simulation.wall("tube")
    height = float(simulation.grains.positions_m[:, 2].max())
    fall_s = math.sqrt(2.0 * 2.0 * height / engine.gravity_m_s2)
    for k in range(1, PORTIONS):
        region = TubeRegion(radius_m=tube.radius_m, bottom_m=(1.0 + 0.6 * k) * height)
        factory = Factory(
            n_grains=n, region=region, sizes=SOIL.sizes, material="soil", seed=1000 * k + seed, time_s=2.0 * k * fall_s
        )
        simulation.add_factory(factory)
    simulation.run(2.0 * PORTIONS * fall_s)
    return State(simulation, "fill", steps_in(20.0 * fall_s, simulation), {"max_overlap_ratio": 0.0})


def shear(seed: int, inertial_number: float) -> dict:
    """Steps and strength of one sheared slice."""
    setup = replace(SLICE, inertial_number=inertial_number)
    reduction = specimen.stiffness_reduction(SOIL, setup, 5e3, 9.81)
    made = direct_shear.run(SOIL, setup, Engine(stiffness_reduction=reduction, time_step_rayleigh_ratio=0.3), seed)
    history = made.history
    found = strength(history["displacement_m"], history["shear_stress_pa"], history["plane_normal_stress_pa"], PLATEAU)
    return {"steps": made.n_steps, "stress_ratio": found.plateau_shear_stress_pa / found.plane_normal_stress_pa}


def mean(rows: list[dict]) -> dict:
    """Mean of every value over the seeds, and standard deviation of every value except steps."""
    result = {}
    for key in rows[0]:
        values = [row[key] for row in rows]
        result[key] = round(float(np.mean(values)), 3)
        if not key.startswith("steps") and len(values) > 1:
            result[f"{key} sd"] = round(float(np.std(values, ddof=1)), 3)
    return result


def main() -> None:
    """Measure and print the savings."""
    seeds = range(1, 1 + (int(sys.argv[1]) if len(sys.argv) > 1 else 3))
    heaps = {
        f"heap, step {ratio} T_R": [heap(seed, replace(HEAP_ENGINE, time_step_rayleigh_ratio=ratio)) for seed in seeds]
        for ratio in (0.1, 0.2, 0.4)
    }
    heaps["heap, step 0.4 T_R, poured"] = [heap(seed, HEAP_ENGINE, poured(seed, HEAP_ENGINE)) for seed in seeds]
    slices = {
        f"shear, inertial number {number}": [shear(seed, number) for seed in seeds] for number in (1e-3, 2e-3, 5e-3, 1e-2, 2e-2)
    }
    result = {name: mean(rows) for name, rows in {**heaps, **slices}.items()}
    for name, row in result.items():
        print(f"{name:32s}", row)
    print(json.dumps({"seeds": len(seeds), "means": result}))


if __name__ == "__main__":
    main()
