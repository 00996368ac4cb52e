"""Draw-downs in a campaign: what becomes a response, what a laboratory states, what is expected and drawn."""

import dataclasses
import math

import numpy as np
import pandas as pd
import pytest

from dem.measure.draw_down import slopes, steady_rate
from virtual_soil.calibration.errors import CalibrationError
from virtual_soil.campaign.experiments.common import engine_of, soil_of
from virtual_soil.campaign.experiments.draw_down import declared, measure, simulate
from virtual_soil.campaign.grains import grain_table
from virtual_soil.campaign.sections import Study
from virtual_soil.campaign.settings import defaults
from virtual_soil.report.experiments import draw_down as described

RUN = {"status": "done", "draw_down_left_deg": 30.0, "draw_down_right_deg": 34.0, "slope_least_deg": 12.0}
TIMES = np.linspace(0.0, 1.0, 101)
FLOW = pd.DataFrame({"time_s": TIMES, "mass_out_kg_m": 5.0 * TIMES})


def responses(**run):
    return measure.measured({**RUN, **run}, FLOW, {})


def test_rate_and_angle_are_those_of_flow_and_slopes():
    found = responses()
    assert found["discharge_rate_kg_s_m"] == pytest.approx(5.0)
    assert found["discharge_rate_error_kg_s_m"] == pytest.approx(0.0, abs=1e-9)
    assert found["draw_down_angle_deg"] == 32.0
    assert math.isnan(found["draw_down_bound_deg"])


def test_a_layer_too_low_for_a_slope_has_an_angle_between_zero_and_its_bound():
    found = responses(draw_down_left_deg=math.nan)
    assert (found["draw_down_angle_deg"], found["draw_down_bound_deg"]) == (6.0, 12.0)


@pytest.mark.parametrize("status", ["arched", "column", "not_finished", "failed"])
def test_what_did_not_run_out_has_no_responses(status):
    assert all(math.isnan(responses(status=status)[name]) for name in measure.NOTHING)
    assert status not in declared.SOUND


def row(config, **material):
    return {**config["material"], **material, "experiment": "draw_down", "fidelity": "campaign", "normal_stress_pa": None}


def stated(**laboratory):
    """A study of 1 mm grains, and its draw-down box in the laboratory."""
    config = defaults(Study)
    config["material"] |= {"radius_m": 1e-3, "shear_modulus_pa": 1e8}
    config["draw_down_test"] |= laboratory
    return config


BOX = {"box_length_m": 0.08, "slot_width_m": 0.016, "fill_height_m": 0.05}


def test_the_laboratorys_box_is_simulated_whatever_the_grains():
    config = stated(**BOX, gravity_m_s2="moon")
    for radius_m in (0.8e-3, 1e-3):
        settings = declared.setup(config, row(config, radius_m=radius_m))
        setup = settings["setup"]
        sizes = [setup[name] * setup["scale_radius_m"] for name in ("length_ratio", "slot_ratio", "height_ratio")]
        assert sizes == pytest.approx(list(BOX.values()))
        assert setup["thickness_ratio"] == config["draw_down"]["thickness_ratio"]
        assert settings["engine"]["gravity_m_s2"] == 1.62
    config = stated(**BOX, thickness_m=0.01)
    assert declared.setup(config, row(config))["setup"]["thickness_ratio"] == pytest.approx(10.0)


@pytest.mark.parametrize(
    ("laboratory", "message"),
    [
        (
            BOX | {"slot_width_m": 0.01},
            "draw_down_test: slot width is 10 mm, 5 grain diameters; allowed: at least 6: narrower ones arch",
        ),
        (BOX | {"box_length_m": 0.04}, "draw_down_test: floor beside the slot is 12 mm, 6 grain diameters; allowed: at least 10"),
        (
            BOX | {"box_length_m": 0.01},
            "draw_down_test: floor beside the slot is -3 mm, -1.5 grain diameters; allowed: at least 10",
        ),
        (BOX | {"thickness_m": 5e-4}, "draw_down_test: thickness of the slice is 0.5 mm, 0.25 grain diameters"),
        (
            {"slot_width_m": 0.02},
            "draw_down_test: box_length_m, fill_height_m is missing; allowed: box_length_m, slot_width_m, fill",
        ),
        ({"thickness_m": 0.02}, "draw_down_test.thickness_m is 0.02; allowed: null without box_length_m"),
    ],
)
def test_a_box_that_cannot_be_simulated_is_refused_in_one_line(laboratory, message):
    config = stated(**laboratory)
    with pytest.raises(CalibrationError) as refusal:
        declared.setup(config, row(config))
    assert message in str(refusal.value)
    assert "\n" not in str(refusal.value)


@pytest.fixture(scope="module")
def small():
    """A draw-down of nearly the smallest size: its design row, settings and result."""
    config = stated()
    config["draw_down"] |= {"length_ratio": 52.0, "slot_ratio": 12.0, "height_ratio": 26.0, "thickness_ratio": 6.0}
    point = row(config, static_friction=0.3, rolling_friction=0.05)
    settings = declared.setup(config, point)
    return point, settings, simulate.run(soil_of(point, settings), settings["setup"], engine_of(settings), 1)


def test_grains_and_steps_were_expected_within_the_headroom(small):
    point, settings, flow = small
    n, steps = declared.cost(point, settings)
    assert n == flow.n_particles
    assert 0.3 < steps / flow.n_steps < 3.0


def test_a_row_of_the_table_has_the_counts_slopes_and_density(small):
    _, settings, flow = small
    done, failed = simulate.row_of(flow, settings), simulate.row_of(None, settings)
    assert set(done) == set(failed)
    assert (done["status"], done["n_out"]) == ("done", flow.n_particles - len(flow.after))
    box, after = flow.setup, flow.after
    left = slopes(after.positions_m, after.radii_m, box.length_m, box.slot_m, box.thickness_m)
    assert (done["draw_down_left_deg"], done["draw_down_right_deg"]) == (left.left_deg, left.right_deg)
    arched = simulate.row_of(dataclasses.replace(flow, status="arched"), settings)
    assert math.isnan(arched["draw_down_left_deg"])
    assert 0.5 < done["box_solid_fraction"] < 0.65
    assert set(flow.history) == set(simulate.HISTORY)
    found = measure.measured(done, pd.DataFrame(flow.history), {})
    assert (found["discharge_rate_kg_s_m"], found["discharge_rate_error_kg_s_m"]) == steady_rate(flow.time_s, flow.mass_out_kg_m)


def test_the_pictures_show_slopes_and_rate(small):
    _, settings, flow = small
    history = pd.DataFrame(flow.history)
    run = measure.measured(simulate.row_of(flow, settings), history, {})
    before, after = (pd.DataFrame(grain_table(grains, "s")) for grains in (flow.before, flow.after))
    lines = described.box(before, after, run, settings["setup"]).axes[1].lines
    x, z = lines[2].get_data()
    assert np.degrees(np.arctan2(z[1] - z[0], x[0] - x[1])) == pytest.approx(run["draw_down_left_deg"])
    assert lines[3].get_label() == f"right {run['draw_down_right_deg']:.1f}°"
    t, m = described.mass_out(history, run).axes[0].lines[1].get_data()
    assert (m[1] - m[0]) / (t[1] - t[0]) == pytest.approx(run["discharge_rate_kg_s_m"])
    assert f"α {run['draw_down_angle_deg']:.1f}°" in described.facts(run)
    assert described.facts({**run, "status": "arched"}) == "arched"
    arched = described.mass_out(history, run | {"discharge_rate_kg_s_m": math.nan}).axes[0]
    assert len(arched.lines) == 1
