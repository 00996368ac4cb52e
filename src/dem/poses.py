"""Bodies that turn: pose, rate of turn and torque, beside what `dem.bodies` holds of every body.

A surface that turns about x0 at the rate w moves at the point c with V + w x (c - x0). The rotation of a body is prescribed, driven
about a fixed axis, I dw/dt = T_grains + T_applied - c w, or free: dL/dt = T about the principal axes of the body.
Boxes and tubes turn without changing shape: they only rub. Meshes and glued grains turn with their body.
"""

import math
from typing import NamedTuple

import numpy as np

from dem.clumps.motion import rotate_block, turn_block
from dem.clumps.records import BLOCK as ROW
from dem.clumps.records import INV_MOMENTS, MOMENTUM, QUATERNION, ROTATION, ROWS, SPIN, rotation_of
from dem.jit import inline_jit, lean_jit
from dem.layout import APPROACH, FORCE, MOTION, PLACE, RADIUS, SECOND_SPIN, SEPARATION, TWIST, UX, VX
from dem.layout import BLOCK as B
from dem.lists.grid import nearest
from dem.meshes.search import Grid
from dem.meshes.triangles import Triangles
from dem.shapes import Wall
from dem.shapes.wall import FreeTurn, TurnDrive

#: Control of a body's rotation.
PRESCRIBED, DRIVEN, FREE = range(3)


class Poses(NamedTuple):
    """Of n bodies: position of x0 (n, 3), quaternion (n, 4), rotation from the body's frame to space (n, 9), rate of turn (n, 3).

    torque (n, 3): of the grains, about x0. control (n,); axis (n, 3), inertia (n, 3): about the axis (first value) or principal
    moments; applied torque (n, 3), damping (n,), angular momentum (n, 3). size (n,): distance in m of the farthest point that turns
    from x0. work: for `turn_block`.
    """

    position: np.ndarray
    quaternion: np.ndarray
    rotation: np.ndarray
    spin: np.ndarray
    torque: np.ndarray
    control: np.ndarray
    axis: np.ndarray
    inertia: np.ndarray
    applied: np.ndarray
    damping: np.ndarray
    momentum: np.ndarray
    size: np.ndarray
    work: np.ndarray


class Ahead(NamedTuple):
    """Poses of n bodies now and after each of the next steps, at constant velocity and rate of turn.

    position (steps, n, 3) and rotation (steps, n, 9) as in `Poses`; quaternion (n, 4) after the last of them.
    """

    position: np.ndarray
    rotation: np.ndarray
    quaternion: np.ndarray


class Rigid(NamedTuple):
    """What kernels read of bodies that turn, and of meshes."""

    poses: Poses
    triangles: Triangles
    grid: Grid


def poses_of(walls: list[Wall]) -> Poses:
    """Poses of walls as they are now."""
    n = len(walls)
    quaternion = np.array([wall.turned for wall in walls], float).reshape(n, 4)
    rotation = rotation_of(quaternion) if n else np.zeros((0, 3, 3))
    poses = Poses(
        position=np.array([wall.pivot for wall in walls], float).reshape(n, 3),
        quaternion=quaternion,
        rotation=rotation.reshape(n, 9),
        spin=np.array([wall.angular_velocity_rad_s for wall in walls], float).reshape(n, 3),
        torque=np.zeros((n, 3)),
        control=np.zeros(n, np.int64),
        axis=np.zeros((n, 3)),
        inertia=np.ones((n, 3)),
        applied=np.zeros((n, 3)),
        damping=np.zeros(n),
        momentum=np.zeros((n, 3)),
        size=np.array([wall.turning_radius_m for wall in walls], float),
        work=np.zeros(ROWS * ROW),
    )
    for w, wall in enumerate(walls):
        turn = wall.turn
        if isinstance(turn, TurnDrive):
            poses.control[w], poses.damping[w], poses.inertia[w] = DRIVEN, turn.damping_n_m_s, turn.inertia_kg_m2
            poses.axis[w] = np.array(turn.axis) / np.linalg.norm(turn.axis)
            poses.applied[w] = turn.applied_torque_n_m * poses.axis[w]
        elif isinstance(turn, FreeTurn):
            poses.control[w], poses.inertia[w], poses.applied[w] = FREE, turn.moments_kg_m2, turn.applied_torque_n_m
            poses.momentum[w] = rotation[w] @ (poses.inertia[w] * (rotation[w].T @ poses.spin[w]))
    return poses


def arms(poses: Poses | None, body: np.ndarray, places: np.ndarray) -> np.ndarray:
    """Places (n, 3) in space in the frames of the bodies (n,) that carry them; zero where no body may turn."""
    if poses is None:
        return np.zeros((len(body), 3))
    return np.einsum("kij,ki->kj", poses.rotation[body].reshape(-1, 3, 3), places - poses.position[body])


