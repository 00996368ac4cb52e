"""A setting stands once, and every setting has an effect."""

import copy
import json
import re
from functools import reduce
from importlib import import_module
from operator import getitem
from pathlib import Path
from types import SimpleNamespace

import pytest
import yaml
from snakemake.api import SnakemakeApi
from snakemake.settings.types import ConfigSettings, ResourceSettings

import compile_kernels
from virtual_soil.campaign import generate, settings, yamls
from virtual_soil.campaign.code import ROOT
from virtual_soil.campaign.experiments import MODULES, module_of
from virtual_soil.campaign.experiments.registry import EXPERIMENTS, REDUCED
from virtual_soil.campaign.sections import Study
from virtual_soil.campaign.study import StudyError, check_config, check_files, design_rows, experiment_settings, simulations

#: A point within the design.
MIDDLE = {"radius_m": 50e-6, "static_friction": 0.3, "rolling_friction": 0.1}
#: Another valid value of what can be changed neither by a factor nor in an obvious other way.
OTHERS = {
    "study": "another",
    "design.variables": None,  # follows grid and sweep, which are changed themselves
    "design.n_points": None,  # of designs without a grid, see test_study
    "design.points_csv": None,
    "soils": ["lunar_regolith", "silica_barco_sand"],
    "optimise.cases": [{"case": "a", "soil": "lunar_regolith", "weights": {"angle_of_repose": 1.0}}],
    "twins": {
        "t": {
            **MIDDLE,
            "repose_seeds": [9],
            "shear_seeds": [9],
            "plane_shear_seeds": [9],
            "slope_seeds": [9],
            "draw_down_seeds": [9],
            "rotating_drum_seeds": [9],
        }
    },
    **{f"{name}.normal_stress_ratios": [100.0, 200.0, 400.0] for name in ("shear", "plane_shear")},
    "shear_test.normal_stresses_pa": [2e3, 4e3, 8e3],
    "shear.normal_stresses_pa": [200.0, 400.0, 800.0],
    "plane_shear.normal_stresses_pa": [200.0, 400.0, 800.0],
    "shear.curve_range_m": [0.0, 1e-3],
    "fidelity.check.couples": [{"static_friction": 0.5, "rolling_friction": 0.2}],
    # go together with others: see test_apparatus and test_grading
    **{f"repose_test.{key}": None for key in ("tube_diameter_m", "fill_height_m", "fill_mass_kg", "plate_width_m")},
    **{f"shear_test.{key}_m": None for key in ("length", "height", "width", "displacement")},
    "slope_test.height_m": None,
    **{f"draw_down_test.{key}_m": None for key in ("box_length", "slot_width", "fill_height", "thickness")},
    **{f"drum_test.{key}": None for key in ("diameter_m", "rate_rpm", "thickness_m")},
    "drum_test.froude_number": 0.05,
    **{f"grading.{key}": None for key in ("sieve_diameters_m", "sieve_passing")},
    "shear.stresses": None,  # see test_study: the fixed ones are too small for boxes of large grains
    "design.geometry": None,  # see the test of its own: 3000 grains of 500 um do not fit into the tube of 50 um
    "material.shape": "tetra",
    "material.aspect_ratio": None,  # of dimers only, see test_shapes
    "insist": None,  # no result depends on it
    "wheel.cases": ["sand"],
    "wheel.mesh.file": "wheel.stl",
    "wheel.bed.bulk_density_kg_m3": 1400.0,
    "plate.measured.compared_m": [0.01, 0.03],
    **{f"{tool}.measured.file": "tests.csv" for tool in ("wheel", "plate")},
    **{f"{tool}.measured.source": "a laboratory" for tool in ("wheel", "plate")},
    "wheel_check.normal_stresses_pa": [2e3, 4e3, 8e3],
    "bulk.packings": "elsewhere",
    "bulk.impact_grains": [50_000],
    "experiments": None,  # see the test of its own: soils and weights go with them
    "screening.response": None,  # a response of another experiment has no base runs in this study
}


@pytest.mark.parametrize("path", generate.FILES)
def test_generated_files_are_those_of_the_settings(path):
    """`make settings` writes them."""
    assert (ROOT / path).read_text(encoding="utf-8") == generate.FILES[path](), f"{path} is not what its classes say: make settings"


def test_the_default_configuration_is_the_classes_defaults():
    assert yaml.safe_load((ROOT / "config/config.yaml").read_text()) == settings.defaults(Study)


