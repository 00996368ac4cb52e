"""Bodies: surfaces (shapes) and glued grains that move as one. Their forces add up on the body, and they take its velocity.

The motion along each axis is prescribed (a fixed body has velocity zero) or driven by a force:
m dv/dt = F_grains + F_applied - c v. Today every wall is a body of one surface; several surfaces may share a body.
"""

import math
from typing import NamedTuple

import numpy as np

from dem import shapes
from dem.clumps.records import Clumps
from dem.jit import inline_jit, jit, lean_jit
from dem.layout import BLOCK as B
from dem.layout import FORCE, LOAD, MOTION, QX, UX, VX
from dem.lists.slabs import SLABS, slab_numbers
from dem.poses import Rigid
from dem.shapes import ENDLESS_M, RECORD, Mesh, Wall
from dem.shapes.wall import FIRST, SECOND


class Bodies(NamedTuple):
    """Velocity, force of the grains, driven (1) or prescribed (0), applied force, mass and damping per axis, (n, 3) each."""

    velocity: np.ndarray
    force: np.ndarray
    driven: np.ndarray
    applied: np.ndarray
    mass: np.ndarray
    damping: np.ndarray


class Surfaces(NamedTuple):
    """Kind (see `dem.shapes`), geometry record (m, RECORD), index of the material, and body of each surface."""

    kind: np.ndarray
    geometry: np.ndarray
    material: np.ndarray
    body: np.ndarray


class Glued(NamedTuple):
    """Grains that belong to a body: index of the grain, index of the body, place (n, 3) in the frame of a body that may turn."""

    grain: np.ndarray
    body: np.ndarray
    arm: np.ndarray


class Carried(NamedTuple):
    """Loads of the glued grains since their bodies got them last.

    loads (n, 6): force and Q in N, by the number in `Glued`. order (n,): those numbers slab by slab, begin (SLABS + 1,): the first
    of each slab.
    """

    loads: np.ndarray
    order: np.ndarray
    begin: np.ndarray


class Scene(NamedTuple):
    """Surroundings of the grains; their clumps, and what turns, or None.

    gravity (3,) in m/s2; period (3,) in m, 0 where not periodic.
    """

    bodies: Bodies
    surfaces: Surfaces
    glued: Glued
    clumps: Clumps | None
    rigid: Rigid | None
    gravity: np.ndarray
    period: np.ndarray


def no_glued() -> Glued:
    """No grains."""
    return Glued(np.zeros(0, np.int64), np.zeros(0, np.int64), np.zeros((0, 3)))


def arrays_of(walls: list[Wall], material_index: dict[str, int]) -> tuple[Bodies, Surfaces]:
    """Bodies and surfaces of walls; forces start at zero."""
    n = len(walls)
    bodies = Bodies(
        velocity=np.array([wall.velocity_m_s for wall in walls], float).reshape(n, 3),
        force=np.zeros((n, 3)),
        driven=np.zeros((n, 3), np.int64),
        applied=np.zeros((n, 3)),
        mass=np.ones((n, 3)),
        damping=np.zeros((n, 3)),
    )
    for k, wall in enumerate(walls):
        for drive in wall.drives:
            bodies.driven[k, drive.axis] = 1
            bodies.applied[k, drive.axis] = drive.applied_force_n
            bodies.mass[k, drive.axis], bodies.damping[k, drive.axis] = drive.mass_kg, drive.damping_kg_s
    geometry = np.array([shapes.record(wall) for wall in walls], float).reshape(n, RECORD)
    surfaces = Surfaces(
        kind=np.array([shapes.kind(wall) for wall in walls], np.int64),
        geometry=np.clip(geometry, -ENDLESS_M, ENDLESS_M),
        material=np.array([material_index[wall.material] for wall in walls], np.int64),
        body=np.arange(n),
    )
    return bodies, surfaces


def wall_now(wall: Wall, scene: Scene, w: int) -> Wall:
    """Wall w where it is now, with its velocity now."""
    moving = shapes.placed(wall, scene.surfaces.geometry[w].tolist())
    values: dict[str, tuple] = {}
    body = scene.surfaces.body[w]
    values["velocity_m_s"] = tuple(scene.bodies.velocity[body].tolist())
    if scene.rigid is not None:
        poses = scene.rigid.poses
        values["angular_velocity_rad_s"] = tuple(poses.spin[body].tolist())
        if wall.pivot_m is not None:
            values["pivot_m"] = tuple(poses.position[body].tolist())
        if isinstance(wall, Mesh):
            values["orientation"] = tuple(poses.quaternion[body].tolist())
    for name, value in values.items():
        object.__setattr__(moving, name, value)
    return moving


@lean_jit
def separation(place, o, surfaces, w):
    """Vector in m from the nearest point of surface w to the centre of the grain whose place record starts at o."""
    return shapes.separation(surfaces.kind[w], place[o], place[o + 1], place[o + 2], surfaces.geometry[w])


@inline_jit
def push(force, n, b):
    """Add the reactions of n contacts to the force (3,) on their surface."""
    x, y, z = 0.0, 0.0, 0.0
    for q in range(n):
        x += b[FORCE * B + q]
        y += b[(FORCE + 1) * B + q]
        z += b[(FORCE + 2) * B + q]
    force[0] -= x
    force[1] -= y
    force[2] -= z


