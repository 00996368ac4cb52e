"""Draw-down of small boxes: what flows out, what stays, and that nothing is lost between them."""

import copy
import dataclasses

import numpy as np
import pytest

from dem import Grains
from dem.experiments import draw_down
from dem.experiments.soil import Engine, Soil
from dem.measure.draw_down import slopes, steady_rate
from dem.measure.packing import slice_solid_fraction

SOIL = Soil(
    radius_m=1e-3, density_kg_m3=2500.0, poisson_ratio=0.2, shear_modulus_pa=2e6, static_friction=0.4, rolling_friction=0.1,
    restitution=0.3, radius_sd_ratio=0.05,
)  # fmt: skip
SETUP = draw_down.Setup(length_ratio=52.0, slot_ratio=12.0, height_ratio=26.0, thickness_ratio=6.0, scale_radius_m=1e-3)
ENGINE = Engine(time_step_rayleigh_ratio=0.4)


@pytest.fixture(scope="module")
def drained():
    """A test, and its states in the middle of both stages."""
    states = {}

    def keep(state):
        if state.stage not in states and (state.stage == "fill" or len(state.notes["time_s"]) == 60):
            states[state.stage] = copy.deepcopy(state)

    return draw_down.run(SOIL, SETUP, ENGINE, 1, keep=keep), states


def test_what_left_and_what_stays_are_what_was_filled(drained):
    flow, _ = drained
    assert flow.status == "done"
    assert flow.n_out + len(flow.after) == flow.n_particles == len(flow.before) == draw_down.n_grains(SOIL, SETUP)
    assert set(flow.after.radii_m) <= set(flow.before.radii_m)
    lost = (flow.before.radii_m**3).sum() - (flow.after.radii_m**3).sum()
    mass = SOIL.density_kg_m3 * 4.0 / 3.0 * np.pi * lost / SETUP.thickness_m
    assert flow.mass_out_kg_m[-1] == pytest.approx(mass, rel=1e-9)
    assert (np.diff(flow.mass_out_kg_m) >= -1e-12).all()
    assert (flow.mass_out_kg_m[0], flow.time_s[0]) == (0.0, 0.0)


def test_the_slot_is_free_and_the_fill_is_dense(drained):
    flow, _ = drained
    x, _, z = flow.after.positions_m.T
    assert (z > 0.0).all()
    assert not ((x > SETUP.edges_m[0] + 1.1e-3) & (x < SETUP.edges_m[1] - 1.1e-3)).any()
    before = flow.before
    assert 0.5 < slice_solid_fraction(before.positions_m, before.radii_m, SETUP.length_m, SETUP.thickness_m) < 0.62


def test_slopes_are_those_of_sand_on_average(drained):
    flows = [drained[0], *(draw_down.run(SOIL, SETUP, ENGINE, seed) for seed in range(2, 7))]
    found = [slopes(f.after.positions_m, f.after.radii_m, SETUP.length_m, SETUP.slot_m, SETUP.thickness_m) for f in flows]
    angles = np.array([[s.left_deg, s.right_deg] for s in found])
    error_deg = angles.std(ddof=1) / np.sqrt(angles.size)  # slopes of so few grains scatter by 5 degrees from fill to fill
    assert (angles > 20.0).all()
    assert angles.mean() < 50.0 + 2.0 * error_deg


def test_the_floor_is_rough_because_its_lowest_grains_stay(drained):
    flow, _ = drained
    x, _, z = flow.before.positions_m.T
    r = flow.before.radii_m
    lowest = (z < 1.5 * r) & ((x + r <= SETUP.edges_m[0]) | (x - r >= SETUP.edges_m[1]))
    stayed = {tuple(place) for place in flow.after.positions_m}
    assert lowest.sum() > 20
    assert {tuple(place) for place in flow.before.positions_m[lowest]} <= stayed


def test_the_rate_is_that_of_the_flow_and_near_the_law_of_beverloo(drained):
    flow, _ = drained
    tenth, sixty = np.interp(np.array([0.1, 0.6]) * flow.mass_out_kg_m[-1], flow.mass_out_kg_m, flow.time_s)
    mean = 0.5 * flow.mass_out_kg_m[-1] / (sixty - tenth)
    rate, error = steady_rate(flow.time_s, flow.mass_out_kg_m)
    assert rate == pytest.approx(mean, rel=0.1)
    assert 0.0 < error < 0.2 * mean
    assert rate == pytest.approx(draw_down.beverloo_kg_s_m(SOIL, SETUP, ENGINE), rel=0.4)


