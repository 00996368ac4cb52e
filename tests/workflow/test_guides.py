"""What the guides print is true: studies are valid, the soil is understood, targets of make and linked files exist."""

import importlib.util
import json
import re
import shutil
import sys
from textwrap import dedent
from types import SimpleNamespace

import pytest
import yaml
from campaign import copy_project, snakemake
from snakemake.utils import update_config

from virtual_soil.campaign.soils import measure_soil
from virtual_soil.campaign.study import ROOT, check_config, design_rows, experiment_settings

PAGES = sorted([ROOT / "README.md", ROOT / "CONTRIBUTING.md", *(ROOT / "config").glob("*.md"), *(ROOT / "docs").rglob("*.md")])
GUIDES = [path for path in PAGES if path.parent.name == "guides"]


def blocks(path):
    """The indented blocks of a page, without their indentation."""
    found = re.findall(r"(?:^(?: {4}.*)?\n)+", path.read_text(), flags=re.MULTILINE)
    return [dedent(block).strip() for block in found if block.strip()]


def studies():
    """(guide, its study as printed, without the commands that may follow) of all guides that print one."""
    for path in GUIDES:
        for block in blocks(path):
            if re.search("^study:", block, flags=re.MULTILINE):
                yield path.stem, yaml.safe_load(re.sub(r"^(\.venv/bin/|make ).*", "", block, flags=re.MULTILINE))


def test_there_are_studies_to_look_at():
    assert {name for name, _ in studies()} >= {"change-the-design", "lunar-gravity", "own-soil"}


@pytest.mark.parametrize(("name", "study"), list(studies()))
def test_a_printed_study_is_valid_and_simulates_something(name, study):
    config = yaml.safe_load((ROOT / "config/config.yaml").read_text())
    update_config(config, study)
    check_config(config)
    assert config["study"] == study["study"]
    assert len(design_rows(config)) > 100


def test_the_printed_soil_file_is_understood_with_the_example_data(tmp_path):
    (soil,) = [block for block in blocks(ROOT / "docs/guides/own-soil.md") if "angle_of_repose_deg:" in block]
    (tmp_path / "my_sand.yaml").write_text(soil)
    shutil.copy(ROOT / "config/soils/example/shear_box.csv", tmp_path / "my_sand.csv")
    assert set(measure_soil(tmp_path / "my_sand.yaml")["property"]) == {"cohesion", "friction_angle", "angle_of_repose"}


@pytest.mark.parametrize("path", PAGES, ids=lambda path: path.relative_to(ROOT).as_posix())
def test_targets_and_links_exist(path):
    text = path.read_text()
    targets = set(re.findall(r"^([a-z-]+):", (ROOT / "Makefile").read_text(), flags=re.MULTILINE))
    used = re.findall(r"(?:^    |`)make ([a-z-]+)", text, flags=re.MULTILINE)
    assert set(used) <= targets
    links = [link for link in re.findall(r"\]\(([^)#]+)(?:#[^)]*)?\)", text) if "://" not in link]
    missing = [link for link in links if not (path.parent / link).exists()]
    assert not missing
    scripts = re.findall(r"\.venv/bin/python ([\w./-]+\.py)", text)
    assert all((ROOT / script).is_file() for script in scripts)


def printed(page, beginning):
    """The block of a guide that begins so."""
    (block,) = [block for block in blocks(ROOT / "docs/guides" / page) if block.startswith(beginning)]
    return block + "\n"


def test_the_printed_experiment_is_planned(tmp_path):
    project = copy_project(tmp_path)
    (project / "src").unlink()
    shutil.copytree(ROOT / "src", project / "src")
    shutil.copy(ROOT / "docs/examples/loose_density.py", project / "src/dem/experiments")
    (project / "workflow/rules/density.smk").write_text(printed("add-an-experiment.md", "# Loose bulk density"))
    (project / "workflow/scripts/simulate_density.py").write_text(
        printed("add-an-experiment.md", '"""Adapt rule `simulate_density`')
    )
    with open(project / "Snakefile", "a") as file:
        file.write('include: "workflow/rules/density.smk"\n')
    planned = snakemake(project, "-n", "densities")
    assert planned.returncode == 0, planned.stderr
    assert re.search(r"^simulate_density +[1-9]", planned.stdout, flags=re.MULTILINE)


def test_the_printed_experiment_gives_a_result_or_a_reason(tmp_path, monkeypatch):
    spec = importlib.util.spec_from_file_location("dem.experiments.loose_density", ROOT / "docs/examples/loose_density.py")
    experiment = importlib.util.module_from_spec(spec)
    monkeypatch.setitem(sys.modules, spec.name, experiment)
    monkeypatch.setattr("dem.experiments.loose_density", experiment, raising=False)
    spec.loader.exec_module(experiment)
    script = tmp_path / "simulate_density.py"
    script.write_text(printed("add-an-experiment.md", '"""Adapt rule'))
    spec = importlib.util.spec_from_file_location("simulate_density", script)
    adapter = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(adapter)
    config = yaml.safe_load((ROOT / "config/config.yaml").read_text())
    row = next(row for row in design_rows(config) if row["experiment"] == "repose")
    output = SimpleNamespace(run=tmp_path / "run.json")
    adapter.main(row, experiment_settings(config, row), "engine", output)
    assert 0.4 < json.loads(output.run.read_text())["solid_fraction"] < 0.66
    small = experiment.Setup(n_particles=10, tube_radius_ratio=12.0, scale_radius_m=row["radius_m"])
    monkeypatch.setattr(experiment, "Setup", lambda **_: small)
    adapter.main(row, experiment_settings(config, row), "engine", output)
    found = json.loads(output.run.read_text())
    assert "there is no core" in found["reason"]
    assert list(found["provenance"]["simulations"]) == [row["simulation_id"]]
