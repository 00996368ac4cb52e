"""Normal impact, Chung & Ooi 2011 (Granular Matter 13, 643), tests 1 to 3: closed forms of `verification.closed_forms`."""

from functools import partial

import numpy as np

import dem
from virtual_soil.verification import closed_forms
from virtual_soil.verification.check import Check
from virtual_soil.verification.scene import ALUMINIUM, ALUMINIUM_OXIDE, FLOOR, GLASS, PRECISIONS, record, scene

GROUP = "Normal impact"
HERTZ = "closed form (Hertz 1882)"
DAMPED = "closed form (Antypov & Elliott 2011)"

ELASTIC_STEPS, DAMPED_STEPS = 1000, 5000
RESTITUTIONS = (0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0)

#: Default time step ratio of `dem.Simulation`.
DEFAULT_STEP_RATIO = 0.2


def checks() -> list[Check]:
    """Run all cases of normal impact."""
    return [
        *(check for precision in PRECISIONS for check in equal_spheres(precision)),
        *(check for precision in PRECISIONS for check in sphere_on_wall(precision)),
        *(check for e in RESTITUTIONS for check in restitution(e)),
        *(restitution_at_the_default_step(e) for e in RESTITUTIONS),
        *(restitution_without_pull(e) for e in RESTITUTIONS[:-1]),
    ]


def elastic_tolerance(precision: str) -> float:
    """Relative tolerance of an elastic impact with ELASTIC_STEPS steps; rounding errors of random sign add up to some 30 units."""
    return closed_forms.elastic_step_error(ELASTIC_STEPS) + 100.0 * PRECISIONS[precision]


def equal_spheres(precision: str) -> list[Check]:
    """Test 1: two equal glass spheres, R 10 mm, 10 m/s each; the force is computed from the momentum change of each step."""
    r, v = 0.010, 10.0
    exact = closed_forms.of_spheres(GLASS, r, r, 2.0 * v)
    simulation = scene(GLASS, r, exact.duration_s / ELASTIC_STEPS, precision=precision)
    simulation.add_grains([(-1.00001 * r, 0, 0), (1.00001 * r, 0, 0)], r, "grain", velocities_m_s=[(v, 0, 0), (-v, 0, 0)])
    run = record(simulation, int(1.1 * ELASTIC_STEPS))
    overlaps = 2.0 * r - np.ptp(run.positions_m[:, :, 0], axis=1)
    speeds = run.velocities_m_s[:, 0, 0] - run.velocities_m_s[:, 1, 0]
    forces = -exact.mass_kg * np.diff(speeds) / simulation.time_step_s
    case = f"test 1: two equal spheres, {precision}"
    return elastic_checks(case, exact, precision, run.times_s, overlaps, forces, speeds)


def sphere_on_wall(precision: str) -> list[Check]:
    """Test 2: an aluminium sphere, R 0.1 m, on a rigid wall at 0.2 m/s; the force is measured at the wall."""
    r, v = 0.1, 0.2
    exact = closed_forms.on_wall(ALUMINIUM, r, v)
    simulation = scene(ALUMINIUM, r, exact.duration_s / ELASTIC_STEPS, precision=precision, walls=[FLOOR])
    simulation.add_grains([(0.0, 0.0, (1.0 + 1e-6) * r)], r, "grain", velocities_m_s=(0.0, 0.0, -v))
    run = record(simulation, int(1.1 * ELASTIC_STEPS))
    overlaps, speeds, forces = r - run.positions_m[:, 0, 2], -run.velocities_m_s[:, 0, 2], -run.floor_forces_n[:, 2]
    case = f"test 2: sphere on rigid wall, {precision}"
    return elastic_checks(case, exact, precision, run.times_s, overlaps, forces, speeds)


