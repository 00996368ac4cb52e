"""The design: which simulations, and that identifiers stay put when the study grows."""

import copy
from pathlib import Path

import pytest
import yaml

from virtual_soil.calibration.errors import CalibrationError
from virtual_soil.calibration.points import point_at
from virtual_soil.campaign.design import SEED_KEYS, decisive, expand, further
from virtual_soil.campaign.experiments.shear.declared import STRESSES_PA

CONFIG = yaml.safe_load((Path(__file__).parents[2] / "config" / "config.yaml").read_text()) | {"experiments": ["repose", "shear"]}


TWIN = {"radius_m": 8e-5, "static_friction": 0.6, "rolling_friction": 0.14, "repose_seeds": [1, 2], "shear_seeds": [1]}


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


def test_nothing_is_wanted_twice():
    table = expand(CONFIG)
    assert not table.duplicated(["simulation_id", "point_id"]).any()
    what = table.drop(columns=["simulation_id", "purposes"])
    assert not what.duplicated().any()


def test_points_share_a_simulation_where_rolling_friction_exceeds_static_friction_only():
    """At static friction 0 five points do the same, at 0.1 two; each in heaps and in shear tests at 4 stresses with 2 seeds."""
    table = expand(CONFIG)
    shared = table[table.duplicated("simulation_id", keep=False)]
    assert ((shared["rolling_friction"] > shared["static_friction"]) | (shared["static_friction"] == 0.0)).all()
    assert len(table) - table["simulation_id"].nunique() == (4 + 1) * (2 + 4 * 2)
    others = table.drop(columns=["purposes", "point_id", "rolling_friction"])
    assert others.drop_duplicates()["simulation_id"].is_unique


@pytest.mark.parametrize(
    ("path", "value"),
    [
        ("shear.normal_stresses_pa", [150.0, 250.0, 500.0, 1000.0, 2000.0]),
        ("design.repose_seeds", [1, 2, 3]),
        ("design.grid.static_friction", [0.0, 0.1, 0.2, 0.3, 0.5, 0.9, 1.3, 1.7]),
    ],
)
def test_a_larger_study_keeps_all_identifiers_of_the_smaller_one(path, value):
    before, after = expand(CONFIG), expand(changed(path, value))
    assert set(before["simulation_id"]) < set(after["simulation_id"])


def test_a_fixed_value_keeps_all_its_digits():
    base = {"radius_m": 1.23456e-3, "static_friction": 0.5}
    assert point_at(base, {"radius_m": 1.23456e-3, "static_friction": 0.123456}) == {
        "radius_m": 1.23456e-3,
        "static_friction": 0.1235,
    }


def test_a_fourth_design_variable_needs_no_code():
    config = changed("design.grid.restitution", [0.3, 0.5, 0.7])
    config["design"]["variables"].append("restitution")
    for couple in (*config["design"]["sweep_couples"], *config["fidelity"]["check"]["couples"]):
        couple["restitution"] = 0.5
    grid = expand(config)
    assert grid[grid["purposes"].str.contains("grid")]["point_id"].nunique() == 105


def test_a_twin_is_simulated_like_any_point_and_known_as_one():
    table = expand(changed("twins.moon", TWIN))
    hidden = table[table["purposes"] == "twin"]
    assert len(hidden) == 2 + 4
    assert set(hidden["rolling_friction"]) == {0.14}


def test_further_points_are_rounded_so_that_the_same_point_is_the_same_simulation():
    seeds = {"repose_seeds": [1], "shear_seeds": [1, 2]}
    points = [{"radius_m": 123.4567e-6, "static_friction": 0.51234567}, {"radius_m": 123.4571e-6, "static_friction": 0.51234111}]
    table = further(CONFIG, "refinement", points, seeds)
    assert len(table) == 1 + 2 * 4
    assert set(table["radius_m"]) == {123.5e-6}
    assert set(table["density_kg_m3"]) == {3000.0}
    assert list(further(CONFIG, "refinement", [], seeds).columns) == list(table.columns)


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
        ("screening.factors", {"restitution": 1.0}, "screening.factors.restitution is 1.0"),
        ("design.grid.rolling_friction", [0.0, 0.1], "design.grid.rolling_friction is .*; allowed: at least three values"),
        ("design.sweep.radius_m", [5e-5], "design values of radius_m is .*; allowed: at least two"),
        ("design.sweep.radius_m", [5e-5, 1e-4], "design.sweep.radius_m is .*; allowed: at least three values"),
        (
            "twins",
            {"moon": {"radius_m": 5e-5, "repose_seeds": [1], "shear_seeds": [1]}},
            "twins.moon is .*; allowed: .* and .*_seeds",
        ),
        ("twins.moon", {**TWIN, "static_friction": 2.0}, "twins.moon.static_friction is 2.0; allowed: within the design, 0 to 1.7"),
        (
            "verify.shear_seeds",
            [7, 1],
            r"verify.shear_seeds is \[1\]; allowed: seeds that the campaign and its refinement do not use",
        ),
    ],
)
def test_a_design_that_contradicts_itself_is_refused(path, value, message):
    with pytest.raises(CalibrationError, match=message):
        expand(changed(path, value))


@pytest.mark.parametrize(("radii", "n_couples", "form", "enough"), [(3, 1, "quadratic", False), (4, 1, "quadratic", True),
    (3, 2, "quadratic", True), (2, 1, "log", True)])  # fmt: skip
def test_a_sweep_must_determine_its_factor(radii, n_couples, form, enough):
    config = changed("design.sweep.radius_m", [5e-5, 1e-4, 2e-4, 4e-4][:radii])
    config["design"]["sweep_couples"] = [{"static_friction": s, "rolling_friction": 0.1} for s in (0.5, 0.9)][:n_couples]
    for entry in config["surrogate"].values():
        entry["g"] = form
    if enough:
        expand(config)
    else:
        with pytest.raises(CalibrationError, match="number of points of design.sweep.radius_m is 3; allowed: more than the 3"):
            expand(config)


def test_every_round_of_further_seeds_doubles_their_number_where_something_is_undecided():
    optimum = {"radius_m": 1e-4, "static_friction": 0.5, "rolling_friction": 0.1}
    seeds = {key: [101] for key in SEED_KEYS.values()} | {"repose_seeds": [101, 102]}
    assert decisive(CONFIG, {}, seeds, 1).empty
    first, second = (decisive(CONFIG, {"a": (optimum, ["repose"])}, seeds, k) for k in (1, 2))
    assert set(first["experiment"]) == {"repose"}
    assert first["seed"].tolist() == [1101, 1102]
    assert second["seed"].tolist() == [2101, 2102, 3101, 3102]
    both = decisive(CONFIG, {"a": (optimum, ["repose"]), "b": (optimum, ["repose", "shear"])}, seeds, 1)
    assert not both.duplicated(["simulation_id", "point_id"]).any()
    assert both["experiment"].value_counts().to_dict() == {"repose": 2, "shear": len(STRESSES_PA)}


def test_further_seeds_that_a_fit_has_used_are_refused():
    config = copy.deepcopy(CONFIG)
    config["verify"] |= {"repose_seeds": [5], "more_seeds": 2}
    config["design"]["repose_seeds"] = [3005]
    with pytest.raises(CalibrationError, match="verify.repose_seeds"):
        expand(config)
