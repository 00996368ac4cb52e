"""What a body costs: a disc of 700 triangles and a plate of none, of one area, pressed into a bed, at rest and turning.

    python benchmarks/body.py [mean grain radius in mm, by default 2.1: 86 000 grains]

A plate that turns stirs the bed as the disc does, so the two tell what the triangles cost from what moving grains cost. Windows of
all states alternate, and each state has several copies, since how arrays lie in memory changes the speed by 5 %. The last line is
JSON.
"""

import json
import math
import sys
import time
from dataclasses import replace

import numpy as np
from wheel_peer import BED, WHEEL_FRICTION, soil_of

from dem import Body, Box, Motion, Simulation, packed, solids, unpacked
from dem.experiments import soil_bed
from dem.experiments.soil import Engine

RADIUS_M, WIDTH_M, SIDES = 0.055, 0.08, 175
PRESSING_M_S, DEPTH_M, TURNING_RAD_S = 0.1, 0.03, 0.2
REST_STEPS, TURN_STEPS = 20_000, 5000
COPIES, ROUNDS, WINDOW_STEPS = 3, 8, 400
#: The state to which the others are compared.
ALONE = "bed at rest"


def disc(x_m: float, y_m: float, bottom_m: float):
    """A disc that lies flat, of 4 SIDES triangles."""
    shape = solids.cylinder(RADIUS_M, WIDTH_M, SIDES)
    return replace(shape, position_m=(x_m, y_m, bottom_m + 0.5 * WIDTH_M))


def plate(x_m: float, y_m: float, bottom_m: float):
    """A square of the disc's area."""
    half = 0.5 * math.sqrt(math.pi) * RADIUS_M
    return Box(low_m=(x_m - half, y_m - half, bottom_m), high_m=(x_m + half, y_m + half, bottom_m))


def pressed(bed: soil_bed.SoilBed, make) -> Simulation:
    """The bed with a body that was pressed into it and held until all is at rest."""
    simulation = bed.copy()
    touching_m = float(simulation.grains.positions_m[:, 2].max()) + 1.1 * float(simulation.grains.radii_m.max())
    shape = make(0.5 * BED.length_m, 0.5 * BED.width_m, touching_m)
    down = Motion(velocity_m_s=(0.0, 0.0, -PRESSING_M_S))
    simulation.add_wall(Body(name="body", material=soil_bed.TOOL_MATERIAL, shape=shape, motion=down))
    simulation.run((touching_m - bed.level_m + DEPTH_M) / PRESSING_M_S)
    simulation.move_wall("body", (0.0, 0.0, 0.0))
    simulation.advance(REST_STEPS)
    return simulation


def states(bed: soil_bed.SoilBed) -> dict[str, Simulation]:
    """State -> simulation; a prepared bed still rings a little."""
    made = {"bed as prepared": bed.copy(), ALONE: bed.copy()}
    made[ALONE].advance(REST_STEPS)
    for name, make in (("plate", plate), ("disc", disc)):
        held = pressed(bed, make)
        turning = unpacked(packed(held))
        turning.turn_wall("body", (0.0, 0.0, TURNING_RAD_S))
        turning.advance(TURN_STEPS)
        made |= {f"{name} held": held, f"{name} turning": turning}
    return made


def window_s(simulation: Simulation) -> float:
    """Processor time of a step."""
    start = time.process_time()
    simulation.advance(WINDOW_STEPS)
    return (time.process_time() - start) / WINDOW_STEPS


def main() -> None:
    """Make the states, measure them in turns, print a row each."""
    soil = soil_of(1e-3 * float(sys.argv[1]) if len(sys.argv) > 1 else 2.1e-3)
    bed = soil_bed.prepare(soil, BED, Engine(time_step_rayleigh_ratio=0.35, rolling_model="type_c"), seed=1)
    bed.simulation.set_interaction("soil", soil_bed.TOOL_MATERIAL, soil.interaction(WHEEL_FRICTION))
    made = states(bed)
    seconds = {name: np.zeros((COPIES, ROUNDS)) for name in made}
    for copy in range(COPIES):
        copies = {name: unpacked(packed(simulation)) for name, simulation in made.items()}
        for k in range(-1, ROUNDS):  # the first round warms up
            for name, simulation in copies.items():
                seconds[name][copy, k] = window_s(simulation)
    rows = []
    for name, simulation in made.items():
        ratios = np.median(seconds[name] / seconds[ALONE], axis=1)
        touching = len(simulation.wall_contacts("body")) if "body" in simulation.wall_names else 0
        row = {"state": name, "grains": simulation.n_grains, "touching": touching}
        rows.append(row | {"ms_per_step": round(1e3 * float(np.median(seconds[name])), 3), "over_bed": ratios.round(3).tolist()})
        print(rows[-1], flush=True)
    print(json.dumps(rows))


if __name__ == "__main__":
    main()
