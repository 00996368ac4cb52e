"""A wheel on one bed in this engine and in LIGGGHTS: time of a step, and what the soil does to the wheel.

    python benchmarks/wheel_peer.py [grain radius in mm]

Both read the same grains and the same STL file, and move the wheel in the same way, in the same number of steps: it sinks, then it
travels at a slip at a constant depth. The bed is timed before the wheel comes, so that what a step of the wheel costs is seen too.
Both have the friction limit of LIGGGHTS, and rolling friction that brakes the relative rolling of two grains (type C, epsd2).
LIGGGHTS begins without the history of the contacts, and so comes to rest first. Both on one thread. The last line is JSON.
"""

import json
import sys
import tempfile
import time
from pathlib import Path
from typing import NamedTuple

import numpy as np

from dem import Body, Motion
from dem.experiments import soil_bed
from dem.experiments.soil import Engine, Soil
from dem.experiments.wheel import touching_height_m
from dem.experiments.wheel_setup import WheelShape
from virtual_soil.exports.rolling import converted
from virtual_soil.verification.peers import liggghts

SHAPE = WheelShape(radius_m=0.058, width_m=0.050)
BED = soil_bed.Setup(length_m=0.32, width_m=0.17, depth_m=0.11)
#: The wheel sinks to a depth below the bed's level and travels there.
SINKING_M_S, SINKAGE_M, SPEED_M_S, SLIP, TRAVEL_M = 0.2, 0.012, 0.1, 0.3, 0.012
STEPS_ALONE, SETTLE_STEPS, SAMPLES = 1000, 4000, 20
WHEEL_FRICTION, ROLLING_MODEL, TANGENTIAL_MODEL = 0.5, "type_c", "liggghts"
#: Neighbour skins of LIGGGHTS in grain radii that are tried; the fastest counts.
SKINS, TRIED_STEPS = (0.2, 0.4, 0.8), 300
#: Quantity of a sample -> LIGGGHTS' formula.
VALUES = {"drawbar_pull_n": "f_wheel[1]", "vertical_force_n": "f_wheel[3]", "torque_n_m": "-f_wheel[5]"}


class Course(NamedTuple):
    """Where the axle begins, touching the bed, and how far it goes down."""

    axle_m: tuple[float, float, float]
    down_m: float


def soil_of(radius_m: float) -> Soil:
    """The grains."""
    grain = {"radius_m": radius_m, "radius_sd_ratio": 0.1, "density_kg_m3": 2650.0, "poisson_ratio": 0.25, "shear_modulus_pa": 2e7}
    return Soil(**grain, static_friction=0.5, rolling_friction=0.1, restitution=0.5)


def course_over(bed: soil_bed.SoilBed) -> Course:
    """The wheel's way over a bed."""
    x, y = 0.5 * (BED.length_m - TRAVEL_M), 0.5 * BED.width_m
    z = touching_height_m(bed.simulation.grains, bed, SHAPE, x, y)
    return Course((x, y, z), z - SHAPE.radius_m - bed.level_m + SINKAGE_M)


def rate_rad_s() -> float:
    """Rate of turn of the travelling wheel."""
    return SPEED_M_S / (1.0 - SLIP) / SHAPE.radius_m


def ours(bed: soil_bed.SoilBed, soil: Soil, course: Course) -> dict:
    """Run the test in this engine: seconds a step without the wheel and with it, and the means of each sample (k, 3)."""
    simulation = bed.copy()
    simulation.set_interaction("soil", soil_bed.TOOL_MATERIAL, soil.interaction(WHEEL_FRICTION))
    start = time.perf_counter()
    simulation.advance(STEPS_ALONE)
    alone_s = (time.perf_counter() - start) / STEPS_ALONE
    surface = SHAPE.surface(soil.smallest_sphere_m, course.axle_m)
    down = Motion(velocity_m_s=(0.0, 0.0, -SINKING_M_S))
    simulation.add_wall(Body(name="wheel", material=soil_bed.TOOL_MATERIAL, shape=surface, motion=down))
    simulation.advance(steps(course.down_m / SINKING_M_S, simulation.time_step_s))
    simulation.move_wall("wheel", (SPEED_M_S, 0.0, 0.0))
    simulation.turn_wall("wheel", (0.0, rate_rad_s(), 0.0))
    every, rows, touching = steps(TRAVEL_M / SPEED_M_S, simulation.time_step_s) // SAMPLES, [], []
    start = time.perf_counter()
    for _ in range(SAMPLES):
        simulation.advance(every)
        force, torque = simulation.mean_wall_forces_n["wheel"], simulation.mean_wall_torques_n_m["wheel"]
        rows.append([force[0], force[2], -torque[1]])
        touching.append(len(simulation.wall_contacts("wheel")))
    wheel_s = (time.perf_counter() - start) / (SAMPLES * every)
    size = {"triangles": len(surface.triangles), "touching": round(float(np.mean(touching)))}
    return {"alone_s": alone_s, "wheel_s": wheel_s, "rows": np.array(rows)} | size


