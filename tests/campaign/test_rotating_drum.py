"""Rotating drums in a campaign: what becomes a response, what a laboratory states, what is expected and drawn."""

import dataclasses
import math

import numpy as np
import pandas as pd
import pytest

from dem.measure.drum import angles_of, steady_angle
from virtual_soil.calibration.errors import CalibrationError
from virtual_soil.campaign.experiments.common import engine_of, soil_of
from virtual_soil.campaign.experiments.rotating_drum import declared, measure, simulate
from virtual_soil.campaign.grains import grain_table
from virtual_soil.campaign.sections import Study
from virtual_soil.campaign.settings import defaults
from virtual_soil.campaign.study import StudyError, design_rows
from virtual_soil.report.experiments import rotating_drum as described


def row(config, **material):
    return {**config["material"], **material, "experiment": "rotating_drum", "fidelity": "campaign", "normal_stress_pa": None}


def stated(**laboratory):
    """A study of 1 mm grains, and its drum in the laboratory."""
    config = defaults(Study)
    config["material"] |= {"radius_m": 1e-3, "shear_modulus_pa": 1e8}
    config["drum_test"] |= laboratory
    return config


DRUM = {"diameter_m": 0.06, "fill_ratio": 0.35, "rate_rpm": 20.0}


def test_the_laboratorys_drum_is_simulated_whatever_the_grains():
    config = stated(**DRUM, gravity_m_s2="moon")
    config["engine"]["energy_ledger"] = True  # it does not book bodies that turn
    for radius_m in (0.8e-3, 1e-3):
        settings = declared.setup(config, row(config, radius_m=radius_m))
        setup = settings["setup"]
        assert setup["diameter_ratio"] * setup["scale_radius_m"] == pytest.approx(0.06)
        assert (setup["fill_ratio"], setup["thickness_ratio"]) == (0.35, config["rotating_drum"]["thickness_ratio"])
        assert setup["froude_number"] == pytest.approx((20.0 * 2.0 * np.pi / 60.0) ** 2 * 0.03 / 1.62)
        assert settings["engine"]["gravity_m_s2"] == 1.62
        assert not settings["engine"]["energy_ledger"]
        assert "turns_before" not in setup
    config = stated(diameter_m=0.06, froude_number=0.02, thickness_m=0.01)
    setup = declared.setup(config, row(config))["setup"]
    assert (setup["froude_number"], setup["thickness_ratio"]) == (0.02, pytest.approx(10.0))


@pytest.mark.parametrize(
    ("laboratory", "message"),
    [
        ({"diameter_m": 0.03}, "drum_test: diameter of the drum is 30 mm, 15 grain diameters; allowed: at least 20"),
        ({"diameter_m": 0.06, "fill_ratio": 0.8}, "drum_test: fill_ratio is 0.8; allowed: from 0.15 to 0.5"),
        (DRUM | {"rate_rpm": 200.0}, "drum_test: froude_number is 1.34"),
        (DRUM | {"froude_number": 0.01}, "drum_test is rate_rpm 20, froude_number 0.01; allowed: one of the two"),
        ({"rate_rpm": 20.0}, "drum_test.rate_rpm is 20.0; allowed: null without drum_test.diameter_m"),
        ({"thickness_m": 0.02}, "drum_test.thickness_m is 0.02; allowed: null without drum_test.diameter_m"),
    ],
)
def test_a_drum_that_cannot_be_simulated_is_refused_in_one_line(laboratory, message):
    config = stated(**laboratory)
    with pytest.raises(CalibrationError) as refusal:
        declared.setup(config, row(config))
    assert message in str(refusal.value)
    assert "\n" not in str(refusal.value)


def test_a_study_that_measures_nothing_is_refused():
    config = stated()
    config["rotating_drum"]["turns_before"] = 1.5
    with pytest.raises(CalibrationError, match=r"rotating_drum.turns_before is 1.5; allowed: less than rotating_drum.turns"):
        declared.setup(config, row(config))


