"""The scalar contact laws; this folder runs with JIT on and off."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import brentq

from dem import Interaction, Material
from dem.contact.laws import capillary, hertz, jkr, mindlin, pull_off, rolling_a
from dem.contact.model import LAWS, Equivalent
from dem.layout import BLOCK

GLASS = (2e10, 0.2)


def test_effective_moduli_of_equal_solids_match_their_closed_forms():
    G, nu = GLASS
    assert hertz.effective_young_modulus(G, nu, G, nu) == pytest.approx(G / (1 - nu))
    assert mindlin.effective_shear_modulus(G, nu, G, nu) == pytest.approx(G / (2 * (2 - nu)))


def test_a_very_stiff_partner_leaves_the_softer_solid_in_charge():
    G, nu = GLASS
    assert hertz.effective_young_modulus(G, nu, 1e20, nu) == pytest.approx(2 * G * (1 + nu) / (1 - nu**2), rel=1e-6)


def test_an_elastic_contact_has_no_dashpot_and_less_restitution_means_more():
    assert hertz.damping_ratio(1.0) == 0.0
    ratios = [hertz.damping_ratio(e) for e in (0.9, 0.5, 0.1)]
    assert ratios == sorted(ratios)


def rebound_by_steps(beta, n=100_000):
    """Rebound of x'' = max(0, ...) by small steps, in natural units."""
    x, v, dt = 0.0, 1.0, 20.0 / n
    while x >= 0.0 and not (v < 0.0 and x**1.25 < -math.sqrt(5.0) * beta * v):
        v -= dt * max(x**1.5 + math.sqrt(5.0) * beta * x**0.25 * v, 0.0)
        x += dt * v
    return -v


@pytest.mark.parametrize("e", [0.02, 0.1, 0.1353, 0.5, 0.9])
def test_without_pull_a_larger_dashpot_is_needed_for_the_same_rebound(e):
    beta = hertz.damping_ratio_without_pull(e)
    assert rebound_by_steps(beta) == pytest.approx(e, rel=2e-3)
    assert beta > hertz.damping_ratio(e)
    assert hertz.normal_force(hertz.Hertz(3e7, 2.0, 0.0), 1e-6, 1e-3, 1e-6**0.25, 10.0) == 0.0


def test_damping_ratio_gives_a_linear_spring_the_restitution_it_is_named_after():
    beta = hertz.damping_ratio(0.5)
    assert math.exp(-math.pi * beta / math.sqrt(1 - beta**2)) == pytest.approx(0.5)


@given(st.floats(1e-9, 1e-4), st.floats(1.01, 4.0))
def test_the_normal_spring_grows_with_the_three_halves_power_of_the_overlap(overlap, factor):
    def force(delta):
        return hertz.normal_force(hertz.Hertz(3e7, 0.0, -1e30), delta, math.sqrt(delta), delta**0.25, 0.0)

    assert force(factor * overlap) == pytest.approx(factor**1.5 * force(overlap), rel=1e-12)


def test_the_dashpot_resists_approach():
    quiet, approaching = (hertz.normal_force(hertz.Hertz(3e7, 2.0, -1e30), 1e-6, 1e-3, 1e-6**0.25, v) for v in (0.0, -0.1))
    assert approaching > quiet


@given(st.floats(0.0, 10.0), st.floats(0.0, 10.0))
def test_slip_never_lets_the_force_exceed_the_limit(trial, limit):
    factor = mindlin.slip(trial**2, limit, 1.0, 1e-30)
    assert 0.0 <= factor <= 1.0
    assert trial * factor <= limit * (1 + 1e-12)
    if trial < limit and limit > 1e-20:  # forces of the size of `tiny` do not matter
        assert factor == pytest.approx(1.0, rel=1e-12)


@given(st.tuples(*[st.floats(-5, 5)] * 3), st.floats(0.0, 10.0))
def test_rolling_resistance_may_stop_a_spin_but_not_reverse_it(spin, change):
    keep = 1.0 - rolling_a.braked(*spin, change, 1.0, 1e-30)
    speed = float(np.linalg.norm(spin))
    assert 0.0 <= keep <= 1.0
    assert keep * speed == pytest.approx(max(0.0, speed - change), abs=1e-12)


@given(st.floats(1e-9, 1e-4))
def test_the_energy_of_the_normal_spring_is_the_integral_of_its_force(overlap):
    law, deltas = hertz.Hertz(3e7, 0.0, -1e30), np.linspace(0.0, overlap, 2001)
    work = np.trapezoid([hertz.spring_force(law, delta, math.sqrt(delta)) for delta in deltas], deltas)
    assert hertz.normal_energy(law, overlap, math.sqrt(overlap)) == pytest.approx(work, rel=1e-5)


@pytest.mark.parametrize("law", LAWS)
def test_every_law_says_what_the_engine_asks_for(law):
    assert len(law.CONSTANTS) <= len(law.PARAMETERS._fields)
    assert set(law.PROPERTIES) <= set(Interaction.__dataclass_fields__)
    assert set(law.WORDS) == {"words", "equation"}
    assert (law.reach((1e7, 0.02, 1e-3), 1e-3) > 0.0) == (law in (jkr, capillary))  # the others need contact
    touch = Interaction(restitution=0.5, static_friction=0.4, rolling_friction=0.1)
    solid = Material(density_kg_m3=2500.0, poisson_ratio=0.2, shear_modulus_pa=1e7)
    assert len(law.column_values(solid, solid, touch)) == len(law.COLUMNS)


# --- adhesion ----------------------------------------------------------------------------------------------------------------

E_STAR, R_STAR, WORK, VOLUME = 6.25e7, 25e-6, 0.02, 1e-3


def constants_of(law, work, number=float):
    """A contact's constants in a number type, and the values that they were made of."""
    raw, c = np.array([E_STAR, work, VOLUME]).repeat(BLOCK), np.zeros(len(law.CONSTANTS) * BLOCK, number)
    nothing = law.PARAMETERS(*(number(0.0) for _ in law.PARAMETERS._fields))
    law.write(nothing, raw, 0, c, 0, Equivalent(R_STAR, 1e-9, 0.0, law.scale(nothing, raw, 0, R_STAR)))
    return law.read(law.PARAMETERS(*(number(hertz.NO_BOUND) for _ in law.PARAMETERS._fields)), c, 0)


