"""Points that share a simulation: their grains do the same to the last bit, and nothing else is taken for the same."""

import copy
import itertools
import math
from importlib import import_module

import pytest
import yaml

from virtual_soil.campaign.code import ROOT
from virtual_soil.campaign.design import make_row
from virtual_soil.campaign.experiments import module_of
from virtual_soil.campaign.experiments.common import engine_of, soil_of
from virtual_soil.campaign.experiments.registry import BY_NAME
from virtual_soil.campaign.study import design_rows, experiment_settings, simulations

CONFIG = yaml.safe_load((ROOT / "config" / "config.yaml").read_text())
SLIDING = {"static_friction": 0.1, "rolling_friction": 0.3}


def small(**changes):
    """The default study with little tests, and changes to a part of it: part -> {key: value}."""
    config = copy.deepcopy(CONFIG)
    config["repose"] |= {"n_particles": 150, "tube_diameter_ratio": 6.0, "max_time_s": 0.02}
    config["shear"] |= {"length_ratio": 16.0, "width_ratio": 8.0, "height_ratio": 10.0, "displacement_ratio": 1.0}
    config["fidelity"]["campaign"] |= {"lift_speed_m_s": 5e-2}
    for part, values in changes.items():
        config[part] |= values
    return config


def row_of(config, experiment, material):
    row = make_row(experiment, "campaign", material, 500.0 if BY_NAME[experiment].LOAD else math.nan, 1)
    return row, experiment_settings(config, row)


def canonical(material, config, experiment):
    return BY_NAME[experiment].canonical(material, config)


def outcome(config, experiment, material):
    """All that a test of a material ends with: positions, velocities and spins before and after, number of steps."""
    row, settings = row_of(config, experiment, material)
    job = import_module(module_of(experiment, "simulate"))
    done = job.run(soil_of(row, settings), settings["setup"], engine_of(settings), 1)
    states = [getattr(done, moment) for moment in job.MOMENTS]
    arrays = (getattr(state, name) for state in states for name in ("positions_m", "velocities_m_s", "angular_velocities_rad_s"))
    return [array.tolist() for array in arrays], done.n_steps


@pytest.mark.parametrize(
    ("experiment", "changes"),
    [
        *itertools.product(
            ("repose", "shear"),
            [
                {},
                {"material": {"radius_sd_ratio": 0.2}},
                {"engine": {"precision": "float64"}},
                {"repose": {"wall_static_friction": 0.05}},
                {"repose": {"wall_static_friction": 0.5, "wall_rolling_friction": 0.6}},
                {"shear": {"preparation_friction_ratio": 1.0}},
            ],
        ),
        # in the precision in which other tests compile plain code for such a domain
        ("repose", {"engine": {"vector_code": False}}),
        ("shear", {"engine": {"vector_code": False, "precision": "float64"}}),
    ],
    ids=str,
)
def test_grains_that_can_only_slide_do_the_same_whatever_their_rolling_friction(experiment, changes):
    config = small(**changes)
    material = {**config["material"], **SLIDING}
    simulated = canonical(material, config, experiment)
    assert simulated == {**material, "rolling_friction": 0.2}
    assert outcome(config, experiment, material) == outcome(config, experiment, simulated)


@pytest.mark.parametrize("change", [{"precision": "float64"}, {"vector_code": False}], ids=str)
def test_the_engine_settings_of_these_cases_reach_the_simulation(change):
    plain, changed = (row_of(small(engine=changes), "repose", CONFIG["material"])[1]["engine"] for changes in ({}, change))
    assert {key: value for key, value in changed.items() if plain[key] != value} == change


@pytest.mark.parametrize(
    ("experiment", "changes"),
    [
        ("repose", {"engine": {"rolling_model": "type_c"}}),
        ("shear", {"engine": {"rolling_model": "type_c", "precision": "float64"}}),
        ("repose", {"repose": {"wall_static_friction": 0.5}}),
        ("repose", {"repose": {"wall_rolling_friction": 0.0}}),
        ("shear", {"shear": {"frame_static_friction": 0.5}}),
    ],
    ids=str,
)
def test_where_grains_can_roll_all_the_same_rolling_friction_counts(experiment, changes):
    config = small(**changes)
    material = {**config["material"], **SLIDING}
    assert canonical(material, config, experiment) == material
    assert outcome(config, experiment, material) != outcome(config, experiment, {**material, "rolling_friction": 0.2})


def test_rolling_friction_below_the_static_one_counts():
    config = small()
    material = {**config["material"], "static_friction": 0.31, "rolling_friction": 0.3}
    assert canonical(material, config, "repose") == material
    assert outcome(config, "repose", material) != outcome(config, "repose", {**material, "rolling_friction": 0.62})


@pytest.mark.parametrize("experiment", ["repose", "shear"])
@pytest.mark.parametrize("static_friction", [0.1, 0.3])
def test_equal_frictions_are_simulated_as_they_are(experiment, static_friction):
    """Rounding decides there whether a grain begins to spin: not a bit is promised."""
    material = {**CONFIG["material"], "static_friction": static_friction, "rolling_friction": static_friction}
    assert canonical(material, small(), experiment) == material


def test_points_that_share_a_simulation_keep_their_rows():
    rows = design_rows(CONFIG)
    frictionless = [row for row in rows if row["static_friction"] == 0.0 and row["experiment"] == "repose" and row["seed"] == 1]
    assert sorted(row["rolling_friction"] for row in frictionless) == [0.0, 0.05, 0.1, 0.2, 0.3]
    assert len({row["point_id"] for row in frictionless}) == 5
    (name,) = {row["simulation_id"] for row in frictionless}
    assert simulations(CONFIG, rows)[name]["rolling_friction"] == 0.0


def test_what_is_simulated_does_not_depend_on_the_row_that_asks_for_it():
    rows = design_rows(CONFIG)
    assert simulations(CONFIG, rows) == simulations(CONFIG, rows[::-1])
