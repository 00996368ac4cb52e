"""The laboratory's apparatus in SI: number of grains, speeds and stresses follow from it; a soil file may state it."""

import copy
import math
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from virtual_soil.calibration.errors import CalibrationError
from virtual_soil.campaign.apparatus import apparatus, check_sizes, laboratory_curve, with_gravity
from virtual_soil.campaign.design import campaign_loads
from virtual_soil.campaign.experiments.plane_shear import declared as plane_shear
from virtual_soil.campaign.experiments.registry import responses_of, with_optional
from virtual_soil.campaign.experiments.repose import declared as repose
from virtual_soil.campaign.experiments.shear import declared as shear
from virtual_soil.campaign.experiments.shear.measure import curve_distance
from virtual_soil.campaign.experiments.slope import declared as slope
from virtual_soil.campaign.sections import Study
from virtual_soil.campaign.settings import defaults
from virtual_soil.campaign.soils import measure_soil
from virtual_soil.campaign.study import StudyError, as_printed, check_config, design_rows, simulations

EXAMPLE = Path(__file__).parents[2] / "config" / "soils" / "example"
TUBE = {"tube_diameter_m": 0.05, "fill_height_m": 0.15, "lift_speed_m_s": 0.01}
TARGET = "angle_of_repose_deg: {value: 34.0, source: own}\n"


def study(**stated):
    """The default study with 2 mm grains as stiff as needed; stated : repose_test and shear_test."""
    config = defaults(Study)
    config["material"] |= {"radius_m": 2e-3, "density_kg_m3": 2650.0, "shear_modulus_pa": 1e9}
    for section, values in stated.items():
        config[section] |= values
    return config


def row(config, experiment="repose", **changes):
    return {**config["material"], "experiment": experiment, "fidelity": "campaign", "normal_stress_pa": 1e5, **changes}


def test_the_number_of_grains_follows_from_the_tube():
    config = study(repose_test=TUBE)
    setup = repose.setup(config, row(config))["setup"]
    grain = 4.0 / 3.0 * math.pi * 2e-3**3
    assert setup["n_particles"] * grain == pytest.approx(0.57 * math.pi * 0.025**2 * 0.15, rel=1e-3)
    assert 2.0 * setup["tube_diameter_ratio"] * setup["scale_radius_m"] == pytest.approx(0.05)
    assert setup["lift_speed_m_s"] == 0.01
    finer = repose.setup(config, row(config, radius_m=1e-3))["setup"]
    assert finer["n_particles"] == pytest.approx(8 * setup["n_particles"], rel=1e-3)
    assert 2.0 * finer["tube_diameter_ratio"] * finer["scale_radius_m"] == pytest.approx(0.05)
    assert finer["plate_half_width_ratio"] * 1e-3 == pytest.approx(setup["plate_half_width_ratio"] * 2e-3, rel=1e-3)
    # the foot of a cone of 12 degrees of this fill
    assert setup["plate_half_width_ratio"] * 2e-3 > (3.0 * 0.025**2 * 0.15 / math.tan(math.radians(12.0))) ** (1 / 3)


def test_the_mass_gives_the_same_grains_as_the_height():
    height = study(repose_test=TUBE)
    mass = study(repose_test={"tube_diameter_m": 0.05, "fill_mass_kg": 0.57 * 2650.0 * math.pi * 0.025**2 * 0.15})
    numbers = [repose.setup(config, row(config))["setup"]["n_particles"] for config in (height, mass)]
    assert abs(numbers[0] - numbers[1]) <= 1


def test_plate_tube_and_gravity_are_those_of_the_laboratory():
    config = study(repose_test={**TUBE, "plate": 0.4, "tube_static_friction": 0.2, "gravity_m_s2": "moon"})
    settings = repose.setup(config, row(config))
    assert settings["setup"]["wall_static_friction"] == 0.4
    assert settings["setup"]["tube_static_friction"] == 0.2
    assert settings["engine"]["gravity_m_s2"] == 1.62
    earth = repose.setup(study(repose_test=TUBE), row(config))
    assert settings["setup"]["max_time_s"] > earth["setup"]["max_time_s"]
    rough = study(repose_test={**TUBE, "plate": "rough"}) | {"repose": {**config["repose"], "wall_static_friction": 0.1}}
    assert repose.setup(rough, row(config))["setup"]["wall_static_friction"] is None


def test_the_engines_gravity_may_be_a_name():
    config = study()
    config["engine"]["gravity_m_s2"] = "moon"
    check_config(config)
    assert with_gravity(config["engine"])["gravity_m_s2"] == 1.62
    config["engine"]["gravity_m_s2"] = "pluto"
    with pytest.raises(StudyError, match="engine.gravity_m_s2: 'pluto' does not match"):
        check_config(config)