def test_the_rate_grows_with_the_free_width_as_beverloo_says(drained):
    """Exponent 3/2 of the width without 1.4 diameters, or 1.9 in boxes as small as these (docs/decisions/12); a fluid has 1."""
    wide = dataclasses.replace(SETUP, length_ratio=60.0, slot_ratio=20.0)
    flow = draw_down.run(SOIL, wide, ENGINE, 1)
    rates = [steady_rate(test.time_s, test.mass_out_kg_m)[0] for test in (drained[0], flow)]
    widths = np.log((20.0 - 2.8) / (12.0 - 2.8))
    assert np.log(rates[1] / rates[0]) / widths == pytest.approx(1.7, abs=0.4)


@pytest.mark.parametrize("stage", ["fill", "flow"])
def test_a_run_that_was_interrupted_ends_with_the_same_bytes(drained, stage):
    flow, states = drained
    again = draw_down.run(SOIL, SETUP, ENGINE, 1, state=copy.deepcopy(states[stage]))
    assert np.array_equal(again.after.positions_m, flow.after.positions_m)
    assert np.array_equal(again.mass_out_kg_m, flow.mass_out_kg_m)
    assert (again.n_steps, again.n_out, again.status) == (flow.n_steps, flow.n_out, flow.status)


def test_a_flow_that_goes_on_at_the_time_limit_is_not_finished(drained):
    state = copy.deepcopy(drained[1]["flow"])
    state.end_step = state.simulation.n_steps + 100
    assert draw_down.run(SOIL, SETUP, ENGINE, 1, state=state).status == "not_finished"


def test_grains_that_bridge_a_narrow_slot_are_an_arch(monkeypatch):
    monkeypatch.setattr(draw_down, "LEAST_SLOT", 1.0)
    narrow = dataclasses.replace(SETUP, slot_ratio=3.0)
    flow = draw_down.run(dataclasses.replace(SOIL, static_friction=0.9), narrow, ENGINE, 1)
    assert flow.status == "arched"
    assert flow.n_out < 0.1 * flow.n_particles


def test_walls_beside_the_slot_are_a_column():
    """Poured grains that roll badly are a house of cards: only those above the slot come down."""
    flow = draw_down.run(dataclasses.replace(SOIL, static_friction=0.9, rolling_friction=0.4), SETUP, ENGINE, 1)
    assert flow.status == "column"
    assert flow.n_out / flow.n_particles == pytest.approx(SETUP.slot_m / SETUP.length_m, abs=0.1)


@pytest.mark.parametrize(
    ("ended", "out_share", "status"), [(True, 0.34, "column"), (True, 0.36, "done"), (False, 0.5, "not_finished")]
)
def test_a_test_is_done_if_soil_beside_the_slot_came_down(ended, out_share, status):
    nothing = Grains(**{name: np.zeros((0, 3)) for name in Grains.__dataclass_fields__})
    assert draw_down.status_of(ended, nothing, out_share, SETUP) == status  # 1.5 * 12 / 52 = 0.346


def test_an_arch_hangs_over_the_middle_of_the_slot():
    def at(x_m):
        return Grains(**{name: np.array([[x_m, 0.0, 0.01]]) for name in Grains.__dataclass_fields__})

    assert draw_down.is_arched(at(0.5 * SETUP.length_m + 0.2 * SETUP.slot_m), SETUP)
    assert not draw_down.is_arched(at(0.5 * SETUP.length_m + 0.4 * SETUP.slot_m), SETUP)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"slot_ratio": 10.0}, r"slot width is 10 mm, 5 grain diameters; allowed: at least 6: narrower ones arch"),
        ({"length_ratio": 40.0}, r"floor beside the slot is 14 mm, 7 grain diameters; allowed: at least 10"),
        ({"height_ratio": 15.0}, r"height of the filling is 15 mm, 7.5 grain diameters; allowed: at least 10"),
        ({"thickness_ratio": 4.0}, r"thickness of the slice is 4 mm, 2 grain diameters; allowed: at least 2.5"),
        ({"thickness_ratio": 5.0}, r"number of grains in the box is \d+; allowed: at least 1000"),
    ],
)
def test_a_box_too_small_for_its_grains_is_refused(change, message):
    with pytest.raises(ValueError, match=message):
        draw_down.check(SOIL, dataclasses.replace(SETUP, **change))


@pytest.mark.parametrize("name", ["length_ratio", "slot_ratio", "scale_radius_m", "preparation_friction_ratio"])
def test_negative_sizes_are_refused(name):
    with pytest.raises(ValueError, match=f"{name} is -1.0; allowed: a (zero or )?positive number"):
        dataclasses.replace(SETUP, **{name: -1.0})
