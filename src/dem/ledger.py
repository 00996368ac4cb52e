"""Energy ledger: what the grains and springs hold, what the contacts lose, what the walls do, booked at every step.

    kinetic + potential + normal springs + tangential springs + rolling springs
        = work of the walls + exchanged - dissipated + springs remade + residual

The contact laws are evaluated a second time here, in float64 and apart from the fast kernels, whose loads show in the kinetic
energy. Every power is a force times the mean of the velocities before and after the step, which is exactly what changes the kinetic
energy. What a tangential or rolling contact takes and its spring does not hold afterwards is dissipated (dashpot and sliding
together: where a contact slides, the law has no separate dashpot). `residual` is what is left over: the time integration's error.

"Springs remade" is the law's own: the tangential stiffness 8 G* sqrt(R* delta) changes with the overlap while the spring
keeps its elongation, and the part of a spring along a turning normal is dropped. That gives or takes energy, whatever the step
(Elata & Berryman 1996, Mech. Mater. 24, 229).
"""

import math
from typing import NamedTuple

import numpy as np

from dem.contact.laws import mindlin
from dem.contact.laws.rolling import braked
from dem.jit import jit
from dem.layout import (
    BLOCK,
    C_N,
    C_T,
    FREE,
    INV_R_SUM,
    INVERSE_MASS,
    K_N,
    K_T,
    LOAD,
    MOTION,
    MU_R,
    MU_S,
    PLACE,
    QX,
    RADIUS,
    RESIST,
    SPEEDS,
    UX,
    VX,
    GrainArrays,
)
from dem.lists.grid import nearest_image
from dem.lists.slabs import SLABS
from dem.step.motion import velocity
from dem.walls import wall_separation

#: Entries of the ledger (J). The first six are what there is now, the others have added up since the start.
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
#: tangential force (3) and what its spring gains, force of the rolling spring (3) and what it gains, d / R_sum.
NOTES = 13
NORMAL, DASHPOT, FORCE, GAIN, ROLLING_FORCE, ROLLING_GAIN, ARM = 0, 3, 4, 7, 8, 11, 12


class Ledger(NamedTuple):
    """Entries (len(ENTRIES),) in J, and room for notes on contacts of pairs and walls, (NOTES,) each."""

    entries: np.ndarray
    pairs: np.ndarray
    walls: np.ndarray


