"""Small rotating drums: what is poured in, what turns, and at which angle the surface stands."""

import copy
import dataclasses
import math

import numpy as np
import pytest
from scipy.spatial import cKDTree
from scipy.spatial.distance import pdist

from dem import Grains, Simulation
from dem.experiments import rotating_drum
from dem.experiments.soil import Engine, Soil
from dem.measure.drum import angles_of, steady_angle, surface_angle_deg

SOIL = Soil(
    radius_m=1e-3, density_kg_m3=2500.0, poisson_ratio=0.2, shear_modulus_pa=2e6, static_friction=0.5, rolling_friction=0.1,
    restitution=0.3, radius_sd_ratio=0.1,  # so wide that they are poured in two goes
)  # fmt: skip
SETUP = rotating_drum.Setup(
    diameter_ratio=40.0, thickness_ratio=7.0, fill_ratio=0.4, froude_number=0.05, turns=0.7, scale_radius_m=1e-3
)
ENGINE = Engine(time_step_rayleigh_ratio=0.4)


def angle(drum, froude_number=0.05):
    return steady_angle(*angles_of(drum.history, froude_number), 0.3)


@pytest.fixture(scope="module")
def turned():
    """A drum that turns at two rates, its states in the middle of both stages, and places of its lining at all looks."""
    states, lining = {}, []

    def each(simulation, stage):
        if stage == "turn":
            lining.append((simulation.time_s, simulation.grains.positions_m[:3]))

    def keep(state):
        if state.stage not in states and (state.stage == "fill" or len(state.notes["looks"]) == 30):
            states[state.stage] = copy.deepcopy(state)

    setup = dataclasses.replace(SETUP, further_froude_numbers=(0.1,))
    return rotating_drum.run(SOIL, setup, ENGINE, 1, each=each, keep=keep), states, lining


def test_all_grains_are_in_the_drum_at_the_beginning_and_at_the_end(turned):
    drum, states, _ = turned
    assert states["fill"].notes["n_poured"] < drum.n_particles
    assert drum.status == "done"
    assert len(drum.before) == len(drum.after) == drum.n_particles == rotating_drum.n_grains(SOIL, SETUP)
    for grains in (drum.before, drum.after):
        assert np.array_equal(grains.radii_m, SOIL.sizes.draw(drum.n_particles, np.random.default_rng(1)))
        assert (np.hypot(grains.positions_m[:, 0], grains.positions_m[:, 2]) < SETUP.radius_m).all()


def test_the_filling_is_as_deep_as_its_share_of_the_volume(turned):
    level = np.nanmean(rotating_drum.surface(turned[0].before, SOIL, SETUP)[15:25])
    assert level == pytest.approx(SETUP.depth_m / SETUP.radius_m - 1.0, abs=0.15)
    assert dataclasses.replace(SETUP, fill_ratio=0.5).depth_m == pytest.approx(SETUP.radius_m)


def test_the_surface_rises_to_the_side_to_which_the_lowest_point_of_the_drum_moves(turned):
    drum, _, lining = turned
    found = angle(drum)
    assert 25.0 < found.mean_deg < 60.0
    assert found.error_deg < 3.0
    assert found.lower_deg < found.mean_deg < found.upper_deg
    times = np.array([time_s for time_s, _ in lining])
    places = np.array([place[0] for _, place in lining])
    first = np.round(drum.froude_numbers, 9) == 0.05
    rate = math.sqrt(0.05 * 9.81 / SETUP.radius_m)
    turned_rad = rate * (times[first] - times[0]) + math.atan2(places[0, 2], places[0, 0])
    assert places[first, 0] == pytest.approx(SETUP.radius_m * np.cos(turned_rad), abs=1e-7)
    assert places[first, 2] == pytest.approx(SETUP.radius_m * np.sin(turned_rad), abs=1e-7)


def test_every_rate_has_its_turns_and_the_grains_are_those_of_the_rate_asked_for(turned):
    drum = turned[0]
    for froude in (0.05, 0.1):
        turns = drum.turns[drum.froude_numbers == froude]
        assert turns[-1] == pytest.approx(0.7, abs=1e-3)
        assert (np.diff(turns) > 0.0).all()
    assert (np.diff(drum.froude_numbers) >= 0.0).all()
    last = drum.heights_ratio[drum.froude_numbers == 0.05][-1]
    assert np.array_equal(rotating_drum.surface(drum.after, SOIL, SETUP), last, equal_nan=True)


@pytest.mark.parametrize("stage", ["fill", "turn"])
def test_a_run_that_was_interrupted_ends_with_the_same_bytes(turned, stage):
    drum, states, _ = turned
    setup = dataclasses.replace(SETUP, further_froude_numbers=(0.1,))
    again = rotating_drum.run(SOIL, setup, ENGINE, 1, state=copy.deepcopy(states[stage]))
    assert np.array_equal(again.after.positions_m, drum.after.positions_m)
    assert np.array_equal(again.heights_ratio, drum.heights_ratio, equal_nan=True)
    assert (again.n_steps, again.status) == (drum.n_steps, drum.status)


def test_the_angle_grows_with_static_friction(turned):
    smooth = rotating_drum.run(dataclasses.replace(SOIL, static_friction=0.1), SETUP, ENGINE, 1)
    assert 8.0 < angle(smooth).mean_deg < angle(turned[0]).mean_deg - 5.0