def steps(duration_s: float, time_step_s: float) -> int:
    """Number of steps, whole samples of them."""
    return SAMPLES * round(duration_s / time_step_s / SAMPLES)


def theirs(bed: soil_bed.SoilBed, soil: Soil, course: Course, folder: Path) -> dict:
    """Run the test in LIGGGHTS, as `ours`."""
    surface, time_step_s = SHAPE.surface(soil.smallest_sphere_m, course.axle_m), bed.simulation.time_step_s
    triangles = surface.vertices_m[surface.triangles] + np.asarray(course.axle_m)
    (folder / "wheel.stl").write_text(liggghts.mesh_text(triangles), encoding="utf-8")
    skin = max(SKINS, key=lambda ratio: tried(bed, soil, course, folder, ratio))
    with liggghts.Liggghts(folder, lines_of(bed, soil, course, folder, skin)) as program:
        program.run(SETTLE_STEPS)
        alone_s = timed(program, STEPS_ALONE)
        program.send(sinking_lines(course.axle_m))
        program.run(steps(course.down_m / SINKING_M_S, time_step_s))
        n = steps(TRAVEL_M / SPEED_M_S, time_step_s)
        program.send(travelling_lines(course, n // SAMPLES))
        wheel_s = timed(program, n)
        last, table = program.run(0)["Step"], np.loadtxt(folder / "samples.txt")
    if not 0 <= last - table[-1, 0] < n // SAMPLES:
        raise liggghts.PeerError(f"{liggghts.NAME} ended at step {table[-1, 0]:.0f}, not at {last:.0f}")
    rows = table[-SAMPLES:, 1:]
    return {"alone_s": alone_s, "wheel_s": wheel_s, "rows": rows, "skin": skin}


def sinking_lines(axle_m: tuple[float, float, float]) -> list[str]:
    """Lines that bring the wheel and sink it."""
    point = " ".join(f"{c:.9g}" for c in axle_m)
    return [
        f"fix wheel all mesh/surface/stress file wheel.stl type 2 reference_point {point}",
        f"fix rim all wall/gran {liggghts.MODEL} mesh n_meshes 1 meshes wheel",
        f"fix down all move/mesh mesh wheel linear 0. 0. {-SINKING_M_S}",
    ]


def travelling_lines(course: Course, every: int) -> list[str]:
    """Lines that let the wheel travel and turn, and sample means over `every` steps."""
    x, y, z = course.axle_m
    axle = f"origin {x:.9g} {y:.9g} {z - course.down_m:.9g} axis 0. 1. 0."
    named = " ".join(f"v_{name}" for name in VALUES)
    return [
        "unfix down",
        f"fix along all move/mesh mesh wheel linear {SPEED_M_S} 0. 0.",
        f"fix turn all move/mesh mesh wheel rotate {axle} period {2.0 * np.pi / rate_rad_s():.9g}",
        *(f"variable {name} equal {formula}" for name, formula in VALUES.items()),
        f"fix samples all ave/time 1 {every} {every} {named} file samples.txt",
    ]


def tried(bed: soil_bed.SoilBed, soil: Soil, course: Course, folder: Path, skin: float) -> float:
    """Steps per second of a few steps without the wheel."""
    with liggghts.Liggghts(folder, lines_of(bed, soil, course, folder, skin)) as program:
        program.run(TRIED_STEPS)
        return 1.0 / timed(program, TRIED_STEPS)


def timed(program: liggghts.Liggghts, n_steps: int) -> float:
    """Seconds a step; the grains are sorted and neighbours found before."""
    program.run(0)
    start = time.perf_counter()
    program.run(n_steps)
    return (time.perf_counter() - start) / n_steps


def lines_of(bed: soil_bed.SoilBed, soil: Soil, course: Course, folder: Path, skin_ratio: float) -> list[str]:
    """Input up to the first step: the settled bed on its glued lowest layer, without the wheel."""
    grains, setup = bed.simulation.grains, bed.setup
    positions = grains.positions_m.copy()
    positions[:, :2] %= (setup.length_m, setup.width_m)
    top = course.axle_m[2] + SHAPE.outer_radius_m + 4.0 * soil.radius_m
    box = [(0.0, setup.length_m), (0.0, setup.width_m), (-4.0 * soil.radius_m, top)]
    text = liggghts.data_text("bed", box, 2, positions, grains.radii_m, soil.density_kg_m3)
    (folder / "grains.data").write_text(text, encoding="utf-8")
    glued = " ".join(str(k + 1) for k in np.sort(bed.glued))
    between, at_wall = converted(soil.rolling_friction, ROLLING_MODEL, "LIGGGHTS")
    rolling = np.array([[between, at_wall], [at_wall, at_wall]])
    friction = np.array([[soil.static_friction, WHEEL_FRICTION], [WHEEL_FRICTION, WHEEL_FRICTION]])
    return [
        *liggghts.header_lines("p p f", Path("grains.data"), skin_ratio * soil.radius_m),
        f"group glued id {glued}", "group free subtract all glued",
        *liggghts.material_lines(soil.shear_modulus_pa, soil.poisson_ratio, soil.restitution, friction, rolling),
        f"timestep {bed.simulation.time_step_s:.9g}", "fix gravity all gravity 9.81 vector 0.0 0.0 -1.0",
        f"fix plate all wall/gran {liggghts.MODEL} primitive type 1 zplane 0.0",
        "fix motion free nve/sphere", "thermo_style custom step atoms ke", "thermo 1000000",
    ]  # fmt: skip


def summary(name: str, run: dict, n_grains: int) -> dict:
    """Numbers of a run: means over the second half of the travel, with the deviation of the samples."""
    half = run.pop("rows")[SAMPLES // 2 :]
    columns = zip(VALUES, half.mean(axis=0), half.std(axis=0, ddof=1), strict=True)
    means = {key: (round(mean, 3), round(sd, 3)) for key, mean, sd in columns}
    speed = {"million_grain_steps_per_s": round(n_grains / run["wheel_s"] / 1e6, 2)}
    return {"program": name} | run | speed | {"wheel_over_bed": round(run["wheel_s"] / run["alone_s"], 3)} | means


def main() -> None:
    """Prepare the bed, run both, print a row each and their ratio."""
    radius_m = 1e-3 * float(sys.argv[1]) if len(sys.argv) > 1 else 2.5e-3
    liggghts.require_installed()
    soil = soil_of(radius_m)
    engine = Engine(time_step_rayleigh_ratio=0.35, rolling_model=ROLLING_MODEL, tangential_model=TANGENTIAL_MODEL)
    bed = soil_bed.prepare(soil, BED, engine, seed=1)
    course = course_over(bed)
    print(f"{bed.simulation.n_grains} grains, step {bed.simulation.time_step_s:.3g} s", flush=True)
    with tempfile.TemporaryDirectory() as folder:
        rows = [summary("virtual-soil", ours(bed, soil, course), bed.simulation.n_grains)]
        print(rows[0], flush=True)
        rows.append(summary("LIGGGHTS", theirs(bed, soil, course, Path(folder)), bed.simulation.n_grains))
    print(rows[1])
    print(json.dumps({"speed_ratio": round(rows[1]["wheel_s"] / rows[0]["wheel_s"], 2), "rows": rows}))


if __name__ == "__main__":
    main()
