"""The shape of a study's grains: what it is resolved to, what it changes, and what is refused."""

import json
import math
import re
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest

from dem import Clump, Mix
from dem.experiments import angle_of_repose
from virtual_soil.calibration.errors import CalibrationError
from virtual_soil.campaign.cost import SPEED_PER_S, expected_s, memory_mb
from virtual_soil.campaign.design import make_row
from virtual_soil.campaign.experiments.common import check_stiffness, engine_of, softening, soil_of
from virtual_soil.campaign.experiments.mohr_coulomb import strength_table
from virtual_soil.campaign.experiments.plane_shear import declared as plane_shear
from virtual_soil.campaign.experiments.registry import EXPERIMENTS
from virtual_soil.campaign.experiments.repose import declared as repose
from virtual_soil.campaign.experiments.repose.measure import measured
from virtual_soil.campaign.experiments.shapes import numbers, resolved, screened_factors
from virtual_soil.campaign.grains import empty_grains, grain_radii_m, grain_table
from virtual_soil.campaign.sections import Study
from virtual_soil.campaign.settings import defaults
from virtual_soil.campaign.study import StudyError, as_printed, check_config, design_rows, simulations
from virtual_soil.campaign.variables import with_walls
from virtual_soil.report.sections import checks


def study(variables=None, **material):
    """The default study of grains of a shape, as the Snakefile completes it."""
    config = defaults(Study)
    config["material"] |= material
    if variables is not None:
        config["design"]["variables"] = variables
    config["shape"] = resolved(config)
    config["material"] = with_walls(config)
    return config


def row(config, experiment="repose", **changes):
    values = {"experiment": experiment, "fidelity": "campaign", "normal_stress_pa": 500.0}
    return {**config["material"], **values, **changes}


def grains_of(config, experiment=repose, **changes):
    """Soil of a simulation from its stored settings, as a job makes it."""
    own = row(config, experiment.NAME, **changes)
    return soil_of(own, experiment.setup(config, own))


def test_spheres_have_the_rows_and_settings_that_they_always_had():
    config = study()
    assert config["shape"] is None
    assert config["material"] == {k: v for k, v in defaults(Study)["material"].items() if k not in ("shape", "aspect_ratio")}
    assert "shape" not in repose.setup(config, row(config))
    assert grains_of(config).shape is None
    plain = make_row("repose", "campaign", defaults(Study)["material"], math.nan, 1)
    assert plain == make_row("repose", "campaign", config["material"], math.nan, 1)
    assert as_printed(config | {"experiments": ["repose"]}) == ["repose"]


@pytest.mark.parametrize("experiment", EXPERIMENTS, ids=lambda experiment: experiment.NAME)
def test_a_preset_reaches_the_grains_of_every_experiment(experiment):
    config = study(shape="tetra")
    assert grains_of(config, experiment).shape == Clump.preset("tetra")
    assert "aspect_ratio" not in config["material"]
    assert as_printed(config | {"experiments": [experiment.NAME]}) == []


def test_the_aspect_ratio_of_dimers_is_a_number_of_the_material():
    assert grains_of(study(shape="dimer")).shape.spheres == Clump.preset("dimer").spheres
    config = study(shape="dimer", aspect_ratio=1.8)
    assert make_row("repose", "campaign", config["material"], math.nan, 1)["aspect_ratio"] == 1.8
    assert grains_of(config).shape == Clump.dimer(1.8)
    assert grains_of(config, aspect_ratio=1.2).shape == Clump.dimer(1.2)


def test_a_design_varies_the_aspect_ratio():
    config = study({"static_friction": [0.2, 1.0], "aspect_ratio": [1.1, 2.0]}, shape="dimer")
    config["design"] |= {"ranges": config["design"]["variables"], "points": [{"static_friction": 0.5, "aspect_ratio": 1.7}]}
    config["design"] |= {"variables": ["static_friction", "aspect_ratio"], "grid": {}, "sweep": {}, "sweep_couples": []}
    config["fidelity"]["check"]["couples"] = []
    rows = design_rows(config)
    assert {r["aspect_ratio"] for r in rows if r["purposes"] == "points"} == {1.7}
    some = next(r for r in simulations(config, rows).values() if r["aspect_ratio"] == 1.7)
    assert soil_of(some, config).shape == Clump.dimer(1.7)


