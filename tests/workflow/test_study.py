"""What the workflow makes of a configuration before anything runs."""

from contextlib import nullcontext

import numpy as np
import pytest
import yaml

from virtual_soil.calibration.space import space_of
from virtual_soil.campaign.code import ROOT
from virtual_soil.campaign.sections import Study
from virtual_soil.campaign.settings import defaults
from virtual_soil.campaign.study import (
    StudyError,
    base_simulation,
    check_soils,
    design_rows,
    experiment_settings,
    simulations,
)
from virtual_soil.campaign.variables import fitting_twins, normal_form, with_walls


def planned(experiment, **changes):
    """Settings of the default study's simulations of one experiment, with other values of some keys ("section.key")."""
    config = yaml.safe_load((ROOT / "config/config.yaml").read_text())
    config["experiments"] = list(dict.fromkeys(["repose", experiment]))
    for key, value in changes.items():
        section, _, name = key.rpartition(".")
        part = config
        for word in filter(None, section.split(".")):
            part = part[word]
        part[name] = value
    found = simulations(config, design_rows(config)).values()
    return [(row, experiment_settings(config, row)) for row in found if row["experiment"] == experiment]


def test_softened_heaps_have_the_same_stiffness_number_for_every_radius_and_gravity():
    for gravity in (9.81, 1.62):
        for row, settings in planned("repose", **{"engine.gravity_m_s2": gravity}):
            if row["fidelity"] == "campaign":
                E_star = row["shear_modulus_pa"] / (1.0 - row["poisson_ratio"]) / settings["engine"]["stiffness_reduction"]
                solid_m = 3000 * 4.0 / 3.0 * row["radius_m"] ** 3 / (15.0 * row["radius_m"]) ** 2  # volume of the grains over area
                assert E_star / (row["density_kg_m3"] * gravity * solid_m) == pytest.approx(20000.0)


def test_the_papers_own_stiffness_is_kept_for_every_radius():
    found = planned("repose", **{"fidelity.campaign.repose_stiffness_number": None})
    assert {settings["engine"]["stiffness_reduction"] for _, settings in found} == {1.0}


def test_the_time_limit_of_a_heap_follows_its_column_and_never_ends_the_lift():
    limits = {}
    for row, settings in planned("repose"):
        setup = settings["setup"]
        column = 3000 * 4.0 / 3.0 * row["radius_m"] ** 3 / (15.0 * row["radius_m"]) ** 2 / 0.5  # loosely filled
        assert setup["lift_speed_m_s"] * setup["max_time_s"] > 1.1 * column
        limits[row["radius_m"]] = setup["max_time_s"]
    assert limits[5e-4] > 3 * limits[5e-5]


def test_a_given_time_limit_is_a_bound():
    free, tight, wide = (planned("repose", **{"repose.max_time_s": bound}) for bound in (None, 0.1, 1e6))
    assert wide == free
    for row, settings in tight:
        assert settings["setup"]["max_time_s"] == pytest.approx(0.1 * row["radius_m"] / 50e-6)


def test_grains_that_are_too_soft_for_their_stresses_are_refused_with_the_modulus_that_would_do():
    stresses = [50e3, 100e3, 200e3]
    with pytest.raises(StudyError, match=r"shear_modulus_pa is 5e\+07; allowed: at least 8e\+08, .* 5000 under 2e\+05 Pa"):
        planned("shear", **{"shear.normal_stresses_pa": stresses, "shear.stresses": "fixed"})
    assert planned("shear", **{"shear.normal_stresses_pa": stresses, "shear.stresses": "fixed", "material.shear_modulus_pa": 1e9})
    with pytest.raises(StudyError, match=r"repose: shear_modulus_pa is 5e\+07; .* \(fidelity.campaign.repose_stiffness_number\)"):
        planned("repose", **{"fidelity.campaign.repose_stiffness_number": 1e7})


def stresses_by_radius(**changes):
    found = planned("shear", **{"fidelity.check.couples": []}, **changes)
    return {
        radius: sorted({row["normal_stress_pa"] for row, _ in found if row["radius_m"] == radius})
        for radius in (25e-6, 50e-6, 500e-6)
    }


