"""What the guides print is true: studies are valid, the soil is understood, targets of make and linked files exist."""

import re
import shutil
from textwrap import dedent

import pytest
import yaml
from snakemake.utils import update_config

from virtual_soil.campaign.apparatus import with_gravity
from virtual_soil.campaign.code import ROOT
from virtual_soil.campaign.soils import measure_soil
from virtual_soil.campaign.study import check_config, design_rows
from virtual_soil.campaign.variables import normal_form, with_walls

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
    config["engine"] = with_gravity(config["engine"])
    config["material"] = with_walls(config)
    config["design"] = normal_form(config)
    assert config["study"] == study["study"]
    assert len(design_rows(config)) > 100


def test_the_printed_soil_file_is_understood_with_the_example_data(tmp_path):
    (soil,) = [block for block in blocks(ROOT / "docs/guides/own-soil.md") if "angle_of_repose_deg:" in block]
    (tmp_path / "my_sand.yaml").write_text(soil)
    shutil.copy(ROOT / "config/soils/example/shear_box.csv", tmp_path / "my_sand.csv")
    assert set(measure_soil(tmp_path / "my_sand.yaml")["property"]) == {
        *("cohesion", "friction_angle", "peak_cohesion", "peak_friction_angle", "angle_of_repose")
    }


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
