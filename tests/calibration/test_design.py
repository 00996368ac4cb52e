"""The design: which simulations, and that identifiers stay put when the study grows."""

import copy
from pathlib import Path

import pytest
import yaml

from calibration import CalibrationError, expand

CONFIG = yaml.safe_load((Path(__file__).parents[2] / "config" / "config.yaml").read_text())


def changed(path, value):
    config = copy.deepcopy(CONFIG)
    *parents, last = path.split(".")
    target = config
    for key in parents:
        target = target[key]
    target[last] = value
    return config


def test_the_default_design_is_the_papers():
    table = expand(CONFIG)
    grid = table[table["purposes"].str.contains("grid")]
    assert grid["point_id"].nunique() == 35
    heaps = table[(table["experiment"] == "repose") & table["purposes"].str.contains("screening")]
    assert len(heaps) == 5 + 7 * 3
    sweep = table[table["purposes"].str.contains("sweep")]
    assert sorted(sweep["radius_m"].unique()) == [25e-6, 50e-6, 100e-6, 200e-6, 500e-6]
    shear = grid[grid["experiment"] == "shear"]
    assert shear.groupby("point_id")["normal_stress_pa"].nunique().min() >= 4
    assert shear.groupby(["point_id", "normal_stress_pa"])["seed"].nunique().min() >= 2


def test_no_simulation_is_made_twice():
    table = expand(CONFIG)
    assert table["simulation_id"].is_unique
    what = table.drop(columns=["simulation_id", "purposes"])
    assert not what.duplicated().any()


@pytest.mark.parametrize(
    ("path", "value"),
    [
        ("shear.normal_stresses_pa", [125.0, 250.0, 500.0, 1000.0, 2000.0]),
        ("design.repose_seeds", [1, 2]),
        ("design.grid.static_friction", [0.0, 0.1, 0.2, 0.3, 0.5, 0.9, 1.3, 1.7]),
    ],
)
def test_a_larger_study_keeps_all_identifiers_of_the_smaller_one(path, value):
    before, after = expand(CONFIG), expand(changed(path, value))
    assert set(before["simulation_id"]) < set(after["simulation_id"])


def test_a_fourth_design_variable_needs_no_code():
    config = changed("design.grid.restitution", [0.3, 0.5])
    config["design"]["variables"].append("restitution")
    for couple in (*config["design"]["sweep_couples"], *config["fidelity"]["check"]["couples"]):
        couple["restitution"] = 0.5
    grid = expand(config)
    assert grid[grid["purposes"].str.contains("grid")]["point_id"].nunique() == 70


@pytest.mark.parametrize(
    ("path", "value", "message"),
    [
        ("design.variables", ["radius_m"], "design.variables is"),
        ("design.grid", {"stickiness": [1.0]}, r"design.grid is \['stickiness'\]; allowed: keys of material"),
        ("design.sweep_couples", [{"static_friction": 0.3}], "design.sweep_couples is"),
        (
            "design.sweep_couples",
            [{"static_friction": 0.4, "rolling_friction": 0.1}],
            "design.sweep_couples static_friction is 0.4",
        ),
        ("screening.changes", {"restitution": 0.5}, "screening.changes.restitution is 0.5"),
    ],
)
def test_a_design_that_contradicts_itself_is_refused(path, value, message):
    with pytest.raises(CalibrationError, match=message):
        expand(changed(path, value))