def test_a_box_that_grows_with_the_grains_is_loaded_in_proportion():
    found = stresses_by_radius()
    assert found[50e-6] == [150.0, 250.0, 500.0, 1000.0]
    assert found[500e-6] == [1500.0, 2500.0, 5000.0, 10000.0]
    assert found[25e-6] == [75.0, 125.0, 250.0, 500.0]
    fixed = {"shear.stresses": "fixed", "shear.normal_stresses_pa": [2e3, 4e3, 8e3]}
    assert stresses_by_radius(**fixed) == dict.fromkeys(found, [2e3, 4e3, 8e3])
    one_box = planned("shear", **{"design.geometry": "fixed", "design.sweep": {"radius_m": [40e-6, 50e-6, 60e-6]}})
    assert {row["normal_stress_pa"] for row, _ in one_box} == {150.0, 250.0, 500.0, 1000.0}


@pytest.mark.parametrize("experiment", ["shear", "plane_shear"])
def test_stresses_may_be_given_in_units_of_the_grains_weight(experiment):
    ratios = [60.0, 100.0, 200.0]
    for row, settings in planned(experiment, **{f"{experiment}.normal_stress_ratios": ratios, "fidelity.check.couples": []}):
        ratio = row["normal_stress_pa"] / (row["density_kg_m3"] * 9.81 * 2 * row["radius_m"])
        assert min(abs(ratio - wanted) for wanted in ratios) < 0.05
        assert settings["setup"]["normal_stress_pa"] == row["normal_stress_pa"]


def test_a_lid_too_light_for_the_soil_under_it_is_refused_with_the_stress_that_would_do():
    with pytest.raises(
        StudyError,
        match=r"shear: shear.normal_stresses_pa is 1.25e\+03 Pa on grains of 500 um; allowed: at least 1.34e\+03 Pa, 10 times",
    ):
        planned("shear", **{"shear.normal_stresses_pa": [125.0, 250.0, 500.0]})
    with pytest.raises(StudyError, match=r"1e\+03 Pa on grains of 500 um; allowed: at least 1.34e\+03 Pa"):
        planned("shear", **{"shear.stresses": "fixed"})
    assert planned("shear", **{"shear.normal_stresses_pa": [125.0, 250.0, 500.0], "engine.gravity_m_s2": 1.62})


def test_twins_of_another_design_that_no_case_names_are_left_out_and_said_to_be():
    config = yaml.safe_load((ROOT / "config/config.yaml").read_text())
    place = {"radius_m": 1e-4, "static_friction": 0.5, "rolling_friction": 0.1, "repose_seeds": [9]}
    config["twins"] = {"fits": {**place, "plane_shear_seeds": [9]}, "other": {**place, "shear_seeds": [9]}, "asked": place}
    config["optimise"]["cases"] = [{"case": "a", "soil": "asked", "weights": {"angle_of_repose": 1.0}}]
    kept, lines = fitting_twins(config)
    assert set(kept) == {"fits", "asked"}
    assert lines == ["twins.other is left out: no case names it, and it is of another design."]


def normal(variables, **changes):
    """The default study with its design in normal form; variables : as in a configuration file."""
    config = yaml.safe_load((ROOT / "config/config.yaml").read_text())
    config["design"] |= {"variables": variables, **changes}
    config["material"] = with_walls(config)
    config["design"] = normal_form(config)
    return config


def test_ranges_of_variables_are_a_complete_design():
    config = normal({"static_friction": [0.1, 1.0], "rolling_friction": [0.0, 0.3]})
    rows = [row for row in design_rows(config) if "points" in row["purposes"]]
    points = {(row["static_friction"], row["rolling_friction"]) for row in rows}
    assert len(points) == 32
    assert {(0.1, 0.0), (0.1, 0.3), (1.0, 0.0), (1.0, 0.3)} < points
    assert {row["radius_m"] for row in rows} == {config["material"]["radius_m"]}
    unit = space_of(config["design"]).unit({"static_friction": [p[0] for p in points], "rolling_friction": [p[1] for p in points]})
    for column in unit.T:  # every eighth of either coordinate is hit about evenly
        counts = np.histogram(column, bins=8, range=(0.0, 1.0))[0]
        assert counts.min() >= 2
        assert counts.max() <= 7
    more = normal({"static_friction": [0.1, 1.0], "rolling_friction": [0.0, 0.3]}, n_points=48)
    assert {row["point_id"] for row in rows} < {row["point_id"] for row in design_rows(more)}


