"""Oblique impact and spin, Chung & Ooi 2011 (Granular Matter 13, 643), tests 4 to 8.

Sliding throughout (Coulomb; Kharaz, Gorham, Salman 2001, Powder Technol. 120, 281): the tangential impulse is mu times the normal
impulse while the force is repulsive, J = mu m* (1 + e_push) v_n (e_push: see `closed_forms`; equal to e without dashpot).
It changes a sphere's tangential speed by J / m and its spin by J arm / (2/5 m R^2), which is 5 J / (2 m R) up to overlap over
radius: the engine's lever arm is R d / (R + R') between spheres and d on a wall, so its mean over the impact is
R (1 - mean overlap / (R + R')). The slip speed decreases by 7/2 J / m*; a contact with an initial slip speed of at least
7/2 mu (1 + e) v_n therefore slips throughout.

Sticking throughout: no closed form, but four ordinary differential equations (`stick`), solved with scipy apart from the engine.
"""

import math
from functools import partial

import numpy as np
import scipy

from virtual_soil.verification import closed_forms
from virtual_soil.verification.check import Check
from virtual_soil.verification.scene import ALUMINIUM, ALUMINIUM_OXIDE, FLOOR, mass_kg, record, scene

GROUP = "Oblique impact"
COULOMB = "closed form (Coulomb, sliding throughout)"
KHARAZ = "Kharaz et al. 2001, digitised"

STEPS = 5000
TOLERANCE = closed_forms.damped_step_error(STEPS)

#: Kharaz et al. 2001: impact angle from the normal (degrees), tangential restitution, spin after the impact (rad/s).
KHARAZ_POINTS = (
    (5, 0.948, 19.3),
    (10, 0.687, 213.0),
    (15, 0.624, 378.0),
    (20, 0.616, 511.0),
    (25, 0.634, 599.0),
    (30, 0.684, 616.5),
)

#: Error of a point digitised from a printed curve: 3 % of the axis of e_t (0 to 1) and of the spin (0 to 700 rad/s).
READING = 0.03
SPIN_READING_RAD_S = READING * 700.0

KHARAZ_RADIUS_M, KHARAZ_SPEED_M_S, KHARAZ_RESTITUTION, KHARAZ_FRICTION = 2.5e-3, 3.9, 0.98, 0.092
SLIDING_ANGLES_DEG = (35, 45, 60, 75, 85)

#: Tests 5 to 8; the initial slip speed is above 7/2 mu (1 + e) v_n = 0.56 m/s in all cases. The last has backspin.
RADIUS_M, NORMAL_SPEED_M_S, FRICTION = 0.1, 0.2, 0.4
RESTITUTIONS = (1.0, 0.5)
SPINS_RAD_S = (7.0, 22.0)
SPEEDS_AND_SPINS = ((0.6, 0.0), (2.4, 0.0), (0.0, 7.0), (0.0, 22.0), (0.6, -4.0))


def checks() -> list[Check]:
    """Run all cases of oblique impact."""
    return [
        *(check for point in KHARAZ_POINTS for check in digitised(*point)),
        *(check for angle in SLIDING_ANGLES_DEG for check in gross_sliding(angle)),
        *(check for e in RESTITUTIONS for check in sticking(e)),
        *(check for e in RESTITUTIONS for speed, spin in SPEEDS_AND_SPINS for check in sphere_on_wall(speed, spin, e)),
        *rolling_on_each_other(),
        *(check for e in RESTITUTIONS for spin in SPINS_RAD_S for check in equal_spheres(spin, e)),
        *(check for e in RESTITUTIONS for spin in SPINS_RAD_S for check in unequal_spheres(spin, e)),
    ]