@jit
def note_contacts(contacts, s, walls, grains, period, frequency, notes, entries, constants, type_c):
    """Evaluate the laws of the contacts of slab or wall s at the grains' state, before the kernels change their history.

    walls : None for contacts between grains. Sets `notes` and adds the springs' energies to `entries`; elongations before the
    step are those that are left after turning with the normal.
    """
    dt = float(constants.dt)
    first, second = contacts.first, contacts.second
    for k in range(contacts.begin[s], contacts.begin[s] + contacts.count[s]):
        note = notes[k]
        note[:] = 0.0
        q = k % BLOCK
        c = contacts.common[0, q:] if contacts.alike[0] else contacts.constants[k // BLOCK, q:]
        h = contacts.history[k // BLOCK, q:]
        i = first[k]
        R_j = 0.0
        nx, ny, nz = separation(grains, i, second[k], walls, period, frequency)
        if walls is None:
            R_j = grains.place[PLACE * second[k] + RADIUS]
        d = math.sqrt(nx * nx + ny * ny + nz * nz)
        overlap = grains.place[PLACE * i + RADIUS] + R_j - d
        if overlap <= 0.0:
            continue
        nx, ny, nz = nx / d, ny / d, nz / d
        arm = d * float(c[INV_R_SUM * BLOCK])
        v = relative_velocity(grains, i, second[k], walls)
        u = spin_sum(grains, i, second[k], walls)
        v_n = v[0] * nx + v[1] * ny + v[2] * nz
        tx = v[0] - v_n * nx + arm * (ny * u[2] - nz * u[1])
        ty = v[1] - v_n * ny + arm * (nz * u[0] - nx * u[2])
        tz = v[2] - v_n * nz + arm * (nx * u[1] - ny * u[0])
        root = math.sqrt(overlap)
        fourth_root = math.sqrt(root)
        spring_n = float(c[K_N * BLOCK]) * root * overlap
        f_n = max(spring_n - float(c[C_N * BLOCK]) * fourth_root * v_n, float(constants.least))
        S_t = float(c[K_T * BLOCK]) * root
        D_t = float(c[C_T * BLOCK]) * fourth_root
        sx, sy, sz = flat(float(h[0]), float(h[BLOCK]), float(h[2 * BLOCK]), nx, ny, nz)
        limit = float(c[MU_S * BLOCK]) * max(f_n, 0.0)
        ax, ay, az = sx + tx * dt, sy + ty * dt, sz + tz * dt
        factor = mindlin.slip(S_t * S_t * (ax * ax + ay * ay + az * az), limit, 1.0, 1e-150)
        ax, ay, az = factor * ax, factor * ay, factor * az
        before = 0.5 * S_t * (sx * sx + sy * sy + sz * sz)
        after = 0.5 * S_t * (ax * ax + ay * ay + az * az)
        fx, fy, fz = S_t * ax + D_t * tx, S_t * ay + D_t * ty, S_t * az + D_t * tz
        factor = mindlin.slip(fx * fx + fy * fy + fz * fz, limit, 1.0, 1e-150)
        fx, fy, fz = factor * fx, factor * fy, factor * fz
        note[NORMAL], note[NORMAL + 1], note[NORMAL + 2], note[ARM] = nx, ny, nz, arm
        note[DASHPOT] = f_n - spring_n
        note[FORCE], note[FORCE + 1], note[FORCE + 2], note[GAIN] = fx, fy, fz, after - before
        entries[NORMAL_SPRINGS] += 0.4 * spring_n * overlap
        entries[SPRINGS_REMADE] += before
        entries[TANGENTIAL_SPRINGS] += after
        if type_c:
            resistance = float(c[MU_R * BLOCK]) * max(f_n, 0.0)
            note_rolling(note, h, S_t, resistance, nx, ny, nz, rolling_velocity(grains, i, second[k], walls), dt, entries)


@jit
def note_rolling(note, h, S_t, resistance, nx, ny, nz, rolling, dt, entries):
    """The rolling spring's part of `note_contacts`; resistance : mu_r F_n, rolling : rolling velocity (3,)."""
    ax, ay, az = flat(float(h[3 * BLOCK]), float(h[4 * BLOCK]), float(h[5 * BLOCK]), nx, ny, nz)
    rx, ry, rz = flat(rolling[0], rolling[1], rolling[2], nx, ny, nz)
    sx, sy, sz = ax + rx * dt, ay + ry * dt, az + rz * dt
    factor = mindlin.slip(S_t * S_t * (sx * sx + sy * sy + sz * sz), resistance, 1.0, 1e-150)
    sx, sy, sz = factor * sx, factor * sy, factor * sz
    before = 0.5 * S_t * (ax * ax + ay * ay + az * az)
    after = 0.5 * S_t * (sx * sx + sy * sy + sz * sz)
    note[ROLLING_FORCE], note[ROLLING_FORCE + 1], note[ROLLING_FORCE + 2] = S_t * sx, S_t * sy, S_t * sz
    note[ROLLING_GAIN] = after - before
    entries[SPRINGS_REMADE] += before
    entries[ROLLING_SPRINGS] += after


@jit
def book_contacts(contacts, s, walls, mean, notes, entries, dt):
    """Of the contacts of slab or wall s, book what the dashpots and sliding and rolling contacts lose in this step.

    mean : the grains with mean velocities, in float64.
    """
    first, second = contacts.first, contacts.second
    for k in range(contacts.begin[s], contacts.begin[s] + contacts.count[s]):
        note = notes[k]
        i = first[k]
        n = note[NORMAL : NORMAL + 3]
        v = relative_velocity(mean, i, second[k], walls)
        u = spin_sum(mean, i, second[k], walls)
        v_n = v[0] * n[0] + v[1] * n[1] + v[2] * n[2]
        arm = note[ARM]
        t = (
            v[0] - v_n * n[0] + arm * (n[1] * u[2] - n[2] * u[1]),
            v[1] - v_n * n[1] + arm * (n[2] * u[0] - n[0] * u[2]),
            v[2] - v_n * n[2] + arm * (n[0] * u[1] - n[1] * u[0]),
        )
        entries[NORMAL_DASHPOTS] -= note[DASHPOT] * v_n * dt
        r = rolling_velocity(mean, i, second[k], walls)
        for a in range(3):
            entries[SLIDING] += note[FORCE + a] * t[a] * dt
            entries[ROLLING] += note[ROLLING_FORCE + a] * r[a] * dt
        entries[SLIDING] -= note[GAIN]
        entries[ROLLING] -= note[ROLLING_GAIN]


@jit
def separation(grains, i, j, walls, period, frequency):
    """Vector in m from grain or wall j to grain i."""
    place, o = grains.place, PLACE * i
    if walls is None:
        p = PLACE * j
        return (
            nearest_image(place[o] - place[p], period[0], frequency[0]),
            nearest_image(place[o + 1] - place[p + 1], period[1], frequency[1]),
            nearest_image(place[o + 2] - place[p + 2], period[2], frequency[2]),
        )
    return wall_separation(place, o, walls, j)


@jit
def three(motion, i):
    """Three numbers of the motion records from i on, in float64."""
    return float(motion[i]), float(motion[i + 1]), float(motion[i + 2])


@jit
def relative_velocity(grains, i, j, walls):
    """Velocity in m/s of grain i against grain or wall j, as contacts see it."""
    x, y, z = three(grains.motion, MOTION * i + VX)
    if walls is None:
        a, b, c = three(grains.motion, MOTION * j + VX)
        return x - a, y - b, z - c
    v = walls.velocity[j]
    return x - v[0], y - v[1], z - v[2]


@jit
def spin_sum(grains, i, j, walls):
    """u_i + u_j in m/s (u = radius x angular velocity); a wall does not turn."""
    x, y, z = three(grains.motion, MOTION * i + UX)
    if walls is None:
        a, b, c = three(grains.motion, MOTION * j + UX)
        return x + a, y + b, z + c
    return x, y, z


@jit
def rolling_velocity(grains, i, j, walls):
    """Rolling velocity in m/s of grain i on grain or wall j (see `dem.contact.laws.rolling`)."""
    x, y, z = three(grains.motion, MOTION * i + UX)
    if walls is None:
        a, b, c = three(grains.motion, MOTION * j + UX)
        r_i, r_j = grains.place[PLACE * i + RADIUS], grains.place[PLACE * j + RADIUS]
        p, q = r_j / (r_i + r_j), r_i / (r_i + r_j)
        return p * x - q * a, p * y - q * b, p * z - q * c
    return x, y, z


@jit
def flat(x, y, z, nx, ny, nz):
    """A vector without its part along the unit vector n."""
    along = x * nx + y * ny + z * nz
    return x - along * nx, y - along * ny, z - along * nz


@jit
def book_grains(grains, loads, gravity, dt, mean, entries):
    """Kinetic (at this instant and half a step later) and potential energy, losses of type A rolling; fills `mean`.

    The stored velocities are half a step behind; with the loads those half a step ahead follow, as in `dem.step.motion.integrate`.
    """
    for k in range(grains.place.shape[0] // PLACE):
        o, i, a = k * PLACE, k * MOTION, k * LOAD
        for t in SPEEDS:
            mean.motion[i + t] = grains.motion[i + t]
        if grains.remainder[i + INVERSE_MASS] == 0.0:
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
def note_step(grains, period, frequency, contacts, walls, wall_contacts, constants, ledger, type_c):
    """Before the forces of a step: evaluate all contacts."""
    entries = ledger.entries
    entries[SPRINGS_REMADE] -= entries[TANGENTIAL_SPRINGS] + entries[ROLLING_SPRINGS]
    entries[KINETIC : KINETIC_AFTER + 1] = 0.0
    for s in range(SLABS):
        note_contacts(contacts, s, None, grains, period, frequency, ledger.pairs, entries, constants, type_c)
    for part in range(wall_contacts.count.shape[0]):
        note_contacts(wall_contacts, part, walls, grains, period, frequency, ledger.walls, entries, constants, type_c)


@jit
def book_step(grains, loads, contacts, walls, wall_contacts, gravity, dt, ledger):
    """After the forces of a step and before anything moves: book what it does."""
    mean, entries = GrainArrays(grains.place, np.empty(grains.motion.shape[0]), grains.remainder), ledger.entries
    book_grains(grains, loads, gravity, dt, mean, entries)
    for s in range(SLABS):
        book_contacts(contacts, s, None, mean, ledger.pairs, entries, dt)
    for part in range(wall_contacts.count.shape[0]):
        book_contacts(wall_contacts, part, walls, mean, ledger.walls, entries, dt)
    for w in range(walls.kind.shape[0]):
        for t in range(3):
            entries[WORK_OF_WALLS] -= walls.force[w, t] * walls.velocity[w, t] * dt


def summary(entries: np.ndarray, exchanged_j: float) -> dict[str, float]:
    """Name -> J: the ledger's entries, `exchanged` (came and left with grains), `dissipated` (sum), `residual`."""
    table = {name: float(value) for name, value in zip(ENTRIES, entries, strict=True) if name != "kinetic_after"}
    held = sum(table[name] for name in ENTRIES[:KINETIC_AFTER])
    table["dissipated"] = sum(table[name] for name in ("normal_dashpots", "sliding", "rolling"))
    table["exchanged"] = exchanged_j
    table["residual"] = held - (table["work_of_walls"] + exchanged_j - table["dissipated"] + table["springs_remade"])
    return table
