"""The whole workflow, end to end, on the smoke study, and what is run again after each kind of change."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pandas as pd
import pytest
import yaml

ROOT = Path(__file__).parents[2]
SNAKEMAKE = [sys.executable, "-m", "snakemake", "--configfile", "config/smoke.yaml"]


def copy_project(target: Path) -> Path:
    """A copy of what the workflow needs, so that tests may edit it."""
    for name in ("config", "workflow", "src", "profiles"):
        shutil.copytree(ROOT / name, target / name, ignore=shutil.ignore_patterns("__pycache__", "*.egg-info"))
    shutil.copy(ROOT / "Snakefile", target)
    return target


def snakemake(project: Path, *arguments: str) -> subprocess.CompletedProcess:
    """Run snakemake in a project with the project's own sources."""
    environment = os.environ | {"PYTHONPATH": str(project / "src")}
    return subprocess.run([*SNAKEMAKE, *arguments], cwd=project, env=environment, capture_output=True, text=True, check=False)


def planned(project: Path) -> dict[str, int]:
    """Rule -> number of jobs that a dry run wants to run."""
    result = snakemake(project, "-n", "all")
    text = result.stdout + result.stderr
    assert result.returncode == 0, text
    if "Nothing to be done" in text:
        return {}
    table = text.split("Job stats:")[1].split("total")[0]
    return {name: int(count) for name, count in re.findall(r"^(\w+)\s+(\d+)$", table, flags=re.MULTILINE)}


@pytest.fixture(scope="session")
def finished(tmp_path_factory):
    """A finished smoke campaign."""
    project = copy_project(tmp_path_factory.mktemp("campaign"))
    result = snakemake(project, "-c2", "all")
    assert result.returncode == 0, result.stdout[-5000:] + result.stderr[-5000:]
    return project


@pytest.fixture
def project(finished, tmp_path):
    """A copy of the finished campaign to edit; file times are kept."""
    return Path(shutil.copytree(finished, tmp_path / "project"))


def edit(path: Path, old: str, new: str) -> None:
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new, 1))


def set_config(project: Path, path: str, value) -> None:
    """Set a key of the smoke configuration."""
    file = project / "config" / "smoke.yaml"
    config = yaml.safe_load(file.read_text())
    *parents, last = path.split(".")
    target = config
    for key in parents:
        target = target.setdefault(key, {})
    target[last] = value
    file.write_text(yaml.safe_dump(config, sort_keys=False))


def test_a_finished_campaign_has_every_table_and_nothing_left_to_do(finished):
    results = finished / "results" / "smoke"
    for name in ("design", "repose", "shear", "strength", "screening", "calibration", "acceleration", "reachability"):
        assert len(pd.read_parquet(results / f"{name}.parquet")) > 0, name
    assert (results / "surrogates.json").stat().st_size > 0
    assert "</html>" in (results / "report.html").read_text()
    assert planned(finished) == {}


def test_the_smoke_campaign_behaves_like_soil(finished):
    results = finished / "results" / "smoke"
    assert set(pd.read_parquet(results / "shear.parquet")["status"]) == {"done"}
    repose = pd.read_parquet(results / "repose.parquet")
    assert "failed" not in set(repose["status"])
    grid = repose[repose["purposes"].str.contains("grid")]
    mean = grid.groupby("rolling_friction")["angle_of_repose_deg"].mean()
    assert mean[0.2] > mean[0.05]
    strength = pd.read_parquet(results / "strength.parquet")
    assert strength["friction_angle_deg"].between(10, 70).all()


def test_a_repeated_simulation_gives_the_same_bytes(project):
    results = project / "results" / "smoke"
    run = next((results / "sims" / "shear").iterdir())
    before = {path.name: path.read_bytes() for path in run.glob("*.parquet")}
    result = snakemake(
        project, "-c1", "--forcerun", "simulate_shear", "--until", "simulate_shear", str(run.relative_to(project) / "run.parquet")
    )
    assert result.returncode == 0, result.stderr[-3000:]
    assert {path.name: path.read_bytes() for path in run.glob("*.parquet")} == before


def test_a_comment_or_docstring_in_the_engine_runs_nothing_again(project):
    edit(project / "src/dem/motion.py", '"""Moving the grains by one step', '# a comment\n"""How grains move in one step')
    assert planned(project) == {}


