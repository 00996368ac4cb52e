"""The smoke campaign, for the tests that need one."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

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