@pytest.fixture(scope="module")
def small():
    """A drum of nearly the smallest size: its design row, settings and result."""
    config = stated()
    config["rotating_drum"] |= {
        "diameter_ratio": 40.0, "thickness_ratio": 7.0, "froude_number": 0.05, "further_froude_numbers": [0.1], "turns": 0.5,
        "turns_before": 0.2,
    }  # fmt: skip
    config["fidelity"]["campaign"]["drum_stiffness_number"] = 4000.0
    point = row(config, static_friction=0.4, rolling_friction=0.1)
    settings = declared.setup(config, point)
    return point, settings, simulate.run(soil_of(point, settings), settings["setup"], engine_of(settings), 1)


MEASURE = {"turns_before": 0.2}


def test_grains_and_steps_were_expected_within_the_headroom(small):
    point, settings, drum = small
    n, steps = declared.cost(point, settings)
    assert n == drum.n_particles + drum.n_lining
    assert 0.7 < steps / drum.n_steps < 1.5


def test_the_response_is_the_angle_at_the_rate_asked_for(small):
    _, settings, drum = small
    history = pd.DataFrame(drum.history)
    run = simulate.row_of(drum, settings)
    found = measure.measured(run, history, MEASURE)
    angle = steady_angle(*angles_of(drum.history, 0.05), 0.2)
    assert found["drum_angle_deg"] == angle.mean_deg
    assert (found["drum_upper_angle_deg"], found["drum_lower_angle_deg"]) == (angle.upper_deg, angle.lower_deg)
    assert measure.measured(run, history, {"turns_before": 0.4})["drum_angle_deg"] != found["drum_angle_deg"]
    assert set(drum.history) == set(simulate.HISTORY)
    failed = simulate.row_of(None, settings)
    assert set(failed) == set(run)
    assert failed["status"] not in declared.SOUND
    assert all(math.isnan(measure.measured(failed, history, MEASURE)[name]) for name in measure.COLUMNS.values())


def test_the_pictures_show_the_drum_its_angle_and_all_rates(small):
    _, settings, drum = small
    history = pd.DataFrame(drum.history)
    run = measure.measured(simulate.row_of(drum, settings), history, MEASURE)
    before, after = (pd.DataFrame(grain_table(grains, "s")) for grains in (drum.before, drum.after))
    lines = described.section(before, after, run, settings["setup"]).axes[1].lines
    x, z = lines[0].get_data()
    assert np.hypot(x, z) == pytest.approx(20.0)
    x, z = lines[1].get_data()
    assert np.degrees(np.arctan2(z[1] - z[0], x[1] - x[0])) == pytest.approx(run["drum_angle_deg"])
    table = described.angles(history, 0.2)
    assert table["froude_number"].tolist() == [0.05, 0.1]
    assert table["mean_deg"].iloc[0] == run["drum_angle_deg"]
    left, right = described.angle_plot(history, table, run, 0.2).axes
    # no angle where the profile of a look has no surface to fit
    assert left.lines[0].get_data()[1] == pytest.approx(angles_of(history, 0.05)[1], nan_ok=True)
    assert right.lines[0].get_data()[1] == pytest.approx(table["mean_deg"])
    assert f"θ {run['drum_angle_deg']:.1f} ±" in described.facts(run)
    assert described.facts({**run, "status": "failed"}) == "failed"
    assert described.angles(None, 0.2).empty


def test_the_film_shows_layers_from_the_bottom_of_the_drum_to_its_axis(small):
    places = np.array([[0.0, 0.0, z] for z in (-20e-3, -15e-3, -1e-3, 20e-3)])
    grains = dataclasses.replace(small[2].before, positions_m=places)
    assert described.colour(grains).tolist() == [0, 1, described.N_LAYERS - 1, described.N_LAYERS - 1]


def test_a_design_that_repeats_no_run_is_refused_before_it_runs():
    config = stated()
    config["experiments"] = ["repose", "plane_shear", "rotating_drum"]
    config["design"] |= {"rotating_drum_seeds": [1, 2], "repose_seeds": [1], "plane_shear_seeds": [1]}
    assert design_rows(config)  # the screening repeats heaps, and a plane shear test has several stresses
    config["design"]["rotating_drum_seeds"] = [1]
    with pytest.raises(StudyError, match=r"design.rotating_drum_seeds is \[1\]; allowed: at least two seeds"):
        design_rows(config)
    config["screening"]["response"] = "drum_angle"
    with pytest.raises(StudyError, match=r"design.repose_seeds is \[1\]"):
        design_rows(config)