def test_stresses_and_box_are_those_of_the_laboratory():
    stresses = [5e4, 1e5, 2e5]
    config = study(shear_test={"length_m": 0.06, "height_m": 0.03, "width_m": 0.06, "normal_stresses_pa": stresses})
    for test in (shear, plane_shear):
        for radius_m in (2e-3, 1e-3):  # whatever the grains
            assert test.loads(config, {**config["material"], "radius_m": radius_m}) == stresses
        assert test.check_loads(config) == [1e5]
    config["shear"]["stresses"] = "fixed"
    setup = shear.setup(config, row(config, "shear"))["setup"]
    assert [setup[f"{key}_ratio"] * setup["scale_radius_m"] for key in ("length", "height", "width")] == pytest.approx(
        [0.06, 0.03, 0.06]
    )


def test_without_an_apparatus_nothing_is_changed():
    config = study()
    assert repose.setup(config, row(config))["setup"]["n_particles"] == config["repose"]["n_particles"]
    assert as_printed(defaults(Study)) == ["repose"]
    config = defaults(Study)
    config["repose_test"] |= TUBE
    assert as_printed(config) == []


@pytest.mark.parametrize(
    ("stated", "message"),
    [
        ({"tube_diameter_m": 0.05}, "repose_test is fill_height_m None, fill_mass_kg None; allowed: just one of the two"),
        ({**TUBE, "fill_mass_kg": 0.4}, "repose_test is fill_height_m 0.15, fill_mass_kg 0.4; allowed: just one of the two"),
        ({"fill_height_m": 0.1}, "repose_test.fill_height_m is 0.1; allowed: null without repose_test.tube_diameter_m"),
        (
            {**TUBE, "tube_diameter_m": 0.012},
            "repose_test.tube_diameter_m is 12 mm with grains of 2 mm radius; allowed: at least 4",
        ),
        ({**TUBE, "fill_height_m": 1e-3}, "repose_test is 33 grains in the tube; allowed: at least 50"),
    ],
)
def test_a_tube_without_sense_is_refused(stated, message):
    config = study(repose_test=stated)
    with pytest.raises(CalibrationError, match=message):
        repose.setup(config, row(config))


def test_too_many_grains_are_refused_with_the_radius_that_would_do():
    config = study(repose_test=TUBE)
    config["material"]["radius_m"] = 2e-4
    config["design"] |= {"grid": {name: [0.1, 0.2, 0.3] for name in ("static_friction", "rolling_friction")}, "sweep": {}}
    config["design"]["variables"] = ["static_friction", "rolling_friction"]
    config["design"]["sweep_couples"] = []
    rows = design_rows(config)
    with pytest.raises(
        StudyError, match=r"repose_test: 5e\+06 grains of 0.2 mm radius take .* h of a core; allowed: 24 h, as with sc"
    ) as e:
        simulations(config, rows)
    larger = float(str(e.value).split("scaled-up grains of ")[1].split(" mm")[0])
    assert 2e-4 < 1e-3 * larger < 2e-3
    assert simulations(config, rows, insist=["repose_test"])
    config["material"]["radius_m"] = 1e-3 * larger
    assert simulations(config, design_rows(config))


def soil_file(folder, text, name="mine"):
    path = folder / f"{name}.yaml"
    path.write_text(TARGET + text)
    return str(path)


def test_a_soil_file_may_state_the_apparatus(tmp_path):
    path = soil_file(tmp_path, "repose_test: {tube_diameter_m: 0.05, fill_mass_kg: 0.4, gravity_m_s2: mars}\n")
    assert set(measure_soil(path)["property"]) == {"angle_of_repose"}
    found = apparatus(study(repose_test={"lift_speed_m_s": 0.02}), [path])
    stated = {key: value for key, value in found["repose_test"].items() if value is not None}
    assert stated == {"tube_diameter_m": 0.05, "fill_mass_kg": 0.4, "gravity_m_s2": "mars", "lift_speed_m_s": 0.02}