@inline_jit
def turn(poses, w, dt):
    """Drive and turn body w by one step; `torque` must hold this step's torque."""
    if poses.control[w] == FREE:
        turn_free(poses, w, dt)
        return
    if poses.control[w] == DRIVEN:
        push, rate = 0.0, 0.0
        for t in range(3):
            push += poses.axis[w, t] * (poses.torque[w, t] + poses.applied[w, t])
            rate += poses.axis[w, t] * poses.spin[w, t]
        rate = (rate + dt * push / poses.inertia[w, 0]) / (1.0 + dt * poses.damping[w] / poses.inertia[w, 0])
        for t in range(3):
            poses.spin[w, t] = rate * poses.axis[w, t]
    turn_at_rate(poses.spin[w], poses.quaternion[w], poses.rotation[w], poses.work, dt)


@lean_jit
def turn_at_rate(spin, quaternion, rotation, work, dt):
    """Turn a body by one step at its rate; overwrites quaternion and rotation. work : as in `Poses`."""
    wx, wy, wz = spin[0], spin[1], spin[2]
    rate = math.sqrt(wx * wx + wy * wy + wz * wz)
    if rate > 0.0:
        sin = math.sin(0.5 * rate * dt) / rate
        turn_by(quaternion, math.cos(0.5 * rate * dt), sin * wx, sin * wy, sin * wz)
        set_rotation(quaternion, rotation, work)


@lean_jit
def turn_by(q, a, b, c, d):
    """Turn a quaternion in space by another (a, b, c, d), and keep its length."""
    w, x, y, z = q[0], q[1], q[2], q[3]
    q[0], q[1] = a * w - b * x - c * y - d * z, a * x + b * w + c * z - d * y
    q[2], q[3] = a * y - b * z + c * w + d * x, a * z + b * y - c * x + d * w
    norm = 1.0 / math.sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3])
    for t in range(4):
        q[t] *= norm


@lean_jit
def set_rotation(quaternion, rotation, work):
    """Set the rotation of a body by its quaternion."""
    for t in range(4):
        work[(QUATERNION + t) * ROW] = quaternion[t]
    rotate_block(1, work)
    for t in range(9):
        rotation[t] = work[(ROTATION + t) * ROW]


@lean_jit
def turn_free(poses, w, dt):
    """As `turn`, for a free rotation: the splitting of `dem.clumps.motion`."""
    work = poses.work
    for t in range(3):
        poses.momentum[w, t] += dt * (poses.torque[w, t] + poses.applied[w, t])
        work[(MOMENTUM + t) * ROW], work[(INV_MOMENTS + t) * ROW] = poses.momentum[w, t], 1.0 / poses.inertia[w, t]
    for t in range(4):
        work[(QUATERNION + t) * ROW] = poses.quaternion[w, t]
    for t in range(9):
        work[(ROTATION + t) * ROW] = poses.rotation[w, t]
    turn_block(1, work, dt)
    rotate_block(1, work)
    for t in range(3):
        poses.spin[w, t] = work[(SPIN + t) * ROW]
    for t in range(4):
        poses.quaternion[w, t] = work[(QUATERNION + t) * ROW]
    for t in range(9):
        poses.rotation[w, t] = work[(ROTATION + t) * ROW]


@inline_jit
def turn_bodies(rigid, grains, scene, dt):
    """Turn every body by one step, after `dem.bodies.move_bodies`, and place the grains glued to them. rigid : None, or Rigid."""
    if rigid is not None:
        turn_all(rigid.poses, grains, scene, dt)


@lean_jit
def turn_all(poses, grains, scene, dt):
    """As `turn_bodies`."""
    for w in range(poses.size.shape[0]):
        for t in range(3):
            poses.position[w, t] += scene.bodies.velocity[w, t] * dt
        turn(poses, w, dt)
    glued = scene.glued
    for k in range(glued.grain.shape[0]):
        w, i = glued.body[k], PLACE * glued.grain[k]
        x, y, z = to_space(poses.rotation[w], glued.arm[k, 0], glued.arm[k, 1], glued.arm[k, 2])
        grains.place[i] = poses.position[w, 0] + x
        grains.place[i + 1] = poses.position[w, 1] + y
        grains.place[i + 2] = poses.position[w, 2] + z


def no_poses(n_steps: int, n_bodies: int) -> Ahead:
    """Space for the poses of n_steps steps."""
    return Ahead(np.zeros((n_steps, n_bodies, 3)), np.zeros((n_steps, n_bodies, 9)), np.zeros((n_bodies, 4)))


