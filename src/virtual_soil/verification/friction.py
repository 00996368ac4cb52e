"""Sliding, rolling and rest of a sphere on a plane: closed forms for rigid bodies.

Every sphere starts on the plane with its equilibrium overlap delta = (m g / k)^(2/3), so that it does not settle. With g_n, g_t
gravity normal to and along the plane, mu_s and mu_r static and rolling friction, I = 2/5 m R^2:
    sliding: dv/dt = g_t - mu_s g_n, d omega/dt = 5 mu_s g_n / 2R; from v0 on a level plane until 2 v0 / (7 mu_s g), then 5/7 v0;
    rolling against a torque mu_r F_n R: dv/dt = 5/7 (g_t - mu_r g_n), on a level plane to rest after 7 v0 / (5 mu_r g);
    it rolls without slip if mu_s g_n >= 2/7 g_t (mu_r = 0), and remains at rest if mu_r and mu_s are at least g_t / g_n.
The engine's lever arm on a plane is R - delta, so the relative accuracy of these forms is delta / R.
"""

import math
from functools import partial

import numpy as np

import dem
from virtual_soil.verification import closed_forms
from virtual_soil.verification.check import Check
from virtual_soil.verification.scene import FLOOR, SOFT, mass_kg, record, scene

GROUP = "Friction and rolling"
RIGID_BODY = "closed form (rigid body)"

RADIUS_M, GRAVITY_M_S2, RESTITUTION = 1e-3, 9.81, 0.5
TIME_STEP_S = 0.1 * dem.rayleigh_time(RADIUS_M, SOFT)
ROLLING_MODELS = ("type_a", "type_c")


def checks() -> list[Check]:
    """Run all cases of friction and rolling."""
    return [
        *sliding_to_rolling(),
        *(check for model in ROLLING_MODELS for check in rolling_to_rest(model)),
        *rolling_down(),
        *sliding_down(),
        *(check for model in ROLLING_MODELS for check in rest_on_incline(model)),
        *(rolling_on_incline(model) for model in ROLLING_MODELS),
    ]


def resting_overlap_m(slope_rad: float = 0.0) -> float:
    """Equilibrium overlap of the sphere with the plane under its weight."""
    weight = mass_kg(SOFT, RADIUS_M) * GRAVITY_M_S2 * math.cos(slope_rad)
    return (weight / closed_forms.on_wall(SOFT, RADIUS_M, 1.0).stiffness) ** (2.0 / 3.0)


def on_plane(mu_s, mu_r, *, slope_rad=0.0, speed_m_s=0.0, rolling=False, **settings) -> dem.Simulation:
    """Create a sphere that rests on the plane, or slides or rolls along x; the slope tilts gravity, downhill is x."""
    gravity = (GRAVITY_M_S2 * math.sin(slope_rad), 0.0, -GRAVITY_M_S2 * math.cos(slope_rad))
    simulation = scene(
        SOFT, RADIUS_M, TIME_STEP_S, restitution=RESTITUTION, static_friction=mu_s, rolling_friction=mu_r,
        gravity_m_s2=gravity, walls=[FLOOR], **settings,
    )  # fmt: skip
    height = RADIUS_M - resting_overlap_m(slope_rad)
    spin = speed_m_s / height if rolling else 0.0
    simulation.add_grains(
        [(0.0, 0.0, height)], RADIUS_M, "grain", velocities_m_s=(speed_m_s, 0.0, 0.0), angular_velocities_rad_s=(0.0, spin, 0.0)
    )
    return simulation


def motion(simulation: dem.Simulation, duration_s: float, n_looks: int):
    """Record times, speeds along x and spins about y at n_looks + 1 equidistant times."""
    run = record(simulation, n_looks, max(1, round(duration_s / n_looks / simulation.time_step_s)))
    return run.times_s, run.velocities_m_s[:, 0, 0], run.spins_rad_s[:, 0, 1]


def slope_of(times, values) -> float:
    """Slope of a straight line fitted to the second half of the samples, after the tangential spring has settled."""
    half = len(times) // 2
    return float(np.polyfit(times[half:], values[half:], 1)[0])


def tolerance_of(duration_s: float, slope_rad: float = 0.0) -> float:
    """Relative tolerance of speeds and rates over a time: lever arm, velocity lag of half a step, and one step of duration."""
    return resting_overlap_m(slope_rad) / RADIUS_M + 1.5 * TIME_STEP_S / duration_s


