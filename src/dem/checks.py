"""Checks before grains are added and before a simulation runs, and the message after a blow-up. None changes the state."""

import itertools
import math

import numpy as np

from dem.layout import RADIUS
from dem.lists.grid import FARTHEST
from dem.material import require
from dem.shapes import Mesh, Wall, distance
from dem.shapes.wall import FIRST
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


def check_overlaps(state: SimulationState, positions: np.ndarray, radii: np.ndarray, owner: np.ndarray) -> None:
    """Refuse new grains that overlap each other or the present ones; those of one owner (n,) >= 0 may."""
    everywhere = np.concatenate([state.places[:, 0:3], positions])
    every_radius = np.concatenate([state.places[:, RADIUS], radii])
    i, j, depth = overlaps(everywhere, every_radius, state.period)
    every_owner = np.concatenate([np.full(state.n_grains, -1), owner])
    fixed = (every_owner[i] == every_owner[j]) & (every_owner[i] >= 0)
    ratios = np.where((j >= state.n_grains) & ~fixed, depth / np.minimum(every_radius[i], every_radius[j]), 0.0)
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
    for wall in state.walls:
        if isinstance(wall, Mesh) and state.n_grains:
            check_images(wall, state.period, float(state.places[:, RADIUS].max()) + skin)
    if state.clumps is not None and len(state.clumps.grain):
        reach = np.linalg.norm(state.clumps.arm, axis=1) + state.places[state.clumps.grain, RADIUS]
        cutoff = 2.0 * reach.max() + skin
        for axis, period in zip("xyz", state.period, strict=True):
            allowed = f"0 or more than {cutoff:.3g}, or a clump could touch its own image"
            require(period == 0 or period > cutoff, f"period_m along {axis}", period, allowed)


def check_images(mesh: Mesh, period: np.ndarray, cutoff: float) -> None:
    """Refuse a mesh that a grain within a cutoff in m would touch together with its image; grains see the image nearest its origin.

    One that is longer than a period, as the wall of a drum along its axis, is right where it does not change along it.
    """
    for axis in np.flatnonzero(period):
        low, high, turns_across = extent(mesh, int(axis))
        half, name = 0.5 * period[axis], f"extent of wall {mesh.name!r} along {'xyz'[axis]}"
        allowed = (
            f"within {half - cutoff:.4g} of its origin, or, if nothing changes along it, beyond {half + cutoff:.4g} on both sides"
        )
        require(cutoff < room(low, high, half, turns_across), name, f"{low:.4g} to {high:.4g} m", allowed)


def extent(mesh: Mesh, axis: int) -> tuple[float, float, bool]:
    """Lowest and highest place of a mesh along an axis from its origin in m, and whether its turning changes them."""
    turns_across = any(np.delete(direction, axis).any() for direction in mesh.axes_of_turn)
    return *mesh.extent(axis, turns_across), turns_across


def room(low: float, high: float, half: float, turns_across: bool) -> float:
    """Largest cutoff in m at which no grain is near a mesh of an extent and its image, half a period being `half`."""
    return max(half - max(-low, high), -math.inf if turns_across else min(-low, high) - half)


def room_beside_images(walls: list[Wall], period: np.ndarray) -> float:
    """Largest cutoff in m at which no grain is near a mesh of these walls and its image; infinite without any."""
    meshes = [wall for wall in walls if isinstance(wall, Mesh)]
    rooms = []
    for mesh, axis in itertools.product(meshes, np.flatnonzero(period)):
        low, high, turns_across = extent(mesh, int(axis))
        rooms.append(room(low, high, 0.5 * period[axis], turns_across))
    return min(rooms, default=math.inf)


def check_finite(state: SimulationState) -> None:
    """Raise SimulationError if a grain has no position: such a grain is at no height, so that it would pass for one that left."""
    if not np.isfinite(state.places).all():
        raise SimulationError(not_finite(state))


