"""Where compiled kernels are stored, on installations that can and cannot be written."""

import os
import re
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest

from dem import cache, jit


@pytest.fixture
def user(tmp_path, monkeypatch):
    """A user with a home and a temporary folder, and without settings."""
    for name in ("NUMBA_CACHE_DIR", "XDG_CACHE_HOME"):
        monkeypatch.delenv(name, raising=False)
    (tmp_path / "temporary").mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "temporary"))
    monkeypatch.setattr(Path, "home", lambda: tmp_path / "home")
    return tmp_path


def homeless():
    raise RuntimeError("Could not determine home directory.")


def test_kernels_are_in_the_users_cache_without_a_word(user, monkeypatch, capsys):
    assert cache.kernel_folder("v") == user / "home/.cache/virtual-soil/kernels/v"
    monkeypatch.setenv("XDG_CACHE_HOME", str(user / "xdg"))
    assert cache.kernel_folder("v") == user / "xdg/virtual-soil/kernels/v"
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(user / "own"))
    assert cache.kernel_folder("v") == user / "own"
    assert capsys.readouterr() == ("", "")


@pytest.mark.parametrize("how", ["home", "XDG_CACHE_HOME", "NUMBA_CACHE_DIR", "no home"])
def test_kernels_are_in_one_temporary_folder_where_the_cache_cannot_be_written(user, monkeypatch, capsys, how):
    """A file in place of the folder: nobody can write below it, not even root."""
    (user / "home").write_text("")
    if how == "no home":
        monkeypatch.setattr(Path, "home", homeless)
    elif how != "home":
        monkeypatch.setenv(how, str(user / "home" / "cache"))
    folder = user / f"temporary/virtual-soil-{os.getuid()}"
    assert cache.kernel_folder("v") == cache.kernel_folder("v") == folder / "kernels" / "v"
    assert folder.stat().st_mode & 0o777 == 0o700
    first, second = capsys.readouterr().err.splitlines()
    assert first == second
    reason = "there is no home folder" if how == "no home" else r"\S+/home/\S+ cannot be written"
    assert re.match(rf"dem: {reason}; kernels are compiled into ", first)
    assert f"compiled into {folder}/kernels/v" in first


@pytest.mark.parametrize("whose", ["open to others", "a link"])
def test_kernels_are_never_loaded_from_a_folder_that_others_can_write(user, monkeypatch, whose):
    monkeypatch.setattr(Path, "home", homeless)
    folder = user / f"temporary/virtual-soil-{os.getuid()}"
    if whose == "a link":
        (user / "elsewhere").mkdir(mode=0o700)
        folder.symlink_to(user / "elsewhere")
    else:
        folder.mkdir()
        folder.chmod(0o777)
    found = cache.kernel_folder("v")
    assert folder not in found.parents
    assert found.parents[1].stat().st_mode & 0o777 == 0o700


def test_the_engine_starts_without_a_home_and_says_so_in_one_line(tmp_path):
    (tmp_path / "home").write_text("")
    (tmp_path / "temporary").mkdir()
    environment = {key: value for key, value in os.environ.items() if key not in ("NUMBA_CACHE_DIR", "XDG_CACHE_HOME")}
    environment |= {"HOME": str(tmp_path / "home"), "TMPDIR": str(tmp_path / "temporary"), "PYTHONPATH": str(jit.PACKAGE.parent)}
    program = "import subprocess, sys; import dem; subprocess.run([sys.executable, '-c', 'import dem; print(dem.Box.__name__)'])"
    done = subprocess.run([sys.executable, "-c", program], env=environment, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout) == (0, "Box\n")
    (line,) = done.stderr.splitlines()
    assert line.startswith(f"dem: {tmp_path}/home/.cache/virtual-soil/kernels/")