@inline_jit
def sum_forces(scene, force, used):
    """Set the bodies' forces to the sum over `force` (slabs, surfaces, 3) of all used slabs, and clear that."""
    for w in range(scene.bodies.force.shape[0]):
        for t in range(3):
            scene.bodies.force[w, t] = 0.0
    for w in range(force.shape[1]):
        body = scene.surfaces.body[w]
        for t in range(3):
            total = 0.0
            for s in range(used):
                total += force[s, w, t]
                force[s, w, t] = 0.0
            scene.bodies.force[body, t] += total


def nothing_carried(n_glued: int) -> Carried:
    """Space for the loads of n_glued grains, and none of them yet."""
    return Carried(np.zeros((n_glued, 6)), np.zeros(n_glued, np.int64), np.zeros(SLABS + 1, np.int64))


@jit
def sort_by_slab(glued, outer, carried):
    """Put the glued grains in the order of the slabs of an outer list of pairs."""
    begin, number = carried.begin, slab_numbers(outer)
    begin[:] = 0
    for k in range(glued.grain.shape[0]):
        begin[1 + (number[glued.grain[k]] if number.shape[0] > 0 else 0)] += 1
    begin[:] = np.cumsum(begin)
    following = begin.copy()
    for k in range(glued.grain.shape[0]):
        s = number[glued.grain[k]] if number.shape[0] > 0 else 0
        carried.order[following[s]] = k
        following[s] += 1


@lean_jit
def take_loads(s, glued, loads, carried):
    """Add the loads on the glued grains of slab s to those that their bodies will get, and clear them."""
    zero = loads.dtype.type(0.0)
    for j in range(carried.begin[s], carried.begin[s + 1]):
        k = carried.order[j]
        a = LOAD * glued.grain[k]
        for t in range(3):
            carried.loads[k, t] += loads[a + t]
            carried.loads[k, 3 + t] += loads[a + QX + t]
        for t in range(LOAD):
            loads[a + t] = zero


@lean_jit
def wait_for_bodies(bodies, glued):
    """True if a force drives a body that carries grains: they then move with the velocity that all loads together give it."""
    for k in range(glued.grain.shape[0]):
        for t in range(3):
            if bodies.driven[glued.body[k], t] > 0:
                return True
    return False


@inline_jit
def give_forces(carried, scene):
    """Give bodies the forces on their glued grains."""
    for k in range(scene.glued.grain.shape[0]):
        for t in range(3):
            scene.bodies.force[scene.glued.body[k], t] += carried.loads[k, t]


@inline_jit
def carry_glued(grains, scene):
    """Give glued grains the velocities of their bodies."""
    bodies, glued = scene.bodies, scene.glued
    for k in range(glued.grain.shape[0]):
        w = glued.body[k]
        i = MOTION * glued.grain[k]
        for t in range(3):
            grains.motion[i + VX + t] = bodies.velocity[w, t]
            grains.motion[i + UX + t] = 0.0
            grains.remainder[i + VX + t] = 0.0
            grains.remainder[i + UX + t] = 0.0


@inline_jit
def geometry_ahead(scene, dt, geometry):
    """Fill geometry (steps, surfaces, RECORD) with the surfaces now and after each of the next steps, at constant velocity."""
    surfaces, velocity = scene.surfaces, scene.bodies.velocity
    for k in range(geometry.shape[0]):
        for w in range(surfaces.kind.shape[0]):
            for t in range(RECORD):
                geometry[k, w, t] = surfaces.geometry[w, t] if k == 0 else geometry[k - 1, w, t]
            for t in range(3 if k else 0):
                geometry[k, w, FIRST + t] += velocity[surfaces.body[w], t] * dt
                geometry[k, w, SECOND + t] += velocity[surfaces.body[w], t] * dt


@lean_jit
def fastest_body(bodies):
    """Speed of the fastest body in m/s."""
    fastest = 0.0
    for w in range(bodies.velocity.shape[0]):
        v = bodies.velocity[w]
        fastest = max(fastest, v[0] * v[0] + v[1] * v[1] + v[2] * v[2])
    return math.sqrt(fastest)


@inline_jit
def move_bodies(scene, dt):
    """Drive and displace every body by one step; returns the largest speed in m/s. `force` must hold this step's forces."""
    bodies, surfaces = scene.bodies, scene.surfaces
    for w in range(bodies.velocity.shape[0]):
        for axis in range(3):
            if bodies.driven[w, axis] > 0:
                mass, v = bodies.mass[w, axis], bodies.velocity[w, axis]
                pushed = v + dt * (bodies.force[w, axis] + bodies.applied[w, axis]) / mass
                bodies.velocity[w, axis] = pushed / (1.0 + dt * bodies.damping[w, axis] / mass)
    for w in range(surfaces.kind.shape[0]):
        for t in range(3):
            surfaces.geometry[w, FIRST + t] += bodies.velocity[surfaces.body[w], t] * dt
            surfaces.geometry[w, SECOND + t] += bodies.velocity[surfaces.body[w], t] * dt
    return fastest_body(bodies)
