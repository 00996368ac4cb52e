"""Checks before grains are added and before a simulation runs, and the message after a blow-up. None changes the state."""

import numpy as np

from dem.layout import RADIUS
from dem.material import require
from dem.shapes import Wall, distance
from dem.state import SimulationState

#: Maximum overlap of new grains in radii: more would throw them apart.
LARGEST_OVERLAP_RATIO = 0.05

ALLOWED = f"at most {LARGEST_OVERLAP_RATIO} of the smaller radius"


class SimulationError(RuntimeError):
    """The simulation cannot go on: it blew up or was set up impossibly."""


def overlaps(positions, radii, period):
    """Pairs i < j that overlap (m,), (m,) and their overlaps in m (m,); nearest images where periodic."""
    from scipy.spatial import cKDTree  # imported here: a factory's grains do not need it, and it takes a quarter of the start-up

    places = positions.copy()
    periodic = period > 0
    places[:, periodic] %= period[periodic]
    pairs = cKDTree(places, boxsize=period).query_pairs(2.0 * radii.max(initial=0.0), output_type="ndarray")
    i, j = pairs.T
    apart = positions[i] - positions[j]
    apart[:, periodic] -= period[periodic] * np.rint(apart[:, periodic] / period[periodic])
    depth = radii[i] + radii[j] - np.linalg.norm(apart, axis=1)
    touching = depth > 0
    return i[touching], j[touching], depth[touching]


def check_overlaps(state: SimulationState, positions: np.ndarray, radii: np.ndarray) -> None:
    """Refuse new grains that overlap each other or the present ones."""
    everywhere = np.concatenate([state.places[:, 0:3], positions])
    every_radius = np.concatenate([state.places[:, RADIUS], radii])
    i, j, depth = overlaps(everywhere, every_radius, state.period)
    ratios = np.where(j >= state.n_grains, depth / np.minimum(every_radius[i], every_radius[j]), 0.0)
    for k in np.flatnonzero(ratios == ratios.max(initial=0.0))[:1]:
        found = f"{ratios[k]:.3g} of a radius"
        require(ratios[k] <= LARGEST_OVERLAP_RATIO, f"overlap of grains {i[k]} and {j[k]}", found, ALLOWED)


def check_surroundings(walls: list[Wall], floor_m: float, positions: np.ndarray, radii: np.ndarray) -> None:
    """Refuse new grains that overlap a wall or are below the floor."""
    if not len(positions):
        return
    for wall in walls:
        ratios = 1.0 - distance(wall, positions) / radii
        k = int(np.argmax(ratios))
        inside = f"grain {k} at {positions[k].tolist()} in wall {wall.name!r}: its overlap"
        require(ratios[k] <= LARGEST_OVERLAP_RATIO, inside, f"{ratios[k]:.3g} of a radius", ALLOWED)
    k = int(np.argmin(positions[:, 2]))
    require(positions[k, 2] >= floor_m, f"height of grain {k}", positions[k, 2], f"at least floor_m = {floor_m}")


def check_ready(state: SimulationState, skin: float) -> None:
    """Refuse to run if an interaction is missing, or a period is too short for nearest images."""
    names, present = list(state.material_index), np.unique(state.material).tolist()
    for a, b in {(a, b) for a in present for b in (*present, *state.surfaces.material.tolist())}:
        missing = np.isnan(state.pair_table[a * len(names) + b, 0])
        allowed = "an Interaction for every pair that can meet"
        require(not missing, f"interaction of {names[a]!r} with {names[b]!r}", "missing", allowed)
    if state.n_grains:
        cutoff = 2.0 * (2.0 * state.places[:, RADIUS].max() + skin)
        for axis, period in zip("xyz", state.period, strict=True):
            allowed = f"0 or more than {cutoff:.3g}, or a grain could touch two images of another"
            require(period == 0 or period > cutoff, f"period_m along {axis}", period, allowed)


def blow_up_message(state: SimulationState, ratio: float, speed_limit: float) -> str:
    """Description of the grain that blew up."""
    velocities = state.velocities
    if not (np.isfinite(velocities).all() and np.isfinite(state.places).all()):
        return f"blew up: a grain's state is not finite after t = {state.time_s:.4g} s"
    speed = np.linalg.norm(velocities[:, :3], axis=1)
    k = int(np.argmax(speed))
    return (
        f"blew up: grain {k} moves at {speed[k]:.3g} m/s after t = {state.time_s:.4g} s, "
        f"more than {ratio} of a radius in one step ({speed_limit:.3g} m/s)"
    )
