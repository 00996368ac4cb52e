"""The smoke campaign, for the tests that need one, and what of a campaign must be the same in every run."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pyarrow.parquet as pq

from virtual_soil.campaign.manifest import hashes

ROOT = Path(__file__).parents[2]
SNAKEMAKE = [sys.executable, "-m", "snakemake", "--configfile", "config/smoke.yaml"]

#: All projects import from the same files, so that kernels are compiled once.
ENVIRONMENT = os.environ | {"PYTHONPATH": str(ROOT / "src")}

#: Tables in which wall times stand, which differ from run to run.
TIMED = ("repose.parquet", "shear.parquet", "acceleration.parquet")


def copy_project(target: Path) -> Path:
    """A copy of what the workflow needs, so that tests may edit it; `src`, which it fingerprints, is a link."""
    for name in ("config", "workflow", "profiles"):
        shutil.copytree(ROOT / name, target / name, ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copy(ROOT / "Snakefile", target)
    (target / "src").symlink_to(ROOT / "src")
    return target


def snakemake(project: Path, *arguments: str) -> subprocess.CompletedProcess:
    """Run snakemake in a project, with the sources that are tested."""
    return subprocess.run([*SNAKEMAKE, *arguments], cwd=project, env=ENVIRONMENT, capture_output=True, text=True, check=False)


def counted(text: str) -> dict[str, int]:
    """Rule -> number of jobs in what a dry run prints; simulate_<experiment> and the like by the rules' messages."""
    table = text.split("Job stats:")[1].split("total")[0]
    jobs = {name: int(count) for name, count in re.findall(r"^(\w+)\s+(\d+)$", table, flags=re.MULTILINE)}
    for rule, said, form in (
        ("simulate", r"Simulate the (\w+) tests of ", "simulate_{}"),
        ("measure", r"Measure the responses of every (\w+) test", "measure_{}"),
        ("reduce", r"Determine the (\w+) of every design point", "{}"),
    ):
        if jobs.pop(rule, 0):
            found = re.findall(rf"^Job \d+: {said}", text, flags=re.MULTILINE)
            jobs |= {form.format(name): found.count(name) for name in found}
    return jobs


def essence(results: Path) -> dict[str, object]:
    """Path -> content of every result without what wall times stand in, which is all that may differ between two runs."""
    found = {}
    for name in hashes(results):
        path = results / name
        if path.name in TIMED:
            table = pq.read_table(path)
            found[name] = table.drop_columns([column for column in table.column_names if "wall_time" in column])
        elif path.name == "report.html":
            found[name] = re.sub(r"in [\d.]+ core-minutes|<td>[\d.]+ / [\d.]+</td>", "", path.read_text())
        elif name == "tables/acceleration.csv":  # its last column
            found[name] = [line.rpartition(",")[0] for line in path.read_text().splitlines()]
        elif path.name != "timing.json":
            found[name] = path.read_bytes()
    return found


def differing(found: dict, expected: dict) -> list[str]:
    """Names of the results in which two campaigns differ, of all that both have; metadata of tables count."""

    def same(one, other):
        return one.equals(other, check_metadata=True) if hasattr(one, "equals") else one == other

    return [name for name in found if name in expected and not same(found[name], expected[name])]