@inline_jit
def poses_ahead(rigid, bodies, dt, ahead, n_steps):
    """Fill `ahead` for n_steps steps. rigid : None, or Rigid; ahead : None, or Ahead."""
    if rigid is not None:
        look_ahead(rigid.poses, bodies.velocity, dt, ahead, n_steps)


@lean_jit
def look_ahead(poses, velocity, dt, ahead, n_steps):
    """As `poses_ahead`."""
    for w in range(poses.size.shape[0]):
        for t in range(4):
            ahead.quaternion[w, t] = poses.quaternion[w, t]
        for k in range(n_steps):
            for t in range(3):
                ahead.position[k, w, t] = ahead.position[k - 1, w, t] + velocity[w, t] * dt if k else poses.position[w, t]
            for t in range(9):
                ahead.rotation[k, w, t] = ahead.rotation[k - 1, w, t] if k else poses.rotation[w, t]
            if k:
                turn_at_rate(poses.spin[w], ahead.quaternion[w], ahead.rotation[k, w], poses.work, dt)


@inline_jit
def rigid_at(rigid, ahead, step):
    """What kernels read of bodies in one of the fused steps. rigid : None, or Rigid; ahead : None, or Ahead."""
    if rigid is None:
        return None
    else:  # noqa: RET505  # numba prunes the branch of a missing type only in this form
        p = rigid.poses
        poses = Poses(
            ahead.position[step],
            p.quaternion,
            ahead.rotation[step],
            p.spin,
            p.torque,
            p.control,
            p.axis,
            p.inertia,
            p.applied,
            p.damping,
            p.momentum,
            p.size,
            p.work,
        )
        return Rigid(poses, rigid.triangles, rigid.grid)


@inline_jit
def keep_turning(rigid, glued):
    """True if all bodies turn as prescribed, and none that turns carries grains. rigid : None, or Rigid."""
    if rigid is None:
        return True
    else:  # noqa: RET505  # numba prunes the branch of a missing type only in this form
        return have_no_drive(rigid.poses, glued)


@lean_jit
def have_no_drive(poses, glued):
    """As `keep_turning`."""
    for w in range(poses.size.shape[0]):
        if poses.control[w] != PRESCRIBED:
            return False
    for k in range(glued.body.shape[0]):
        for t in range(3):
            if poses.spin[glued.body[k], t] != 0.0:
                return False
    return True


@inline_jit
def fastest_surface(rigid, bodies, speed):
    """Largest speed in m/s of any point of a body; speed : that of the fastest x0."""
    if rigid is None:
        return speed
    else:  # noqa: RET505  # numba prunes the branch of a missing type only in this form
        return fastest_point(rigid.poses, bodies, speed)


@lean_jit
def fastest_point(poses, bodies, speed):
    """As `fastest_surface`."""
    for w in range(poses.size.shape[0]):
        v, u = bodies.velocity[w], poses.spin[w]
        of_turn = poses.size[w] * math.sqrt(u[0] * u[0] + u[1] * u[1] + u[2] * u[2])
        speed = max(speed, math.sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]) + of_turn)
    return speed


@inline_jit
def to_space(r, x, y, z):
    """A vector of a body's frame in space; r (9,): its rotation."""
    return r[0] * x + r[1] * y + r[2] * z, r[3] * x + r[4] * y + r[5] * z, r[6] * x + r[7] * y + r[8] * z


@inline_jit
def to_body(r, x, y, z):
    """A vector in a body's frame; r (9,): its rotation."""
    return r[0] * x + r[3] * y + r[6] * z, r[1] * x + r[4] * y + r[7] * z, r[2] * x + r[5] * y + r[8] * z


@inline_jit
def from_pivot(poses, w, x, y, z, images):
    """Vector in m from x0 of body w, or of its nearest image, to a point; images : None, or `dem.layout.Period`."""
    p = poses.position[w]
    return nearest(x - p[0], 0, images), nearest(y - p[1], 1, images), nearest(z - p[2], 2, images)


@inline_jit
def rub(rigid, w, places, n, b, access):
    """Give n contacts in the work buffer, separations included, the motion that body w has at them by its rate of turn.

    rigid : None, or Rigid. places : see `dem.step.gather.gather_at_surface`.
    """
    if rigid is not None:
        turn_velocities(rigid.poses, w, places, n, b, access.images)
        turn_second_spin(rigid.poses, w, places, n, b, access.spins)


@lean_jit
def turn_velocities(poses, w, places, n, b, images):
    """Subtract w x (c - x0) from the relative velocities; c is the nearest point of the surface."""
    wx, wy, wz = poses.spin[w, 0], poses.spin[w, 1], poses.spin[w, 2]
    if wx == 0.0 and wy == 0.0 and wz == 0.0:
        return
    for q in range(n):
        x, y, z = from_pivot(poses, w, places[q], places[B + q], places[2 * B + q], images)
        x, y, z = x - b[SEPARATION * B + q], y - b[(SEPARATION + 1) * B + q], z - b[(SEPARATION + 2) * B + q]
        b[APPROACH * B + q] -= wy * z - wz * y
        b[(APPROACH + 1) * B + q] -= wz * x - wx * z
        b[(APPROACH + 2) * B + q] -= wx * y - wy * x


