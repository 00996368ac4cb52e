"""Order of the integrator, and invariance of the laws under changes of the reference frame.

Order: the error of the leapfrog's positions is of second order in the step. The engine's velocities lag by half a step; taken at
the time of the positions, their error is of first order, and so is the error of dashpot forces, which use them. The force is not
smooth at the first contact, so every run starts exactly at the touch.

Frames: the cloud in a frame at rest, moving, rotated, or shifted through a periodic boundary reaches the same relative state up to
rounding. Each collision amplifies rounding by the distance between two collisions over the radius.
"""

import numpy as np
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from virtual_soil.verification import closed_forms
from virtual_soil.verification.check import Check
from virtual_soil.verification.conservation import RADIUS_M, make_cloud
from virtual_soil.verification.scene import GLASS, record, scene

GROUP = "Order and invariance"

#: Numbers of steps during the observed part of an impact, doubled from run to run.
STEPS = (50, 100, 200, 400, 800)
#: Tolerance of the slope of a straight line through the errors of five step sizes: terms of the next half order.
ORDER_TOLERANCE = 0.1

#: Rounding in float64 at ten radii from the origin, 1e-15 radii, amplified tenfold by each of up to ten collisions.
FRAME_TOLERANCE = 1e-5


def checks() -> list[Check]:
    """Run all cases of order and invariance."""
    return [*orders(), *frames()]


def exact_impact(impact: closed_forms.Impact, time_s: float) -> tuple[float, float]:
    """Overlap and its rate at a time after touch, computed with scipy."""
    k, m = impact.stiffness, impact.mass_kg

    def derivative(_, state):
        delta = max(state[0], 0.0)
        return [state[1], -(k * delta**1.5 + np.sqrt(5.0 * k * m * np.sqrt(delta)) * impact.beta * state[1]) / m]

    scale = np.array([impact.elastic_overlap_m, impact.speed_m_s])
    solution = solve_ivp(derivative, (0.0, time_s), [0.0, impact.speed_m_s], rtol=1e-12, atol=1e-13 * scale, method="DOP853")
    return solution.y[0, -1], solution.y[1, -1]


def errors(restitution: float) -> dict[str, list[float]]:
    """Relative errors of overlap and speed at 0.7 elastic durations after touch, for every number of steps."""
    r, v = 0.01, 10.0
    impact = closed_forms.of_spheres(GLASS, r, r, 2.0 * v, restitution)
    time = 0.7 * impact.duration_s
    overlap, speed = exact_impact(impact, time)
    found: dict[str, list[float]] = {"overlap": [], "speed": []}
    for n in STEPS:
        simulation = scene(GLASS, r, time / n, restitution=restitution)
        simulation.add_grains([(-r, 0, 0), (r, 0, 0)], r, "grain", velocities_m_s=[(v, 0, 0), (-v, 0, 0)])
        run = record(simulation, 1, n)
        found["overlap"].append(abs(2.0 * r - np.ptp(run.positions_m[-1, :, 0]) - overlap) / impact.elastic_overlap_m)
        found["speed"].append(abs(run.velocities_m_s[-1, 0, 0] - run.velocities_m_s[-1, 1, 0] - speed) / impact.speed_m_s)
    return found


def orders() -> list[Check]:
    """Check the order of the error, the slope of log(error) against log(step), in impacts of two glass spheres."""
    found = []
    for e, quantity, order, note in (
        (1.0, "overlap", 2.0, ""),
        (1.0, "speed", 1.0, "velocities stand half a step behind positions"),
        (0.5, "overlap", 1.0, "the dashpot reads velocities half a step old"),
    ):
        slope = -np.polyfit(np.log(STEPS), np.log(errors(e)[quantity]), 1)[0]
        found.append(
            Check(
                group=GROUP, case=f"impact with e = {e:g}", quantity=f"order of the error of the {quantity}", unit="-",
                source="closed form (leapfrog)", expected=order, obtained=float(slope), tolerance=ORDER_TOLERANCE, note=note,
            )
        )  # fmt: skip
    return found


def fly(shift_m=(0.0, 0.0, 0.0), drift_m_s=(0.0, 0.0, 0.0), turn: Rotation | None = None, period_m: float = 0.0):
    """Positions, velocities and spins of the cloud after 0.01 s, in the shifted, moving or rotated frame."""
    turn = turn or Rotation.identity()
    simulation, positions, radii, velocities, spins = make_cloud(model="type_a", mu_r=0.2, period_m=(period_m,) * 3)
    simulation.add_grains(turn.apply(positions) + shift_m, radii, "grain", turn.apply(velocities) + drift_m_s, turn.apply(spins))
    run = record(simulation, 1, round(0.01 / simulation.time_step_s))
    back, moved = turn.inv(), np.asarray(shift_m) + np.asarray(drift_m_s) * run.times_s[-1]
    return back.apply(run.positions_m[-1] - moved), back.apply(run.velocities_m_s[-1] - drift_m_s), back.apply(run.spins_rad_s[-1])


def frames() -> list[Check]:
    """Compare the cloud in different frames, in float64: largest difference over the radius, or over the largest initial value."""
    turn, period = Rotation.from_rotvec((0.3, -1.1, 0.7)), 14.0 * RADIUS_M
    at_rest, periodic = fly(), fly(period_m=period)
    cases = {
        "shifted by 15 radii": (at_rest, fly(shift_m=(0.01, -0.01, 0.005))),
        "moving at 3.7 m/s": (at_rest, fly(drift_m_s=(1.0, -2.0, 3.0))),
        "turned by 75°": (at_rest, fly(turn=turn)),
        "shifted across a periodic boundary": (periodic, fly(shift_m=(0.5 * period,) * 3, period_m=period)),
    }
    _, _, _, velocities, spins = make_cloud()
    scales = RADIUS_M, np.abs(velocities).max(), np.abs(spins).max()
    return [
        Check(
            group=GROUP, case=f"cloud of 64 grains, {case}", quantity=f"difference of the {quantity}", unit="-",
            source="closed form (invariance)", expected=0.0, obtained=float(np.abs(ours - theirs).max() / scale),
            tolerance=FRAME_TOLERANCE,
        )
        for case, states in cases.items()
        for quantity, scale, ours, theirs in zip(("positions", "velocities", "spins"), scales, *states, strict=True)
    ]  # fmt: skip