def sliding_to_rolling() -> list[Check]:
    """Transition from sliding to rolling on a level plane."""
    mu, v0 = 0.3, 0.1
    sticks = 2.0 * v0 / (7.0 * mu * GRAVITY_M_S2)
    times, speeds, spins = motion(on_plane(mu, 0.0, speed_m_s=v0), 2.0 * sticks, 400)
    sliding = times < 0.9 * sticks
    slip = speeds - spins * RADIUS_M
    rolls = times[np.argmax(slip < 0.01 * v0)] / 0.99  # the slip decreases linearly; the tangential spring affects its last part
    tolerance, looks = tolerance_of(sticks), times[1] / sticks
    check = partial(Check, group=GROUP, case="sliding sphere that begins to roll", source=RIGID_BODY)
    deceleration = -np.polyfit(times[sliding], speeds[sliding], 1)[0]
    turning = np.polyfit(times[sliding], spins[sliding], 1)[0]
    rows = (
        ("deceleration", "m/s²", mu * GRAVITY_M_S2, deceleration, tolerance),
        ("angular acceleration", "rad/s²", 2.5 * mu * GRAVITY_M_S2 / RADIUS_M, turning, tolerance),
        ("time when it begins to roll", "s", sticks, rolls, tolerance + looks),
        ("final speed", "m/s", 5.0 / 7.0 * v0, speeds[-1], tolerance),
        ("final spin", "rad/s", 5.0 / 7.0 * v0 / RADIUS_M, spins[-1], 2.0 * tolerance),
    )
    return [
        check(quantity=quantity, unit=unit, expected=expected, obtained=float(obtained), tolerance=relative * expected)
        for quantity, unit, expected, obtained, relative in rows
    ]


def rolling_to_rest(model: str) -> list[Check]:
    """Rolling to rest on a level plane under the torque mu_r F_n R."""
    mu_r, v0 = 0.02, 0.05
    stops = 7.0 * v0 / (5.0 * mu_r * GRAVITY_M_S2)
    simulation = on_plane(0.5, mu_r, speed_m_s=v0, rolling=True, rolling_model=model)
    times, speeds, spins = motion(simulation, 1.2 * stops, 240)
    braking = (times > 0.1 * stops) & (times < 0.9 * stops)
    check = partial(Check, group=GROUP, case=f"rolling to rest, {model}", source=RIGID_BODY)
    rate = 5.0 / 7.0 * mu_r * GRAVITY_M_S2
    found = [
        check(
            quantity="angular deceleration", unit="rad/s²", expected=rate / RADIUS_M,
            obtained=float(-np.polyfit(times[braking], spins[braking], 1)[0]),
            tolerance=2.0 * tolerance_of(stops) * rate / RADIUS_M,
        ),
        check(
            quantity="time to rest", unit="s", expected=stops, obtained=float(times[np.argmax(speeds < 1e-3 * v0)]),
            tolerance=(tolerance_of(stops) + 1e-3) * stops + times[1],
        ),
    ]  # fmt: skip
    return [*found, remaining_speed(check, model, mu_r, speeds[-20:])]


def remaining_speed(check, model: str, mu_r: float, speeds) -> Check:
    """Residual speed at rest: zero with type A; with type C the sphere oscillates on the rolling spring, which has no dashpot.

    The spring's energy at the limit is M^2 / 2 k_r with M = mu_r F_n R and k_r = S_t R^2; the kinetic energy is 7/10 m v^2.
    """
    weight = mass_kg(SOFT, RADIUS_M) * GRAVITY_M_S2
    k_r = 8.0 * SOFT.shear_modulus_pa / (2.0 - SOFT.poisson_ratio) * math.sqrt(RADIUS_M * resting_overlap_m())
    rocking = math.sqrt((mu_r * weight) ** 2 / k_r / (1.4 * mass_kg(SOFT, RADIUS_M)))
    return check(
        quantity="largest speed after that", unit="m/s", relation="at most", expected=0.0 if model == "type_a" else rocking,
        obtained=float(np.abs(speeds).max()), tolerance=1e-12 if model == "type_a" else 0.0,
        note="" if model == "type_a" else "the rolling spring has no dashpot: the bound is its energy at the limit",
    )  # fmt: skip


def incline(mu_s, mu_r, slope_rad, duration_s=0.2, **settings):
    """Record acceleration along the slope and angular acceleration of a sphere that starts at rest."""
    times, speeds, spins = motion(on_plane(mu_s, mu_r, slope_rad=slope_rad, **settings), duration_s, 200)
    return slope_of(times, speeds), slope_of(times, spins)


