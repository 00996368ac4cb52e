"""Energy ledger: what the grains and springs hold, what the contacts lose, what the walls do, booked at every step.

    kinetic + potential + normal springs + tangential springs + rolling springs
        = work of the walls + exchanged - dissipated + springs remade + residual

The contact laws are evaluated a second time here, by the same functions (`dem.contact.model`) but in float64 and apart from the
fast kernels, whose loads appear in the kinetic energy. Every power is a force times the mean of the velocities before and after
the step, which equals the change of the kinetic energy. Dissipated energy = work done on the contact minus the change of its
spring's energy (dashpot and sliding together: where a contact slides, the law has no separate dashpot). `residual` is the
imbalance: the time integration's error.

"Springs remade" belongs to the law: the tangential stiffness 8 G* sqrt(R* delta) changes with the overlap while the spring
keeps its elongation, and the part of a spring along a turning normal is dropped. That adds or removes energy at any time step
(Elata & Berryman 1996, Mech. Mater. 24, 229).
"""

import math
from typing import NamedTuple

import numpy as np

from dem import bodies
from dem.clumps.motion import book_clumps
from dem.contact.laws.mindlin import flat, slip
from dem.contact.laws.rolling_a import braked
from dem.contact.model import (
    Numbers,
    Touch,
    acting_damping,
    deformation,
    n_constants,
    n_history,
    normal_energy,
    normal_force,
    read,
    rolling_spring,
    shrink,
    spring_force,
    tangential_damping,
    tangential_energy,
    tangential_limit,
    tangential_stiffness,
    torn_energy,
    touches,
)
from dem.jit import jit
from dem.layout import (
    BLOCK,
    FREE,
    GEOMETRY,
    INV_R_SUM,
    INVERSE_MASS,
    LOAD,
    MOTION,
    PLACE,
    QX,
    RADIUS,
    RESIST,
    SHARE,
    SPEEDS,
    UX,
    VX,
    GrainArrays,
)
from dem.lists.grid import nearest
from dem.lists.slabs import SLABS
from dem.step.motion import velocity

#: Entries of the ledger (J). The first six are current values, the others accumulate from the start.
ENTRIES = (
    "kinetic",
    "potential",
    "normal_springs",
    "tangential_springs",
    "rolling_springs",
    "kinetic_after",
    "normal_dashpots",
    "sliding",
    "rolling",
    "work_of_walls",
    "springs_remade",
)
(
    KINETIC,
    POTENTIAL,
    NORMAL_SPRINGS,
    TANGENTIAL_SPRINGS,
    ROLLING_SPRINGS,
    KINETIC_AFTER,
    NORMAL_DASHPOTS,
    SLIDING,
    ROLLING,
    WORK_OF_WALLS,
    SPRINGS_REMADE,
) = range(len(ENTRIES))

#: Columns of the notes on a contact between `note_contacts` and `book_contacts`: normal (3), force of the normal dashpot,
#: tangential force (3), gain of its spring, force of the rolling spring (3), its gain, d / R_sum.
NORMAL, DASHPOT, FORCE, GAIN, ROLLING_FORCE, ROLLING_GAIN, ARM, NOTES = 0, 3, 4, 7, 8, 11, 12, 13

#: Stands in for zero in float64, as `dem.contact.model.TINY` does in the contact precision.
TINY = 1e-150


class Ledger(NamedTuple):
    """Entries (len(ENTRIES),) in J, and space for notes on contacts of pairs and surfaces, (NOTES,) each."""

    entries: np.ndarray
    pairs: np.ndarray
    surfaces: np.ndarray


class At(NamedTuple):
    """One contact: grain i, grain or surface j, its constants and history (from their first value on)."""

    i: int
    j: int
    constants: np.ndarray
    history: np.ndarray