def test_the_stresses_are_those_of_the_laboratorys_file(tmp_path):
    for name in ("example.yaml", "shear_box.csv"):
        (tmp_path / name).write_bytes((EXAMPLE / name).read_bytes())
    text = (tmp_path / "example.yaml").read_text()
    path = tmp_path / "example.yaml"
    assert apparatus(study(), [str(path)])["shear_test"]["normal_stresses_pa"] is None
    path.write_text(text + "shear_test: {}\n")
    stresses = apparatus(study(), [str(path)])["shear_test"]["normal_stresses_pa"]
    assert stresses == [25e3, 50e3, 100e3, 200e3]
    config = study(shear_test={"normal_stresses_pa": stresses})
    assert campaign_loads(config, config["material"])["plane_shear"] == stresses


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("repose_test: {tube_diameter_mm: 50}\n", "repose_test: unknown key 'tube_diameter_mm'; allowed: fill_height_m"),
        ("repose_test: {tube_diameter_m: 50}\n", "repose_test.tube_diameter_m is 50; allowed: usually 0.0001 to 2, in the unit"),
        ("repose_test: {tube_diameter_m: -0.05}\n", "repose_test.tube_diameter_m: -0.05 is less than or equal to the minimum of 0"),
        ("repose_test: {gravity_m_s2: pluto}\n", "repose_test.gravity_m_s2: 'pluto' does not match"),
        ("repose_test: {plate: smooth}\n", "repose_test.plate: 'smooth' does not match"),
        ("repose_test: 50 mm\n", "repose_test is '50 mm'; allowed: a mapping with keys of"),
        ("shear_test: {normal_stresses_pa: [50, 100]}\n", r"shear_test.normal_stresses_pa: \[50, 100\] is too short"),
    ],
)
def test_an_impossible_apparatus_in_a_soil_file_is_refused(tmp_path, text, message):
    with pytest.raises(CalibrationError, match=message):
        measure_soil(soil_file(tmp_path, text))


def test_an_unusual_size_may_be_insisted_on(tmp_path):
    path = soil_file(tmp_path, "repose_test: {tube_diameter_m: 3.0, fill_height_m: 2.0, insist: true}\n")
    assert apparatus(study(), [path])["repose_test"]["tube_diameter_m"] == 3.0


def test_one_campaign_has_one_apparatus(tmp_path):
    first = soil_file(tmp_path, "repose_test: {tube_diameter_m: 0.05, fill_height_m: 0.1}\n")
    second = soil_file(tmp_path, "repose_test: {tube_diameter_m: 0.06}\n", "other")
    with pytest.raises(
        CalibrationError, match=r"repose_test.tube_diameter_m is 0.06 in .*other.yaml and 0.05 in .*mine.yaml; allowed"
    ):
        apparatus(study(), [first, second])
    with pytest.raises(CalibrationError, match="0.05 in .*mine.yaml and 0.07 in the study; allowed: one apparatus for a study"):
        apparatus(study(repose_test={"tube_diameter_m": 0.07}), [first])
    config = copy.deepcopy(study())
    apparatus(config, [first])
    assert config == study()


def curves(folder, weight=1.0):
    """A study whose case asks for the distance from the curves of its soil, the example's."""
    for name in ("example.yaml", "shear_box.csv"):
        (folder / name).write_bytes((EXAMPLE / name).read_bytes())
    config = defaults(Study) | {"experiments": ["shear"]}
    config["optimise"]["cases"] = [{"case": "a", "soil": "example", "weights": {"curve_distance": weight, "friction_angle": 1.0}}]
    return config, [str(folder / "example.yaml")]


def test_the_distance_from_the_laboratorys_curve_is_measured_if_a_case_asks_for_it(tmp_path):
    config, files = curves(tmp_path)
    curve = laboratory_curve(config, files)
    assert [round(test["normal_stress_pa"], -3) for test in curve] == [25e3, 50e3, 100e3, 200e3]
    assert with_optional(config) == ["shear", "curve_distance"]
    assert "curve_distance" in responses_of(with_optional(config))
    without, files = curves(tmp_path, weight=0.0)
    assert laboratory_curve(without, files) is None
    assert "curve_distance" not in responses_of(with_optional(without))
    config["optimise"]["cases"][0]["soil"] = "other"
    with pytest.raises(CalibrationError, match="weight curve_distance of other is no shear curves; allowed: a soil file"):
        laboratory_curve(config, files)


def test_the_distance_of_a_curve_from_itself_and_from_a_shifted_one_is_known():
    u = np.linspace(0.0, 4e-3, 50)
    ratio = 0.6 * np.tanh(u / 5e-4)
    history = pd.DataFrame({"displacement_m": u, "shear_stress_pa": 1e5 * ratio, "plane_normal_stress_pa": 1e5})
    history["applied_normal_stress_pa"] = 1e5
    theirs = [{"normal_stress_pa": 1.02e5, "displacement_m": u.tolist(), "stress_ratio": (ratio + 0.05).tolist()}]
    assert curve_distance(history, theirs, None) == pytest.approx(0.05)
    assert curve_distance(history, [{**theirs[0], "stress_ratio": ratio.tolist()}], [1e-3, 2e-3]) == pytest.approx(0.0, abs=1e-12)
    bent = [{**theirs[0], "stress_ratio": np.where(u > 2e-3, ratio + 0.2, ratio).tolist()}]
    assert curve_distance(history, bent, [0.0, 1.9e-3]) == pytest.approx(0.0, abs=1e-12)
    assert curve_distance(history, bent, [2.2e-3, 9.0]) == pytest.approx(0.2)
    assert math.isnan(curve_distance(history, [{**theirs[0], "normal_stress_pa": 5e4}], None))
    assert math.isnan(curve_distance(history, None, None))