def elastic_checks(case, exact, precision, times, overlaps, forces, speeds) -> list[Check]:
    """Check four quantities of an elastic impact; begin and end of the contact are interpolated linearly to zero overlap."""
    tolerance = elastic_tolerance(precision)
    inside = np.flatnonzero(overlaps > 0.0)
    begin, end = (np.interp(0.0, *sorted_pair(overlaps[k : k + 2], times[k : k + 2])) for k in (inside[0] - 1, inside[-1]))
    pairs = (
        ("largest force", "N", exact.largest_force_n, forces.max()),
        ("largest overlap", "m", exact.elastic_overlap_m, overlaps.max()),
        ("duration", "s", exact.duration_s, end - begin),
        ("rebound speed over impact speed", "-", 1.0, -speeds[-1] / speeds[0]),
    )
    check = partial(Check, group=GROUP, case=case, source=HERTZ)
    return [
        check(quantity=quantity, unit=unit, expected=float(expected), obtained=float(obtained), tolerance=tolerance * expected)
        for quantity, unit, expected, obtained in pairs
    ]


def sorted_pair(x, y):
    """Sort two points by x."""
    order = np.argsort(x)
    return x[order], y[order]


def rebound(e: float, time_step_s: float, n_looks: int, every_steps: int, damping_model: str = "edem"):
    """Test 3: a sphere of aluminium oxide, R 2.5 mm, on a rigid wall at 3.9 m/s; restitution, largest overlap, contact steps."""
    r, v = 2.5e-3, 3.9
    simulation = scene(ALUMINIUM_OXIDE, r, time_step_s, restitution=e, walls=[FLOOR], damping_model=damping_model)
    simulation.add_grains([(0.0, 0.0, (1.0 + 1e-6) * r)], r, "grain", velocities_m_s=(0.0, 0.0, -v))
    run = record(simulation, n_looks, every_steps)
    overlaps = r - run.positions_m[:, 0, 2]
    return run.velocities_m_s[-1, 0, 2] / v, overlaps.max(), every_steps * np.count_nonzero(overlaps > 0.0)


def restitution(e: float) -> list[Check]:
    """Test 3 with a small time step: restitution of the contact law."""
    exact = closed_forms.on_wall(ALUMINIUM_OXIDE, 2.5e-3, 3.9, e)
    obtained, overlap, _ = rebound(e, exact.duration_s / DAMPED_STEPS, n_looks=DAMPED_STEPS // 5, every_steps=10)
    tolerance = closed_forms.damped_step_error(DAMPED_STEPS)
    check = partial(Check, group=GROUP, case=f"test 3: e = {e:g} asked for", source=DAMPED)
    return [
        check(quantity="restitution", unit="-", expected=e, obtained=float(obtained), tolerance=tolerance),
        check(
            quantity="largest overlap", unit="m", expected=exact.largest_overlap_m, obtained=float(overlap),
            tolerance=tolerance * exact.largest_overlap_m,
        ),
    ]  # fmt: skip


def restitution_without_pull(e: float) -> Check:
    """Test 3 without attractive forces: the dashpot coefficient is solved for, so that the restitution is e."""
    duration = closed_forms.on_wall(ALUMINIUM_OXIDE, 2.5e-3, 3.9, e).duration_s
    # a stronger dashpot prolongs the contact: three durations of the other model suffice for e = 0.1
    obtained, _, _ = rebound(e, duration / DAMPED_STEPS, n_looks=3 * DAMPED_STEPS // 10, every_steps=10, damping_model="no_pull")
    return Check(
        group=GROUP, case=f"test 3: e = {e:g} asked for, never pulling", quantity="restitution", unit="-",
        source="Thornton et al. 2013", expected=e, obtained=float(obtained), tolerance=closed_forms.damped_step_error(DAMPED_STEPS),
    )  # fmt: skip


def restitution_at_the_default_step(e: float) -> Check:
    """Test 3 with the default time step: restitution in a fast and stiff impact."""
    step = DEFAULT_STEP_RATIO * dem.rayleigh_time(2.5e-3, ALUMINIUM_OXIDE)
    obtained, _, n_steps = rebound(e, step, n_looks=80, every_steps=1)
    return Check(
        group=GROUP, case=f"test 3: e = {e:g} asked for, default time step", source=DAMPED, quantity="restitution", unit="-",
        expected=e, obtained=float(obtained), tolerance=closed_forms.damped_step_error(n_steps),
        note=f"{n_steps} steps per contact; slower impacts have more",
    )  # fmt: skip