def blow_up_message(state: SimulationState, ratio: float, speed_limit: float) -> str:
    """Description of the wall or grain that is too fast, or of the grain that is too far away, and what helps."""
    if not all(np.isfinite(values).all() for values in (state.bodies.velocity, state.velocities, state.places)):
        return not_finite(state)
    behind = numbers_behind(state)
    if len(behind):
        return f"blew up: {behind_message(state, behind[0])}"
    walls, grains = surface_speeds(state), np.linalg.norm(state.velocities[:, :3], axis=1)
    wall, grain = walls.max(initial=0.0), grains.max(initial=0.0)
    after, limit = f"after t = {state.time_s:.4g} s", f"more than {ratio} of a radius in one step ({speed_limit:.3g} m/s)"
    if wall > speed_limit:
        w = int(np.argmax(walls))
        return f"blew up: {moves(state, w, wall)} {after}, {limit}; {slower(state, w)}"
    if grain > speed_limit:
        k = int(np.argmax(grains))
        # a wall that strikes a grain gives it at most twice its own speed
        struck = f"; {moves(state, int(np.argmax(walls)), wall)}" if 2.0 * wall >= grain else ""
        return f"blew up: grain {state.ids[k]} moves at {grain:.3g} m/s {after}, {limit}{struck}{fallen(state, k)}"
    k = int(np.argmax(np.abs(state.places[:, :3]).max(axis=1) / state.places[:, RADIUS]))
    place = f"({', '.join(f'{x:.4g}' for x in state.places[k, :3])}) m {after}"
    return f"blew up: grain {state.ids[k]} is at {place}, more than {FARTHEST:g} radii from the origin{fallen(state, k)}"


def surface_speeds(state: SimulationState) -> np.ndarray:
    """Largest speed in m/s of any point of each wall."""
    speeds = np.linalg.norm(state.bodies.velocity, axis=1)
    if state.poses is None:
        return speeds
    return speeds + state.poses.size * np.linalg.norm(state.poses.spin, axis=1)


def numbers_behind(state: SimulationState) -> np.ndarray:
    """Numbers in memory of the grains whose centres are inside a solid mesh."""
    found = np.zeros(state.n_grains, bool)
    for w, wall in enumerate(state.walls):
        if isinstance(wall, Mesh) and wall.solid and state.n_grains:
            found |= distance(state.wall(w), state.places[:, :3]) < 0.0
    return np.flatnonzero(found & state.is_free)


def behind_message(state: SimulationState, k: int) -> str:
    """Description of a grain, by its number in memory, that is behind the surface of a solid mesh."""
    place = ", ".join(f"{x:.4g}" for x in state.places[k, :3])
    return (
        f"grain {state.ids[k]} at ({place}) m is inside a solid mesh after t = {state.time_s:.4g} s: stiffer grains, a smaller "
        "time_step_rayleigh_ratio or a slower mesh keep it outside; where grains belong inside, set solid=False"
    )


def not_finite(state: SimulationState) -> str:
    """Description of the first wall or grain whose state is not finite."""
    walls = np.flatnonzero(~np.isfinite(state.bodies.velocity).all(axis=1))
    grains = state.ids[~(np.isfinite(state.places).all(axis=1) & np.isfinite(state.velocities).all(axis=1))]
    names = [f"wall {state.walls[w].name!r}" for w in walls] + [f"grain {k}" for k in sorted(grains)]
    return f"blew up: position or velocity of {names[0]} is not finite after t = {state.time_s:.4g} s"


def moves(state: SimulationState, w: int, speed: float) -> str:
    """Wall w with its speed in m/s, for a message."""
    return f"wall {state.walls[w].name!r} moves at {speed:.3g} m/s"


def slower(state: SimulationState, w: int) -> str:
    """Advice on a wall that is too fast."""
    axis = int(np.argmax(np.abs(state.bodies.velocity[w])))
    if state.bodies.driven[w, axis]:
        return f"a force drives it along {'xyz'[axis]}: increase mass_kg or damping_kg_s of its Drive"
    return "move it more slowly, or reduce time_step_rayleigh_ratio"


def fallen(state: SimulationState, k: int) -> str:
    """Advice on a grain that falls, in the order in memory, with no wall below it; empty for others."""
    lowest = state.surfaces.geometry[:, FIRST + 2].min(initial=np.inf)
    velocity, falls = state.velocities[k, :3], state.gravity[2] < 0
    if not falls or state.places[k, 2] + state.places[k, RADIUS] > lowest or -velocity[2] < 0.9 * np.linalg.norm(velocity):
        return ""
    return (
        f"; it is at z = {state.places[k, 2]:.4g} m, and no wall is below it: if it fell off, set floor_m; grains below that "
        "height leave the simulation at the end of each `advance`"
    )