def test_the_slope_has_the_height_of_the_laboratory_whatever_the_grains():
    config = study(slope_test={"height_m": 0.1, "gravity_m_s2": "moon"})
    for radius_m in (2e-3, 4e-3):
        settings = slope.setup(config, row(config, "slope", radius_m=radius_m))
        setup = settings["setup"]
        assert setup["height_ratio"] * setup["scale_radius_m"] == pytest.approx(0.1)
        assert setup["length_ratio"] == pytest.approx(3.0 * setup["height_ratio"])
        assert settings["engine"]["gravity_m_s2"] == 1.62
    with pytest.raises(
        CalibrationError, match=r"slope_test.height_m is 100 mm with grains of 10 mm radius; allowed: at least 12 r"
    ):
        slope.setup(config, row(config, "slope", radius_m=1e-2))


def test_adhesion_presses_the_slopes_grains_as_their_weight_does():
    config = study(slope_test={"height_m": 0.1})
    config["engine"] |= {"gravity_m_s2": 9.81}
    plain, sticky = (
        slope.setup(config, row(config, "slope", adhesive_stress_pa=stress))["engine"]["stiffness_reduction"]
        for stress in (0.0, 500.0)
    )
    weight_pa = 0.57 * 2650.0 * 9.81 * 0.1
    assert plain / sticky == pytest.approx(1.0 + 4.0 / math.pi * 500.0 / weight_pa)


def cohesive(tmp_path, cohesion, **stated):
    """A study of sticking grains and a soil file with this cohesion and both angles; stated : repose_test, slope_test."""
    soil = tmp_path / "silt.yaml"
    soil.write_text(f"steady_cohesion_pa: {cohesion}\nangle_of_repose_deg: {{value: 50, source: own}}\n")
    config = study(**stated) | {"experiments": ["repose", "slope", "plane_shear"], "soils": ["silt"]}
    config["material"]["adhesive_stress_pa"] = 1.0
    config["optimise"]["cases"] = [{"case": "a", "soil": "silt", "weights": {"angle_of_repose": 1.0, "steady_cohesion": 1.0}}]
    return config, [str(soil)]


COHERENT = "{value: 100, source: own}"
SIZED = {**TUBE, "gravity_m_s2": "earth"}


def test_an_angle_of_a_soil_that_coheres_needs_the_size_of_its_test(tmp_path):
    why = r"missing; allowed: stated in SI: silt has a cohesion of 100 Pa, so its angle depends on the size of the test"
    for stated, key in (({}, "tube_diameter_m, fill_height_m or fill_mass_kg, gravity_m_s2"), (TUBE, "gravity_m_s2")):
        with pytest.raises(CalibrationError, match=f"repose_test: {key} is {why}"):
            check_sizes(*cohesive(tmp_path, COHERENT, repose_test=stated))
    check_sizes(*cohesive(tmp_path, COHERENT, repose_test=SIZED))
    config, files = cohesive(tmp_path, COHERENT)
    config["optimise"]["cases"][0]["weights"] = {"slope_angle": 1.0}
    with pytest.raises(CalibrationError, match=f"slope_test: height_m, gravity_m_s2 is {why}"):
        check_sizes(config, files)


def test_grains_without_adhesion_and_soils_without_cohesion_need_no_size(tmp_path):
    config, files = cohesive(tmp_path, COHERENT)
    config["material"]["adhesive_stress_pa"] = 0.0
    check_sizes(config, files)
    config["design"]["variables"] = {"adhesive_stress_pa": [0.0, 10.0]}
    with pytest.raises(CalibrationError, match="repose_test"):
        check_sizes(config, files)
    check_sizes(*cohesive(tmp_path, "{value: 0, source: own}"))
    check_sizes(*cohesive(tmp_path, "{value: 5, source: own, standard_uncertainty: 4}"))
    config, files = cohesive(tmp_path, COHERENT)
    config["optimise"]["cases"][0]["weights"] = {"steady_cohesion": 1.0}
    check_sizes(config, files)


def test_a_soil_that_would_stand_in_its_tube_is_refused(tmp_path):
    column = r"100 Pa / 149 Pa, is 0.67; allowed: at most 0.1: it stands as a column in this test; measure a slope"
    for fill in ({"fill_height_m": 0.01}, {"fill_height_m": None, "fill_mass_kg": 0.57 * 2650.0 * math.pi * 0.025**2 * 0.01}):
        with pytest.raises(CalibrationError, match=column.replace("149", "148")):
            check_sizes(*cohesive(tmp_path, COHERENT, repose_test={**SIZED, **fill}))
    with pytest.raises(CalibrationError, match="is 0.27"):  # on the moon
        check_sizes(*cohesive(tmp_path, COHERENT, repose_test={**SIZED, "gravity_m_s2": "moon"}))