def force_at(law, constants, overlap, number=float):
    """Normal force without dashpot, its repulsive part, and the contact's energy, at an overlap."""
    deformed, root, fourth_root = law.deformation(constants, number(overlap), number(1e-18))
    repulsive = law.normal_force(constants, deformed, root, fourth_root, number(0.0))
    net = law.attracted(constants, repulsive, number(overlap), root, fourth_root)
    return net, repulsive, law.normal_energy(constants, number(overlap), root)


def jkr_by_bisection(overlap):
    """Force of the implicit law and its repulsive part, by the contact radius."""
    least = (math.pi * WORK * R_STAR**2 / (8 * E_STAR)) ** (1 / 3)

    def gap(a):
        return a**2 / R_STAR - math.sqrt(2 * math.pi * WORK * a / E_STAR) - overlap

    a = brentq(gap, least, R_STAR, xtol=1e-22, rtol=1e-14)
    repulsive = 4 * E_STAR * a**3 / (3 * R_STAR)
    return repulsive - math.sqrt(8 * math.pi * WORK * E_STAR * a**3), repulsive


@pytest.mark.parametrize(("number", "error"), [(float, 1e-10), (np.float32, 3e-5)])
@pytest.mark.parametrize("overlap", [-2.2007e-8, -2.2e-8, -1.058e-8, -1e-9, 0.0, 1e-9, 2.666e-8, 1e-7, 1e-6])
def test_the_jkr_curve_is_that_of_the_implicit_law(overlap, number, error):
    net, repulsive, _ = force_at(jkr, constants_of(jkr, WORK, number), overlap, number)
    expected_net, expected_repulsive = jkr_by_bisection(overlap)
    scale = 1.5 * math.pi * WORK * R_STAR
    assert float(net) == pytest.approx(expected_net, rel=error, abs=error * scale)
    assert float(repulsive) == pytest.approx(expected_repulsive, rel=error, abs=error * scale)


