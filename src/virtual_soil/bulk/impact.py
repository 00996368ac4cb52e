"""Impact: a steel ball falls into a bed of grains a tenth of its size.

The ball starts just above the bed, with the speed of its free fall: before contact z = z_0 - v_0 t - g t^2 / 2 is exact.
"""

import math
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np

import dem
from virtual_soil.bulk import peer
from virtual_soil.bulk.materials import GRAVITY_M_S2, STEEL, TANGENTIAL_MODEL, interactions, materials
from virtual_soil.bulk.packings import Packing
from virtual_soil.bulk.run import Run, sampled
from virtual_soil.bulk.variants import SHIFTS_M

#: In the order of LIGGGHTS' types: grains, then ball and box.
NAMES = ("M1", STEEL)
FAR_M = 1.0


@dataclass(frozen=True, kw_only=True)
class Setup:
    """Box, ball and clock; the defaults are the benchmark's, but for the late start and the duration.

    half_x_m, half_y_m, bottom_m : inner faces of the box. ball_z_m, ball_speed_m_s : the ball (downwards) at t = 0. softening : the
    grains' E is divided by it. clearance_m : fall left at the late start. shift_m : (x, y) of the ball from the centre.
    duration_s : after the late start.
    """

    half_x_m: float = 0.049
    half_y_m: float = 0.030
    bottom_m: float = -0.0902431
    ball_radius_m: float = 10e-3
    ball_z_m: float = 0.06
    ball_speed_m_s: float = 5.0
    softening: float = 1.0
    time_step_s: float = 5e-7
    sample_s: float = 0.25e-3
    duration_s: float = 12e-3
    clearance_m: float = 1e-3
    shift_m: tuple[float, float] = (0.0, 0.0)


#: Grains of the bed -> time in s until the ball is thrown back, or at rest.
DURATIONS_S = {25_000: 12e-3, 50_000: 25e-3}
#: By variant, `<grains>_<number of the start>`.
SETUPS = {
    f"{n_grains}_{k}": Setup(shift_m=shift, duration_s=duration)
    for n_grains, duration in DURATIONS_S.items()
    for k, shift in enumerate(SHIFTS_M)
}


class Start(NamedTuple):
    """The ball at the late start: height in m, speed in m/s (downwards), time in s since the benchmark's start."""

    z_m: float
    speed_m_s: float
    time_s: float


def first_touch_m(packing: Packing, setup: Setup) -> float:
    """Height in m of the ball's centre where it first touches a grain at rest; -inf if it misses them all."""
    reach = setup.ball_radius_m + packing.radii_m
    away = np.hypot(*(packing.positions_m[:, :2] - setup.shift_m).T)
    below = away < reach
    return float((packing.positions_m[below, 2] + np.sqrt(reach[below] ** 2 - away[below] ** 2)).max(initial=-math.inf))


def late_start(packing: Packing, setup: Setup) -> Start:
    """The ball in free fall, `clearance_m` above its first contact.

    Raises
    ------
    ValueError : that is not below the ball's first height.
    """
    z = first_touch_m(packing, setup) + setup.clearance_m
    fallen = setup.ball_z_m - z
    if not 0 <= fallen < math.inf:
        raise ValueError(
            f"ball_z_m is {setup.ball_z_m}; allowed: above {z:.6g}, clearance_m above the bed, under the ball a grain."
        )
    speed = math.sqrt(setup.ball_speed_m_s**2 + 2.0 * GRAVITY_M_S2 * fallen)
    return Start(z, speed, (speed - setup.ball_speed_m_s) / GRAVITY_M_S2)


def free_fall_m(times_s: np.ndarray, start: Start) -> np.ndarray:
    """Height in m of the ball without a bed, times (k,) in s since the late start."""
    return start.z_m - start.speed_m_s * times_s - 0.5 * GRAVITY_M_S2 * times_s**2


