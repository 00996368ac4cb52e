"""The import rule: workflow -> report -> campaign -> calibration, exports, dem, none of which knows another."""

import ast
import os
import subprocess
import sys
from pathlib import Path

import pytest

from dem import jit

SRC = Path(__file__).parents[1] / "src"


#: What a package may import of the project. Workflow scripts may import all.
MAY_IMPORT = {
    "dem": set(),
    "virtual_soil.calibration": set(),
    "virtual_soil.exports": {"dem"},
    "virtual_soil.verification": {"dem"},
    "virtual_soil.bulk": {"dem", "virtual_soil.verification"},
    "virtual_soil.campaign": {"dem", "virtual_soil.calibration", "virtual_soil.exports"},
    "virtual_soil.wheel": {"dem", "virtual_soil.calibration", "virtual_soil.campaign", "virtual_soil.verification"},
    "virtual_soil.report": {"dem", "virtual_soil.calibration", "virtual_soil.exports", "virtual_soil.campaign"},
}
#: Modules below all packages.
SHARED = {"virtual_soil.errors"}
#: What a package must do without, of other projects.
FORBIDDEN = {
    "dem": {"pandas", "pyarrow", "snakemake", "yaml"},
    "virtual_soil.calibration": {"numba", "snakemake"},
    "virtual_soil.exports": {"numba", "snakemake"},
    "virtual_soil.campaign": {"numba"},
    "virtual_soil.wheel": {"numba", "snakemake"},
    "virtual_soil.report": {"numba"},
}


def imported(path):
    """Full names of everything a file imports."""
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}: a relative import"
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


def package_of(name):
    """The package of the project that a module belongs to; None for other projects' modules."""
    return next((package for package in MAY_IMPORT if f"{name}.".startswith(f"{package}.")), None)


@pytest.mark.parametrize("package", MAY_IMPORT)
def test_packages_know_only_what_lies_below_them(package):
    files = list((SRC / package.replace(".", "/")).rglob("*.py"))
    assert files
    for path in files:
        for name in imported(path):
            top = name.split(".")[0]
            assert top not in FORBIDDEN.get(package, set()), (path, name)
            if top == "virtual_soil" and any(name.startswith(shared) for shared in SHARED):
                continue
            assert top != "virtual_soil" or package_of(name), f"{path} imports {name}, which belongs to no package"
            assert package_of(name) in {None, package} | MAY_IMPORT[package], (path, name)


def test_scripts_are_adapters_and_one_log():
    beside = [path.name for path in (SRC.parent / "workflow" / "scripts").glob("_*")]
    assert [name for name in beside if name != "__pycache__"] == ["_log.py"]


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
    files = [(path.name, list(imported(path))) for path in (SRC / "dem").rglob("*.py")]
    assert {name for name, names in files if any(full.startswith("numba") for full in names)} == {"jit.py", "parts.py"}
    assert {name for name, names in files if any(full.startswith("dem.parts.") for full in names)} == {"jit.py"}


def test_kernels_do_not_depend_on_what_is_left_out_of_their_source():
    for path in (SRC / "dem").rglob("*.py"):
        above = path.relative_to(SRC / "dem").parts[0] in jit.ABOVE_KERNELS
        names = set(imported(path))
        forbidden = ("dem.jit.",) if above else tuple(f"dem.{folder}" for folder in jit.ABOVE_KERNELS)
        assert not [name for name in names if f"{name}.".startswith(forbidden)], path


def test_kernels_are_cached_by_their_source(tmp_path):
    code = "import dem, numba; print(numba.config.CACHE_DIR, numba.config.SLP_VECTORIZE)"
    environment = {k: v for k, v in os.environ.items() if not k.startswith("NUMBA_")} | {"XDG_CACHE_HOME": str(tmp_path)}
    seen = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True)
    assert seen.stdout.split() == [str(tmp_path / "virtual-soil" / "kernels" / jit.SOURCE), "1"]


def test_experiments_use_the_public_api_only():
    for path in (SRC / "dem" / "experiments").glob("*.py"):
        modules = [node.module for node in ast.walk(ast.parse(path.read_text())) if isinstance(node, ast.ImportFrom)]
        assert all(not m.startswith("dem.") or m.startswith("dem.experiments") for m in modules), path
