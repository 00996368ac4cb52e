"""Cost per grain-step from 3000 to 300 000 grains, and one large simulation on several threads.

    python benchmarks/scale.py [largest number of grains]

A periodic bed of the paper's base set (type A) comes to rest once. The larger beds consist of copies of it, so that every grain has
the same neighbours in all of them. The last line is JSON.
"""

import json
import os
import sys
import time

import numpy as np

from dem import Box, BoxRegion, Factory, Interaction, Material, Simulation, Sizes

RADIUS_M = 50e-6
TILE_GRAINS, DEPTH_GRAINS = 3000, 24
SIDE_M = RADIUS_M * np.sqrt(TILE_GRAINS / DEPTH_GRAINS * 4.0)
SETTLE_S, AGAIN_STEPS = 0.2, 2000
WINDOW_GRAIN_STEPS = 60_000_000
#: Number of copies along x and y.
COPIES = ((1, 1), (2, 2), (3, 3), (6, 6), (10, 10))


def empty_bed(copies: tuple[int, int], threads: int) -> Simulation:
    """Create a floor with periodic boundaries along x and y."""
    far = 2.0 * SIDE_M * max(copies)
    return Simulation(
        materials={"soil": Material(density_kg_m3=3000.0, poisson_ratio=0.2, shear_modulus_pa=5e5)},
        interactions={("soil", "soil"): Interaction(restitution=0.5, static_friction=0.3, rolling_friction=0.1)},
        smallest_radius_m=RADIUS_M,
        walls=[Box(name="floor", material="soil", low_m=(-far, -far, 0.0), high_m=(far, far, 0.0))],
        period_m=(copies[0] * SIDE_M, copies[1] * SIDE_M, 0.0),
        time_step_rayleigh_ratio=0.2,
        threads=threads,
    )


def settled_tile() -> Simulation:
    """Create a tile of TILE_GRAINS grains at rest, about DEPTH_GRAINS deep."""
    simulation = empty_bed((1, 1), threads=1)
    region = BoxRegion(low_m=(0.0, 0.0), high_m=(SIDE_M, SIDE_M), bottom_m=0.0)
    simulation.add_factory(Factory(n_grains=TILE_GRAINS, region=region, sizes=Sizes(mean_m=RADIUS_M), material="soil", seed=1))
    simulation.run(SETTLE_S)
    return simulation


def bed(tile: Simulation, copies: tuple[int, int], threads: int, again_steps: int = AGAIN_STEPS) -> Simulation:
    """Create a bed from adjacent copies of a tile, at rest, and go on for some steps."""
    simulation = empty_bed(copies, threads)
    grains = tile.grains
    corners = [(x * SIDE_M, y * SIDE_M, 0.0) for x in range(copies[0]) for y in range(copies[1])]
    places = np.concatenate([grains.positions_m + corner for corner in corners])
    radii, velocities = np.tile(grains.radii_m, len(corners)), np.tile(grains.velocities_m_s, (len(corners), 1))
    simulation.add_grains(places, radii, "soil", velocities)
    simulation.advance(again_steps)
    return simulation


def speed(simulation: Simulation) -> float:
    """Million grain-steps per second of one call over WINDOW_GRAIN_STEPS."""
    steps, start = WINDOW_GRAIN_STEPS // simulation.n_grains, time.perf_counter()
    simulation.advance(steps)
    return steps * simulation.n_grains / (time.perf_counter() - start) / 1e6


def memory_bytes(simulation: Simulation) -> int:
    """Total size in bytes of all arrays of the simulation."""
    arrays = {}

    def collect(value):
        if isinstance(value, np.ndarray):
            base = value if value.base is None else value.base
            arrays[id(base)] = base.nbytes
        elif isinstance(value, tuple):
            for part in value:
                collect(part)

    for value in vars(simulation._state).values():
        collect(value)
    return sum(arrays.values())


def main() -> None:
    """Measure and print the costs."""
    largest = int(sys.argv[1]) if len(sys.argv) > 1 else 300_000
    tile, rows = settled_tile(), []
    for copies in [copies for copies in COPIES if TILE_GRAINS * np.prod(copies) <= largest]:
        simulation = bed(tile, copies, threads=1)
        n, samples = simulation.n_grains, [speed(simulation) for _ in range(4)]
        rows.append({"grains": n, "m_grain_steps_per_s": round(float(np.median(samples)), 1)})
        rows[-1]["bytes_per_grain"] = round(memory_bytes(simulation) / n)
        print(rows[-1], flush=True)
    growth = rows[0]["m_grain_steps_per_s"] / rows[-1]["m_grain_steps_per_s"]
    print(f"cost per grain-step grows by {growth:.2f} from {rows[0]['grains']} to {rows[-1]['grains']} grains")

    n, threads = min(rows[-1]["grains"], 108_000), min(2, os.cpu_count())
    copies = next(copies for copies in COPIES if TILE_GRAINS * np.prod(copies) == n)
    beds = {k: bed(tile, copies, threads=k) for k in (1, threads)}
    pairs = [(speed(beds[1]), speed(beds[threads])) for _ in range(6)]
    ratios = [several / one for one, several in pairs]
    print(f"{n} grains on {threads} threads: {np.median(ratios):.2f} times one thread ({min(ratios):.2f} to {max(ratios):.2f})")
    print(
        json.dumps({"scale": rows, "growth": round(growth, 2), "threads": threads, "speed_up": round(float(np.median(ratios)), 2)})
    )


if __name__ == "__main__":
    main()
