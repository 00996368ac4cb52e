"""Rotating drum: large grains below small ones are mixed; shell and end plates turn together.

Frame of the benchmark: axis along y, gravity along -z, rotation -w about y, so that the lowest point of the shell moves to +x. Our
drum stands on its end, since tubes are upright: our x, y, z are the benchmark's z, x, y, and gravity acts along our -x.
"""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

import dem
from virtual_soil.bulk import peer
from virtual_soil.bulk.materials import GRAVITY_M_S2, STEEL, TANGENTIAL_MODEL, interactions, materials
from virtual_soil.bulk.packings import Packing
from virtual_soil.bulk.run import Run, sampled
from virtual_soil.bulk.variants import DRUM_BEGINNING, DRUM_STARTS
from virtual_soil.verification.peers import liggghts

#: In the order of LIGGGHTS' types.
GRAINS = ("M1", "M2")
NAMES = (*GRAINS, STEEL)
#: Axes of the benchmark's frame in ours.
TO_OURS = [2, 0, 1]
#: Quadrants that are counted, by the sign of both x and z.
ZONES = {"zone_1": 1.0, "zone_2": -1.0}
#: Bound of the places' changes in m along each axis, half the largest overlap in the packing.
SHIFT_M = 1e-6


@dataclass(frozen=True, kw_only=True)
class Setup:
    """Drum and clock; softening: the grains' E is divided by it. start : number of the start, see `started`.

    The benchmark's soft variant has E / 500 and steps of 1e-4 s, 0.53 of the Rayleigh time of M1: more than our code accepts beside
    rigid walls, so that both codes have the largest step that divides the interval of the samples.
    """

    radius_m: float = 0.1
    half_length_m: float = 0.03
    turn_rate_rad_s: float = 2.0
    softening: float = 500.0
    time_step_s: float = 0.05 / 640
    sample_s: float = 0.05
    duration_s: float = 2.5
    start: int = 0


KINDS = {"soft": Setup(), "hard": Setup(softening=1.0, time_step_s=8e-7, duration_s=5.0)}
#: By variant, `<kind>_<number of the start>`.
SETUPS = {f"{kind}_{start}": replace(setup, start=start) for kind, setup in KINDS.items() for start in range(DRUM_STARTS)}
SETUPS[DRUM_BEGINNING] = replace(KINDS["hard"], duration_s=0.02, sample_s=0.01)


def started(packing: Packing, setup: Setup) -> Packing:
    """The packing of a start: as it is published, or with places changed at random by up to SHIFT_M (starts from 1 on)."""
    shifts = np.random.default_rng(setup.start).uniform(-SHIFT_M, SHIFT_M, packing.positions_m.shape)
    return packing if setup.start == 0 else replace(packing, positions_m=packing.positions_m + shifts)


def walls(setup: Setup) -> list[dem.Wall]:
    """Shell and end plates in our frame; they only rub."""
    spin = (0.0, 0.0, -setup.turn_rate_rad_s)
    half, beyond = setup.half_length_m, 1.5 * setup.radius_m
    shell = dem.Tube(
        name="shell", material=STEEL, radius_m=setup.radius_m, bottom_m=-2.0 * half, top_m=2.0 * half, angular_velocity_rad_s=spin
    )
    plates = [
        dem.Box(name=name, material=STEEL, low_m=(-beyond, -beyond, z), high_m=(beyond, beyond, z), angular_velocity_rad_s=spin)
        for name, z in (("front", -half), ("back", half))
    ]
    return [shell, *plates]


def counted(positions_m: np.ndarray, is_of: dict[str, np.ndarray]) -> dict[str, float]:
    """Grains in each zone and barycentre (x, z) of each material; positions (n, 3) in the benchmark's frame."""
    x, z = positions_m[:, 0], positions_m[:, 2]
    found = {
        f"{zone}_{name}": float(((sign * x > 0) & (sign * z > 0) & grains).sum())
        for zone, sign in ZONES.items()
        for name, grains in is_of.items()
    }
    for name, grains in is_of.items():
        found |= {f"x_{name}": float(x[grains].mean()), f"z_{name}": float(z[grains].mean())}
    return found | {"grains": float(len(positions_m))}