def rolling_down() -> list[Check]:
    """Rolling down without rolling friction, at 5/7 g sin(slope), also just above the minimum friction 2/7 tan(slope)."""
    slope = 0.2
    expected = 5.0 / 7.0 * GRAVITY_M_S2 * math.sin(slope)
    found = []
    for mu_s in (0.5, 1.05 * 2.0 / 7.0 * math.tan(slope)):
        check = partial(Check, group=GROUP, case=f"incline 0.2 rad, µs = {mu_s:.3f}, µr = 0: rolls", source=RIGID_BODY)
        rates = incline(mu_s, 0.0, slope)
        for quantity, unit, value, obtained in zip(
            ("acceleration", "angular acceleration"), ("m/s²", "rad/s²"), (expected, expected / RADIUS_M), rates, strict=True
        ):
            tolerance = 2.0 * tolerance_of(0.2, slope) * value
            found.append(check(quantity=quantity, unit=unit, expected=value, obtained=obtained, tolerance=tolerance))
    return found


def sliding_down() -> list[Check]:
    """Sliding down with friction below 2/7 tan(slope): g (sin - mu_s cos) and 5 mu_s g cos / 2R."""
    slope = 0.5
    mu_s = 0.8 * 2.0 / 7.0 * math.tan(slope)
    speeding, turning = incline(mu_s, 0.0, slope)
    check = partial(Check, group=GROUP, case=f"incline 0.5 rad, µs = {mu_s:.3f}, µr = 0: slides", source=RIGID_BODY)
    expected = GRAVITY_M_S2 * (math.sin(slope) - mu_s * math.cos(slope))
    spin = 2.5 * mu_s * GRAVITY_M_S2 * math.cos(slope) / RADIUS_M
    tolerance = tolerance_of(0.2, slope)
    return [
        check(quantity="acceleration", unit="m/s²", expected=expected, obtained=speeding, tolerance=tolerance * expected),
        check(quantity="angular acceleration", unit="rad/s²", expected=spin, obtained=turning, tolerance=tolerance * spin),
    ]


def rest_on_incline(model: str) -> list[Check]:
    """Rest on an incline if mu_r and mu_s are 5 % above tan(slope), and rest without slip if they are 2.2 tan(slope).

    The load is applied suddenly, so the springs first overshoot to twice their equilibrium extension: below 2 tan(slope) they slip.
    At rest the tangential spring is extended by m g sin / S_t; type C's rolling spring, k_r = S_t R^2, displaces the centre by the
    same amount again.
    """
    slope, duration = 0.2, 0.5
    stiffness = 8.0 * SOFT.shear_modulus_pa / (2.0 - SOFT.poisson_ratio) * math.sqrt(RADIUS_M * resting_overlap_m(slope))
    stretch = mass_kg(SOFT, RADIUS_M) * GRAVITY_M_S2 * math.sin(slope) / stiffness
    way = stretch if model == "type_a" else 2.0 * stretch
    found = []
    for excess in (1.05, 2.2):
        mu = excess * math.tan(slope)
        run = record(on_plane(mu, mu, slope_rad=slope, rolling_model=model), 50, round(duration / TIME_STEP_S / 50))
        case = f"incline 0.2 rad, µs = µr = {excess:g} tan: rests, {model}"
        check = partial(Check, group=GROUP, case=case, source=RIGID_BODY)
        speeds = np.abs(run.velocities_m_s[25:, 0, 0])
        found.append(
            check(
                quantity="largest speed, 0.25 to 0.5 s", unit="m/s", relation="at most", expected=0.0,
                obtained=float(speeds.max()), tolerance=1e-12,
            )
        )  # fmt: skip
    tolerance = 2.0 * resting_overlap_m(slope) / RADIUS_M  # lever arms of force and of rotation
    return [
        *found,
        check(
            quantity="way down the slope", unit="m", expected=way, obtained=float(run.positions_m[-1, 0, 0]),
            tolerance=tolerance * way,
        ),
    ]  # fmt: skip


def rolling_on_incline(model: str) -> Check:
    """Rolling down with mu_r 20 % below tan(slope), at 5/7 g (sin - mu_r cos)."""
    slope = 0.2
    mu_r = 0.8 * math.tan(slope)
    expected = 5.0 / 7.0 * GRAVITY_M_S2 * (math.sin(slope) - mu_r * math.cos(slope))
    obtained, _ = incline(0.5, mu_r, slope, rolling_model=model)
    return Check(
        group=GROUP, case=f"incline 0.2 rad, µr = 0.8 tan: rolls, {model}", source=RIGID_BODY, quantity="acceleration", unit="m/s²",
        expected=expected, obtained=obtained,
        tolerance=2.0 * tolerance_of(0.2, slope) * GRAVITY_M_S2 * math.sin(slope),
    )  # fmt: skip