def hit_wall(material, radius_m, velocity_m_s, spin_rad_s, restitution, friction):
    """Tangential speed and spin of a sphere after an impact on the floor at (tangential, normal) velocity with a spin about y."""
    tangential, normal = velocity_m_s
    step = closed_forms.on_wall(material, radius_m, normal).duration_s / STEPS
    simulation = scene(material, radius_m, step, restitution=restitution, static_friction=friction, walls=[FLOOR])
    simulation.add_grains(
        [(0.0, 0.0, radius_m)], radius_m, "grain", velocities_m_s=(tangential, 0.0, -normal),
        angular_velocities_rad_s=(0.0, spin_rad_s, 0.0),
    )  # fmt: skip
    run = record(simulation, 1, 2 * STEPS)
    return run.velocities_m_s[-1, 0, 0], run.spins_rad_s[-1, 0, 1]


def hit_wall_as_kharaz(angle_deg):
    """Test 4 at one angle: tangential restitution, spin in rad/s, initial speeds (tangential, normal)."""
    angle = math.radians(angle_deg)
    before = (KHARAZ_SPEED_M_S * math.sin(angle), KHARAZ_SPEED_M_S * math.cos(angle))
    speed, spin = hit_wall(ALUMINIUM_OXIDE, KHARAZ_RADIUS_M, before, 0.0, KHARAZ_RESTITUTION, KHARAZ_FRICTION)
    return speed / before[0], spin, before


def digitised(angle_deg: float, e_t: float, spin_rad_s: float) -> list[Check]:
    """Test 4 at angles with temporary sticking."""
    obtained, spin, _ = hit_wall_as_kharaz(angle_deg)
    check = partial(Check, group=GROUP, case=f"test 4: {angle_deg:g}°", source=KHARAZ)
    return [
        check(quantity="tangential restitution", unit="-", expected=e_t, obtained=float(obtained), tolerance=READING),
        check(quantity="spin", unit="rad/s", expected=spin_rad_s, obtained=float(spin), tolerance=SPIN_READING_RAD_S),
    ]


def gross_sliding(angle_deg: float) -> list[Check]:
    """Test 4 at angles with sliding throughout: e_t = 1 - mu (1 + e) / tan(angle), spin 5 mu (1 + e) v_n / 2R."""
    obtained, spin, (tangential, normal) = hit_wall_as_kharaz(angle_deg)
    impact = closed_forms.on_wall(ALUMINIUM_OXIDE, KHARAZ_RADIUS_M, normal, KHARAZ_RESTITUTION)
    impulse = KHARAZ_FRICTION * (1.0 + impact.push_restitution) * normal
    e_t = 1.0 - impulse / tangential
    arm = 1.0 - impact.mean_overlap_m / KHARAZ_RADIUS_M
    expected_spin = 2.5 * impulse * arm / KHARAZ_RADIUS_M
    check = partial(Check, group=GROUP, case=f"test 4: {angle_deg:g}°", source=COULOMB)
    return [
        check(
            quantity="tangential restitution", unit="-", expected=e_t, obtained=float(obtained), tolerance=TOLERANCE * (1.0 - e_t)
        ),
        check(quantity="spin", unit="rad/s", expected=expected_spin, obtained=float(spin), tolerance=TOLERANCE * expected_spin),
    ]


def sphere_on_wall(tangential_m_s: float, spin_rad_s: float, e: float) -> list[Check]:
    """Tests 5 and 6: constant normal speed, tangential speed or spin or both (backspin), sliding throughout."""
    impact = closed_forms.on_wall(ALUMINIUM, RADIUS_M, NORMAL_SPEED_M_S, e)
    slip = tangential_m_s - spin_rad_s * RADIUS_M
    impulse = math.copysign(FRICTION * (1.0 + impact.push_restitution) * NORMAL_SPEED_M_S, slip)
    arm = 1.0 - impact.mean_overlap_m / RADIUS_M
    speed, spin = hit_wall(ALUMINIUM, RADIUS_M, (tangential_m_s, NORMAL_SPEED_M_S), spin_rad_s, e, FRICTION)
    number = 5 if tangential_m_s else 6
    case = f"test {number}: speed {tangential_m_s:g} m/s, spin {spin_rad_s:g} rad/s, e = {e:g}"
    check = partial(Check, group=GROUP, case=case, source=COULOMB)
    change, turn = -impulse, 2.5 * impulse * arm / RADIUS_M
    return [
        check(
            quantity="change of tangential speed", unit="m/s", expected=change, obtained=float(speed - tangential_m_s),
            tolerance=TOLERANCE * abs(change),
        ),
        check(
            quantity="change of spin", unit="rad/s", expected=turn, obtained=float(spin - spin_rad_s),
            tolerance=TOLERANCE * abs(turn),
        ),
    ]  # fmt: skip


