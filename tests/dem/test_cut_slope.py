"""Cut slopes of small beds: what stands, what falls, and that the bisection tells them apart."""

import copy
import dataclasses

import numpy as np
import pytest

from dem.experiments import cut_slope
from dem.experiments.soil import Engine, Soil

SOIL = Soil(
    radius_m=1e-3, density_kg_m3=2500.0, poisson_ratio=0.2, shear_modulus_pa=2e6, static_friction=0.3, rolling_friction=0.05,
    restitution=0.3,
)  # fmt: skip
SETUP = cut_slope.Setup(
    length_ratio=50.0,
    height_ratio=18.0,
    thickness_ratio=8.0,
    tolerance_deg=4.0,
    preparation_friction_ratio=0.3,
    scale_radius_m=1e-3,
)
ENGINE = Engine(time_step_rayleigh_ratio=0.4)
#: Weight per area of the slope, rho_b g H.
WEIGHT_PA = 0.6 * SOIL.density_kg_m3 * ENGINE.gravity_m_s2 * SETUP.height_m


def sticky(stress_pa):
    return dataclasses.replace(SOIL, adhesive_stress_pa=stress_pa)


@pytest.fixture(scope="module")
def slope():
    return cut_slope.run(SOIL, SETUP, ENGINE, 1)


def test_a_slope_without_adhesion_stands_about_its_friction_angle(slope):
    assert slope.status == "done"
    assert 25.0 < slope.stands_deg < slope.falls_deg < 55.0
    assert slope.half_width_deg <= 0.5 * SETUP.tolerance_deg
    assert slope.stood_moved_ratio <= cut_slope.FALLEN_SHARE < slope.fell_moved_ratio
    assert slope.height_m == pytest.approx(SETUP.height_m)
    assert 0.55 < slope.solid_fraction < 0.65


def test_the_bisection_tried_both_sides_of_its_answer(slope):
    stood, fell = (slope.cuts[:, 0][which] for which in (slope.cuts[:, 1] <= 0.1, slope.cuts[:, 1] > 0.1))
    assert (stood.max(), fell.min()) == (slope.stands_deg, slope.falls_deg)
    assert len(np.unique(slope.cuts[:, 0])) == len(slope.cuts)


def test_the_grains_before_and_after_are_those_of_the_cut_that_fell(slope):
    x, _, z = slope.before.positions_m.T
    down = (x - SETUP.crest_m) * np.tan(np.radians(slope.falls_deg))
    bottom = cut_slope.FLOOR_LAYER * SOIL.radius_m
    assert (z <= np.clip(bottom + SETUP.height_m - down, bottom, bottom + SETUP.height_m) + 1e-9).all()
    assert len(slope.before) == len(slope.after) < slope.n_particles
    assert slope.after.positions_m[:, 2].mean() < slope.before.positions_m[:, 2].mean()


def test_adhesion_steepens_the_slope_until_it_stands_as_a_wall(slope):
    steeper = cut_slope.run(sticky(0.05 * WEIGHT_PA), SETUP, ENGINE, 1)
    assert steeper.slope_angle_deg > slope.slope_angle_deg + 5.0
    assert steeper.solid_fraction == pytest.approx(slope.solid_fraction, abs=0.02)  # prepared without adhesion
    wall = cut_slope.run(sticky(2.0 * WEIGHT_PA), SETUP, ENGINE, 1)
    assert (wall.status, wall.stands_deg) == ("column", 90.0)
    assert np.isnan(wall.falls_deg)
    assert np.isnan(wall.slope_angle_deg)


def test_adhesion_during_the_preparation_gives_a_looser_bed(slope):
    early = dataclasses.replace(SETUP, prepared_with_adhesion=True, tolerance_deg=60.0)
    assert cut_slope.run(sticky(5.0 * WEIGHT_PA), early, ENGINE, 1).solid_fraction < slope.solid_fraction - 0.02


def test_grains_without_friction_are_flat_even_in_the_flattest_cut():
    slippery = dataclasses.replace(SOIL, static_friction=0.0, rolling_friction=0.0)
    flat = cut_slope.run(slippery, SETUP, ENGINE, 1)
    assert (flat.status, flat.falls_deg) == ("flat", SETUP.least_deg)
    assert np.isnan(flat.stands_deg)


@pytest.mark.parametrize("stage", ["settle", "cut"])
def test_a_run_that_was_interrupted_ends_with_the_same_bytes(slope, stage):
    class Stopped(Exception):
        pass

    states = []

    def keep(state):
        if state.stage == stage and (stage == "settle" or len(state.notes["cuts"]) == 2):
            states.append(copy.deepcopy(state))
            raise Stopped

    with pytest.raises(Stopped):
        cut_slope.run(SOIL, SETUP, ENGINE, 1, keep=keep)
    again = cut_slope.run(SOIL, SETUP, ENGINE, 1, state=states[0])
    assert np.array_equal(again.cuts, slope.cuts)
    assert np.array_equal(again.after.positions_m, slope.after.positions_m)
    assert (again.n_steps, again.simulated_time_s) == (slope.n_steps, slope.simulated_time_s)


def test_every_cut_starts_from_the_same_bed(slope):
    """The same angle cut twice, with others between, ends with the same bytes."""
    state = cut_slope.start(SOIL, SETUP, ENGINE, 1)
    state.go_on(lambda current: current.simulation.is_static(cut_slope.SETTLED_ENERGY_RATIO), None)
    cut_slope.note_bed(state, SOIL, SETUP, ENGINE)
    ends = []
    for angle in (40.0, 70.0, 40.0):
        cut_slope.cut(state, SOIL, SETUP, ENGINE, angle)
        state.simulation.advance(500)
        ends.append(state.simulation.grains.positions_m)
    assert np.array_equal(ends[0], ends[2])
    assert len(ends[1]) < len(ends[0])


@pytest.mark.parametrize(
    ("stood", "fell", "expected"),
    [
        ([], [], 55.0),
        ([55.0], [], 72.5),
        ([55.0], [72.5], 63.75),
        ([55.0, 63.75], [64.5], None),
        ([89.5], [], 90.0),
        ([89.5, 90.0], [], None),
        ([], [20.5], 20.0),
        ([], [20.5, 20.0], None),
        ([20.0], [20.5], None),
    ],
)
def test_the_next_cut_halves_the_bracket_and_tries_its_ends(stood, fell, expected):
    assert cut_slope.next_angle_deg(stood, fell, 20.0, 1.0) == expected
