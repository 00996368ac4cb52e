"""Checkouts in unusual folders, and results outside the checkout."""

import os
import re
import subprocess
import sys
import sysconfig
from pathlib import Path

import pytest
from campaign import ENVIRONMENT, ROOT, copy_project

from virtual_soil.campaign import status
from virtual_soil.campaign.folders import FolderError, check_folders
from virtual_soil.campaign.study import StudyError, soil_files

PLAIN = Path("/home/ä-1/soil_2.0~#!@+,%")


@pytest.mark.parametrize("character", [" ", "\t", "'", '"', "$", "&", ";", "(", "[", "]", "{", "*", "?", "\\", "`", "|", "<"])
def test_an_interpreter_that_a_shell_would_misread_is_refused(character):
    python = f"{PLAIN}/a{character}b/.venv/bin/python"
    with pytest.raises(FolderError, match=rf"^{re.escape(python)}: the path of Python has .* allowed: a folder without blanks"):
        check_folders(PLAIN, PLAIN, python)
    assert "\n" not in str(pytest.raises(FolderError, check_folders, PLAIN, PLAIN, python).value)


@pytest.mark.parametrize("brace", "{}")
def test_folders_with_braces_are_refused(brace):
    odd = PLAIN / f"a{brace}"
    with pytest.raises(FolderError, match=rf"^{re.escape(str(odd))}: the name of the checkout has '{brace}'"):
        check_folders(odd, PLAIN, "/usr/bin/python3")
    with pytest.raises(FolderError, match=rf"^{re.escape(str(odd))}: the name of the working directory has '{brace}'"):
        check_folders(PLAIN, odd, "/usr/bin/python3")


def test_all_other_folders_are_allowed():
    check_folders(PLAIN, PLAIN, f"{PLAIN}/.venv/bin/python")
    check_folders(Path("/a b [c]"), Path("/d 'e' $f"), "/usr/bin/python3")


def test_the_characters_that_are_allowed_do_not_mislead_a_shell(tmp_path):
    folder = tmp_path / PLAIN.relative_to("/")
    folder.mkdir(parents=True)
    (folder / "python").symlink_to("/bin/echo")
    assert subprocess.run(["bash", "-c", f"{folder}/python yes"], capture_output=True, text=True, check=True).stdout == "yes\n"


def test_the_installation_is_refused_in_such_a_folder_by_a_python_without_packages(tmp_path):
    (tmp_path / "a b").mkdir()
    command = [sys.executable, "-S", "-m", "virtual_soil.campaign.folders"]
    done, plain = (
        subprocess.run(command, cwd=folder, env=ENVIRONMENT, capture_output=True, text=True, check=False)
        for folder in (tmp_path / "a b", tmp_path)
    )
    assert (plain.returncode, plain.stderr) == (0, "")
    assert done.returncode == 1
    (line,) = done.stderr.splitlines()
    assert line.startswith(f"error: {tmp_path}/a b/.venv/bin/python: the path of Python has ' '")
    assert "$(PYTHON) -m virtual_soil.campaign.folders\n\t$(PYTHON) -m venv" in (ROOT / "Makefile").read_text()


def plan(python, *arguments, cwd):
    """A run of snakemake by an interpreter."""
    paths = os.pathsep.join([str(ROOT / "src"), sysconfig.get_path("purelib")])
    command = [str(python), "-m", "snakemake", *map(str, arguments)]
    return subprocess.run(command, cwd=cwd, env=ENVIRONMENT | {"PYTHONPATH": paths}, capture_output=True, text=True, check=False)


def test_a_checkout_in_a_folder_with_a_blank_says_so_before_the_first_job(tmp_path):
    (tmp_path / "a b").mkdir()
    project = copy_project(tmp_path / "a b" / "main")
    python = project / "python"
    python.symlink_to(Path(sys.executable).resolve())
    done = plan(python, "-c1", "results/default/design.parquet", cwd=project)
    assert done.returncode == 1
    assert f"{python}: the path of Python has ' '" in done.stdout + done.stderr
    assert not (project / "results").exists()


def test_results_may_be_outside_the_checkout(tmp_path):
    """By --directory, and by running in another folder, which may have any name without braces."""
    for name, place in (("far", ["--directory", tmp_path / "far"]), ("a b [1]", [])):
        (tmp_path / name).mkdir()
        of_study = ["--snakefile", ROOT / "Snakefile", "--configfile", ROOT / "config/smoke.yaml", *place]
        done = plan(sys.executable, "-c1", "results/smoke/design.parquet", *of_study, cwd=ROOT if place else tmp_path / name)
        assert done.returncode == 0, done.stdout + done.stderr
        assert (tmp_path / name / "results/smoke/design.parquet").is_file()
    done = plan(sys.executable, "-n", "all", "first_answer", *of_study, cwd=tmp_path / name)
    assert done.returncode == 0, done.stdout + done.stderr


def test_the_progress_of_a_study_outside_the_checkout_is_shown(tmp_path):
    (tmp_path / "results/elsewhere").mkdir(parents=True)
    (tmp_path / "results/elsewhere/design.parquet").touch()
    with pytest.raises(SystemExit, match=r"there is no results/default; started studies: elsewhere"):
        status.main(["--directory", str(tmp_path)])


def test_soils_are_of_the_working_directory_or_of_the_checkout(tmp_path, monkeypatch):
    for folder, soil in (("work", "mine"), ("work", "both"), ("checkout", "both"), ("checkout", "theirs")):
        file = tmp_path / folder / "config/soils" / f"{soil}.yaml"
        file.parent.mkdir(parents=True, exist_ok=True)
        file.touch()
    monkeypatch.chdir(tmp_path / "work")
    found = soil_files({"soils": ["mine", "both", "theirs"]}, tmp_path / "checkout")
    assert found == ["config/soils/mine.yaml", "config/soils/both.yaml", f"{tmp_path}/checkout/config/soils/theirs.yaml"]
    with pytest.raises(StudyError, match=r"there is no config/soils/none.yaml; existing soils: both, mine, theirs"):
        soil_files({"soils": ["none"]}, tmp_path / "checkout")
