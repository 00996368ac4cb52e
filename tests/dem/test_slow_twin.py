"""The fast kernels against the slow and obvious twin, step by step, on random configurations."""

from dataclasses import replace

import numpy as np
import pytest
from slow_twin import SlowTwin

import dem

MATERIALS = {
    "sand": dem.Material(density_kg_m3=2500.0, poisson_ratio=0.2, shear_modulus_pa=1e7),
    "clay": dem.Material(density_kg_m3=1800.0, poisson_ratio=0.4, shear_modulus_pa=3e6),
}
INTERACTIONS = {
    ("sand", "sand"): dem.Interaction(restitution=0.5, static_friction=0.4, rolling_friction=0.1),
    ("sand", "clay"): dem.Interaction(restitution=0.3, static_friction=0.7, rolling_friction=0.02),
    ("clay", "clay"): dem.Interaction(restitution=0.9, static_friction=0.2, rolling_friction=0.3),
}
#: Sticky: grains cannot leave each other at the speeds here; clay and sand do not stick.
STICKY = {
    pair: replace(touch, work_of_adhesion_j_m2=w) for (pair, touch), w in zip(INTERACTIONS.items(), (3.0, 0.0, 1.0), strict=True)
}
PERIOD = (0.0, 6.2e-3, 0.0)


def crowd(seed, alike, interactions=INTERACTIONS, **settings):
    """18 grains, alike or of two sizes and materials, fly at each other on a moving floor; in a tube where nothing is periodic."""
    rng = np.random.default_rng(seed)
    walls = [
        dem.Box(name="floor", material="sand", low_m=(-1, -1, 0), high_m=(1, 1, 0), velocity_m_s=(0.05, 0.0, 0.02)),
        dem.Box(name="block", material="clay", low_m=(3e-3, -1e-3, -1e-3), high_m=(5e-3, 1e-3, 1e-3)),
    ]
    if "period_m" not in settings:
        walls.append(dem.Tube(name="tube", material="clay", radius_m=4.6e-3, bottom_m=1e-3, top_m=1.0, velocity_m_s=(0, 0, 0.05)))
    simulation = dem.Simulation(
        materials=MATERIALS,
        interactions=interactions,
        walls=walls,
        smallest_radius_m=0.7e-3,
        time_step_rayleigh_ratio=0.2,
        **settings,
    )
    places, names = [], []
    while len(places) < 18:
        place = rng.uniform((-3e-3, -3e-3, 1.1e-3), (3e-3, 3e-3, 7e-3))
        radius, name = (1e-3, "sand") if alike else [(1e-3, "sand"), (0.7e-3, "clay")][rng.integers(2)]
        try:
            velocity = rng.normal(0.0, 0.3, 3) - 40 * (place - (0, 0, 3e-3))
            simulation.add_grains([place], radius, name, velocity, rng.normal(0.0, 200.0, 3))
        except ValueError:  # no room there
            continue
        places.append(place)
        names.append(name)
    return simulation, names


@pytest.mark.parametrize("seed", [1, 2])
@pytest.mark.parametrize("alike", [False, True])
# every pair of two settings, in half of the combinations: each is compiled by itself
@pytest.mark.parametrize(
    ("rolling_model", "vector_code", "period"),
    [("type_a", True, PERIOD), ("type_c", True, None), ("type_c", False, PERIOD), ("type_a", False, None)],
)
def test_the_fast_kernels_do_what_the_slow_twin_does(seed, alike, rolling_model, vector_code, period):
    settings = {"rolling_model": rolling_model, "vector_code": vector_code, "precision": "float64"}
    if period:
        settings["period_m"] = period
    fast, names = crowd(seed, alike, **settings)
    slow = SlowTwin(fast, names, INTERACTIONS, rolling_model, period=period or (0.0, 0.0, 0.0))
    met = set()
    for _ in range(60):
        fast.advance(10)
        for _ in range(10):
            slow.step()
            met |= set(slow.springs)
        grains = fast.grains
        assert grains.positions_m == pytest.approx(slow.x, abs=1e-12)
        assert grains.velocities_m_s == pytest.approx(slow.v, abs=1e-7)
        assert grains.angular_velocities_rad_s == pytest.approx(slow.w, abs=1e-4)
    assert sum(isinstance(j, int) for _, j in met) > 5
    assert sum(not isinstance(j, int) for _, j in met) > 0


@pytest.mark.parametrize("seed", [1, 2])
def test_with_the_limit_of_liggghts_friction_goes_beyond_coulombs(seed):
    settings = {"tangential_model": "liggghts", "precision": "float64"}
    fast, names = crowd(seed, False, **settings)
    slow, coulomb = (SlowTwin(fast, names, INTERACTIONS, tangential_model=model) for model in ("liggghts", "edem"))
    for _ in range(60):
        fast.advance(10)
        for _ in range(10):
            slow.step()
            coulomb.step()
        grains = fast.grains
        assert grains.positions_m == pytest.approx(slow.x, abs=1e-12)
        assert grains.velocities_m_s == pytest.approx(slow.v, abs=1e-7)
        assert grains.angular_velocities_rad_s == pytest.approx(slow.w, abs=1e-4)
    assert slow.beyond_coulomb > 10
    assert coulomb.beyond_coulomb == 0
    assert np.abs(slow.w - coulomb.w).max() > 1.0


@pytest.mark.parametrize("seed", [1, 2])
@pytest.mark.parametrize(
    ("adhesion", "rolling_model", "vector_code", "period"), [("constant", "type_a", True, None), ("jkr", "type_c", False, PERIOD)]
)
def test_adhesive_grains_do_what_the_slow_twin_does(seed, adhesion, rolling_model, vector_code, period):
    settings = {"rolling_model": rolling_model, "vector_code": vector_code, "precision": "float64", "adhesion": adhesion}
    settings["energy_ledger"] = vector_code  # as in the verification: a kernel less to compile
    if period:
        settings["period_m"] = period
    fast, names = crowd(seed, False, STICKY, **settings)
    slow = SlowTwin(fast, names, STICKY, rolling_model, period=period or (0.0, 0.0, 0.0), adhesion=adhesion)
    met = set()
    for _ in range(60):
        fast.advance(10)
        for _ in range(10):
            slow.step()
            met |= set(slow.springs)
        grains = fast.grains
        # the curve of JKR is right to 2e-8 of the pull-off force
        assert grains.positions_m == pytest.approx(slow.x, abs=1e-9 if adhesion == "jkr" else 1e-11)
        assert grains.velocities_m_s == pytest.approx(slow.v, abs=1e-5)
    assert sum(isinstance(j, int) for _, j in met) > 5
    assert (slow.outlasted > 10) == (adhesion == "jkr")


def test_single_precision_follows_the_slow_twin_through_the_first_contacts():
    fast, names = crowd(1, alike=False)
    slow = SlowTwin(fast, names, INTERACTIONS)
    met = set()
    for _ in range(300):
        slow.step()
        met |= set(slow.springs)
    fast.advance(300)
    assert len(met) > 3
    assert fast.grains.velocities_m_s == pytest.approx(slow.v, abs=2e-4)


def test_the_walls_feel_what_the_slow_twin_says():
    fast, names = crowd(2, alike=False, precision="float64")
    slow = SlowTwin(fast, names, INTERACTIONS)
    total = np.zeros((3, 3))
    for _ in range(500):
        slow.step()
        total += slow.wall_forces
    fast.advance(500)
    assert (np.abs(total).max(axis=1) > 0).sum() >= 2
    assert np.array(list(fast.mean_wall_forces_n.values())) == pytest.approx(total / 500, rel=1e-6, abs=1e-12)
