"""Arrays of the clumps in a simulation, and how they are made, chosen and read.

Members are grains like all others: lists, walls and contact laws do not know that they belong together. Their motion follows from
their clump's (`dem.clumps.motion`); of a member's record, the inverse mass is its clump's, which the dashpots of its contacts take.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from dem.clumps.mix import Shape
from dem.html import Rich
from dem.material import require

#: Rows of a block of clumps. State: centre (m), quaternion that turns the body frame to space, velocity (m/s), angular momentum
#: about the centre in space (kg m2/s); velocity and angular momentum stand half a step behind, as those of grains.
CENTRE, QUATERNION, VELOCITY, MOMENTUM = 0, 3, 7, 10
#: Constants: 1/m (1/kg), 1/I about the axes of the body frame (1/(kg m2)), radius of the sphere of equal volume (m).
INV_MASS, INV_MOMENTS, SIZE = 13, 14, 17
#: Of this step: force, torque about the centre, the largest torque that opposes spin; rotation from body frame to space, row by
#: row; angular velocity in space.
FORCE, TORQUE, BRAKE, ROTATION, SPIN = 18, 21, 24, 25, 34
ROWS = 37

AT_REST = (0.0, 0.0, 0.0)


#: Clumps in a block: few enough that it stays in the first-level cache while one loop after the other passes over it.
BLOCK = 64
#: Clumps that vector code takes at a time.
FOUR = 4


class Clumps(NamedTuple):
    """Clumps of a simulation, for the kernels.

    blocks (blocks, ROWS x BLOCK): values of clump b stand at [b // BLOCK, row * BLOCK + b % BLOCK]. begin (n + 1,): members of
    clump b are begin[b] to begin[b + 1]; grain (m,), arm (m, 4): index of the grain; place in the body frame, and radius, in m.
    owner (grains,): clump of every grain, -1 without. others : grains without.
    For vector code, each FOUR clumps but the few left over have lanes of one member each: those of clumps FOUR g and on are
    lane[g] to lane[g + 1], as many as the largest of them has members, and of the others the last comes again;
    lane_grain (lanes, FOUR), lane_arm (lanes, 4, FOUR): as grain and arm.
    """

    blocks: np.ndarray
    begin: np.ndarray
    grain: np.ndarray
    arm: np.ndarray
    owner: np.ndarray
    others: np.ndarray
    lane: np.ndarray
    lane_grain: np.ndarray
    lane_arm: np.ndarray


class NewClumps(NamedTuple):
    """Clumps to be added: table (n, ROWS), kinds (n,), number of members (n,), their arms as in `Clumps` (m, 4)."""

    table: np.ndarray
    kind: np.ndarray
    n_members: np.ndarray
    arm: np.ndarray

    @property
    def owner(self) -> np.ndarray:
        """Clump of every member (m,)."""
        return np.repeat(np.arange(len(self.table)), self.n_members)


class Members(NamedTuple):
    """Members of new clumps, clump by clump: positions, velocities, angular velocities (m, 3), radii (m,)."""

    positions: np.ndarray
    velocities: np.ndarray
    spins: np.ndarray
    radii: np.ndarray


@dataclass(frozen=True)
class ClumpStates(Rich):
    """A copy of the clumps' state, in the order in which they were added.

    Attributes
    ----------
    positions_m, velocities_m_s, angular_velocities_rad_s : (n, 3), of the centres of mass.
    orientations : (n, 4), quaternions (w, x, y, z) that turn the frame of the prototype's spheres to space.
    radii_m, masses_kg : (n,), radii of the spheres of equal volume. moments_kg_m2 : (n, 3), about the axes of that frame.
    members : grains of each clump, as numbered in `Simulation.grains`.
    """

    positions_m: np.ndarray
    orientations: np.ndarray
    velocities_m_s: np.ndarray
    angular_velocities_rad_s: np.ndarray
    radii_m: np.ndarray
    masses_kg: np.ndarray
    moments_kg_m2: np.ndarray
    members: list[np.ndarray]

    def __len__(self):
        return len(self.radii_m)

    def __repr__(self):
        return f"ClumpStates({len(self)} clumps)"


def table_of(clumps: Clumps | None) -> np.ndarray:
    """Values of the clumps (n, ROWS), a copy; none without clumps."""
    if clumps is None:
        return np.zeros((0, ROWS))
    table = clumps.blocks.reshape(-1, ROWS, BLOCK).transpose(0, 2, 1).reshape(-1, ROWS)
    return table[: len(clumps.begin) - 1].copy()  # of a single block it is a view


def states_of(clumps: Clumps | None, ids: np.ndarray) -> ClumpStates:
    """State of the clumps; ids (n,): number of every grain in the order of addition."""
    table = table_of(clumps)
    number = np.argsort(np.argsort(ids))
    members = [] if clumps is None else np.split(number[clumps.grain], clumps.begin[1:-1])[: len(table)]
    order = np.argsort([of_clump[0] for of_clump in members]).astype(int)
    table = table[order]
    return ClumpStates(
        positions_m=table[:, CENTRE : CENTRE + 3],
        orientations=table[:, QUATERNION : QUATERNION + 4],
        velocities_m_s=table[:, VELOCITY : VELOCITY + 3],
        angular_velocities_rad_s=angular_velocities(table),
        radii_m=table[:, SIZE],
        masses_kg=1.0 / table[:, INV_MASS],
        moments_kg_m2=1.0 / table[:, INV_MOMENTS : INV_MOMENTS + 3],
        members=[members[b] for b in order],
    )


def clumps_of(table: np.ndarray, n_members: np.ndarray, grain: np.ndarray, arm: np.ndarray, n_grains: int) -> Clumps:
    """Clumps of a table (n, ROWS); the other arguments as in `Clumps` and `NewClumps`."""
    n = len(table)
    padded = np.zeros(((n + BLOCK - 1) // BLOCK * BLOCK, ROWS))
    padded[:n] = table
    blocks = np.ascontiguousarray(padded.reshape(-1, BLOCK, ROWS).transpose(0, 2, 1)).reshape(-1, ROWS * BLOCK)
    owner = np.full(n_grains, -1, np.int32)
    owner[grain] = np.repeat(np.arange(n), n_members)
    begin = np.concatenate([[0], np.cumsum(n_members)]).astype(np.int64)
    lane, entry = lanes_of(begin)
    grain = grain.astype(np.int64)
    lane_arm = np.ascontiguousarray(arm[entry].transpose(0, 2, 1))
    return Clumps(blocks, begin, grain, arm, owner, np.flatnonzero(owner < 0), lane, grain[entry], lane_arm)


def lanes_of(begin: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """First lane of each FOUR clumps (groups + 1,), and entries in `Clumps.grain` of the members of every lane (lanes, FOUR)."""
    whole = (len(begin) - 1) // FOUR * FOUR
    first, last = begin[:whole].reshape(-1, FOUR), begin[1 : whole + 1].reshape(-1, FOUR) - 1
    n_lanes = (last - first).max(axis=1, initial=-1) + 1
    lane = np.concatenate([[0], np.cumsum(n_lanes)]).astype(np.int64)
    group = np.repeat(np.arange(len(n_lanes)), n_lanes)
    turn = np.arange(len(group)) - lane[group]
    return lane, np.minimum(first[group] + turn[:, None], last[group])


def selected(clumps: Clumps | None, number: np.ndarray, new: NewClumps | None, n_grains: int) -> Clumps | None:
    """The clumps after grain k became number[k] (-1: removed) and new ones, with the last grains as members, came.

    A clump without its first member is gone. Clumps stand in the order of their first members in memory.
    """
    if clumps is None and new is None:
        return None
    old = clumps or clumps_of(np.zeros((0, ROWS)), np.zeros(0, np.int64), np.zeros(0, np.int64), np.zeros((0, 4)), 0)
    grain, n_members, table, arm = number[old.grain], np.diff(old.begin), table_of(old), old.arm
    if new is not None:
        grain = np.concatenate([grain, np.arange(n_grains - len(new.arm), n_grains)])
        n_members, table, arm = (
            np.concatenate(parts) for parts in ((n_members, new.n_members), (table, new.table), (arm, new.arm))
        )
    first = np.cumsum(n_members) - n_members
    order = np.argsort(grain[first], kind="stable") if len(first) else first
    order = order[grain[first[order]] >= 0]
    member = np.concatenate([[], *(np.arange(first[b], first[b] + n_members[b]) for b in order)]).astype(np.int64)
    return clumps_of(table[order], n_members[order], grain[member], arm[member], n_grains)


def new_clumps(
    shape: Shape, kinds: np.ndarray, positions, radii, quaternions, velocities, spins, density_kg_m3: float
) -> NewClumps:
    """Clumps of a shape's kinds (n,): positions, velocities, spins (n, 3), radii of equal volume (n,), quaternions (n, 4)."""
    n, spheres = len(radii), np.concatenate([clump.spheres for clump in shape.shapes])
    n_spheres = np.array([clump.n_spheres for clump in shape.shapes])
    mass = density_kg_m3 * 4.0 / 3.0 * np.pi * radii**3
    moments = mass[:, None] * radii[:, None] ** 2 * np.array([clump.moments for clump in shape.shapes])[kinds]
    rotation = rotation_of(quaternions)
    in_body = np.einsum("bij,bi->bj", rotation, spins)
    table = np.zeros((n, ROWS))
    table[:, CENTRE : CENTRE + 3], table[:, QUATERNION : QUATERNION + 4] = positions, quaternions
    table[:, VELOCITY : VELOCITY + 3] = velocities
    table[:, MOMENTUM : MOMENTUM + 3] = np.einsum("bij,bj->bi", rotation, moments * in_body)
    table[:, ROTATION : ROTATION + 9] = rotation.reshape(n, 9)
    table[:, INV_MASS], table[:, INV_MOMENTS : INV_MOMENTS + 3], table[:, SIZE] = 1.0 / mass, 1.0 / moments, radii
    n_members = n_spheres[kinds]
    owner = np.repeat(np.arange(n), n_members)
    first = (np.cumsum(n_spheres) - n_spheres)[kinds]
    members = spheres[first[owner] + np.arange(len(owner)) - (np.cumsum(n_members) - n_members)[owner]]
    return NewClumps(table, kinds, n_members, radii[owner, None] * members)


def members_of(new: NewClumps) -> Members:
    """Members of new clumps."""
    owner, spins = new.owner, angular_velocities(new.table)
    turns = rotation_of(new.table[:, QUATERNION : QUATERNION + 4])
    arms = np.einsum("mij,mj->mi", turns[owner], new.arm[:, :3])
    return Members(
        positions=new.table[owner, CENTRE : CENTRE + 3] + arms,
        velocities=new.table[owner, VELOCITY : VELOCITY + 3] + np.cross(spins[owner], arms),
        spins=spins[owner],
        radii=new.arm[:, 3],
    )


def unit_quaternions(orientations, n: int) -> np.ndarray:
    """Quaternions (n, 4) of norm 1; orientations : one or n of any other norm, or None for no turn. Refuses what is no rotation."""
    turns = np.asarray((1.0, 0.0, 0.0, 0.0) if orientations is None else orientations, float)
    require(turns.shape in ((4,), (n, 4)), "shape of orientations", turns.shape, f"(4,) or ({n}, 4)")
    norms = np.linalg.norm(np.atleast_2d(turns), axis=1, keepdims=True)
    require(bool((np.isfinite(norms) & (norms > 0.0)).all()), "orientations", "zero or not finite", "quaternions")
    return np.broadcast_to(np.atleast_2d(turns) / norms, (n, 4))


def rotation_of(quaternions: np.ndarray) -> np.ndarray:
    """Rotations (n, 3, 3) of quaternions (w, x, y, z) (n, 4) of norm 1."""
    w, x, y, z = quaternions.T
    rows = [
        [w * w + x * x - y * y - z * z, 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)],
        [2.0 * (x * y + w * z), w * w - x * x + y * y - z * z, 2.0 * (y * z - w * x)],
        [2.0 * (x * z - w * y), 2.0 * (y * z + w * x), w * w - x * x - y * y + z * z],
    ]
    return np.array(rows).reshape(3, 3, -1).transpose(2, 0, 1)


