"""Which files of a finished study are no longer as they were written."""

import shutil
import subprocess

import pytest

import check_manifest
from virtual_soil.campaign.manifest import ManifestError, differences, hashes, write_manifest


@pytest.fixture
def study(tmp_path):
    """A finished study of three files."""
    folder = tmp_path / "study"
    for name, content in (("report.html", b"<html>"), ("sims/a/run.parquet", bytes(range(256))), ("sims/b/run.parquet", b"")):
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(content)
    write_manifest(folder)
    return folder


def test_a_study_that_nobody_touched_agrees(study, capsys):
    assert differences(study) == []
    assert check_manifest.main(study) == 0
    assert capsys.readouterr().out == f"{study}: all files are as they were written\n"


@pytest.mark.parametrize("place", [0, 100, 255])
def test_one_byte_is_noticed_wherever_it_is(study, place, capsys):
    path = study / "sims" / "a" / "run.parquet"
    content = bytearray(path.read_bytes())
    content[place] ^= 1
    path.write_bytes(content)
    assert check_manifest.main(study) == 1
    assert capsys.readouterr().out == f"{path}: changed\n"


def test_every_file_has_a_line_of_its_own(study):
    (study / "report.html").unlink()
    (study / "sims" / "b" / "run.parquet").write_bytes(b"no longer empty")
    (study / "sims" / "c").mkdir()
    (study / "sims" / "c" / "run.parquet").write_bytes(b"")
    assert differences(study) == [
        f"{study}/report.html: missing",
        f"{study}/sims/b/run.parquet: changed",
        f"{study}/sims/c/run.parquet: not in the manifest",
    ]


def test_files_that_change_places_are_noticed(study):
    a, b = (study / "sims" / name / "run.parquet" for name in "ab")
    a.rename(study / "other")
    b.rename(a)
    (study / "other").rename(b)
    assert len(differences(study)) == 2


def test_checkpoints_and_what_a_killed_job_left_belong_to_no_study(study):
    (study / "checkpoints").mkdir()
    (study / "checkpoints" / "0123456789.npz").write_bytes(b"state")
    assert differences(study) == []
    (study / "sims" / "a" / ".part-17-run.parquet").write_bytes(b"half")
    write_manifest(study)
    assert set(hashes(study)) == {"report.html", "sims/a/run.parquet", "sims/b/run.parquet"}
    assert differences(study) == []


def test_a_study_without_a_sound_manifest_says_so(study, capsys):
    (study / "manifest.sha256").write_text("nonsense\n")
    with pytest.raises(ManifestError, match="line 1 is 'nonsense'; allowed: 64 hex digits, two blanks, a path"):
        differences(study)
    (study / "manifest.sha256").unlink()
    assert check_manifest.main(study) == 1
    assert capsys.readouterr().out.endswith("manifest.sha256 is missing; it is written when a study is finished: snakemake all.\n")


@pytest.mark.skipif(shutil.which("sha256sum") is None, reason="no sha256sum on this machine")
def test_sha256sum_reads_the_manifest(study):
    check = ["sha256sum", "--check", "--strict", "manifest.sha256"]
    assert subprocess.run(check, cwd=study, capture_output=True, check=False).returncode == 0
    (study / "report.html").write_bytes(b"<HTML>")
    assert subprocess.run(check, cwd=study, capture_output=True, check=False).returncode == 1
