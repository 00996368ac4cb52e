"""The angle-of-repose test in LIGGGHTS: identical initial grains, tube, finite plate and protocol as in `angle_of_repose`.

The initial state is that of our engine at time 0, before any contact, so no contact history is lost. Both programs fill, settle,
lift and come to rest independently; packings and heaps are compared.
"""

from pathlib import Path

import numpy as np

from dem import Grains
from dem.experiments import angle_of_repose
from dem.experiments.soil import Engine, Soil
from virtual_soil.verification.peers.liggghts import (
    MODEL,
    Liggghts,
    data_text,
    header_lines,
    material_lines,
    mesh_text,
    rectangle,
    tube,
)

SKIN_RATIO = 0.2
#: Sampling interval of the grains, in steps.
LOOK_STEPS = 2000


def input_lines(
    folder: Path, soil: Soil, setup: angle_of_repose.Setup, engine: Engine, start: Grains, time_step_s: float
) -> list[str]:
    """Return the input of one heap up to the filled tube; writes the files it refers to into the folder."""
    half, scale = setup.plate_half_width_ratio * setup.scale_radius_m, setup.scale_radius_m
    tube_top = float(start.positions_m[:, 2].max()) + 4.0 * scale
    box_top = tube_top + setup.lift_speed_m_s * setup.max_time_s + 4.0 * scale
    side, floor = half + 4.0 * scale, -2.0 * soil.sizes.largest_m
    box = [(-side, side), (-side, side), (floor, box_top)]
    (folder / "grains.data").write_text(data_text("heap", box, 2, start.positions_m, start.radii_m, soil.density_kg_m3))
    (folder / "tube.stl").write_text(mesh_text(tube(setup.tube_diameter_ratio * scale, 0.0, tube_top)))
    plate = rectangle((-half, -half, 0.0), (2 * half, 0.0, 0.0), (0.0, 2 * half, 0.0))
    (folder / "plate.stl").write_text(mesh_text(plate))
    wall_s = soil.static_friction if setup.wall_static_friction is None else setup.wall_static_friction
    wall_r = soil.rolling_friction if setup.wall_rolling_friction is None else setup.wall_rolling_friction
    return [
        *header_lines("f f f", folder / "grains.data", SKIN_RATIO * soil.radius_m),
        *material_lines(
            soil.shear_modulus_pa / engine.stiffness_reduction,
            soil.poisson_ratio,
            soil.restitution,
            [[soil.static_friction, wall_s], [wall_s, wall_s]],
            [[soil.rolling_friction, wall_r], [wall_r, wall_r]],
        ),
        f"timestep {time_step_s:.9g}",
        f"fix gravity all gravity {engine.gravity_m_s2:.9g} vector 0.0 0.0 -1.0",
        f"fix plate all mesh/surface file {folder / 'plate.stl'} type 2",
        f"fix tube all mesh/surface file {folder / 'tube.stl'} type 2",
        f"fix walls all wall/gran {MODEL} mesh n_meshes 2 meshes plate tube",
        "fix motion all nve/sphere",
        "compute top all reduce max z",
        "thermo_style custom step atoms ke c_top",
        "thermo 1000000",
        "thermo_modify lost ignore norm no",
    ]


def grains_of(peer: Liggghts) -> Grains:
    """Read the grains from the running program."""
    table = peer.dump("x y z vx vy vz omegax omegay omegaz radius")
    return Grains(table[:, 1:4], table[:, 4:7], table[:, 7:10], table[:, 10])


def run(folder: Path, soil: Soil, setup: angle_of_repose.Setup, engine: Engine, seed: int) -> angle_of_repose.Heap:
    """Simulate one heap in LIGGGHTS with the stop criteria of `angle_of_repose.run`. All grains have soil.radius_m."""
    ours = angle_of_repose.build(soil, setup, engine, seed)
    start, dt, n, r = ours.grains, ours.time_step_s, setup.n_particles, soil.radius_m
    mass = soil.density_kg_m3 * 4.0 / 3.0 * np.pi * r**3
    fall_m = mass * engine.gravity_m_s2 * r  # energy of a fall by one radius, J

    def is_static(now, ratio):
        return now["KinEng"] < ratio * now["Atoms"] * fall_m

    with Liggghts(folder, input_lines(folder, soil, setup, engine, start, dt)) as peer:
        settle_time = angle_of_repose.SETTLE_FALL_TIMES * (2.0 * start.positions_m[:, 2].max() / engine.gravity_m_s2) ** 0.5
        now = peer.run(LOOK_STEPS)
        while now["Step"] * dt < settle_time and not is_static(now, angle_of_repose.SETTLED_ENERGY_RATIO):
            now = peer.run(LOOK_STEPS)
        filled = grains_of(peer)

        peer.send([f"fix lift all move/mesh mesh tube linear 0. 0. {setup.lift_speed_m_s:.9g}"])
        begin, status = now["Step"], "time_limit"
        while (now["Step"] - begin) * dt < setup.max_time_s:
            now = peer.run(LOOK_STEPS)
            height = now["top"] + r
            if (now["Step"] - begin) * dt * setup.lift_speed_m_s <= height:
                continue
            few = now["Atoms"] < angle_of_repose.LEAST_REMAINING_RATIO * n
            if few or height < angle_of_repose.FLAT_HEIGHT_RATIO * 2.0 * r:
                status = "flat"
                break
            if is_static(now, angle_of_repose.STATIC_ENERGY_RATIO):
                status = "static"
                break
        grains = grains_of(peer)
    return angle_of_repose.Heap(
        status=status,
        filled=filled,
        grains=grains,
        n_lost=n - len(grains),
        n_steps=int(now["Step"]),
        simulated_time_s=(now["Step"] - begin) * dt,
        max_overlap_ratio=float("nan"),
    )