def random_orientations(n: int, rng: np.random.Generator) -> np.ndarray:
    """N quaternions (n, 4), uniform over all rotations: a normal vector in four dimensions has no preferred direction."""
    quaternions = rng.standard_normal((n, 4))
    return quaternions / np.linalg.norm(quaternions, axis=1)[:, None]


def angular_velocities(table: np.ndarray) -> np.ndarray:
    """Angular velocities in space in rad/s (n, 3)."""
    rotation = rotation_of(table[:, QUATERNION : QUATERNION + 4])
    in_body = np.einsum("bij,bi->bj", rotation, table[:, MOMENTUM : MOMENTUM + 3])
    return np.einsum("bij,bj->bi", rotation, in_body * table[:, INV_MOMENTS : INV_MOMENTS + 3])


def kinetic_energies(clumps: Clumps | None) -> tuple[float, float]:
    """Kinetic energy of translation and rotation in J."""
    table = table_of(clumps)
    translation = 0.5 * ((table[:, VELOCITY : VELOCITY + 3] ** 2).sum(axis=1) / table[:, INV_MASS]).sum()
    rotation = 0.5 * (table[:, MOMENTUM : MOMENTUM + 3] * angular_velocities(table)).sum()
    return float(translation), float(rotation)


def potential_energy(clumps: Clumps | None, gravity: np.ndarray) -> float:
    """Potential energy in J."""
    table = table_of(clumps)
    return -float(((table[:, CENTRE : CENTRE + 3] @ gravity) / table[:, INV_MASS]).sum())
