"""Contacts of a wall at this moment, read between two steps: where grains touch it, and with what load.

The kernels of the time loop evaluate the contacts as they stand, so the loads add up to those of the step to come. Nothing changes:
the contacts' history stays in the outer lists.
"""

from dataclasses import dataclass

import numpy as np

from dem.bodies import Scene, separation
from dem.html import Rich
from dem.layout import FX, LOAD, PLACE, QX, RADIUS, aligned_zeros
from dem.lists.slabs import used_slabs
from dem.lists.storage import STALE, Outer
from dem.lists.surfaces import prune_surfaces
from dem.material import require
from dem.meshes.contacts import TOO_MANY
from dem.runner import Runner
from dem.shapes import MESH
from dem.state import SimulationState
from dem.step import schedule


@dataclass(frozen=True)
class WallContacts(Rich):
    """Grains that press or rub against a wall, or against grains glued to it: k of them.

    grains (k,): their numbers, in the order of addition; of loads on a glued grain its own. points_m (k, 3): where they touch; the
    nearest point of one that touches a mesh at several patches, and a glued grain's centre. forces_n (k, 3): on the wall.
    torques_n_m (k, 3): of these forces about the wall's pivot (of a mesh its origin).
    """

    grains: np.ndarray
    points_m: np.ndarray
    forces_n: np.ndarray
    torques_n_m: np.ndarray

    def __len__(self):
        return len(self.grains)


def wall_contacts(runner: Runner, w: int) -> WallContacts:
    """Contacts of wall w; raises ValueError if the lists of neighbours are not made yet."""
    allowed = "a simulation that has made a step since grains or walls were added or removed"
    require(runner.state.lists.age[0] < STALE, "contacts of a wall", "not known", allowed)
    runner.prepare_grid()
    scene = runner.state.scene()
    parts = at_surface(runner, scene, w), on_glued(runner, scene, w)
    rows = [np.concatenate(columns) for columns in zip(*parts, strict=True)]
    acts = rows[2].any(axis=1) | rows[3].any(axis=1)
    grains, points, forces, torques = (values[acts] for values in rows)
    return WallContacts(runner.state.ids[grains], points, forces, torques)


def lever_torques(arms: np.ndarray, forces: np.ndarray, radii: np.ndarray, twists: np.ndarray) -> np.ndarray:
    """Torques (k, 3) of loads at places (k, 3) from the pivot: force (k, 3), and twist (k, 3), which is torque over radius (k,)."""
    return np.cross(arms, forces) + radii[:, None] * twists


def pivot_of(state: SimulationState, w: int) -> np.ndarray:
    """Point about which the torques on a wall count (3,)."""
    return np.asarray(state.wall(w).pivot, float)


def nearest_images(state: SimulationState, vectors: np.ndarray) -> np.ndarray:
    """Vectors (k, 3) to the nearest periodic images."""
    period = state.period
    turns = np.divide(vectors, period, out=np.zeros_like(vectors), where=period > 0)
    return vectors - period * np.rint(turns)


def new_loads(state: SimulationState) -> np.ndarray:
    """Load records of all grains, zero."""
    return aligned_zeros(state.n_grains * LOAD, state.widths.number, 3)