def test_a_file_s_clump_is_part_of_the_settings_so_that_jobs_need_no_file(tmp_path):
    file = tmp_path / "grit.txt"
    file.write_text("# x y z r\n0 0 0 1.0\n0.9, 0, 0, 0.7\n0.5 0.8 0 0.5\n")
    config = study(shape=str(file))
    settings = repose.setup(config, row(config))
    assert settings["shape"]["name"] == "grit.txt"
    found, same = soil_of(row(config), settings).shape, Clump.read(file)
    file.unlink()
    for one, other in zip(found.spheres, same.spheres, strict=True):
        assert one == pytest.approx(other, abs=1e-8)
    assert found.moments == pytest.approx(same.moments, abs=1e-8)
    single = tmp_path / "one.txt"
    single.write_text("0 0 0 3\n")
    assert study(shape=str(single))["shape"] is None


@pytest.mark.parametrize(
    ("material", "variables", "message"),
    [
        ({"shape": "cube"}, None, "material.shape is cube; allowed: sphere, dimer, trimer, tetra, or a file with a line `x y z r`"),
        ({"aspect_ratio": 1.5}, None, "material.aspect_ratio is 1.5; allowed: null with material.shape sphere: only a dimer"),
        ({"shape": "tetra", "aspect_ratio": 1.5}, None, "aspect_ratio is 1.5; allowed: null with material.shape tetra"),
        ({}, {"aspect_ratio": [1.1, 2.0]}, "design.variables is .*aspect_ratio.*; allowed: others with material.shape sphere"),
    ],
)
def test_shapes_that_there_are_not_are_refused(material, variables, message):
    with pytest.raises(CalibrationError, match=message) as caught:
        study(variables, **material)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("0 0 0 1\n5 0 0 1\n", "material.shape: sphere 2 of clump .* is apart from sphere 1"),
        ("0 0 0 1\n0.2 0 0 0.5\n", "material.shape: sphere 2 of clump .* is inside sphere 1"),
        ("0 0 0 1\n1 0 0 0.04\n", "material.shape: largest over smallest radius .* is 25; allowed: at most 20"),
        ("0 0 0\n", r"material.shape: .*grit.txt, line 1 is '0 0 0'; allowed: four numbers x y z r"),
    ],
)
def test_files_that_make_no_clump_are_refused(tmp_path, text, message):
    file = tmp_path / "grit.txt"
    file.write_text(text)
    with pytest.raises(CalibrationError, match=message) as caught:
        study(shape=str(file))
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("ratio", [1.0, 2.5])
@pytest.mark.parametrize("place", ["material", "grid"])
def test_aspect_ratios_out_of_range_are_refused(ratio, place):
    config = defaults(Study)
    config["material"]["shape"] = "dimer"
    if place == "material":
        config["material"]["aspect_ratio"] = ratio
    else:
        config["design"]["grid"] = {"static_friction": [0.1, 0.5, 0.9], "aspect_ratio": [1.2, 1.6, ratio]}
    with pytest.raises(StudyError, match=f"aspect_ratio: {ratio} is (less|greater) than"):
        check_config(config)


def test_a_clump_longer_than_the_period_is_refused(tmp_path):
    file = tmp_path / "rod.txt"
    file.write_text("".join(f"{k} 0 0 1\n" for k in range(48)))
    config = study(shape=str(file))
    with pytest.raises(CalibrationError, match=r"plane_shear.width_ratio is .* mm long; allowed: more than"):
        plane_shear.setup(config, row(config, "plane_shear"))