def stick(impact: closed_forms.Impact, shear_modulus_pa: float, tangential_m_s: float) -> tuple[float, float]:
    """Tangential speed and spin after an impact on a wall without slip, from the differential equations of the contact law.

    delta'' m = -F_n, s' = v_x - omega a, v_x' m = -F_t, omega' 2/5 m R^2 = F_t a with a = R - delta, S_t = 8 G* sqrt(R delta),
    F_t = S_t s + 2 sqrt(5/6) beta sqrt(S_t m) s', and F_t = 0 while F_n is attractive (Coulomb's limit is then zero).
    """
    m, r, beta = impact.mass_kg, impact.radius_m, impact.beta
    k, k_t = impact.stiffness, 8.0 * shear_modulus_pa * math.sqrt(r)

    def forces(state):
        delta, rate, v, omega, s = state
        root = math.sqrt(max(delta, 0.0))
        normal = k * root**3 + math.sqrt(5.0 * k * m * root) * beta * rate
        slip = v - omega * (r - delta)
        tangential = k_t * root * s + 2.0 * math.sqrt(5.0 / 6.0 * k_t * root * m) * beta * slip
        return normal, tangential if normal > 0.0 else 0.0, slip

    def derivative(_, state):
        normal, tangential, slip = forces(state)
        return [state[1], -normal / m, -tangential / m, 2.5 * tangential * (r - state[0]) / (m * r**2), slip]

    def parted(time, state):
        return state[0] if time > 0.1 * impact.duration_s else 1.0

    parted.terminal = True  # type: ignore[attr-defined]  # attribute read by scipy
    start = [0.0, impact.speed_m_s, tangential_m_s, 0.0, 0.0]
    scale = [impact.elastic_overlap_m, impact.speed_m_s, tangential_m_s, tangential_m_s / r, impact.elastic_overlap_m]
    solution = scipy.integrate.solve_ivp(
        derivative, (0.0, 3.0 * impact.duration_s), start, events=parted, rtol=1e-8, atol=1e-9 * np.array(scale),
        max_step=impact.duration_s / 500.0,
    )  # fmt: skip
    return solution.y[2, -1], solution.y[3, -1]


def sticking(e: float) -> list[Check]:
    """Test 5 with high friction, so that the contact never slips: tangential stiffness and dashpot."""
    tangential = 0.1
    impact = closed_forms.on_wall(ALUMINIUM, RADIUS_M, NORMAL_SPEED_M_S, e)
    modulus = ALUMINIUM.shear_modulus_pa / (2.0 - ALUMINIUM.poisson_ratio)
    expected = stick(impact, modulus, tangential)
    obtained = hit_wall(ALUMINIUM, RADIUS_M, (tangential, NORMAL_SPEED_M_S), 0.0, e, 1e3)
    check = partial(Check, group=GROUP, case=f"test 5: no slip, e = {e:g}", source="differential equation (scipy)")
    return [
        check(
            quantity="tangential speed", unit="m/s", expected=float(expected[0]), obtained=float(obtained[0]),
            tolerance=TOLERANCE * tangential,
        ),
        check(
            quantity="spin", unit="rad/s", expected=float(expected[1]), obtained=float(obtained[1]),
            tolerance=TOLERANCE * tangential / RADIUS_M,
        ),
    ]  # fmt: skip