@pytest.mark.parametrize("rolling_friction", [0.0, 0.3])
def test_a_grain_on_the_shell_alone_rests_where_the_tangent_is_its_rolling_friction(rolling_friction):
    """Rolling resistance of type A: the weight's arm balances the torque mu_r N r; without it the grain stays at the bottom."""
    soil = dataclasses.replace(SOIL, radius_sd_ratio=0.0, rolling_friction=rolling_friction)
    simulation = Simulation(
        materials={"soil": soil.softened(1.0)}, interactions={("soil", "soil"): soil.interaction()},
        walls=[rotating_drum.shell(soil, SETUP)], period_m=(0.0, SETUP.thickness_m, 0.0), smallest_radius_m=1e-3,
        **ENGINE.options(soil),
    )  # fmt: skip
    rate, wanted = 3.0, math.atan(rolling_friction)
    reach, radius = SETUP.radius_m + 0.05e-3, SETUP.radius_m + 1.05e-3
    spin = (0.0, -rate * radius / 1e-3, 0.0)
    simulation.add_grains((reach * math.sin(wanted), 1e-3, -reach * math.cos(wanted)), 1e-3, "soil", angular_velocities_rad_s=spin)
    simulation.turn_wall("drum", (0.0, -rate, 0.0))
    angles = []
    for _ in range(100):
        simulation.run(0.01)
        x, _, z = simulation.grains.positions_m[0]
        angles.append(math.atan2(x, -z))
    assert np.mean(angles[50:]) == pytest.approx(wanted, abs=0.02)


def test_a_surface_of_made_up_grains_has_their_angle_and_ignores_single_ones_in_flight():
    rng = np.random.default_rng(2)
    places = rng.uniform([-1.0, 0.0, -1.0], [1.0, 0.35, 1.0], (40000, 3)) * SETUP.radius_m
    inside = np.hypot(places[:, 0], places[:, 2]) < SETUP.radius_m
    below = places[inside & (places[:, 2] < math.tan(math.radians(35.0)) * places[:, 0] - 0.1 * SETUP.radius_m)]
    flying = np.array([[-8e-3, 1e-3, 10e-3], [6e-3, 5e-3, 15e-3], [2e-3, 3e-3, 12e-3]])

    def seen(positions):
        nothing = np.zeros_like(positions)
        heights = rotating_drum.surface(Grains(positions, nothing, nothing, np.full(len(positions), 1e-3)), SOIL, SETUP)
        return surface_angle_deg(rotating_drum.places_across(SOIL, SETUP), heights)

    assert seen(below) == pytest.approx(35.0, abs=0.7)
    assert seen(np.concatenate([below, flying])) == pytest.approx(seen(below), abs=0.3)
    assert seen(below + [0.0, 3.0 * SETUP.thickness_m, 0.0]) == pytest.approx(seen(below), abs=1e-6)


def test_the_lining_does_not_overlap_and_lets_no_grain_through():
    places = rotating_drum.lining(SOIL, SETUP)
    copies = np.concatenate([places + [0.0, k * SETUP.thickness_m, 0.0] for k in (-1, 0, 1)])
    assert pdist(copies).min() >= 2.0 * SOIL.radius_m * (1.0 - 1e-9)
    angle, y = np.random.default_rng(1).uniform(0.0, [2.0 * np.pi, SETUP.thickness_m], (5000, 2)).T
    shell = np.column_stack([SETUP.radius_m * np.cos(angle), y, SETUP.radius_m * np.sin(angle)])
    assert cKDTree(copies).query(shell)[0].max() < 2.0 * SOIL.radius_m


def test_grains_are_poured_apart_inside_the_drum_and_above_those_that_lie_there():
    soil = dataclasses.replace(SOIL, radius_sd_ratio=0.3)
    places = rotating_drum.free_places(soil, SETUP, -0.3 * SETUP.radius_m, np.random.default_rng(1))
    largest = soil.sizes.largest_m
    copies = np.concatenate([places + [0.0, k * SETUP.thickness_m, 0.0] for k in (-1, 0, 1)])
    assert len(places) > 30
    assert pdist(copies).min() > 2.0 * largest
    assert (np.hypot(places[:, 0], places[:, 2]) + largest < SETUP.radius_m - soil.radius_m).all()
    assert (places[:, 2] - largest > -0.3 * SETUP.radius_m).all()


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"diameter_ratio": 30.0}, "diameter of the drum is 30 mm, 15 grain diameters; allowed: at least 20"),
        ({"thickness_ratio": 4.0}, "thickness of the slice is 4 mm, 2 grain diameters; allowed: at least 2.5"),
        ({"thickness_ratio": 5.0}, r"number of grains in the drum is \d+; allowed: at least 400"),
    ],
)
def test_a_drum_too_small_for_its_grains_is_refused(change, message):
    with pytest.raises(ValueError, match=message):
        rotating_drum.check(SOIL, dataclasses.replace(SETUP, **change))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"diameter_ratio": -1.0}, "diameter_ratio is -1.0; allowed: a positive number"),
        ({"turns": math.nan}, "turns is nan; allowed: a positive number"),
        ({"fill_ratio": 0.6}, "fill_ratio is 0.6; allowed: from 0.15 to 0.5"),
        ({"froude_number": 0.0}, "froude_number is 0.0; allowed: above 0, at most 0.2"),
        ({"further_froude_numbers": [0.5]}, "froude_number is 0.5; allowed: above 0, at most 0.2"),
    ],
)
def test_sizes_and_rates_without_sense_are_refused(change, message):
    with pytest.raises(ValueError, match=message):
        dataclasses.replace(SETUP, **change)