@pytest.mark.parametrize("experiment", EXPERIMENTS, ids=lambda experiment: experiment.NAME)
def test_every_experiment_has_the_declared_names(experiment):
    for part, names in MODULES.items():
        if part == "laboratory" and experiment.LABORATORY is None:
            continue
        module = import_module(module_of(experiment.NAME, part))
        assert not [name for name in names if not hasattr(module, name)], (experiment.NAME, part)


def other(value, rules):
    """Another value that the rules allow."""
    if "enum" in rules:
        return next((choice for choice in rules["enum"] if choice != value), None)
    if isinstance(value, bool):
        return not value
    if isinstance(value, int):
        return value + 1
    if isinstance(value, float):
        return value * (1.05 if value >= 1.0 else 0.95) if value else 0.1
    if value is None:
        return 0.5
    if isinstance(value, list) and value and isinstance(value[0], int | float):
        return [*value, value[-1] + 1 if isinstance(value[-1], int) else 0.95 * value[-1]]
    if isinstance(value, list):
        return value[:1]
    name = next(iter(value))
    return {**value, name: other(value[name], {})}


def complete():
    """The default study with all experiments."""
    return settings.defaults(Study) | {"experiments": [experiment.NAME for experiment in reversed(EXPERIMENTS)]}


def changed(key):
    """The complete study with another value of one key; None if there is none."""
    config = complete()
    target, (*parents, last) = config, key.split(".")
    for parent in parents:
        target = target[parent]
    kinds = {name: (field, kind) for name, field, kind in settings.leaves(Study)}
    value = OTHERS[key] if key in OTHERS else other(target[last], settings.schema_of(*kinds[key]))
    if value is None:
        return None
    target[last] = value
    return config


def identities(config):
    """All that identifies the simulations of a study, as text."""
    rows = simulations(config, design_rows(config))
    return json.dumps([[row, experiment_settings(config, row)] for row in rows.values()], sort_keys=True)


def parameters(config, monkeypatch):
    """Files, parameters and resources of all rules of a study, as text."""
    monkeypatch.chdir(ROOT)
    with SnakemakeApi() as api:
        workflow = api.workflow(
            resource_settings=ResourceSettings(cores=1),
            config_settings=ConfigSettings(config=copy.deepcopy(config)),
            snakefile=Path("Snakefile"),
        )._workflow
        tests = [SimpleNamespace(experiment=test.NAME, reduced=table, round="1", soil="", case="", stage="", batch="")
                 for test in EXPERIMENTS for table in REDUCED]  # fmt: skip
        return "\n".join(map(str, (of_rule(rule, tests) for rule in workflow.rules)))


#: Parameters that hand over sections whole, whether they are used or not: they prove nothing.
WHOLE = {
    ("report", "config"),
    ("export", "config"),
    ("refinement_design", "study"),
    ("verification_design", "study"),
    ("compile_kernels", "settings"),
    ("compile_wheel_kernels", "settings"),
}


def of_rule(rule, tests):
    files = [str(path) for path in (*rule.input, *rule.output) if not callable(path)]
    found = [rule.name, files, {k: v for k, v in rule.resources.items() if not callable(v)}]
    for name, value in rule.params.items():
        if (rule.name, name) in WHOLE:
            continue
        if not callable(value):
            found.append((name, value))
        elif name == "settings":
            found += [(name, value(wildcards)) for wildcards in tests if rule.name != "animate"]
    return found


KEYS = [name for name, *_ in settings.leaves(Study)]


def test_every_setting_changes_a_simulation_or_a_rule(monkeypatch):
    plain = complete()
    same_simulations, same_rules = identities(plain), parameters(plain, monkeypatch)
    without_effect = []
    for key in KEYS:
        config = changed(key)
        if config is None or key == "batch_minutes":  # shares simulations out among jobs: see test_batches
            continue
        check_config(config)
        if identities(config) == same_simulations and parameters(config, monkeypatch) == same_rules:
            without_effect.append(key)
    assert without_effect == []


def test_a_study_has_the_simulations_of_its_experiments():
    config = complete()
    assert {row["experiment"] for row in design_rows(config)} == set(config["experiments"])
    few = config | {"experiments": ["repose", "plane_shear"]}
    assert {row["experiment"] for row in design_rows(few)} == set(few["experiments"])


def test_the_geometry_is_of_the_simulations_identity():
    config = settings.defaults(Study)
    config["design"]["sweep"] = {"radius_m": [40e-6, 50e-6, 60e-6]}
    fixed = copy.deepcopy(config)
    fixed["design"]["geometry"] = "fixed"
    assert identities(config) != identities(fixed)