@pytest.mark.parametrize("law", [pull_off, jkr, capillary])
@pytest.mark.parametrize("overlap", [1e-12, 1e-9, 1e-6])
def test_without_work_of_adhesion_the_force_is_hertz(law, overlap):
    net, repulsive, _ = force_at(law, constants_of(law, 0.0), overlap)
    expected = hertz.stiffness(E_STAR, R_STAR) * overlap**1.5
    assert net == pytest.approx(expected, rel=1e-6)
    assert repulsive == pytest.approx(expected, rel=1e-6)


@pytest.mark.parametrize("law", [pull_off, jkr, capillary])
@pytest.mark.parametrize("overlap", [-1.5e-8, 1e-8, 3e-7])
def test_the_force_is_the_slope_of_the_energy(law, overlap):
    if law is pull_off and overlap < 0:
        return
    constants, step = constants_of(law, WORK), 1e-12
    ahead, behind = (force_at(law, constants, overlap + sign * step)[2] for sign in (1, -1))
    assert (ahead - behind) / (2 * step) == pytest.approx(force_at(law, constants, overlap)[0], rel=1e-5, abs=1e-10)


def test_a_jkr_contact_begins_with_an_overlap_and_ends_where_it_is_torn_off():
    constants = constants_of(jkr, WORK)
    torn = jkr.reach((E_STAR, WORK), R_STAR)
    assert torn == pytest.approx(22.008e-9, rel=1e-4)
    fresh, held = [np.zeros(1), np.ones(1)]
    assert not jkr.touches(constants, -1.0, -0.1 * torn, fresh, 0, 0.0)
    assert jkr.touches(constants, -1.0, -0.99 * torn, held, 0, 0.0)
    assert not jkr.touches(constants, -1.0, -1.01 * torn, held, 0, 0.0)
    assert jkr.torn_energy(constants, held, 0) > 0.0 == jkr.torn_energy(constants, fresh, 0)


def test_a_bridge_pulls_as_willett_found_from_first_touch_until_it_breaks():
    constants = constants_of(capillary, WORK)
    breaks = capillary.reach((E_STAR, WORK, VOLUME), R_STAR)
    assert breaks == pytest.approx(0.1 * R_STAR)
    full = 2 * math.pi * WORK * R_STAR
    for gap in (0.0, 1e-7, 1e-6, 2.4e-6):
        x = gap * math.sqrt(2 * R_STAR / (VOLUME * R_STAR**3))
        net, repulsive, _ = force_at(capillary, constants, -gap)
        assert net == pytest.approx(-full / (1 + 1.05 * x + 2.5 * x**2))
        assert repulsive == 0.0
    fresh, held = np.zeros(1), np.ones(1)
    assert not capillary.touches(constants, -1.0, -0.1 * breaks, fresh, 0, 0.0)
    assert capillary.touches(constants, -1.0, -0.99 * breaks, held, 0, 0.0)
    assert not capillary.touches(constants, -1.0, -1.01 * breaks, held, 0, 0.0)
    gaps = np.linspace(0.0, breaks, 2001)
    work = np.trapezoid([-force_at(capillary, constants, -gap)[0] for gap in gaps], gaps)
    assert capillary.torn_energy(constants, held, 0) == pytest.approx(work, rel=1e-5)
    assert capillary.torn_energy(constants, fresh, 0) == 0.0


def test_at_contact_a_bridge_is_the_constant_pull_off():
    for overlap in (1e-9, 1e-7):
        by_bridge, by_law = (force_at(law, constants_of(law, WORK), overlap) for law in (capillary, pull_off))
        assert by_bridge == pytest.approx(by_law, rel=1e-14)