def test_a_change_of_physics_runs_all_simulations_again(project):
    edit(project / "src/dem/motion.py", "twist = 2.5 * kick", "twist = 2.4 * kick")
    jobs = planned(project)
    design = pd.read_parquet(project / "results/smoke/design.parquet")
    assert jobs["simulate_repose"] == (design["experiment"] == "repose").sum()
    assert jobs["simulate_shear"] == (design["experiment"] == "shear").sum()


def test_a_changed_estimator_measures_again_but_simulates_nothing(project):
    edit(project / "src/dem/measure/heap.py", "import numpy as np", "import numpy as np\n\nUNUSED = 1")
    jobs = planned(project)
    assert {"measure_repose", "measure_shear"} <= set(jobs)
    assert not {"simulate_repose", "simulate_shear", "compile_kernels"} & set(jobs)


AFTER_FIT = {"fit_surrogates", "calibrate", "report", "all"}


@pytest.mark.parametrize(
    ("path", "value", "rules"),
    [
        ("repose.estimator", "silhouette", {"measure_repose", "screening", "check_acceleration", "reachability", *AFTER_FIT}),
        ("shear.strength", "peak", {"strength", "reachability", *AFTER_FIT}),
        ("surrogate.angle_of_repose.g", "quadratic", AFTER_FIT),
        ("optimise.n_starts", 4, {"calibrate", "report", "all"}),
    ],
)
def test_a_changed_choice_is_run_again_from_there_only(project, path, value, rules):
    set_config(project, path, value)
    assert set(planned(project)) == rules


def test_a_changed_target_is_run_again_from_there_only(project):
    edit(project / "config/soils/silica_barco_sand.yaml", "value: 30.0", "value: 31.0")
    assert set(planned(project)) == {"measure_soils", "calibrate", "reachability", "report", "all"}


@pytest.mark.parametrize(
    ("path", "value", "new_repose", "new_shear"),
    [
        ("shear.normal_stresses_pa", [250.0, 500.0, 1000.0, 2000.0], 0, 12),
        ("design.shear_seeds", [1, 2], 0, 36),
        ("design.repose_seeds", [1, 7], 12, 0),
        ("design.grid.rolling_friction", [0.05, 0.1, 0.2, 0.3], 3, 9),
    ],
)
def test_an_addition_adds_only_its_own_simulations(project, path, value, new_repose, new_shear):
    set_config(project, path, value)
    jobs = planned(project)
    assert (jobs.get("simulate_repose", 0), jobs.get("simulate_shear", 0)) == (new_repose, new_shear)


@pytest.mark.parametrize(
    ("path", "value", "message"),
    [
        ("repose.n_grains", 100, "repose: unknown key 'n_grains'; allowed: "),
        ("material.poisson_ratio", 0.7, "material.poisson_ratio: 0.7 is greater than or equal to the maximum of 0.5"),
        ("shear.strength", "strongest", "shear.strength: 'strongest' is not one of ['peak', 'plateau']"),
        (
            "soils",
            ["green_cheese"],
            "there is no config/soils/green_cheese.yaml; existing soils: lunar_regolith, silica_barco_sand",
        ),
        ("design.variables", ["radius_m"], "design.variables is ['radius_m']; allowed"),
        ("study", "../elsewhere", "study: '../elsewhere' does not match"),
    ],
)
def test_a_bad_configuration_is_refused_before_anything_runs(tmp_path, path, value, message):
    project = copy_project(tmp_path)
    set_config(project, path, value)
    result = snakemake(project, "-n", "all")
    assert result.returncode != 0
    assert message in result.stdout + result.stderr
    assert not (project / "results").exists()


def test_the_linter_has_only_the_hints_that_contributing_explains():
    result = snakemake(ROOT, "--lint")
    hints = set(re.findall(r"^    \* (.*):$", result.stderr + result.stdout, flags=re.MULTILINE))
    explained = {"Mixed rules and functions in same snakefile.", "Specify a conda environment or container for each rule."}
    assert hints <= explained
    for hint in hints:
        assert hint.rstrip(".") in (ROOT / "CONTRIBUTING.md").read_text().replace("\n", " ")