@pytest.mark.parametrize(
    "variables",
    [
        {"restitution": [0.2, 0.9]},
        {"wall_static_friction": [0.0, 1.0], "static_friction": [0.1, 1.0]},
        {"density_kg_m3": [1500.0, 3000.0], "radius_sd_ratio": [0.0, 0.2], "shear_modulus_pa": [5e7, 5e8]},
        dict.fromkeys(["static_friction", "rolling_friction", "restitution", "wall_rolling_friction"], [0.1, 0.6]),
    ],
)
def test_every_property_of_grains_and_walls_may_be_a_variable(variables):
    config = normal(variables)
    rows = [row for row in design_rows(config) if row["purposes"] == "points"]
    for name, (low, high) in variables.items():
        values = {row[name] for row in rows}
        assert len(values) >= 14
        assert low <= min(values) < max(values) <= high
    heaps = [(row, experiment_settings(config, row)["setup"]) for row in rows if row["experiment"] == "repose"]
    for name in variables:
        if name.startswith("wall"):
            assert all(setup[name] == row[name] for row, setup in heaps)
    assert set(config["design"]["fixed"]) == {"radius_m", "static_friction", "rolling_friction"} - set(variables)


def test_a_film_shows_the_specimen_of_the_simulation_that_its_point_shares():
    config = normal({"wall_static_friction": [0.0, 1.0], "static_friction": [0.1, 1.0]})
    rows = design_rows(config)
    for experiment in config["experiments"]:
        shown = base_simulation(config, rows, experiment)
        assert shown == simulations(config, rows)[shown["simulation_id"]]  # its point, too, of which the seed is


def test_a_wall_that_is_no_variable_keeps_its_setting():
    config = normal({"static_friction": [0.1, 1.0]})
    row = next(row for row in design_rows(config) if row["experiment"] == "repose")
    assert experiment_settings(config, row)["setup"]["wall_static_friction"] is None


@pytest.mark.parametrize(
    ("variables", "changes", "message"),
    [
        ({"static_friction": [1.0, 0.1]}, {}, r"design.variables.static_friction is \[1.0, 0.1\]; allowed: the lowest value, then"),
        ({"stickiness": [0.1, 1.0]}, {}, r"design.variables is \['stickiness'\]; allowed: some of \['adhesive_stress_pa', "),
        ({"static_friction": [0.1, 1.0]}, {"n_points": 4}, "design.n_points is 4; allowed: at least 5: 5 for every variable"),
        (["static_friction"], {"n_points": 40}, "design.n_points is 40; allowed: null where design.variables are names"),
        (["restitution"], {}, "design.grid is {}; allowed: values of at least one of design.variables; or give their ranges"),
    ],
)
def test_a_design_without_sense_is_refused(variables, changes, message):
    with pytest.raises(ValueError, match=message):
        design_rows(normal(variables, **changes))


def test_a_polynomial_needs_a_grid():
    config = normal({"static_friction": [0.1, 1.0]})
    config["surrogate"]["angle_of_repose"]["model"] = "quadratic"
    with pytest.raises(StudyError, match="surrogate.angle_of_repose.model is quadratic; allowed: best or gaussian_process: a poly"):
        design_rows(config)


def test_points_are_read_from_a_file(tmp_path):
    path = tmp_path / "points.csv"
    numbers = [(0.1 + 0.05 * k, 0.02 * k) for k in range(12)]
    path.write_text("# mine\nstatic_friction, rolling_friction, remark\n" + "".join(f"{s:.4g},{r:.4g},x\n" for s, r in numbers))
    config = normal(["static_friction", "rolling_friction"], points_csv=str(path))
    rows = [row for row in design_rows(config) if row["purposes"] == "points"]
    assert {(row["static_friction"], row["rolling_friction"]) for row in rows} == {
        (float(f"{s:.4g}"), float(f"{r:.4g}")) for s, r in numbers
    }
    assert config["design"]["ranges"] == {"static_friction": [0.1, 0.65], "rolling_friction": [0.0, 0.22]}