def test_grains_of_clumps_are_stiff_enough_for_what_presses_on_their_spheres():
    spheres, dimers = grains_of(study()), grains_of(study(shape="dimer"))
    pressed = Clump.preset("dimer").smallest_ratio ** -2
    assert softening(spheres, 500.0, 2e4) / softening(dimers, 500.0, 2e4) == pytest.approx(pressed)
    limit = 5e7 / (1.0 - 0.2) / 1000.0  # stress at which E*/p is 1000
    check_stiffness(dimers, 0.99 * limit / pressed, None, "key")
    with pytest.raises(CalibrationError, match="shear_modulus_pa"):
        check_stiffness(dimers, 1.01 * limit / pressed, None, "key")


def test_a_simulation_of_clumps_costs_their_spheres():
    members = []
    for shape in ("sphere", "dimer", "tetra"):
        config = study(shape=shape)
        members.append((row(config), repose.setup(config, row(config))))
    assert [repose.cost(*member)[0] for member in members] == [3000, 6000, 12000]
    plain, dimers, tetras = (expected_s(*member) for member in members)
    assert 2.0 * 1.3 * plain < dimers < tetras  # and shorter steps
    assert dimers == pytest.approx(1.3 * math.prod(repose.cost(*members[1])) / SPEED_PER_S)
    assert memory_mb(members[2:], 1) - memory_mb(members[:1], 1) == pytest.approx(9000 * 2e-3, abs=1.0)


def test_clumps_turn_by_sliding_so_their_rolling_friction_always_counts():
    material = {**defaults(Study)["material"], "static_friction": 0.1, "rolling_friction": 0.3}
    spheres, clumps = (study(shape=shape) for shape in ("sphere", "tetra"))
    assert repose.canonical(material, spheres)["rolling_friction"] == 0.2
    assert repose.canonical(material, clumps)["rolling_friction"] == 0.3


def test_the_screening_leaves_out_a_rolling_friction_that_clumps_have_not():
    rolling = "rolling_friction"
    assert rolling not in screened_factors(study(shape="dimer", rolling_friction=0.0))
    assert rolling in screened_factors(study(shape="dimer"))
    assert rolling in screened_factors(study(rolling_friction=0.0))  # refused, as it always was
    assert numbers({"shape": "dimer", "a": None}) == {"aspect_ratio": 1.5}


def test_stored_grains_know_their_clumps(monkeypatch):
    monkeypatch.setattr("dem.compiled.ensure", lambda *_, **__: None)
    config = study(shape="tetra")
    settings = repose.setup(config, row(config))
    setup = angle_of_repose.Setup(**settings["setup"])
    soil = soil_of(row(config), settings)
    table = pd.DataFrame(grain_table(angle_of_repose.build(soil, setup, engine_of(settings), 1).grains, "s", soil))
    assert len(table) == 4 * 3000
    assert table["clump"].nunique() == 3000
    assert grain_radii_m(table) == pytest.approx(50e-6)
    assert set(empty_grains(clumps=True)) == set(table)
    run = {"status": "static", "n_particles": 3000}
    lattice = measured(run, table, {"estimator": "profile"})  # a loose column, not a heap
    spheres = measured(run, table.drop(columns=["clump", "clump_radius_m"]), {"estimator": "profile"})
    assert lattice["heap_height_m"] == pytest.approx(spheres["heap_height_m"], rel=0.2)
    assert lattice["angle_profile_deg"] != spheres["angle_profile_deg"]  # in diameters of grains, not of spheres


def test_a_strength_line_keeps_the_aspect_ratio_of_its_grains():
    tests = [{**row(study(shape="dimer", aspect_ratio=1.3)), "point_id": "p", "purposes": "points", "normal_stress_pa": p,
              "shear": 0.5 * p} for p in (100.0, 200.0, 400.0)]  # fmt: skip
    (line,) = strength_table(pd.DataFrame(tests), ("shear", "normal_stress_pa")).to_dict("records")
    assert line["aspect_ratio"] == 1.3