def loads_of(loads: np.ndarray, grains: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Forces and twists (k, 3) of grains in float64."""
    records = loads.reshape(-1, LOAD)[grains].astype(float)
    return records[:, FX : FX + 3], records[:, QX : QX + 3]


def at_surface(runner: Runner, scene: Scene, w: int) -> tuple[np.ndarray, ...]:
    """Numbers in memory, points, forces and torques of the grains near the surface of wall w."""
    state, model, scratch = runner.state, runner.model, runner.scratch()
    lists, surfaces, rigid = state.lists, scene.surfaces, scene.rigid
    contacts, loads, n_surfaces = lists.surfaces.contacts, new_loads(state), len(surfaces.kind)
    acting = lists._replace(place=state.grains.place, within=reaches(state, model.reach_m))
    cutoff, has_meshes = 0.5 * model.reach_m, rigid is not None
    while prune_surfaces(state.view(), surfaces, rigid, acting, cutoff, model, scratch.near) == TOO_MANY and has_meshes:
        runner.n_triangles *= 2
        scratch = runner.scratch()
    count = np.zeros_like(contacts.count)
    count[w::n_surfaces] = contacts.count[w::n_surfaces]
    contacts.count[:] = 0  # the loop would take what is here for the history of a step that it made
    own = contacts._replace(count=count)
    near = np.concatenate([np.arange(contacts.begin[p], contacts.begin[p] + count[p]) for p in range(w, len(count), n_surfaces)])
    if not len(near):
        return nothing()
    workspace = scratch.buffers[0], scratch.places[0], scratch.force[0], scratch.torque[0], scratch.near
    velocity = scene.bodies.velocity
    for s in range(used_slabs(lists.pairs.outer.slab)):
        model_parts = model.access, model.laws
        schedule.surface_forces(s, surfaces.geometry, state.grains, loads, own, surfaces, rigid, velocity, workspace, *model_parts)
    apart = separations(state, scene, w, contacts.first[near], near, scratch.near)
    by_distance = np.lexsort((np.linalg.norm(apart, axis=1), contacts.first[near]))
    grains, first = np.unique(contacts.first[near][by_distance], return_index=True)
    centres, radii = state.places[grains, :3], state.places[grains, RADIUS]
    forces, twists = loads_of(loads, grains)
    arms = nearest_images(state, centres - pivot_of(state, w))
    return grains, centres - apart[by_distance][first], -forces, -lever_torques(arms, forces, radii, twists)


def separations(state: SimulationState, scene: Scene, w: int, grains: np.ndarray, near: np.ndarray, of_mesh) -> np.ndarray:
    """Vectors (k, 3) from the nearest points of wall w to grains (k,); near (k,): numbers of their contacts, of_mesh : `Near`."""
    if scene.surfaces.kind[w] == MESH:
        return of_mesh.separation[near]
    return np.array([separation(state.grains.place, PLACE * i, scene.surfaces, w) for i in grains.tolist()])


def on_glued(runner: Runner, scene: Scene, w: int) -> tuple[np.ndarray, ...]:
    """Numbers in memory, centres, forces and torques of the grains that are glued to wall w."""
    state, model, scratch = runner.state, runner.model, runner.scratch()
    grains = scene.glued.grain[scene.glued.body == w]
    if not len(grains):
        return nothing()
    carried = np.zeros(state.n_grains, bool)
    carried[grains] = True
    pairs, loads = state.lists.pairs, new_loads(state)
    mine, contacts = pairs._replace(outer=touching(pairs.outer, carried)), pairs.contacts
    acting = state.lists._replace(pairs=mine, place=state.grains.place, within=reaches(state, model.reach_m))
    schedule.prune(state.view(), acting, model, scratch.threads)
    none, buffer = mine.outer.order[:0], scratch.buffers[0]
    for s in range(used_slabs(pairs.outer.slab)):
        schedule.pair_forces(s, none, state.grains, loads, contacts, buffer, model.access, model.laws)
    contacts.count[:] = 0
    forces, twists = loads_of(loads, grains)
    arms = state.places[grains, :3] - pivot_of(state, w)
    return grains, state.places[grains, :3], forces, lever_torques(arms, forces, state.places[grains, RADIUS], twists)


def reaches(state: SimulationState, reach_m: float) -> np.ndarray:
    """Share of each grain (n,) in the distance in m from centre to centre up to which contacts act, `reach_m` the gap then."""
    return state.places[:, RADIUS] + 0.5 * reach_m


def touching(outer: Outer, chosen: np.ndarray) -> Outer:
    """The pairs of an outer list that have a chosen grain; chosen (n,)."""
    n = int(outer.row.max(initial=0))
    keep = chosen[outer.owner[:n]] | chosen[outer.partner[:n]]
    before, kept = np.concatenate([[0], np.cumsum(keep)]), np.flatnonzero(keep)
    return outer._replace(row=before[outer.row], owner=outer.owner[kept], partner=outer.partner[kept], history=outer.history[kept])


def nothing() -> tuple[np.ndarray, ...]:
    """No contacts."""
    return np.zeros(0, np.int64), np.zeros((0, 3)), np.zeros((0, 3)), np.zeros((0, 3))
