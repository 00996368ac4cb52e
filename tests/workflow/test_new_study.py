"""`make new-study`: a beginner's files are valid, say what is missing, and overwrite nothing."""

import re
import shutil
from pathlib import Path

import pytest
import yaml
from snakemake.utils import update_config

from virtual_soil.calibration.errors import CalibrationError
from virtual_soil.campaign import new_study
from virtual_soil.campaign.code import ROOT
from virtual_soil.campaign.soils import measure_soil
from virtual_soil.campaign.study import check_config

DEFAULT = (ROOT / "config" / "config.yaml").read_text()


@pytest.fixture
def project(tmp_path):
    """A project's configuration, to be written to."""
    shutil.copytree(ROOT / "config", tmp_path / "config")
    return tmp_path


def uncommented(path: Path) -> str:
    """A starter file with every suggested line in force; prose has a blank after its #."""
    return re.sub(r"^#(?! \S)", "", path.read_text(), flags=re.MULTILINE)


def test_a_study_of_a_known_soil_is_ready_to_run(project):
    (path,) = new_study.start(project, "moon", "lunar_regolith")
    config = yaml.safe_load(DEFAULT)
    update_config(config, yaml.safe_load(path.read_text()))
    check_config(config)
    assert (config["study"], config["soils"]) == ("moon", ["lunar_regolith"])
    (case,) = config["optimise"]["cases"]
    assert case["soil"] == "lunar_regolith"
    assert config["experiments"] == ["repose", "plane_shear"]
    assert case["weights"] == {"angle_of_repose": 1, "steady_cohesion": 1, "steady_friction_angle": 1}


def test_a_soil_without_targets_of_plane_shear_is_asked_by_the_shear_box(project):
    soil = project / "config/soils/box.yaml"
    soil.write_text("".join(f"{name}: {{value: 30.0, source: own}}\n" for name in ("friction_angle_deg", "angle_of_repose_deg")))
    (path,) = new_study.start(project, "moon", "box")
    own = yaml.safe_load(path.read_text())
    assert own["experiments"] == ["repose", "shear"]
    assert own["optimise"]["cases"][0]["weights"] == {"angle_of_repose": 1, "friction_angle": 1}


def test_the_suggested_lines_are_valid_and_change_nothing_as_they_stand(project):
    (path,) = new_study.start(project, "moon", "lunar_regolith")
    own, default = yaml.safe_load(uncommented(path)), yaml.safe_load(DEFAULT)
    config = yaml.safe_load(DEFAULT)
    update_config(config, own)
    check_config(config)
    assert {"material", "engine", "design", "refine"} <= set(own)
    # a new study fixes the radius
    assert config["design"].pop("variables") == {"static_friction": [0.0, 1.5], "rolling_friction": [0.0, 0.3]}
    assert config["design"].pop("n_points") == 32
    del default["design"]["n_points"]
    del default["design"]["variables"]
    own_keys = ("study", "experiments", "soils", "optimise")
    assert {key: config[key] for key in config if key not in own_keys} == {
        key: default[key] for key in default if key not in own_keys
    }


def test_a_soil_of_ones_own_is_refused_until_it_is_filled_in(project):
    _, soil = new_study.start(project, "my_sand")
    with pytest.raises(CalibrationError, match=r"my_sand.yaml: peak_cohesion_pa.value is None; allowed: a number"):
        measure_soil(soil)
    soil.write_text(re.sub("value: , standard_uncertainty: ,", "value: 33.0, standard_uncertainty: 1.0,", soil.read_text()))
    assert measure_soil(soil)["value"].tolist() == [33.0] * 3


def test_the_suggested_shear_box_file_is_understood(project):
    _, soil = new_study.start(project, "my_sand")
    shutil.copy(project / "config/soils/example/shear_box.csv", soil.with_suffix(".csv"))
    lines = uncommented(soil).replace("value: , standard_uncertainty: ,", "value: 33.0,").splitlines()
    soil.write_text("\n".join(line for line in lines if not line.startswith("peak_")))
    own = yaml.safe_load((project / "config" / "my_sand.yaml").read_text())
    assert set(own["optimise"]["cases"][0]["weights"]) < set(measure_soil(soil)["property"])


