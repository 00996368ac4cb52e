"""The import rule: workflow knows calibration and dem; these two do not know each other; only dem knows numba."""

import ast
import os
import subprocess
import sys
from pathlib import Path

import pytest

from dem.jit import source_hash

SRC = Path(__file__).parents[1] / "src"


def imported(path):
    """Top-level names of everything a file imports."""
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            yield from (alias.name.split(".")[0] for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield node.module.split(".")[0]


@pytest.mark.parametrize(
    ("package", "forbidden"),
    [
        ("dem", {"calibration", "snakemake", "pandas", "pyarrow", "yaml"}),
        ("calibration", {"dem", "numba", "snakemake"}),
        ("exports", {"calibration", "numba", "snakemake"}),
    ],
)
def test_packages_know_only_what_lies_below_them(package, forbidden):
    files = list((SRC / package).rglob("*.py"))
    assert files
    for path in files:
        assert not forbidden & set(imported(path)), path


def test_no_array_is_read_as_a_pickle():
    """Ruff's rules for pickles, eval and unsafe YAML do not know this door."""
    files = [path for folder in ("src", "workflow", "benchmarks", "docs") for path in (SRC.parent / folder).rglob("*.py")]
    assert files
    for path in files:
        keywords = [node for node in ast.walk(ast.parse(path.read_text())) if isinstance(node, ast.keyword)]
        opened = [
            k for k in keywords if k.arg == "allow_pickle" and not (isinstance(k.value, ast.Constant) and k.value.value is False)
        ]
        assert not opened, path


def test_numba_is_imported_in_one_place():
    # An import elsewhere could come first, before jit.py has set numba's environment (cache folder, vectoriser).
    importers = [path.name for path in (SRC / "dem").rglob("*.py") if "numba" in set(imported(path))]
    assert importers == ["jit.py"]


def test_kernels_are_cached_by_the_package_source(tmp_path):
    code = "import dem, numba; print(numba.config.CACHE_DIR, numba.config.SLP_VECTORIZE)"
    environment = {k: v for k, v in os.environ.items() if not k.startswith("NUMBA_")} | {"XDG_CACHE_HOME": str(tmp_path)}
    seen = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True)
    assert seen.stdout.split() == [str(tmp_path / "virtual-soil" / "kernels" / source_hash()), "1"]


def test_experiments_use_the_public_api_only():
    for path in (SRC / "dem" / "experiments").glob("*.py"):
        modules = [node.module for node in ast.walk(ast.parse(path.read_text())) if isinstance(node, ast.ImportFrom)]
        assert all(not m.startswith("dem.") or m.startswith("dem.experiments") for m in modules), path
