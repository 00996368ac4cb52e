"""The closed forms against published figures and against their differential equation."""

import math

import pytest
from scipy.integrate import solve_ivp

from virtual_soil.verification.closed_forms import HERTZ_DURATION, HERTZ_MEAN_OVERLAP, of_spheres, on_wall
from virtual_soil.verification.scene import ALUMINIUM, ALUMINIUM_OXIDE, GLASS


def test_elastic_impacts_have_the_published_force_overlap_and_duration():
    """Chung & Ooi 2011, tests 1 and 2."""
    glass, aluminium = of_spheres(GLASS, 0.01, 0.01, 20.0), on_wall(ALUMINIUM, 0.1, 0.2)
    assert HERTZ_DURATION == pytest.approx(2.94328, abs=5e-6)
    for impact, force, overlap, duration in (
        (glass, 10696.9, 274.11e-6, 40.339e-6),
        (aluminium, 11369.9, 49.717e-6, 731.66e-6),
    ):
        assert impact.largest_force_n == pytest.approx(force, rel=1e-5)
        assert impact.elastic_overlap_m == pytest.approx(overlap, rel=2e-5)
        assert impact.duration_s == pytest.approx(duration, rel=2e-5)


def solve(impact):
    """Rebound speed when the overlap is zero again, and largest one, over the impact speed; largest and mean overlap."""
    k, m, beta = impact.stiffness, impact.mass_kg, impact.beta

    def force(delta, rate):
        delta = max(delta, 0.0)
        return k * delta**1.5 + math.sqrt(5.0 * k * m) * beta * delta**0.25 * rate

    def parted(time, state):
        return state[0] if time > 0.1 * impact.duration_s else 1.0

    parted.terminal = True
    start, end = [0.0, impact.speed_m_s, 0.0], 5.0 * impact.duration_s

    def derivative(_, state):
        return [state[1], -force(*state[:2]) / m, force(*state[:2]) * state[0]]

    scales = (impact.elastic_overlap_m, impact.speed_m_s, impact.mass_kg * impact.speed_m_s * impact.elastic_overlap_m)
    solution = solve_ivp(
        derivative, (0.0, end), start, events=parted, rtol=1e-9, atol=[1e-11 * scale for scale in scales],
        max_step=impact.duration_s / 1000.0,
    )  # fmt: skip
    overlaps, rates, moments = solution.y
    impulse = m * (impact.speed_m_s - rates[-1])
    return -rates[-1] / impact.speed_m_s, -rates.min() / impact.speed_m_s, overlaps.max(), moments[-1] / impulse


@pytest.mark.parametrize("e", [0.1, 0.3, 0.5, 0.9, 1.0])
def test_the_damped_impact_solves_its_differential_equation(e):
    impact = on_wall(ALUMINIUM_OXIDE, 2.5e-3, 3.9, e)
    rebound, fastest, overlap, mean = solve(impact)
    assert rebound == pytest.approx(e, rel=1e-5)
    assert fastest == pytest.approx(impact.push_restitution, rel=1e-5)
    assert overlap == pytest.approx(impact.largest_overlap_m, rel=1e-5)
    if e == 1.0:
        assert mean == pytest.approx(impact.mean_overlap_m, rel=1e-6)
        assert pytest.approx(0.8176, abs=1e-4) == HERTZ_MEAN_OVERLAP
