"""Settings of wheel, plate and cone as the engine's; the soil of a case; what is refused before a bed is prepared."""

import copy
import re

import numpy as np
import pandas as pd
import pytest

from dem import solids
from virtual_soil.calibration.errors import CalibrationError
from virtual_soil.campaign.sections import Study
from virtual_soil.campaign.settings import defaults
from virtual_soil.campaign.study import StudyError, check_config
from virtual_soil.campaign.tables import load_schema, write_table
from virtual_soil.wheel.setups import bed_settings, check_setups, run_names, shape_of, soil_and_engine
from virtual_soil.wheel.setups import test_of as of_run
from virtual_soil.wheel.soil import cases_of, engine_settings, grain_settings, is_confirmed, soil_of_case, verdicts_of

TOY = {
    "shape": {
        "radius_m": 0.010,
        "width_m": 0.008,
        "rim": "smooth",
        "grousers": {"count": 0, "height_m": 0.002, "thickness_m": 0.001},
    },
    "load_n": 0.1,
    "slips": [0.5],
    "speed_m_s": 0.05,
    "travel_ratio": 1.2,
    "grains_per_radius": 5.0,
    "shear_modulus_pa": 1e6,
}
BED = {"length_ratio": 4.7, "width_ratio": 2.5, "depth_ratio": 1.5}


def toy(**changes):
    """Study with a toy wheel, normalised as the rules see it; changes : of section `wheel`."""
    config = defaults(Study)
    config["design"]["variables"] = ["static_friction", "rolling_friction"]
    config["wheel"] |= copy.deepcopy(TOY)
    config["wheel"]["bed"] |= BED
    for key, value in changes.items():
        if isinstance(value, dict):
            config["wheel"][key] |= value
        else:
            config["wheel"][key] = value
    return config


@pytest.fixture
def calibration(tmp_path):
    """A made-up table of a finished calibration; the polynomial's optimum is another."""
    values = {"case": "sand", "soil": "s", "surrogate": ["ours", "polynomial"], "radius_m": 5e-5, "static_friction": [0.6, 0.9]}
    values |= {"rolling_friction": 0.12, "status": "converged", "missed": "", "extrapolated": "", "iterations": 3}
    values |= {"prediction": ["confirmed", ""], "match": ["not decided: cohesion", ""]}
    columns = {name: rule for name, rule in load_schema("calibration").items() if not rule.get("optional")}
    table = pd.DataFrame({name: values.get(name, 0.5 if rule["type"] == "number" else "") for name, rule in columns.items()})
    write_table(table, str(tmp_path / "calibration.parquet"), "calibration", {})
    return tmp_path / "calibration.parquet"


def checked(config, calibration):
    wheel = config["wheel"]
    job = {"soil": soil_of_case(config, calibration, "sand"), "grains": grain_settings(wheel)}
    job |= {"engine": engine_settings(config, wheel)}
    check_setups(wheel, job)
    return job


def test_the_soil_has_the_optimums_frictions_and_grains_of_the_wheels_size(calibration):
    config = toy()
    config["material"] |= {"restitution": 0.37, "adhesive_stress_pa": 40.0, "radius_sd_ratio": 0.1}
    soil, _ = soil_and_engine(checked(config, calibration))
    assert (soil.static_friction, soil.rolling_friction) == (0.6, 0.12)
    assert (soil.restitution, soil.adhesive_stress_pa, soil.radius_sd_ratio) == (0.37, 40.0, 0.1)
    assert soil.radius_m == pytest.approx(0.010 / 10.0)
    assert soil.shear_modulus_pa == 1e6
    config["wheel"]["shear_modulus_pa"] = None
    own, _ = soil_and_engine(checked(config, calibration))
    assert own.shear_modulus_pa == config["material"]["shear_modulus_pa"]


def test_a_variable_that_is_fixed_keeps_the_materials_value(calibration):
    config = toy()
    config["design"]["variables"] = ["rolling_friction"]
    config["material"]["static_friction"] = 0.8
    row = soil_of_case(config, calibration, "sand")["row"]
    assert (row["static_friction"], row["rolling_friction"]) == (0.8, 0.12)


def test_a_case_without_an_answer_is_named(calibration, tmp_path):
    with pytest.raises(CalibrationError, match=r"case regolith is there 0 times; allowed: once"):
        soil_of_case(toy(), calibration, "regolith")
    with pytest.raises(CalibrationError, match=r"calibration of case sand is missing \(.*none\.parquet\); allowed: .*`all`"):
        soil_of_case(toy(), tmp_path / "none.parquet", "sand")


def test_only_a_confirmed_and_matching_answer_is_confirmed(calibration):
    assert verdicts_of(calibration, ["sand"]) == {"sand": ["confirmed", "not decided: cohesion"]}
    assert not is_confirmed(["confirmed", "not decided: cohesion"])
    assert not is_confirmed(["not simulated", "matches"])
    assert is_confirmed(["confirmed", "matches"])


def test_cases_are_those_named_or_all():
    assert cases_of({"cases": []}, ["a", "b"]) == ["a", "b"]
    assert cases_of({"cases": ["b"]}, ["a", "b"]) == ["b"]
    with pytest.raises(CalibrationError, match=re.escape("wheel.cases is ['c']; allowed: names of optimise.cases: a, b.")):
        cases_of({"cases": ["c"]}, ["a", "b"])


def test_the_beds_sides_follow_from_radius_and_width():
    bed = bed_settings(toy(bed={"preparation_friction_ratio": 0.7, "prepared_with_adhesion": True})["wheel"])
    assert [bed[name] for name in ("length_m", "width_m", "depth_m")] == pytest.approx([0.047, 0.020, 0.015])
    assert (bed["preparation_friction_ratio"], bed["prepared_with_adhesion"]) == (0.7, True)


