"""A wheel with grousers rolls on a bed of a million grains: time of a step, and memory.

    python benchmarks/million.py [number of tiles along x and y]

The bed consists of copies of a tile that came to rest once, see `scale.py`; the wheel, 30 grains in radius, is driven through its
surface. The last line is JSON.
"""

import json
import os
import resource
import sys
import time

import scale

from dem import Body, Motion, solids

WHEEL_M, WIDTH_M, GROUSER_M = 60 * scale.RADIUS_M, 50 * scale.RADIUS_M, 6 * scale.RADIUS_M
SINKING_M_S, SPEED_M_S, SLIP, SUNK_M = 0.5, 0.05, 0.3, 8 * scale.RADIUS_M
STEPS = 400


def rolling(tile, side: int, threads: int):
    """Create a bed with a wheel in it, which pushed its way in."""
    simulation = scale.bed(tile, (side, side), threads, again_steps=0)
    top_m, middle_m = float(simulation.grains.positions_m[:, 2].max()) + scale.RADIUS_M, 0.5 * side * scale.SIDE_M
    axle_m = (middle_m, middle_m, top_m + WHEEL_M + GROUSER_M)
    shape = solids.wheel(WHEEL_M, WIDTH_M, 24, GROUSER_M, 2 * scale.RADIUS_M, 240, position_m=axle_m)
    rate_rad_s = SPEED_M_S / (WHEEL_M * (1.0 - SLIP))
    sinking = Motion(velocity_m_s=(SPEED_M_S, 0.0, -SINKING_M_S), angular_velocity_rad_s=(0.0, rate_rad_s, 0.0))
    simulation.add_wall(Body(name="wheel", material="soil", shape=shape, motion=sinking))
    simulation.run(SUNK_M / SINKING_M_S)
    simulation.move_wall("wheel", (SPEED_M_S, 0.0, 0.0))
    return simulation, len(shape.triangles)


def main() -> None:
    """Measure and print time and memory, with one thread and with two."""
    side = int(sys.argv[1]) if len(sys.argv) > 1 else 19
    tile, rows = scale.settled_tile(), []
    for threads in (1, min(2, os.cpu_count())):
        simulation, n_triangles = rolling(tile, side, threads)
        start = time.perf_counter()
        simulation.advance(STEPS)
        seconds = (time.perf_counter() - start) / STEPS
        size = {"grains": simulation.n_grains, "triangles": n_triangles, "on_wheel": len(simulation.wall_contacts("wheel"))}
        rows.append({**size, "threads": threads, "s_per_step": round(seconds, 4)})
        rows[-1]["ns_per_grain_step"] = round(1e9 * seconds / simulation.n_grains, 1)
        rows[-1]["arrays_mb"] = round(scale.memory_bytes(simulation) / 1e6)
        rows[-1]["peak_mb"] = round(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3)
        print(rows[-1], flush=True)
        del simulation
    print(json.dumps(rows))


if __name__ == "__main__":
    main()