@jit
def note_contacts(s, contacts, scene, run, notes, entries):
    """Evaluate the laws of the contacts of slab or part s at the grains' state, before the kernels change their history.

    scene : None for contacts between grains, else with their surfaces. Sets `notes` and adds the springs' energies to `entries`.
    """
    for k in range(contacts.begin[s], contacts.begin[s] + contacts.count[s]):
        q = k % BLOCK
        c = contacts.common[0, q:] if contacts.alike[0] else contacts.constants[k // BLOCK, q:]
        at = At(contacts.first[k], contacts.second[k], c, contacts.history[k // BLOCK, q:])
        note_contact(at, scene, run, notes[k], entries)


@jit
def note_contact(at, scene, run, note, entries):
    """The part of `note_contacts` for one contact; elongations before the step are those left after turning with the normal."""
    grains, laws, c, h = run.state.grains, run.model.laws, at.constants, at.history
    dt = float(laws.numbers.dt)
    note[:] = 0.0
    nx, ny, nz = separation(grains, at.i, at.j, scene, run.model.access.images)
    d = math.sqrt(nx * nx + ny * ny + nz * nz)
    distance = grains.place[PLACE * at.i + RADIUS] + second_radius(grains, at.j, scene) - d
    normal = read(laws.normal, c, GEOMETRY * BLOCK)
    if not touches(normal, distance, distance, h, 0, 0.0):
        entries[NORMAL_DASHPOTS] += torn_energy(normal, h, 0)
        return
    overlap, root, fourth_root = deformation(normal, distance, TINY)
    nx, ny, nz = nx / d, ny / d, nz / d
    arm = d * float(c[INV_R_SUM * BLOCK])
    v = relative_velocity(grains, at.i, at.j, scene)
    u = spin_sum(grains, at.i, at.j, scene)
    v_n = v[0] * nx + v[1] * ny + v[2] * nz
    tx = v[0] - v_n * nx + arm * (ny * u[2] - nz * u[1])
    ty = v[1] - v_n * ny + arm * (nz * u[0] - nx * u[2])
    tz = v[2] - v_n * nz + arm * (nx * u[1] - ny * u[0])
    row_t = GEOMETRY + n_constants(laws.normal)
    tangential = read(laws.tangential, c, row_t * BLOCK)
    f_n = normal_force(normal, overlap, root, fourth_root, v_n)
    pressing = max(f_n, 0.0)
    S_t, D_t = tangential_stiffness(tangential, root), tangential_damping(tangential, fourth_root)
    o = n_history(laws.normal) * BLOCK
    sx, sy, sz = flat(float(h[o]), float(h[o + BLOCK]), float(h[o + 2 * BLOCK]), nx, ny, nz)
    limit = tangential_limit(tangential, f_n, 0.0)
    ax, ay, az = sx + tx * dt, sy + ty * dt, sz + tz * dt
    factor = slip(S_t * S_t * (ax * ax + ay * ay + az * az), limit, 1.0, TINY)
    ax, ay, az = factor * ax, factor * ay, factor * az
    before = tangential_energy(tangential, S_t, sx * sx + sy * sy + sz * sz)
    after = tangential_energy(tangential, S_t, ax * ax + ay * ay + az * az)
    D_t = acting_damping(tangential, D_t, factor, 1.0, 0.0)
    fx, fy, fz = S_t * ax + D_t * tx, S_t * ay + D_t * ty, S_t * az + D_t * tz
    factor = shrink(tangential, fx * fx + fy * fy + fz * fz, limit, 1.0, TINY)
    fx, fy, fz = factor * fx, factor * fy, factor * fz
    note[NORMAL], note[NORMAL + 1], note[NORMAL + 2], note[ARM] = nx, ny, nz, arm
    note[DASHPOT] = f_n - spring_force(normal, overlap, root)
    note[FORCE], note[FORCE + 1], note[FORCE + 2], note[GAIN] = fx, fy, fz, after - before
    entries[NORMAL_SPRINGS] += normal_energy(normal, distance, root)
    entries[SPRINGS_REMADE] += before
    entries[TANGENTIAL_SPRINGS] += after
    touch = Touch(nx, ny, nz, 1.0, S_t, pressing, float(c[SHARE * BLOCK]))
    note_rolling(at, touch, rolling_velocity(grains, at.i, at.j, scene), note, entries, laws, laws.separate)


@jit
def note_rolling(at, touch, velocity, note, entries, laws, separate):
    """The rolling spring's part of `note_contact`; velocity : rolling velocity (3,). A brake is booked with the grains."""
    if separate is not None:
        row = GEOMETRY + n_constants(laws.normal) + n_constants(laws.tangential)
        o = (n_history(laws.normal) + n_history(laws.tangential)) * BLOCK
        numbers = Numbers(float(laws.numbers.dt), 1.0, 0.0, TINY)
        law = read(laws.rolling, at.constants, row * BLOCK)
        fx, fy, fz, before, after = rolling_spring(law, at.history, o, touch, velocity, numbers)
        note[ROLLING_FORCE], note[ROLLING_FORCE + 1], note[ROLLING_FORCE + 2] = fx, fy, fz
        note[ROLLING_GAIN] = after - before
        entries[SPRINGS_REMADE] += before
        entries[ROLLING_SPRINGS] += after


@jit
def book_contacts(s, contacts, scene, run, mean, notes, entries):
    """Book the losses of dashpots and of sliding and rolling contacts of slab or part s in this step.

    mean : the grains with mean velocities, in float64.
    """
    first, second, dt = contacts.first, contacts.second, run.model.step_s
    for k in range(contacts.begin[s], contacts.begin[s] + contacts.count[s]):
        note = notes[k]
        i = first[k]
        n = note[NORMAL : NORMAL + 3]
        v = relative_velocity(mean, i, second[k], scene)
        u = spin_sum(mean, i, second[k], scene)
        v_n = v[0] * n[0] + v[1] * n[1] + v[2] * n[2]
        arm = note[ARM]
        t = (
            v[0] - v_n * n[0] + arm * (n[1] * u[2] - n[2] * u[1]),
            v[1] - v_n * n[1] + arm * (n[2] * u[0] - n[0] * u[2]),
            v[2] - v_n * n[2] + arm * (n[0] * u[1] - n[1] * u[0]),
        )
        entries[NORMAL_DASHPOTS] -= note[DASHPOT] * v_n * dt
        r = rolling_velocity(mean, i, second[k], scene)
        for a in range(3):
            entries[SLIDING] += note[FORCE + a] * t[a] * dt
            entries[ROLLING] += note[ROLLING_FORCE + a] * r[a] * dt
        entries[SLIDING] -= note[GAIN]
        entries[ROLLING] -= note[ROLLING_GAIN]


@jit
def second_radius(grains, j, scene):
    """Radius in m of grain j; 0 for a surface."""
    if scene is None:
        return grains.place[PLACE * j + RADIUS]
    return 0.0


@jit
def separation(grains, i, j, scene, images):
    """Vector in m from grain or surface j to grain i."""
    place, o = grains.place, PLACE * i
    if scene is None:
        p = PLACE * j
        return (
            nearest(place[o] - place[p], 0, images),
            nearest(place[o + 1] - place[p + 1], 1, images),
            nearest(place[o + 2] - place[p + 2], 2, images),
        )
    return bodies.separation(place, o, scene.surfaces, j)


@jit
def three(motion, i):
    """Three numbers of the motion records from i on, in float64."""
    return float(motion[i]), float(motion[i + 1]), float(motion[i + 2])


@jit
def relative_velocity(grains, i, j, scene):
    """Velocity in m/s of grain i against grain or surface j, as contacts see it."""
    x, y, z = three(grains.motion, MOTION * i + VX)
    if scene is None:
        a, b, c = three(grains.motion, MOTION * j + VX)
        return x - a, y - b, z - c
    v = scene.bodies.velocity[scene.surfaces.body[j]]
    return x - v[0], y - v[1], z - v[2]


@jit
def spin_sum(grains, i, j, scene):
    """u_i + u_j in m/s (u = radius x angular velocity); a surface does not turn."""
    x, y, z = three(grains.motion, MOTION * i + UX)
    if scene is None:
        a, b, c = three(grains.motion, MOTION * j + UX)
        return x + a, y + b, z + c
    return x, y, z


@jit
def rolling_velocity(grains, i, j, scene):
    """Rolling velocity in m/s of grain i on grain or surface j (see `dem.contact.laws.rolling_c`)."""
    x, y, z = three(grains.motion, MOTION * i + UX)
    if scene is None:
        a, b, c = three(grains.motion, MOTION * j + UX)
        r_i, r_j = grains.place[PLACE * i + RADIUS], grains.place[PLACE * j + RADIUS]
        p, q = r_j / (r_i + r_j), r_i / (r_i + r_j)
        return p * x - q * a, p * y - q * b, p * z - q * c
    return x, y, z


@jit
def book_grains(state, gravity, dt, mean, entries):
    """Kinetic (at this instant and half a step later) and potential energy, losses of type A rolling; fills `mean`.

    The stored velocities are half a step behind; with the loads those half a step ahead follow, as in `dem.step.motion.integrate`.
    """
    grains, loads = state.grains, state.loads
    for k in range(grains.place.shape[0] // PLACE):
        o, i, a = k * PLACE, k * MOTION, k * LOAD
        for t in SPEEDS:
            mean.motion[i + t] = grains.motion[i + t]
        if grains.remainder[i + FREE] == 0.0:
            continue
        inverse_mass, free = float(grains.remainder[i + INVERSE_MASS]), float(grains.remainder[i + FREE])
        mass = 1.0 / inverse_mass
        kick = inverse_mass * dt
        before, after = 0.0, 0.0
        for t in range(3):
            v = velocity(grains, i + VX + t)
            w = v + kick * loads[a + t] + free * gravity[t] * dt
            before += 0.5 * mass * v * v
            after += 0.5 * mass * w * w
            mean.motion[i + VX + t] = 0.5 * (v + w)
            entries[POTENTIAL] -= mass * free * gravity[t] * grains.place[o + t]
        twist = 2.5 * kick
        ux, uy, uz = velocity(grains, i + UX), velocity(grains, i + UX + 1), velocity(grains, i + UX + 2)
        wx, wy, wz = ux + twist * loads[a + QX], uy + twist * loads[a + QX + 1], uz + twist * loads[a + QX + 2]
        keep = 1.0 - braked(wx, wy, wz, twist * loads[a + RESIST], 1.0, 1e-30)
        turned = 0.2 * mass * (wx * wx + wy * wy + wz * wz)
        entries[ROLLING] += turned * (1.0 - keep * keep)
        after += turned * keep * keep
        before += 0.2 * mass * (ux * ux + uy * uy + uz * uz)
        mean.motion[i + UX] = 0.5 * (ux + wx)
        mean.motion[i + UX + 1] = 0.5 * (uy + wy)
        mean.motion[i + UX + 2] = 0.5 * (uz + wz)
        entries[KINETIC] += 0.5 * (before + after)
        entries[KINETIC_AFTER] += after


@jit
def note_step(run, ledger):
    """Before the forces of a step: evaluate all contacts. ledger : None, or a Ledger (also below)."""
    if ledger is not None:
        entries, pairs, surfaces = ledger.entries, run.lists.pairs.contacts, run.lists.surfaces.contacts
        entries[SPRINGS_REMADE] -= entries[TANGENTIAL_SPRINGS] + entries[ROLLING_SPRINGS]
        entries[KINETIC : KINETIC_AFTER + 1] = 0.0
        for s in range(SLABS):
            note_contacts(s, pairs, None, run, ledger.pairs, entries)
        for part in range(surfaces.count.shape[0]):
            note_contacts(part, surfaces, run.scene, run, ledger.surfaces, entries)


@jit
def book_step(run, ledger):
    """After the forces of a step and before anything moves: book its powers."""
    if ledger is not None:
        state, scene, dt, entries = run.state, run.scene, run.model.step_s, ledger.entries
        pairs, surfaces = run.lists.pairs.contacts, run.lists.surfaces.contacts
        mean = GrainArrays(state.grains.place, np.empty(state.grains.motion.shape[0]), state.grains.remainder)
        book_grains(state, scene.gravity, dt, mean, entries)
        before, after, potential, rolling = book_clumps(scene.clumps, state.grains, scene.gravity, dt, mean)
        entries[KINETIC] += 0.5 * (before + after)
        entries[KINETIC_AFTER] += after
        entries[POTENTIAL] += potential
        entries[ROLLING] += rolling
        for s in range(SLABS):
            book_contacts(s, pairs, None, run, mean, ledger.pairs, entries)
        for part in range(surfaces.count.shape[0]):
            book_contacts(part, surfaces, scene, run, mean, ledger.surfaces, entries)
        for w in range(scene.bodies.force.shape[0]):
            for t in range(3):
                entries[WORK_OF_WALLS] -= scene.bodies.force[w, t] * scene.bodies.velocity[w, t] * dt


def summary(entries: np.ndarray, exchanged_j: float) -> dict[str, float]:
    """Name -> J: the ledger's entries, `exchanged` (came and left with grains), `dissipated` (sum), `residual`."""
    table = {name: float(value) for name, value in zip(ENTRIES, entries, strict=True) if name != "kinetic_after"}
    held = sum(table[name] for name in ENTRIES[:KINETIC_AFTER])
    table["dissipated"] = sum(table[name] for name in ("normal_dashpots", "sliding", "rolling"))
    table["exchanged"] = exchanged_j
    table["residual"] = held - (table["work_of_walls"] + exchanged_j - table["dissipated"] + table["springs_remade"])
    return table