def ours(packing: Packing, setup: Setup) -> Run:
    """Our code; quantities zone_1_M1 and so on, x_M1, z_M1 and so on (barycentres in m), grains."""
    packing = started(packing, setup)
    is_of = {name: packing.materials == name for name in GRAINS}
    simulation = dem.Simulation(
        materials=materials(NAMES, setup.softening),
        interactions=interactions(NAMES),
        smallest_radius_m={name: float(packing.radii_m[own].min()) for name, own in is_of.items()},
        time_step_s=setup.time_step_s,
        gravity_m_s2=(-GRAVITY_M_S2, 0.0, 0.0),
        tangential_model=TANGENTIAL_MODEL,
        walls=walls(setup),
    )
    for name, own in is_of.items():
        simulation.add_grains(packing.positions_m[own][:, TO_OURS], packing.radii_m[own], name)
    order = np.argsort(TO_OURS)
    return sampled(simulation, lambda now: counted(now.grains.positions_m[:, order], is_of), setup.duration_s, setup.sample_s)


def plate_mesh(setup: Setup, z_m: float) -> np.ndarray:
    """Triangles (n, 3, 3) of an end plate in our frame: a square that covers the shell's end, in four parts."""
    half = 1.1 * setup.radius_m
    corners = [(x, y, z_m) for x in (-half, 0.0) for y in (-half, 0.0)]
    return np.concatenate([liggghts.rectangle(corner, (half, 0.0, 0.0), (0.0, half, 0.0)) for corner in corners])


def shell_lines(packing: Packing, setup: Setup) -> list[str]:
    """A round shell about z that turns, for each material by itself, whose grains have one radius.

    LIGGGHTS takes the shell's velocity at the grain's centre, R - r from the axis: the rate here is R / (R - r) times the drum's.
    A mesh has the right velocity, but a grain near an edge touches both facets, which hinders it.
    """
    lines = []
    for name in packing.names:
        radius_m = float(packing.radii_m[packing.materials == name].mean())
        rate = -setup.turn_rate_rad_s * setup.radius_m / (setup.radius_m - radius_m)
        lines.append(
            f"fix shell_{name} {name} wall/gran {peer.MODEL} primitive type {len(NAMES)} "
            f"zcylinder {setup.radius_m:.9g} 0.0 0.0 shear x {rate:.9g}"
        )
    return lines


def of_liggghts(packing: Packing, setup: Setup, folder: Path) -> Run:
    """LIGGGHTS in a folder, in our frame as its round walls turn about z only; quantities as those of `ours`."""
    packing = started(packing, setup)
    turned = replace(packing, positions_m=packing.positions_m[:, TO_OURS])
    turning = f"surface_ang_vel origin 0. 0. 0. axis 0. 0. 1. omega {-setup.turn_rate_rad_s:.9g}"
    plates = {"front": plate_mesh(setup, -setup.half_length_m), "back": plate_mesh(setup, setup.half_length_m)}
    wide, long = 1.2 * setup.radius_m, 1.2 * setup.half_length_m
    lines = [
        *peer.grains_lines(folder, turned, [(-wide, wide), (-wide, wide), (-long, long)], NAMES),
        *peer.material_lines(NAMES, setup.softening),
        *(peer.mesh_line(folder, name, triangles, len(NAMES), turning) for name, triangles in plates.items()),
        peer.mesh_walls(list(plates)),
        *shell_lines(packing, setup),
        "region zone_1 block 0 INF 0 INF INF INF",
        "region zone_2 block INF 0 INF 0 INF INF",
        *peer.motion_lines(setup.time_step_s, "-1.0 0.0 0.0"),
    ]
    values = {f"{zone}_{name}": f"count({name},{zone})" for zone in ZONES for name in GRAINS}
    values |= {f"{axis}_{name}": f"xcm({name},{ours})" for name in GRAINS for axis, ours in (("x", "y"), ("z", "x"))}
    clock = peer.Clock(setup.duration_s, setup.sample_s, setup.time_step_s)
    return peer.sampled(folder, lines, values | {"grains": "count(all)"}, len(packing), clock)