@pytest.mark.parametrize(
    ("text", "written"),
    [
        ("50e3", "50000 or 50.0e+3"),
        ("1e3", "1000 or 1.0e+3"),
        ("1.5e-3", None),
        ("1e-4", "0.0001 or 1.0e-4"),
        ("2.E5", "200000 or 2.e+5"),
    ],
)
def test_a_number_that_yaml_takes_for_a_text_is_refused_with_how_to_write_it(text, written):
    config = settings.defaults(Study)
    config["plane_shear"]["normal_stresses_pa"] = [yaml.safe_load(text), 1e5, 2e5]
    if written is None:
        assert yaml.safe_load(text) == 1.5e-3
        return
    with pytest.raises(StudyError, match=re.escape(f"is not of type 'number' (YAML reads this as a text; write {written}).")):
        check_config(config)
    assert yaml.safe_load(written.split(" or ")[1]) == float(text)


def numbers(value, path=()):
    """Paths of all numbers in a configuration, and of what may be one."""
    if isinstance(value, dict | list):
        items = value.items() if isinstance(value, dict) else enumerate(value)
        for key, inner in items:
            yield from numbers(inner, (*path, key))
    elif value is None or (isinstance(value, int | float) and not isinstance(value, bool)):
        yield path


def test_no_number_of_a_study_may_be_a_text():
    config = settings.defaults(Study)
    texts = {("design", "points_csv"), ("wheel", "mesh", "file")}  # or null
    texts |= {(tool, "measured", key) for tool in ("wheel", "plate") for key in ("file", "source")}
    found = [path for path in numbers(config) if path not in texts]
    assert len(found) > 150
    for path in found:
        changed = copy.deepcopy(config)
        reduce(getitem, path[:-1], changed)[path[-1]] = yamls.load("1e3")
        with pytest.raises(StudyError, match=r"YAML reads this as a text; write 1000 or 1\.0e\+3"):
            check_config(changed)


@pytest.mark.parametrize("text", ["study: a\nstudy: b\n", "material:\n  radius_m: 1\n  radius_m: 2\n"])
def test_a_key_that_is_given_twice_is_refused(text, tmp_path):
    path = tmp_path / "study.yaml"
    path.write_text(text)
    with pytest.raises(StudyError, match=r"study.yaml: not a sound YAML file \(the key '\w+' is given twice, again in line \d\)"):
        check_files([path])


@pytest.mark.parametrize(
    ("key", "value", "message"),
    [
        ("material.radius_m", 50.0, "material.radius_m: 50 is unusual; usual: 1e-06 to 0.1, in the unit of the name"),
        ("material.shear_modulus_pa", 50.0, "material.shear_modulus_pa: 50 is unusual; usual: 10000 to 1e+12"),
        ("material.density_kg_m3", 3.0, "material.density_kg_m3: 3 is unusual; usual: 100 to 25000"),
        ("design.sweep", {"radius_m": [25.0, 50.0, 100.0]}, "design.sweep.radius_m: 25 is unusual"),
        ("shear.normal_stresses_pa", [0.05, 0.1, 0.2], "shear.normal_stresses_pa: 0.05 is unusual; usual: 1 to 5e+06"),
    ],
)
def test_numbers_that_are_wrong_by_magnitudes_are_refused_unless_insisted_on(key, value, message):
    config = settings.defaults(Study)
    *parents, last = key.split(".")
    reduce(getitem, parents, config)[last] = value
    with pytest.raises(StudyError, match=re.escape(message)) as refused:
        check_config(config)
    named = re.findall(r"insist: \[(.+?)\]", str(refused.value))
    assert named
    check_config(config | {"insist": named})


@pytest.mark.parametrize(("clumps", "variants"), [(False, {False}), (True, {False, True})])
@pytest.mark.parametrize("turning", [False, True])
def test_kernels_are_compiled_for_clumps_and_for_bodies_that_turn_where_a_study_has_them(
    monkeypatch, tmp_path, clumps, variants, turning
):
    """Those without are needed, too: a simulation is set up before its clumps are added."""
    asked = []
    monkeypatch.setattr("dem.compiled.ensure", lambda **chosen: asked.append(chosen))
    engine = complete()["engine"] | {"energy_ledger": True}
    compile_kernels.main(engine, ["none", "constant"], clumps, turning, str(tmp_path / "kernels.txt"))
    wanted = {(law, variant, turns) for law in ("none", "constant") for variant in variants for turns in {False, turning}}
    assert {(chosen["adhesion"], chosen["clumps"], chosen.get("turning", False)) for chosen in asked} == wanted
    # the ledger does not book bodies that turn
    assert all(chosen["energy_ledger"] != chosen.get("turning", False) for chosen in asked)
