"""The scalar contact laws; this folder runs with JIT on and off."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dem import Interaction, Material
from dem.contact.laws import hertz, mindlin, rolling_a
from dem.contact.model import LAWS

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
    assert law.reach(1e-3) == 0.0
    touch = Interaction(restitution=0.5, static_friction=0.4, rolling_friction=0.1)
    solid = Material(density_kg_m3=2500.0, poisson_ratio=0.2, shear_modulus_pa=1e7)
    assert len(law.column_values(solid, solid, touch)) == len(law.COLUMNS)