@pytest.mark.parametrize(
    ("text", "variables", "message"),
    [
        (None, ["static_friction"], "design.points_csv is .*points.csv; allowed: a file with a column for every variable"),
        ("a,b\n1,2\n", ["static_friction"], "columns is .*; allowed: those of design.variables; there is no static_friction"),
        ("", ["static_friction"], "there is no static_friction"),
        ("static_friction\n" + "0.1\n" * 6, ["static_friction"], "points is some twice; allowed: each once"),
        ("static_friction\n0.1\n0.2\nhigh\n", ["static_friction"], "static_friction of point 3 is 'high'; allowed: a number"),
        ("static_friction\n0.1\n0.2\n", ["static_friction"], "number of points is 2; allowed: at least 5"),
        (
            "static_friction\n" + "".join(f"0.{k}\n" for k in range(1, 8)),
            {"static_friction": [0.2, 1.0]},
            r"static_friction is \[0.1, 0.7\]; allowed: within design.variables, 0.2 to 1",
        ),
    ],
)
def test_a_file_of_points_without_sense_is_refused(tmp_path, text, variables, message):
    path = tmp_path / "points.csv"
    if text is not None:
        path.write_text(text)
    with pytest.raises(ValueError, match=message):
        normal(variables, points_csv=str(path))


def test_a_radius_that_is_no_variable_is_fixed():
    config = yaml.safe_load((ROOT / "config/config.yaml").read_text())
    every = normal_form(config)
    assert every == {key: value for key, value in config["design"].items() if key not in ("n_points", "points_csv")}
    config["design"]["variables"] = ["static_friction", "rolling_friction"]
    config["material"]["radius_m"] = 1.2345e-3
    config["material"]["shear_modulus_pa"] = 5e9
    config["design"] = normal_form(config)
    assert config["design"]["sweep"] == {}
    assert config["design"]["fixed"] == {"radius_m": 1.2345e-3}
    rows = design_rows(config)
    assert {row["radius_m"] for row in rows if "grid" in row["purposes"]} == {1.2345e-3}
    assert len({row["point_id"] for row in rows if "grid" in row["purposes"]}) == 35
    space = space_of(config["design"])
    assert space.variables == ("static_friction", "rolling_friction")
    values = space.values(space.crowd(8))
    assert values["radius_m"].tolist() == [1.2345e-3] * 8
    assert space.unit(values) == pytest.approx(space.crowd(8))


@pytest.mark.parametrize(
    ("stated", "case", "message"),
    [
        (
            "peak",
            {"friction_angle": 1},
            "target friction_angle of a is a peak strength; allowed: a plateau strength, as the simulated",
        ),
        ("steady", {"peak_friction_angle": 1}, "target peak_friction_angle of a is a steady strength; allowed: a peak strength"),
        ("plateau", {"friction_angle": 1}, ""),
        ("peak", {"peak_friction_angle": 1}, ""),
    ],
)
def test_a_target_of_another_strength_than_the_simulated_is_refused(tmp_path, monkeypatch, stated, case, message):
    folder = tmp_path / "config" / "soils"
    folder.mkdir(parents=True)
    (name,) = case
    (folder / "mine.yaml").write_text(f"{name}_deg: {{value: 30.0, source: own, strength: {stated}}}\n")
    monkeypatch.chdir(tmp_path)
    config = defaults(Study) | {"soils": ["mine"], "experiments": ["repose", "plane_shear", "shear"]}
    config["optimise"]["cases"] = [{"case": "a", "soil": "mine", "weights": case}]
    with pytest.raises(StudyError, match=message) if message else nullcontext():
        check_soils(config)


def test_a_largest_strain_below_the_first_look_is_refused():
    message = "plane_shear.max_shear_strain is 2.0; allowed: at least plane_shear.shear_strain, 3"
    with pytest.raises(StudyError, match=message):
        planned("plane_shear", experiments=["repose", "plane_shear"], **{"plane_shear.max_shear_strain": 2.0})