def meet(spin_i: float, spin_j: float, radius_j: float, e: float):
    """Final y velocities (2,) and spins about z (2,) of a head-on impact along x of a sphere of RADIUS_M with another."""
    step = closed_forms.of_spheres(ALUMINIUM, RADIUS_M, radius_j, NORMAL_SPEED_M_S).duration_s / STEPS
    simulation = scene(ALUMINIUM, RADIUS_M, step, restitution=e, static_friction=FRICTION)
    half = 0.5 * NORMAL_SPEED_M_S
    for x, r, v, spin in ((-RADIUS_M, RADIUS_M, half, spin_i), (radius_j, radius_j, -half, spin_j)):
        simulation.add_grains([(x, 0, 0)], r, "grain", velocities_m_s=(v, 0, 0), angular_velocities_rad_s=(0, 0, spin))
    run = record(simulation, 1, 2 * STEPS)
    return run.velocities_m_s[-1, :, 1], run.spins_rad_s[-1, :, 2]


def equal_spheres(spin_rad_s: float, e: float) -> list[Check]:
    """Test 7 with identical spins, so that the surfaces slide."""
    return spinning_spheres("test 7: equal spheres", spin_rad_s, spin_rad_s, RADIUS_M, e)


def unequal_spheres(spin_rad_s: float, e: float) -> list[Check]:
    """Test 8: a spinning sphere, R 0.1 m, hits a non-spinning one, R 0.5 m, here of the same density."""
    return spinning_spheres("test 8: R 0.1 m on 0.5 m", spin_rad_s, 0.0, 5.0 * RADIUS_M, e)


def spinning_spheres(case: str, spin_i: float, spin_j: float, radius_j: float, e: float) -> list[Check]:
    """Head-on impact of two spheres that slide on each other throughout because of their spins."""
    impact = closed_forms.of_spheres(ALUMINIUM, RADIUS_M, radius_j, NORMAL_SPEED_M_S, e)
    impulse = FRICTION * impact.mass_kg * (1.0 + impact.push_restitution) * NORMAL_SPEED_M_S
    arm = 1.0 - impact.mean_overlap_m / (RADIUS_M + radius_j)
    speeds, spins = meet(spin_i, spin_j, radius_j, e)
    check = partial(Check, group=GROUP, case=f"{case}, spins {spin_i:g}, {spin_j:g} rad/s, e = {e:g}", source=COULOMB)
    found = []
    # i, on the left, spins anticlockwise: its surface moves up at the contact, and friction pushes i down and j up
    for name, r, sign, speed, turn in zip("ij", (RADIUS_M, radius_j), (-1.0, 1.0), speeds, spins - (spin_i, spin_j), strict=True):
        mass = mass_kg(ALUMINIUM, r)
        expected = {"transverse speed": ("m/s", sign * impulse / mass, speed)}
        expected["change of spin"] = ("rad/s", -2.5 * impulse * arm / (mass * r), turn)
        for quantity, (unit, value, obtained) in expected.items():
            found.append(
                check(
                    quantity=f"{quantity} of {name}", unit=unit, expected=value, obtained=float(obtained),
                    tolerance=TOLERANCE * abs(value),
                )
            )  # fmt: skip
    return found


def rolling_on_each_other() -> list[Check]:
    """Test 7 with opposite spins, as of gear wheels: no slip, no tangential force, spins unchanged."""
    spin = 5.0
    speeds, spins = meet(spin, -spin, RADIUS_M, 0.5)
    check = partial(Check, group=GROUP, case="test 7: equal spheres, spins 5, -5 rad/s", source="closed form (no slip, no force)")
    rounding = 1e-12  # some ten thousand float64 additions
    return [
        check(quantity="spin of i", unit="rad/s", expected=spin, obtained=float(spins[0]), tolerance=rounding * spin),
        check(quantity="spin of j", unit="rad/s", expected=-spin, obtained=float(spins[1]), tolerance=rounding * spin),
        check(
            quantity="transverse speed of i", unit="m/s", expected=0.0, obtained=float(speeds[0]),
            tolerance=rounding * spin * RADIUS_M,
        ),
    ]  # fmt: skip