def walls(setup: Setup) -> list[dem.Box]:
    """The box, open at the top."""
    half_x, half_y = setup.half_x_m, setup.half_y_m
    faces = {
        "bottom": ((-FAR_M, -FAR_M, -FAR_M), (FAR_M, FAR_M, setup.bottom_m)),
        "left": ((-FAR_M, -FAR_M, -FAR_M), (-half_x, FAR_M, FAR_M)),
        "right": ((half_x, -FAR_M, -FAR_M), (FAR_M, FAR_M, FAR_M)),
        "front": ((-FAR_M, -FAR_M, -FAR_M), (FAR_M, -half_y, FAR_M)),
        "back": ((-FAR_M, half_y, -FAR_M), (FAR_M, FAR_M, FAR_M)),
    }
    return [dem.Box(name=name, material=STEEL, low_m=low, high_m=high) for name, (low, high) in faces.items()]


def ours(packing: Packing, setup: Setup) -> Run:
    """Our code; quantities ball_z_m, ball_speed_m_s (upwards), bed_z_m (mean of the grains) and grains."""
    start = late_start(packing, setup)
    simulation = dem.Simulation(
        materials=materials(NAMES, setup.softening),
        interactions=interactions(NAMES),
        smallest_radius_m={"M1": float(packing.radii_m.min()), STEEL: setup.ball_radius_m},
        time_step_s=setup.time_step_s,
        gravity_m_s2=(0.0, 0.0, -GRAVITY_M_S2),
        tangential_model=TANGENTIAL_MODEL,
        walls=walls(setup),
    )
    simulation.add_grains(packing.positions_m, packing.radii_m, "M1")
    ball = (*setup.shift_m, start.z_m)
    simulation.add_grains([ball], setup.ball_radius_m, STEEL, velocities_m_s=(0.0, 0.0, -start.speed_m_s))

    def look(now: dem.Simulation) -> dict[str, float]:
        grains = now.grains
        return {
            "ball_z_m": float(grains.positions_m[-1, 2]),
            "ball_speed_m_s": float(grains.velocities_m_s[-1, 2]),
            "bed_z_m": float(grains.positions_m[:-1, 2].mean()),
            "grains": float(now.n_grains),
        }

    return sampled(simulation, look, setup.duration_s, setup.sample_s)


def of_liggghts(packing: Packing, setup: Setup, folder: Path) -> Run:
    """LIGGGHTS in a folder; quantities as those of `ours`."""
    start, n = late_start(packing, setup), len(packing) + 1
    everything = Packing(
        positions_m=np.vstack([packing.positions_m, (*setup.shift_m, start.z_m)]),
        radii_m=np.append(packing.radii_m, setup.ball_radius_m),
        materials=np.append(packing.materials, STEEL),
    )
    velocities = np.zeros((n, 3))
    velocities[-1, 2] = -start.speed_m_s
    half_x, half_y, radius = setup.half_x_m, setup.half_y_m, setup.ball_radius_m
    top = start.z_m + 10.0 * radius
    box = [(-half_x - radius, half_x + radius), (-half_y - radius, half_y + radius), (setup.bottom_m - radius, top)]
    planes = {"x": (-half_x, half_x), "y": (-half_y, half_y), "z": (setup.bottom_m,)}
    lines = [
        *peer.grains_lines(folder, everything, box, NAMES, velocities),
        *peer.material_lines(NAMES, setup.softening),
        *(
            f"fix wall_{axis}{k} all wall/gran {peer.MODEL} primitive type 2 {axis}plane {place:.9g}"
            for axis, places in planes.items()
            for k, place in enumerate(places)
        ),
        *peer.motion_lines(setup.time_step_s),
    ]
    values = {"ball_z_m": f"z[{n}]", "ball_speed_m_s": f"vz[{n}]", "bed_z_m": "xcm(M1,z)", "grains": "count(all)"}
    return peer.sampled(folder, lines, values, n, peer.Clock(setup.duration_s, setup.sample_s, setup.time_step_s))