@pytest.mark.parametrize(
    ("study", "soil", "message"),
    [
        ("my sand", None, "STUDY is 'my sand'; allowed: letters, digits, - and _"),
        ("", None, "STUDY is ''"),
        ("moon", "cheese", "SOIL is 'cheese'; allowed: apollo_12_surface, cmu_sand, glass_beads_50um, "),
        ("paper", None, "config/paper.yaml exists already and is left as it is"),
        ("lunar_regolith", None, "config/soils/lunar_regolith.yaml exists already"),
    ],
)
def test_what_cannot_be_is_refused_and_nothing_is_written(project, study, soil, message):
    before = {path: path.read_bytes() for path in project.rglob("*.yaml")}
    with pytest.raises(SystemExit, match=re.escape(message)):
        new_study.start(project, study, soil)
    assert {path: path.read_bytes() for path in project.rglob("*.yaml")} == before


def test_a_wheel_is_asked_for_by_words_and_only_what_differs_is_written(project):
    words = "radius_m=0.1 width_m=0.05 load_n=20 slips=0,0.2,0.5 gravity_m_s2=moon bed.seeds=3 held=travel".split()
    tools = {"wheel": words, "plate": ["diameters_m=0.05,0.09"]}
    (path,) = new_study.start(project, "rover", "lunar_regolith", tools)
    own = yaml.safe_load(path.read_text())
    assert own["wheel"] == {
        "cases": ["rover"],
        "shape": {"radius_m": 0.1},  # width and way of holding are the default's
        "load_n": 20,
        "slips": [0, 0.2, 0.5],
        "gravity_m_s2": "moon",
        "bed": {"seeds": [3]},
    }
    assert own["plate"] == {"diameters_m": [0.05, 0.09]}
    assert own["cone"] == {"base_area_m2": None}
    config = yaml.safe_load(DEFAULT)
    update_config(config, own)
    check_config(config)
    assert config["wheel"]["cases"] == [case["case"] for case in config["optimise"]["cases"]]


def test_a_study_without_words_has_no_wheel(project):
    (path,) = new_study.start(project, "rover", "lunar_regolith")
    assert not {"wheel", "plate", "cone"} & set(yaml.safe_load(path.read_text()))


@pytest.mark.parametrize(
    ("tool", "word", "message"),
    [
        ("wheel", "diameter_m=0.2", "WHEEL has 'diameter_m=0.2'; allowed: <key>=<value> with the keys cases, shape.radius_m, "),
        ("plate", "depth_m", "PLATE has 'depth_m'; allowed: <key>=<value> with the keys diameters_m, depth_m"),
        ("cone", "angle_deg=[", "CONE has 'angle_deg=['; allowed: a value in YAML"),
        ("cone", "angle_deg=200", "cone.angle_deg"),
        ("wheel", "radius_m=100", "wheel.shape.radius_m: 100 is unusual"),
    ],
)
def test_a_word_that_cannot_be_is_refused_and_nothing_is_written(project, tool, word, message):
    before = {path: path.read_bytes() for path in project.rglob("*.yaml")}
    with pytest.raises(SystemExit, match=re.escape(message)):
        new_study.start(project, "rover", "lunar_regolith", {tool: [word]})
    assert {path: path.read_bytes() for path in project.rglob("*.yaml")} == before


def test_the_command_takes_the_words_and_names_what_comes_next(project, monkeypatch, capsys):
    monkeypatch.setattr(new_study, "ROOT", project)
    new_study.main(["rover", "lunar_regolith", "--wheel", "load_n=20  slips=0.5", "--cone", "depth_m=0.04"])
    assert yaml.safe_load((project / "config/rover.yaml").read_text())["cone"] == {"depth_m": 0.04}
    said = capsys.readouterr().out
    assert "snakemake -n wheel --configfile config/rover.yaml" in said
    assert "snakemake -n cone --configfile config/rover.yaml" in said