def test_the_report_says_that_grains_are_clumps():
    for shape, words in (("sphere", "Equal spheres"), ("tetra", r"rigid unions of spheres \(tetra\)")):
        said = checks.assumptions(SimpleNamespace(config=study(shape=shape), as_printed=[]))
        assert len([line for line in said if re.search(words, line)]) == 1


# --- mixes ----------------------------------------------------------------------------------------------------------

MIX = [{"shape": "sphere", "share": 3}, {"shape": "dimer", "share": 1}]


def test_a_mix_has_its_shapes_and_shares_in_the_settings():
    config = study(shape=MIX)
    kinds = [{"share": 0.75, "name": "sphere"}, {"share": 0.25, "name": "dimer"}]
    assert config["shape"] == {"name": "mix by number: 0.75 sphere, 0.25 dimer", "mix": kinds}
    assert config["shape"] == study(shape=[{"shape": "sphere", "share": 0.75}, {"shape": "dimer", "share": 0.25}])["shape"]
    assert json.loads(json.dumps(config["shape"])) == config["shape"]


@pytest.mark.parametrize("experiment", EXPERIMENTS, ids=lambda experiment: experiment.NAME)
def test_a_mix_reaches_the_grains_of_every_experiment(experiment):
    config = study(shape=MIX)
    mix = grains_of(config, experiment).shape
    assert [shape.n_spheres for shape in mix.shapes] == [1, 2]
    assert mix.fractions.tolist() == [0.75, 0.25]
    n_spheres, steps = experiment.cost(row(config, experiment.NAME), experiment.setup(config, row(config, experiment.NAME)))
    assert n_spheres > 0.0 < steps
    assert as_printed(config | {"experiments": [experiment.NAME]}) == []


def test_the_aspect_ratio_of_a_mix_is_that_of_its_dimers():
    mix = grains_of(study(shape=MIX, aspect_ratio=1.8), aspect_ratio=1.2).shape
    assert mix == Mix((Clump.preset("sphere"), Clump.dimer(1.2)), (0.75, 0.25))
    assert study(shape=MIX)["material"]["aspect_ratio"] == 1.5
    assert "aspect_ratio" not in study(shape=[{"shape": "sphere", "share": 1}, {"shape": "tetra", "share": 1}])["material"]


def test_a_mix_of_one_shape_is_that_shape_and_of_spheres_is_spheres():
    nothing = {"shape": "tetra", "share": 0}
    assert study(shape=[{"shape": "dimer", "share": 0.2}, nothing])["shape"] == study(shape="dimer")["shape"]
    assert study(shape=[{"shape": "sphere", "share": 2}, nothing])["shape"] is None
    assert study(shape=[{"shape": "sphere", "share": 2}, {"shape": "sphere", "share": 1}])["shape"] is None


def test_a_file_of_a_mix_is_part_of_the_settings(tmp_path):
    file = tmp_path / "grit.txt"
    file.write_text("0 0 0 1.0\n0.9 0 0 0.7\n")
    config = study(shape=[{"shape": str(file), "share": 1}, {"shape": "tetra", "share": 1}])
    file.unlink()
    assert config["shape"]["name"] == "mix by number: 0.5 grit.txt, 0.5 tetra"
    assert [shape.n_spheres for shape in grains_of(config).shape.shapes] == [2, 4]


def test_a_simulation_of_a_mix_costs_its_spheres():
    config = study(shape=MIX)
    member = (row(config), repose.setup(config, row(config)))
    assert repose.cost(*member)[0] == pytest.approx(1.25 * 3000)
    assert expected_s(*member) == pytest.approx(1.3 * math.prod(repose.cost(*member)) / SPEED_PER_S)


