"""Clumps, rigid unions of spheres: their inertia, free rotation, impacts, rest, conservation, order of the step, packing.

Inertia. Two spheres of radius r with centres r apart: their lens has 5/12 pi r^3, so the union has 9/4 pi r^3; a row of three has
19/6 pi r^3. Moments follow as integrals of rho^4/4 and z^2 rho^2 along the axis.

Free rotation (Euler's equations; Landau & Lifshitz, Mechanics, 36 and 37). With moments 1, 2, 3 the angular velocity (1, 1, 1)
returns after 6.422703, (0.01, 1, 0) flips to (0.01, -1, 0) and returns after 41.50922, in units of the inverse angular velocity
(elliptic integrals). The splitting is of second order: with n steps per radian a period is wrong by a share of 1/n^2, which shifts
the spin by its rate of change times that. A symmetric top turns about its angular momentum L at L / I_perp.

Impact of a dimer, axis at 45 degrees, at speed v on a smooth wall, elastic: the impulse J = 2 v / (1/m + a^2/I), a = r / sqrt(8),
acts for a moment only: V' = J/m - v, w' = J a / I. During the impact the dimer turns by at most w' times its duration, which
changes a by as much.
"""

import math
from typing import Any

import numpy as np
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

import dem
from virtual_soil.verification import closed_forms
from virtual_soil.verification.check import Check
from virtual_soil.verification.rest import GRAVITY_M_S2, under_gravity
from virtual_soil.verification.scene import FLOOR, RIGID, SOFT, mass_kg, scene

GROUP = "Clumps"

#: Radius of the spheres of a dimer, and of the sphere of the dimer's volume.
RADIUS_M = 1e-3
DIMER = dem.Clump.preset("dimer")
EQUIVALENT_M = RADIUS_M / DIMER.smallest_ratio
MASS_KG = mass_kg(SOFT, EQUIVALENT_M)
TIME_STEP_S = 0.2 * dem.rayleigh_time(RADIUS_M, SOFT)

#: Error of volume and moments by columns, see `dem.clumps.union`.
COLUMN_ERROR = 5e-5

#: A top of any three moments: one sphere that touches nothing.
TOP = dem.Clump("top", ((0.0, 0.0, 0.0, 1.0),), (1.0, 2.0, 3.0))
#: Angular velocity at the start, time after which it returns, and its value after half of that time, if known.
TOPS = (
    ((1.0, 1.0, 1.0), 6.422703, None),
    ((0.01, 1.0, 0.0), 41.50922, (0.01, -1.0, 0.0)),
    ((0.001, 1.0, 0.0), 57.46285, (0.001, -1.0, 0.0)),
)
#: Steps per turn of these tops, an even number; error of the stated periods.
TOP_STEPS, PERIOD_ERROR = 20_000, 5e-7

#: Numbers of steps of an impact, and those of its reference; slope of the errors as in the group "Order and invariance".
STEPS, FINEST = (50, 100, 200, 400), 6400
ORDER_TOLERANCE = 0.1

#: Rounding in float64 of some 1e4 contacts' loads.
ROUNDING = 1e-12

#: Dimers in the packing; how much denser than spheres, which pack to 0.64 at random, they are at least. Spheroids of this aspect
#: reach 0.70 (Donev et al. 2004, Science 303, 990).
N_PACKED, DENSER = 500, 0.02


def checks() -> list[Check]:
    """Run all cases of clumps."""
    return [
        *inertia(),
        *(check for top in TOPS for check in free_top(*top)),
        *precession(),
        *impact(),
        *single_sphere(),
        *lying(),
        *cloud(),
        order(),
        *energy(),
        packing(),
    ]


def check(case: str, quantity: str, unit: str, source: str, expected: float, obtained, tolerance: float = 0.0, **more) -> Check:
    """One check of this group."""
    return Check(
        group=GROUP, case=case, quantity=quantity, unit=unit, source=source, expected=expected, obtained=float(obtained),
        tolerance=tolerance, **more,
    )  # fmt: skip