@lean_jit
def turn_second_spin(poses, w, places, n, b, spins):
    """Second spin velocities are those of a large grain j that turns with the body: p_j u_j = r_i w. spins : see `Access`."""
    if spins is not None:
        for q in range(n):
            for t in range(3):
                b[(SECOND_SPIN + t) * B + q] = poses.spin[w, t] * places[3 * B + q]


@inline_jit
def wrench(rigid, w, torque, places, n, b, images):
    """Add the torque of n contacts' loads about x0 of body w to `torque` (3,): the opposite of theirs on the grains."""
    if rigid is not None:
        add_torque(rigid.poses, w, torque, places, n, b, images)


@lean_jit
def add_torque(poses, w, torque, places, n, b, images):
    """As `wrench`."""
    tx, ty, tz = 0.0, 0.0, 0.0
    for q in range(n):
        x, y, z = from_pivot(poses, w, places[q], places[B + q], places[2 * B + q], images)
        r = places[3 * B + q]
        fx, fy, fz = float(b[FORCE * B + q]), float(b[(FORCE + 1) * B + q]), float(b[(FORCE + 2) * B + q])
        tx += y * fz - z * fy + r * b[TWIST * B + q]
        ty += z * fx - x * fz + r * b[(TWIST + 1) * B + q]
        tz += x * fy - y * fx + r * b[(TWIST + 2) * B + q]
    torque[0] -= tx
    torque[1] -= ty
    torque[2] -= tz


@inline_jit
def sum_torques(rigid, surfaces, torque, used):
    """Set the bodies' torques to the sum over `torque` (slabs, surfaces, 3) of all used slabs, and clear that."""
    if rigid is not None:
        add_slabs(rigid.poses, surfaces, torque, used)


@lean_jit
def add_slabs(poses, surfaces, torque, used):
    """As `sum_torques`."""
    for w in range(poses.size.shape[0]):
        for t in range(3):
            poses.torque[w, t] = 0.0
    for w in range(torque.shape[1]):
        for t in range(3):
            for s in range(used):
                poses.torque[surfaces.body[w], t] += torque[s, w, t]
                torque[s, w, t] = 0.0


@inline_jit
def give_torques(rigid, grains, carried, glued):
    """Give bodies the torques of the loads on their glued grains. rigid : None, or Rigid."""
    if rigid is not None:
        add_torques_of(rigid.poses, grains, carried.loads, glued)


@lean_jit
def add_torques_of(poses, grains, loads, glued):
    """As `give_torques`."""
    for k in range(glued.grain.shape[0]):
        w, r = glued.body[k], grains.place[PLACE * glued.grain[k] + RADIUS]
        x, y, z = to_space(poses.rotation[w], glued.arm[k, 0], glued.arm[k, 1], glued.arm[k, 2])
        fx, fy, fz = loads[k, 0], loads[k, 1], loads[k, 2]
        poses.torque[w, 0] += y * fz - z * fy + r * loads[k, 3]
        poses.torque[w, 1] += z * fx - x * fz + r * loads[k, 4]
        poses.torque[w, 2] += x * fy - y * fx + r * loads[k, 5]


@inline_jit
def turn_glued(rigid, grains, scene):
    """Give glued grains the motion of the turning bodies. After `dem.bodies.carry_glued`. rigid : None, or Rigid."""
    if rigid is not None:
        turn_each(rigid.poses, grains, scene.bodies, scene.glued)


@lean_jit
def turn_each(poses, grains, bodies, glued):
    """As `turn_glued`."""
    number = grains.motion.dtype.type
    for k in range(glued.grain.shape[0]):
        w, i, o = glued.body[k], MOTION * glued.grain[k], PLACE * glued.grain[k]
        x, y, z = to_space(poses.rotation[w], glued.arm[k, 0], glued.arm[k, 1], glued.arm[k, 2])
        r, (wx, wy, wz) = grains.place[o + RADIUS], (poses.spin[w, 0], poses.spin[w, 1], poses.spin[w, 2])
        grains.motion[i + VX] = number(bodies.velocity[w, 0] + wy * z - wz * y)
        grains.motion[i + VX + 1] = number(bodies.velocity[w, 1] + wz * x - wx * z)
        grains.motion[i + VX + 2] = number(bodies.velocity[w, 2] + wx * y - wy * x)
        for t in range(3):
            grains.motion[i + UX + t] = number(r * poses.spin[w, t])
