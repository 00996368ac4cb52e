"""Cost per grain-step from 3000 to 300 000 grains, and one large simulation on several threads.

    python benchmarks/scale.py [largest number of grains]

A bed of grains comes to rest in a wide box; the paper's base set, type A. The last line is JSON.
"""

import json
import os
import sys
import time

import numpy as np

from dem import Box, BoxRegion, Factory, Interaction, Material, Simulation, Sizes

RADIUS_M = 50e-6
DEPTH_GRAINS = 24
SETTLE_S = 0.04
WINDOW_S = 1.5


def bed(n_grains: int, threads: int) -> Simulation:
    """Grains dropped into a box, some DEPTH_GRAINS deep, nearly at rest."""
    side = RADIUS_M * np.sqrt(n_grains / DEPTH_GRAINS * 4.0)
    half = 0.5 * side
    walls = [
        Box(name="floor", material="soil", low_m=(-half, -half, 0.0), high_m=(half, half, 0.0)),
        *(
            Box(name=f"{axis}{sign:+d}", material="soil", low_m=low, high_m=high)
            for axis, sign, low, high in (
                ("x", -1, (-half, -half, 0.0), (-half, half, 1.0)),
                ("x", 1, (half, -half, 0.0), (half, half, 1.0)),
                ("y", -1, (-half, -half, 0.0), (half, -half, 1.0)),
                ("y", 1, (-half, half, 0.0), (half, half, 1.0)),
            )
        ),
    ]
    simulation = Simulation(
        materials={"soil": Material(density_kg_m3=3000.0, poisson_ratio=0.2, shear_modulus_pa=5e5)},
        interactions={("soil", "soil"): Interaction(restitution=0.5, static_friction=0.3, rolling_friction=0.1)},
        smallest_radius_m=RADIUS_M,
        walls=walls,
        time_step_rayleigh_ratio=0.2,
        threads=threads,
    )
    region = BoxRegion(low_m=(-half, -half), high_m=(half, half), bottom_m=0.0)
    sizes = Sizes(mean_m=RADIUS_M)
    simulation.add_factory(Factory(n_grains=n_grains, region=region, sizes=sizes, material="soil", seed=1))
    simulation.run(SETTLE_S)
    return simulation


def speed(simulation: Simulation) -> float:
    """Million grain-steps per second over about WINDOW_S."""
    steps, done, start = max(1, 10_000_000 // simulation.n_grains), 0, time.perf_counter()
    while time.perf_counter() - start < WINDOW_S:
        simulation.advance(steps)
        done += steps
    return done * simulation.n_grains / (time.perf_counter() - start) / 1e6


def memory_bytes(simulation: Simulation) -> int:
    """Bytes of all arrays that the simulation holds."""
    arrays = {}

    def collect(value):
        if isinstance(value, np.ndarray):
            base = value if value.base is None else value.base
            arrays[id(base)] = base.nbytes
        elif isinstance(value, tuple):
            for part in value:
                collect(part)

    for value in vars(simulation).values():
        collect(value)
    return sum(arrays.values())


def main() -> None:
    """Measure and print."""
    largest = int(sys.argv[1]) if len(sys.argv) > 1 else 300_000
    rows = []
    for n in [n for n in (3000, 10_000, 30_000, 100_000, 300_000) if n <= largest]:
        simulation = bed(n, threads=1)
        samples = [speed(simulation) for _ in range(4)]
        rows.append({"grains": n, "m_grain_steps_per_s": round(float(np.median(samples)), 1)})
        rows[-1]["bytes_per_grain"] = round(memory_bytes(simulation) / n)
        print(rows[-1], flush=True)
    growth = rows[0]["m_grain_steps_per_s"] / rows[-1]["m_grain_steps_per_s"]
    print(f"cost per grain-step grows by {growth:.2f} from {rows[0]['grains']} to {rows[-1]['grains']} grains")

    n, threads = min(largest, 100_000), min(2, os.cpu_count())
    beds = {k: bed(n, threads=k) for k in (1, threads)}
    pairs = [(speed(beds[1]), speed(beds[threads])) for _ in range(6)]
    ratios = [several / one for one, several in pairs]
    print(f"{n} grains on {threads} threads: {np.median(ratios):.2f} times one thread ({min(ratios):.2f} to {max(ratios):.2f})")
    print(
        json.dumps({"scale": rows, "growth": round(growth, 2), "threads": threads, "speed_up": round(float(np.median(ratios)), 2)})
    )


if __name__ == "__main__":
    main()