def inertia() -> list[Check]:
    """Volume and principal moments of two spheres, exact, and of a row of three, by columns."""
    row = dem.Clump.of_spheres([(x, 0.0, 0.0, 1.0) for x in (-1.0, 0.0, 1.0)], name="row of three")
    found = []
    for name, clump, volume, axial, across, error in (
        ("two spheres, r apart", DIMER, 2.25, 0.425, 0.7375, 1e-12),
        ("three spheres in a row, r apart", row, 19.0 / 6.0, 331.0 / 760.0, None, COLUMN_ERROR),
    ):
        r = clump.smallest_ratio
        known = [
            ("volume over pi r^3", volume, 4.0 / 3.0 / r**3),
            ("moment about the axis over m r^2", axial, clump.moments[0] / r**2),
        ]
        if across is not None:
            known.append(("moment across over m r^2", across, clump.moments[1] / r**2))
        found += [check(name, what, "-", "closed form (caps)", value, got, error * value) for what, value, got in known]
    return found


def free(time_step_s: float = TIME_STEP_S, **settings) -> dem.Simulation:
    """Create an empty simulation without gravity."""
    return scene(SOFT, RADIUS_M, time_step_s, **settings)


def in_body(clumps: dem.ClumpStates, vectors: np.ndarray) -> np.ndarray:
    """Vectors in space (n, 3) in the frames of the clumps."""
    return Rotation.from_quat(clumps.orientations, scalar_first=True).inv().apply(vectors)