def test_stored_grains_of_a_mix_know_their_clumps(monkeypatch):
    monkeypatch.setattr("dem.compiled.ensure", lambda *_, **__: None)
    config = study(shape=MIX)
    settings = repose.setup(config, row(config))
    setup, soil = angle_of_repose.Setup(**settings["setup"]), soil_of(row(config), settings)
    table = pd.DataFrame(grain_table(angle_of_repose.build(soil, setup, engine_of(settings), 1).grains, "s", soil))
    assert table.groupby("clump").size().value_counts().to_dict() == {1: 2250, 2: 750}
    assert grain_radii_m(table) == pytest.approx(np.full(3000, 50e-6))
    spheres = table.groupby("clump").filter(lambda own: len(own) == 1)
    assert spheres["radius_m"].to_numpy() == pytest.approx(50e-6)


@pytest.mark.parametrize(
    ("shape", "message"),
    [
        ([], r"material.shape is \[\]; allowed: a shape, or a list of {shape, share}"),
        (
            [{"shape": "sphere", "share": 0}, {"shape": "dimer", "share": 0.0}],
            "sum of the shares in material.shape is 0; allowed: a pos",
        ),
        (
            [{"shape": "sphere", "share": 1}, {"shape": "dimer", "share": -0.5}],
            r"material.shape.1.share is -0.5; allowed: a number, zero",
        ),
        ([{"shape": "sphere", "share": math.inf}], "material.shape.0.share is inf; allowed: a number"),
        ([{"shape": "sphere", "share": math.nan}], "material.shape.0.share is nan; allowed: a number"),
        ([{"shape": "sphere", "share": 1}, {"shape": "cube", "share": 1}], "material.shape.1.shape is cube; allowed: sphere"),
    ],
)
def test_mixes_that_there_are_not_are_refused(shape, message):
    with pytest.raises(CalibrationError, match=message) as caught:
        study(shape=shape)
    assert "\n" not in str(caught.value)


def test_a_mix_of_too_different_spheres_is_refused(tmp_path):
    file = tmp_path / "rod.txt"
    file.write_text("".join(f"{k} 0 0 1\n" for k in range(60)) + "".join(f"{k} 0.9 0 0.11\n" for k in range(60)))
    with pytest.raises(CalibrationError, match="material.shape: largest over smallest radius of a mix is .*; allowed: at most 20"):
        study(shape=[{"shape": "sphere", "share": 1}, {"shape": str(file), "share": 1}])


def test_an_aspect_ratio_without_dimers_in_a_mix_is_refused():
    mix = [{"shape": "sphere", "share": 1}, {"shape": "tetra", "share": 1}]
    with pytest.raises(
        CalibrationError, match="aspect_ratio is 1.5; allowed: null with material.shape sphere, tetra: only a dimer"
    ):
        study(shape=mix, aspect_ratio=1.5)


@pytest.mark.parametrize(
    ("shape", "message"),
    [
        ([], r"material.shape: \[\] should be non-empty"),
        ([{"shape": "sphere"}], "material.shape.0: 'share' is a required property"),
        (
            [{"shape": "sphere", "share": -1}],
            "material.shape.0.share: -1 is less than the minimum of 0. It means: share of this shape",
        ),
        ([{"shape": "sphere", "share": 1, "radius_m": 1}], "material.shape.0: unknown key 'radius_m'; allowed: shape, share"),
        (["sphere"], "material.shape.0: 'sphere' is not of type 'object'. It means: a shape and its share, {shape: dimer"),
        (3, "material.shape: 3 is not of type 'string', 'array'"),
    ],
)
def test_entries_of_a_mix_are_checked_by_the_schema(shape, message):
    config = defaults(Study)
    config["material"]["shape"] = shape
    with pytest.raises(StudyError, match=message):
        check_config(config)


def test_the_report_says_the_shares_of_a_mix():
    said = checks.assumptions(SimpleNamespace(config=study(shape=MIX), as_printed=[]))
    assert any("(mix by number: 0.75 sphere, 0.25 dimer)" in line for line in said)
