"""The smoke campaign through the profiles, on the SLURM that run.sh has started: its results are the bytes of a local run.

Jobs of the one campaign are cancelled and run out of their time; they are submitted again and go on.
"""

import contextlib
import subprocess
import time
from pathlib import Path

import pytest
from campaign import ENVIRONMENT, SNAKEMAKE, copy_project, differing, essence

RESULTS = Path("results") / "smoke"
#: A job is disturbed when so many simulations of its batch are finished.
FINISHED = 3
PATIENCE_S = 1800.0


def started(project: Path, *arguments: str, **environment: str) -> subprocess.Popen:
    """Snakemake, in a folder of its own."""
    copy_project(project)
    with open(project / "snakemake.log", "w") as log:
        variables = ENVIRONMENT | environment
        return subprocess.Popen([*SNAKEMAKE, *arguments, "--", "all"], cwd=project, env=variables, stdout=log, stderr=log)


def ended_well(process: subprocess.Popen, project: Path) -> None:
    assert process.wait(PATIENCE_S) == 0, (project / "snakemake.log").read_text()[-5000:]


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


def half_done(project: Path, experiment: str, rule: str) -> str | None:
    """Id of a running job of the rule that has finished simulations of its batch; the slurm plugin names the rule in a comment."""
    tables = RESULTS / "checkpoints" / "*" / {"repose": "grains", "shear": "history"}[experiment]
    if len(list(project.glob(f"{tables}.parquet"))) < FINISHED:
        return None
    return next((line.split()[0] for line in squeue("%i %T %k") if line.split()[1] == "RUNNING" and rule in line), None)


def disturb(project: Path, process: subprocess.Popen, experiment: str, state: str, *command: str) -> None:
    """Give SLURM a command about a half-done job of an experiment, until a job has ended in the state."""
    rule = f"simulate_{experiment}"
    while True:
        job = wait_until(lambda: half_done(project, experiment, rule), process)
        with contextlib.suppress(subprocess.CalledProcessError):  # it has ended meanwhile
            subprocess.run([word.replace("JOB", job) for word in command], check=True)
        going = [f"{job} RUNNING", f"{job} COMPLETING"]
        wait_until(lambda going=going: not any(line in going for line in squeue("%i %T")), process)
        if any(state in line and rule in line for line in squeue("%T %k")):
            return


@pytest.fixture(scope="session")
def local(tmp_path_factory):
    """What the campaign gives on this machine without SLURM, in the batches that the profiles ask for."""
    project = tmp_path_factory.mktemp("local")
    ended_well(started(project, "-c2", "--config", "batch_minutes=20"), project)
    return essence(project / RESULTS)


@pytest.fixture(scope="session")
def campaigns(local, tmp_path_factory):
    """The campaigns of both profiles, running side by side: profile -> (Snakemake, its folder)."""
    folders = {name: tmp_path_factory.mktemp(name) for name in ("slurm", "generic")}
    settings = ["--slurm-status-command", "squeue", "--slurm-init-seconds-before-status-checks", "3"]
    processes = {
        "slurm": started(folders["slurm"], "--profile", "profiles/slurm", *settings),
        "generic": started(
            folders["generic"], "--profile", "profiles/generic", "--seconds-between-status-checks", "2", SCHEDULER="slurm"
        ),
    }
    yield {name: (processes[name], folders[name]) for name in processes}
    for process in processes.values():
        process.terminate()
        process.wait(PATIENCE_S)


def same(found: dict, expected: dict) -> None:
    assert found.keys() == expected.keys()
    assert not differing(found, expected)


def test_what_is_cancelled_or_runs_out_of_time_goes_on_and_gives_the_same_bytes(local, campaigns):
    process, project = campaigns["slurm"]
    disturb(project, process, "shear", "TIMEOUT", "scontrol", "update", "JobId=JOB", "EndTime=now+1")
    disturb(project, process, "repose", "CANCELLED", "scancel", "JOB")
    ended_well(process, project)
    for experiment in ("repose", "shear"):
        logs = [path.read_text() for path in (project / "logs" / "smoke" / experiment).glob("*.log")]
        assert any("finished before, in" in log for log in logs)
    same(essence(project / RESULTS), local)


def test_any_submit_command_gives_the_same_bytes(local, campaigns):
    process, project = campaigns["generic"]
    ended_well(process, project)
    assert (project / "logs" / "cluster").is_dir()
    same(essence(project / RESULTS), local)