def spun(spin: tuple[float, float, float], period: float, n: int) -> tuple[np.ndarray, float]:
    """Angular velocity in the body's frame after half a period and a period (2, 3), and the largest change of energy of both."""
    simulation = free()
    unit = period / (n * simulation.time_step_s)
    simulation.add_clumps(TOP, [(0.0, 0.0, 0.0)], RADIUS_M, "grain", angular_velocities_rad_s=np.multiply(spin, unit))
    energies, seen = [simulation.kinetic_energy_j], []
    for _ in range(2):
        simulation.advance(n // 2)
        clumps = simulation.clumps
        seen.append(in_body(clumps, clumps.angular_velocities_rad_s)[0] / unit)
        energies.append(simulation.kinetic_energy_j)
    return np.array(seen), float(np.abs(np.array(energies) / energies[0] - 1.0).max())


def free_top(spin: tuple[float, float, float], period: float, flipped: tuple[float, float, float] | None) -> list[Check]:
    """A top of unequal moments comes back to where it was."""
    case, source = f"free top, moments 1, 2, 3, spin {spin}", "closed form (Euler, elliptic integrals)"
    seen, gain = spun(spin, period, TOP_STEPS)
    turned2 = float(period / TOP_STEPS * np.linalg.norm(spin)) ** 2
    x, y, z = spin
    rate = float(np.abs([y * z, z * x, x * y / 3.0]).max())  # Euler's equations with moments 1, 2, 3
    error = period * rate * turned2 + PERIOD_ERROR
    found = [check(case, "error of the spin after a period", "-", source, 0.0, np.abs(seen[1] - spin).max(), error)]
    if flipped:
        found.append(check(case, "error of the spin after half of it", "-", source, 0.0, np.abs(seen[0] - flipped).max(), error))
    return [*found, check(case, "change of the energy", "-", "closed form (Euler)", 0.0, gain, turned2)]


def precession() -> list[Check]:
    """The axis of a free dimer turns about its angular momentum."""
    spin, angle, n = np.array([3.0, 1.0, 0.0]), 1.0, 2000  # the dimer's axis is x
    moments = np.array(DIMER.moments)
    momentum = moments * spin
    rate = np.linalg.norm(momentum) / moments[1]
    simulation = free()
    unit = angle / rate / (n * simulation.time_step_s)
    simulation.add_clumps(DIMER, [(0.0, 0.0, 0.0)], EQUIVALENT_M, "grain", angular_velocities_rad_s=spin * unit)
    simulation.advance(n)
    axis = Rotation.from_quat(simulation.clumps.orientations[0], scalar_first=True).apply([1.0, 0.0, 0.0])
    about = momentum / np.linalg.norm(momentum)
    expected = Rotation.from_rotvec(angle * about).apply([1.0, 0.0, 0.0])
    error, source = float(np.linalg.norm(spin) / rate / n) ** 2, "closed form (L / I across)"
    return [check("free dimer", "error of its axis after 1 rad", "rad", source, 0.0, np.linalg.norm(axis - expected), error)]


def impact() -> list[Check]:
    """A dimer falls on a smooth wall with its axis at 45 degrees."""
    v, tilt = 0.01, 0.25 * math.pi
    simulation = free(0.1 * TIME_STEP_S, walls=[FLOOR])
    height = RADIUS_M * (1.0 + 0.5 * math.sin(tilt))
    turn = (math.cos(0.5 * tilt), 0.0, math.sin(0.5 * tilt), 0.0)
    simulation.add_clumps(DIMER, [(0, 0, height)], EQUIVALENT_M, "grain", orientations=turn, velocities_m_s=(0, 0, -v))
    contact = closed_forms.on_wall(SOFT, RADIUS_M, v)
    simulation.run(3.0 * contact.duration_s)
    clumps = simulation.clumps
    up, spin = clumps.velocities_m_s[0, 2] / v, -clumps.angular_velocities_rad_s[0, 1] * RADIUS_M / v
    turned = 0.819835 * v / RADIUS_M * contact.duration_s
    case, source = "dimer at 45 degrees on a smooth wall, e = 1", "closed form (impulse)"
    return [
        check(case, "speed upwards over v", "-", source, 0.710145, up, turned),
        check(case, "spin over v / r", "-", source, 0.819835, spin, turned),
    ]


def single_sphere() -> list[Check]:
    """A clump of one sphere bounces, slides and rolls as the sphere does."""
    ends = []
    for is_clump in (False, True):
        simulation = under_gravity()
        motion: dict[str, Any] = {"velocities_m_s": (0.1, 0.0, -0.1), "angular_velocities_rad_s": (3.0, -50.0, 20.0)}
        if is_clump:
            simulation.add_clumps(dem.Clump.preset("sphere"), [(0, 0, 1.2 * RADIUS_M)], RADIUS_M, "grain", **motion)
        else:
            simulation.add_grains([(0, 0, 1.2 * RADIUS_M)], RADIUS_M, "grain", **motion)
        simulation.run(0.05)
        ends.append(simulation.grains)
    sphere, clump = ends
    case, source = "clump of one sphere on a floor, type A", "the sphere"
    shift = np.abs(clump.positions_m - sphere.positions_m).max() / RADIUS_M
    turn = np.abs(clump.angular_velocities_rad_s - sphere.angular_velocities_rad_s).max()
    return [
        check(case, "largest difference of position", "r", source, 0.0, shift, ROUNDING),
        check(case, "largest difference of spin", "rad/s", source, 0.0, turn, 1e3 * ROUNDING),
    ]


def lying() -> list[Check]:
    """A dimer that lies on the floor."""
    simulation = under_gravity(precision="float32")
    simulation.add_clumps(DIMER, [(0, 0, RADIUS_M)], EQUIVALENT_M, "grain")
    simulation.run(1.0)
    before = simulation.clumps.positions_m
    simulation.run(0.5)
    force = simulation.mean_wall_forces_n["floor"] / (MASS_KG * GRAVITY_M_S2)
    drift = np.linalg.norm(simulation.clumps.positions_m - before) / RADIUS_M
    case, source = "dimer lying on a floor, float32", "closed form (equilibrium)"
    return [
        check(case, "floor force over weight", "-", source, -1.0, force[2], 1e-6),
        check(case, "floor force across over weight", "-", source, 0.0, np.hypot(*force[:2]), 1e-6),
        check(case, "drift in 0.5 s", "r", source, 0.0, drift, 1e-6),
    ]


def momenta(clumps: dem.ClumpStates) -> tuple[np.ndarray, np.ndarray, float, float]:
    """Momentum and angular momentum about the origin (3,), and sums of the magnitudes of all contributions."""
    momentum = clumps.masses_kg[:, None] * clumps.velocities_m_s
    turn = Rotation.from_quat(clumps.orientations, scalar_first=True)
    spin = turn.apply(clumps.moments_kg_m2 * turn.inv().apply(clumps.angular_velocities_rad_s))
    orbital = np.cross(clumps.positions_m, momentum)
    sizes = np.linalg.norm(momentum, axis=1).sum(), np.linalg.norm(orbital, axis=1).sum() + np.linalg.norm(spin, axis=1).sum()
    return momentum.sum(axis=0), (orbital + spin).sum(axis=0), *sizes


def cloud() -> list[Check]:
    """Momentum and angular momentum of tetrahedra that collide, slide and spin."""
    shape, rng = dem.Clump.preset("tetra"), np.random.default_rng(3)
    size = RADIUS_M / shape.smallest_ratio
    simulation = free(restitution=0.7, static_friction=0.5)
    positions = np.stack(np.meshgrid(*[np.arange(3) * 2.1 * shape.bounding_ratio * size] * 3), -1).reshape(-1, 3)
    positions -= positions.mean(axis=0)
    velocities, spins = -20.0 * positions + rng.normal(0.0, 0.02, (27, 3)), rng.normal(0.0, 20.0, (27, 3))
    motion = {"velocities_m_s": velocities, "angular_velocities_rad_s": spins}
    simulation.add_clumps(shape, positions, size, "grain", seed=1, **motion)
    before = momenta(simulation.clumps)
    simulation.run(0.05)
    after = momenta(simulation.clumps)
    moved = np.linalg.norm(simulation.clumps.velocities_m_s - velocities, axis=1) > 0.01
    case, source = "cloud of 27 tetrahedra with friction", "conservation"
    return [
        check(case, f"change of {what}, relative", "-", source, 0.0, np.linalg.norm(after[k] - before[k]) / before[k + 2], ROUNDING)
        for k, what in enumerate(("momentum", "angular momentum"))
    ] + [check(case, "clumps that have collided", "-", "-", 14, moved.sum(), relation="at least")]


def struck(n: int) -> np.ndarray:
    """Positions in r and orientations of two dimers, one of which strikes the other off its centre, after n steps."""
    v, tilt, r = 0.5, math.radians(120.0), RADIUS_M
    duration_s = closed_forms.of_spheres(SOFT, r, r, v).duration_s
    simulation = free(0.5 * duration_s / n)
    up = np.array([0.0, math.sin(0.3), math.cos(0.3)])
    axis = np.array([math.cos(tilt), 0.0, math.sin(tilt)])
    first = np.array([0.5 * r, 0.0, 0.0]) + 2.0 * r * up  # the sphere that touches
    turn = (math.cos(0.5 * tilt), 0.0, -math.sin(0.5 * tilt), 0.0)
    simulation.add_clumps(DIMER, [(0, 0, 0)], EQUIVALENT_M, "grain", angular_velocities_rad_s=(200.0, 0.0, 0.0))
    simulation.add_clumps(DIMER, [first + 0.5 * r * axis], EQUIVALENT_M, "grain", orientations=turn, velocities_m_s=-v * up)
    simulation.advance(n)
    clumps = simulation.clumps
    return np.concatenate([(clumps.positions_m / r).ravel(), clumps.orientations.ravel()])


def order() -> Check:
    """Order of the error in the step, without friction."""
    exact = struck(FINEST)
    errors = [np.abs(struck(n) - exact).max() for n in STEPS]
    slope = -np.polyfit(np.log(STEPS), np.log(errors), 1)[0]
    case = "impact of two dimers, e = 1, no friction"
    return check(case, "order of the error of places and turns", "-", "closed form (leapfrog)", 2.0, slope, ORDER_TOLERANCE)


def poured(time_step_rayleigh_ratio: float) -> dict[str, float]:
    """Energy ledger in J after 60 dimers fell into a tube, settled and were released."""
    touch = dem.Interaction(restitution=0.5, static_friction=0.4, rolling_friction=0.1)
    simulation = dem.Simulation(
        materials={"grain": SOFT}, interactions={("grain", "grain"): touch}, smallest_radius_m=RADIUS_M, energy_ledger=True,
        precision="float64", time_step_rayleigh_ratio=time_step_rayleigh_ratio,
        walls=[
            dem.Box(name="floor", material="grain", low_m=(-1.0, -1.0, 0.0), high_m=(1.0, 1.0, 0.0)),
            dem.Tube(name="tube", material="grain", radius_m=6.0 * RADIUS_M, bottom_m=0.0, top_m=1.0),
        ],
    )  # fmt: skip
    region = dem.TubeRegion(radius_m=6.0 * RADIUS_M, bottom_m=0.0)
    sizes = dem.Sizes(mean_m=EQUIVALENT_M)
    simulation.add_factory(dem.Factory(n_grains=60, region=region, sizes=sizes, material="grain", seed=1, shape=DIMER))
    simulation.run(0.12)
    simulation.move_wall("tube", (0.0, 0.0, 0.05))
    simulation.run(0.05)
    return simulation.energies_j


def energy() -> list[Check]:
    """Residual of the energy balance, as in the group "Energy"."""
    coarse, fine = (abs(book["residual"]) / book["dissipated"] for book in (poured(0.2), poured(0.05)))
    case, source = "60 dimers filled and released, type A", "first law"
    return [
        check(case, "residual / dissipated", "-", source, 3e-3, coarse, relation="at most", note="0.2 T_R"),
        check(case, "residual, 0.2 over 0.05 T_R", "-", source, 8.0, coarse / fine, relation="at least", note="16 in theory"),
    ]


def solid_fraction(shape: dem.Clump | None) -> float:
    """Solid fraction of frictionless grains that have settled in a smooth tube, inside; members have RADIUS_M."""
    simulation = dem.Simulation(
        materials={"grain": SOFT, "rigid": RIGID}, smallest_radius_m=RADIUS_M, time_step_rayleigh_ratio=0.4,
        interactions={
            pair: dem.Interaction(restitution=0.3, static_friction=0.0, rolling_friction=0.0)
            for pair in (("grain", "grain"), ("grain", "rigid"))
        },
        walls=[FLOOR, dem.Tube(name="tube", material="rigid", radius_m=12.0 * RADIUS_M, bottom_m=0.0, top_m=1.0)],
    )  # fmt: skip
    size, n = (RADIUS_M, 2 * N_PACKED) if shape is None else (RADIUS_M / shape.smallest_ratio, N_PACKED)
    region, sizes = dem.TubeRegion(radius_m=12.0 * RADIUS_M, bottom_m=0.0), dem.Sizes(mean_m=size)
    simulation.add_factory(dem.Factory(n_grains=n, region=region, sizes=sizes, material="grain", seed=1, shape=shape))
    simulation.run(0.6)
    positions = simulation.grains.positions_m
    low, high = 4.0 * RADIUS_M, float(np.quantile(positions[:, 2], 0.8))
    u, angle, w = np.random.default_rng(0).uniform(size=(3, 100_000))
    rho, phi = 8.0 * RADIUS_M * np.sqrt(u), 2.0 * math.pi * angle
    points = np.column_stack([rho * np.cos(phi), rho * np.sin(phi), low + w * (high - low)])
    return float((cKDTree(positions).query(points)[0] < RADIUS_M).mean())


def packing() -> Check:
    """Dimers pack more densely than spheres."""
    spheres, dimers = solid_fraction(None), solid_fraction(DIMER)
    note = f"spheres {spheres:.3f}, dimers {dimers:.3f}"
    case, what = "frictionless dimers in a smooth tube, float32", "solid fraction less that of spheres"
    return check(case, what, "-", "Donev et al. 2004 (spheroids)", DENSER, dimers - spheres, relation="at least", note=note)
