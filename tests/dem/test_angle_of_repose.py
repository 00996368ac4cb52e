"""How the angle-of-repose test ends."""

from dataclasses import replace

import numpy as np
import pytest

from dem import Grains, Material, Simulation, SimulationError
from dem.experiments import angle_of_repose
from dem.experiments.soil import Engine, Soil
from dem.measure import heap

RADIUS = 1e-3
STEEL = Material(density_kg_m3=7800.0, poisson_ratio=0.3, shear_modulus_pa=5e7)


SOIL = Soil(
    radius_m=RADIUS,
    density_kg_m3=2500.0,
    poisson_ratio=0.2,
    shear_modulus_pa=1e6,
    static_friction=0.3,
    rolling_friction=0.1,
    restitution=0.5,
)


def make(static_friction, rolling_friction, max_time_s=2.0, lift_speed_m_s=0.05, adhesive_stress_pa=0.0):
    soil = replace(SOIL, static_friction=static_friction, rolling_friction=rolling_friction, adhesive_stress_pa=adhesive_stress_pa)
    setup = angle_of_repose.Setup(
        n_particles=500,
        tube_diameter_ratio=10.0,
        plate_half_width_ratio=60.0,
        lift_speed_m_s=lift_speed_m_s,
        max_time_s=max_time_s,
        scale_radius_m=RADIUS,
    )
    return angle_of_repose.run(soil, setup, Engine(stiffness_reduction=1.0, time_step_rayleigh_ratio=0.2), seed=1)


def test_a_soil_without_friction_ends_flat_before_the_time_is_up():
    ended = make(0.0, 0.0)
    assert ended.status == "flat"
    assert ended.simulated_time_s < 2.0
    grains = ended.grains
    assert heap.measure_heap(grains.positions_m, grains.radii_m).is_flat


def test_a_rough_soil_ends_static_and_stands():
    ended = make(0.9, 0.3)
    assert ended.status == "static"
    assert angle_of_repose.height_m(ended.grains) > angle_of_repose.FLAT_HEIGHT_RATIO * 2 * RADIUS


def test_grains_that_stick_too_much_to_fall_stand_as_a_column():
    weight_pa = 0.57 * SOIL.density_kg_m3 * 9.81 * 0.03  # of the filled column
    ended = make(0.3, 0.1, adhesive_stress_pa=3.0 * weight_pa)
    assert ended.status == "column"
    assert make(0.3, 0.1, adhesive_stress_pa=0.005 * weight_pa).status == "static"


def cone(slope_deg, n=20000):
    """Grains at random in a cone of n grains."""
    rng = np.random.default_rng(1)
    foot = (4.0 * n * RADIUS**3 / (0.57 * np.tan(np.radians(slope_deg)))) ** (1 / 3)
    height = foot * np.tan(np.radians(slope_deg))
    x, y, z = rng.uniform((-foot, -foot, 0.0), (foot, foot, height), (8 * n, 3)).T
    inside = np.flatnonzero(np.hypot(x, y) < foot * (1.0 - z / height))[:n]
    places = np.column_stack([x, y, z])[inside]
    return Grains(places, 0.0 * places, 0.0 * places, np.full(len(places), RADIUS))


def test_the_share_of_a_column_is_that_of_no_cone_of_the_same_volume():
    """Steep cones are heaps in a flat tube too, though most of their grains stay within its radius."""
    n = 20000
    for aspect in (0.3, 1.0, 3.0):  # height of the fill over the tube's diameter
        tube_m = (n * 4.0 / 3.0 * RADIUS**3 / (0.57 * 2.0 * aspect)) ** (1 / 3)
        assert not angle_of_repose.is_column(cone(48.0), tube_m)
    assert angle_of_repose.is_column(cone(75.0), (n * 4.0 / 3.0 * RADIUS**3 / (0.57 * 2.0)) ** (1 / 3))


def test_a_heap_that_is_still_moving_when_the_time_is_up_is_named_so():
    assert make(0.9, 0.3, max_time_s=0.02, lift_speed_m_s=2.0).status == "time_limit"


def test_grains_that_are_still_in_their_tube_when_the_time_is_up_are_no_heap():
    with pytest.raises(
        SimulationError, match=r"the tube is not clear of the grains at the time limit of 0.02 s: its rim is 1 mm high"
    ):
        make(0.9, 0.3, max_time_s=0.02)


def test_what_the_test_calls_flat_is_flat_to_the_estimators():
    assert angle_of_repose.FLAT_HEIGHT_RATIO == heap.MIN_HEIGHT_RATIO


def test_too_few_grains_are_flat_however_high():
    n = 5
    positions = np.column_stack([np.zeros(n), np.zeros(n), RADIUS * (1 + 2 * np.arange(n))])
    tower = Grains(positions, np.zeros((n, 3)), np.zeros((n, 3)), np.full(n, RADIUS))
    assert angle_of_repose.is_flat(tower, 10 * n + 1)
    assert not angle_of_repose.is_flat(tower, n)


def test_every_setting_of_the_engine_reaches_the_simulation(monkeypatch):
    monkeypatch.setattr("dem.compiled.ensure", lambda *_, **__: None)
    engine = Engine(
        rolling_model="type_c",
        damping_model="no_pull",
        adhesion="jkr",
        precision="float64",
        vector_code=False,
        energy_ledger=True,
        gravity_m_s2=5.0,
        time_step_rayleigh_ratio=0.1,
    )
    sticky = replace(SOIL, adhesive_stress_pa=100.0)
    options = engine.options(sticky)
    simulation = Simulation(materials={"soil": STEEL}, interactions={}, smallest_radius_m=RADIUS, **options)
    assert options.items() <= (simulation._settings | {"gravity_m_s2": (0.0, 0.0, -5.0)}).items()
    assert simulation.gravity_m_s2 == (0.0, 0.0, -5.0)
    assert engine.options(SOIL) == options | {"adhesion": "none"}
    assert set(options) | {"stiffness_reduction"} == set(Engine.__dataclass_fields__)
