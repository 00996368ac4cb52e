"""A study through the profiles, on the SLURM that run.sh has started: its results are the bytes of the same study made here.

Jobs are cancelled, and run out of their time; both are submitted again and go on. Only the campaign of a study smaller than `smoke`
is made: every further rule would be a job of its own, seen to be finished some ten seconds late.
"""

import os
import shutil
import subprocess
import sys
import time
from pathlib import Path

import pandas as pd
import pytest

ROOT = Path(__file__).parents[2]
STUDY = "tests/slurm/study.yaml"
TABLES = [f"results/small/{name}.parquet" for name in ("repose", "strength")]
#: A job is disturbed when so many simulations of its batch are finished.
FINISHED = 3
PATIENCE_S = 900.0


def started(project: Path, *arguments: str, **environment: str) -> subprocess.Popen:
    """Snakemake, in a folder of its own that shares the sources, so that kernels are compiled once."""
    for name in ("config", "workflow", "profiles", "tests/slurm"):
        shutil.copytree(ROOT / name, project / name, ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copy(ROOT / "Snakefile", project)
    (project / "src").symlink_to(ROOT / "src")
    command = [sys.executable, "-m", "snakemake", *arguments, "--configfile", STUDY]
    with open(project / "snakemake.log", "w") as log:
        variables = os.environ | {"PYTHONPATH": str(ROOT / "src")} | environment
        return subprocess.Popen([*command, "--", *TABLES], cwd=project, env=variables, stdout=log, stderr=log)


def ended_well(process: subprocess.Popen, project: Path) -> None:
    assert process.wait(PATIENCE_S) == 0, (project / "snakemake.log").read_text()[-5000:]


def files(project: Path) -> dict[str, bytes]:
    """Everything that simulations wrote but the times that they took, and the tables without these."""
    results = project / "results" / "small"
    found = {str(path.relative_to(results)): path.read_bytes() for path in results.glob("sims/*/*/*.parquet")}
    for path in (results / "repose.parquet", results / "strength.parquet"):
        found[path.name] = pd.read_parquet(path).drop(columns="wall_time_s", errors="ignore").to_csv().encode()
    return found


def squeue(columns: str) -> list[str]:
    command = ["squeue", "--noheader", "--states", "all", "--format", columns]
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout.splitlines()


def wait_until(condition, process: subprocess.Popen):
    """What the condition gives once it gives anything; fails when Snakemake ends before."""
    end = time.monotonic() + PATIENCE_S
    while not (found := condition()):
        assert process.poll() is None, "ended too early"
        assert time.monotonic() < end
        time.sleep(0.1)
    return found


def running(rule: str) -> str | None:
    """Id of the rule's job that runs; the plugin writes the rule into a job's comment."""
    return next((line.split()[0] for line in squeue("%i %T %k") if line.split()[1] == "RUNNING" and rule in line), None)


@pytest.fixture(scope="session")
def local(tmp_path_factory):
    """The study's files, made on this machine without SLURM, in the batches that the profiles ask for."""
    project = tmp_path_factory.mktemp("local")
    ended_well(started(project, "-c2", "--config", "batch_minutes=20"), project)
    return files(project)


def test_what_is_cancelled_or_runs_out_of_time_goes_on_and_gives_the_same_bytes(local, tmp_path):
    settings = ["--slurm-status-command", "squeue", "--slurm-init-seconds-before-status-checks", "3"]
    process = started(tmp_path, "--profile", "profiles/slurm", *settings)
    kept = tmp_path / "results" / "small" / "checkpoints"
    try:
        for rule, table, end in (
            ("simulate_shear", "history", ["scontrol", "update", "EndTime=now+1"]),
            ("simulate_repose", "grains", ["scancel"]),
        ):
            wait_until(lambda table=table: len(list(kept.glob(f"*/{table}.parquet"))) >= FINISHED, process)
            job = wait_until(lambda rule=rule: running(rule), process)
            subprocess.run([*end, job if end == ["scancel"] else f"JobId={job}"], check=True)
        ended_well(process, tmp_path)
    finally:
        process.terminate()
        process.wait(PATIENCE_S)
    states = squeue("%T %k")
    assert any("CANCELLED" in line and "simulate_repose" in line for line in states), states
    assert any("TIMEOUT" in line and "simulate_shear" in line for line in states), states
    for experiment in ("repose", "shear"):
        log = (tmp_path / "logs" / "small" / experiment / "campaign.log").read_text()
        assert log.count("finished before, in") >= FINISHED
    assert files(tmp_path) == local


def test_any_submit_command_gives_the_same_bytes(local, tmp_path):
    process = started(tmp_path, "--profile", "profiles/generic", "--seconds-between-status-checks", "2", SCHEDULER="slurm")
    try:
        ended_well(process, tmp_path)
    finally:
        process.terminate()
        process.wait(PATIENCE_S)
    assert (tmp_path / "logs" / "cluster").is_dir()
    assert files(tmp_path) == local