def test_gravity_is_the_wheels_or_the_engines():
    config = toy()
    config["engine"]["gravity_m_s2"] = 3.71
    assert engine_settings(config, config["wheel"])["gravity_m_s2"] == 3.71
    config["wheel"]["gravity_m_s2"] = "moon"
    assert engine_settings(config, config["wheel"])["gravity_m_s2"] == 1.62


def test_runs_are_the_slips_or_one_free_run():
    config = toy(slips=[-0.2, 0.0, 0.23])
    assert run_names(config["wheel"]) == ["-0.2", "0", "0.23"]
    assert of_run(config["wheel"], "-0.2").slip == -0.2
    free = toy(held="free", drawbar_load_n=0.02)["wheel"]
    assert run_names(free) == ["free"]
    assert of_run(free, "free").slip is None


def test_a_sound_wheel_is_not_refused(calibration):
    default = defaults(Study)
    default["design"]["variables"] = ["static_friction", "rolling_friction"]
    checked(default, calibration)
    checked(toy(), calibration)
    checked(toy(shape={"grousers": {"count": 8, "height_m": 0.001, "thickness_m": 0.001}}), calibration)
    checked(toy(shape={"rim": "sandpaper"}), calibration)
    assert shape_of(toy(shape={"rim": "sandpaper"})["wheel"]).rim == "sandpaper"


@pytest.mark.parametrize(
    ("wheel", "message"),
    [
        (
            {"shape": {"width_m": 0.005}, "bed": {"width_ratio": 4.0}},
            "width_m of the wheel is 0.005 m, 2.5 grain diameters",
        ),
        ({"bed": {"length_ratio": 3.5}}, "wheel: length_m of the bed is 0.035; allowed: at least 0.04 for this wheel"),
        ({"bed": {"depth_ratio": 0.8}}, "wheel.bed: depth_m of the bed is 0.008 m, 4 grain diameters; allowed: at least 5"),
        ({"travel_ratio": 3.0}, "wheel: travel_ratio of the wheel is 3.0; allowed: at most 2.7"),
        ({"drawbar_load_n": 1.0}, "wheel: drawbar_load_n is 1.0; allowed: 0 unless held is 'free'"),
        ({"held": "rim", "slips": [-1.0]}, "wheel: slip of the wheel is -1.0; allowed: from -1 (locked) to below 1, -1 excluded"),
        (
            {"shape": {"rim": "sandpaper"}, "mesh": {"file": "none.stl"}},
            "wheel.shape.rim is sandpaper; allowed: smooth with wheel.mesh.file",
        ),
        (
            {"shape": {"rim": "sandpaper", "grousers": {"count": 8, "height_m": 0.001, "thickness_m": 0.001}}},
            "wheel.shape: rim of the wheel is 'sandpaper'; allowed: 'smooth' with grousers or a mesh",
        ),
        ({"mesh": {"file": "none.stl"}}, "wheel.mesh: mesh file is none.stl; allowed: a file that exists"),
    ],
)
def test_what_cannot_run_is_refused_in_one_line(calibration, wheel, message):
    with pytest.raises(CalibrationError, match=re.escape(message)) as refusal:
        checked(toy(**wheel), calibration)
    assert "\n" not in str(refusal.value)


@pytest.mark.parametrize(
    ("key", "value", "message"),
    [
        ("slips", [1.0], "wheel.slips.0: 1.0 is greater than or equal to the maximum of 1"),
        ("slips", [-1.2], "wheel.slips.0: -1.2 is less than the minimum of -1"),
        ("grains_per_radius", 3.0, "wheel.grains_per_radius: 3.0 is less than the minimum of 5"),
        ("held", "fast", "wheel.held: 'fast' is not one of ['travel', 'rim', 'free']"),
        ("load_n", 0.0, "wheel.load_n: 0.0 is less than or equal to the minimum of 0"),
        ("load_n", 1e7, "wheel.load_n: 1e+07 is unusual"),
    ],
)
def test_settings_out_of_their_range_are_refused(key, value, message):
    config = defaults(Study)
    config["wheel"][key] = value
    with pytest.raises(StudyError, match=re.escape(message)):
        check_config(config)


def test_a_mesh_must_be_as_wide_and_as_large_as_stated(tmp_path):
    wheel, path = solids.wheel(0.010, 0.008, 0, 0.0, 0.0, 40), tmp_path / "wheel.stl"
    corners = 1e3 * wheel.vertices_m[wheel.triangles]
    facets = ["facet normal 0 0 0\nouter loop\n" + "".join(f"vertex {x} {y} {z}\n" for x, y, z in corner) for corner in corners]
    path.write_text("solid wheel\n" + "".join(f"{facet}endloop\nendfacet\n" for facet in facets) + "endsolid wheel\n")
    mesh = {"file": str(path), "unit": "mm", "axis": "y"}
    outer = float(np.hypot(*wheel.vertices_m[:, [0, 2]].T).max())
    found = shape_of(toy(mesh=mesh)["wheel"])
    assert found.width_m == pytest.approx(0.008)
    assert (found.radius_m, found.outer_radius_m) == (0.010, pytest.approx(outer))
    with pytest.raises(CalibrationError, match=r"wheel\.shape\.width_m is 0\.008; allowed: the width of .*, 0\.2032 \(unit in\)"):
        shape_of(toy(mesh=mesh | {"unit": "in"})["wheel"])
    with pytest.raises(CalibrationError, match=r"wheel\.shape\.radius_m is 0\.005; allowed: at least 0\.006"):
        shape_of(toy(mesh=mesh, shape={"radius_m": 0.005})["wheel"])
