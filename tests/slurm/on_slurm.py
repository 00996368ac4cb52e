"""Part of the smoke campaign through the profiles, on the SLURM that run.sh has started: its results are the bytes of a local run.

Jobs of the one campaign are cancelled and run out of their time; they are submitted again and go on.
"""

import contextlib
import re
import subprocess
import time
from pathlib import Path

import psutil
import pytest
import yaml
from campaign import ENVIRONMENT, SNAKEMAKE, copy_project, differing, essence

RESULTS = Path("results") / "smoke"
#: What the campaigns of the two profiles make: after the refinement, whose jobs are known only when the first fit is done, and
#: before it. Every job takes some ten seconds on a cluster, most of them waiting.
REFINED, FITTED = (RESULTS / "rounds" / stage / "surrogates.json" for stage in ("1", "0"))
#: A job is disturbed when so many simulations of its batch are finished, and as many are left.
FINISHED = 3
PATIENCE_S = 1800.0


def without_twins(file: Path) -> None:
    """Leave the first case and no virtual soils: a third of the simulations need no cluster to be tested again."""
    config = yaml.safe_load(file.read_text())
    del config["twins"]
    config["optimise"]["cases"] = config["optimise"]["cases"][:1]
    file.write_text(yaml.safe_dump(config))


def started(project: Path, *arguments: str, target: str = "all", **environment: str) -> subprocess.Popen:
    """Snakemake, in a folder of its own."""
    without_twins(copy_project(project) / "config" / "smoke.yaml")
    with open(project / "snakemake.log", "w") as log:
        variables = ENVIRONMENT | environment
        return subprocess.Popen([*SNAKEMAKE, *arguments, "--", target], cwd=project, env=variables, stdout=log, stderr=log)


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


def half_done(project: Path, experiment: str) -> tuple[str, str, Path] | None:
    """Id, comment and log of a running job that has done a part of its batch; the slurm plugin writes the comments."""
    running = {line.split()[2]: line.split()[0] for line in squeue("%i %T %k") if line.split()[1] == "RUNNING"}
    for log in (project / "logs" / "smoke" / experiment).glob("*.log"):
        comment = f"rule_simulate_wildcards_{experiment}_{log.stem}"
        at = re.findall(r"^simulation \w+: (\d+) of (\d+)$", log.read_text(), flags=re.MULTILINE)
        if comment in running and at and FINISHED < int(at[-1][0]) <= int(at[-1][1]) - FINISHED:
            return running[comment], comment, log
    return None


def hold(log: Path) -> None:
    """Stop the process that writes a log, or its batch may end before SLURM, which looks twice a minute, finds it out of time."""
    for process in psutil.process_iter():
        with contextlib.suppress(psutil.Error):
            if str(log) in [file.path for file in process.open_files()]:
                process.suspend()  # SLURM wakes what it ends


def held(project: Path, process: subprocess.Popen, experiments: tuple[str, ...]) -> list[tuple[str, str, Path]]:
    """Half-done jobs of the experiments, all held before any is disturbed: a job may end while SLURM ends another."""
    found: dict[str, tuple[str, str, Path]] = {}

    def all_found() -> bool:
        for experiment in experiments:
            job = None if experiment in found else half_done(project, experiment)
            if job is not None:
                hold(job[2])
                found[experiment] = job
        return len(found) == len(experiments)

    wait_until(all_found, process)
    return [found[experiment] for experiment in experiments]


def disturb(process: subprocess.Popen, job: str, comment: str, state: str, *command: str) -> None:
    """Give SLURM a command about a job, which must end in the state."""
    subprocess.run(command, check=True)
    going = [f"{job} RUNNING", f"{job} COMPLETING"]
    wait_until(lambda: not any(line in going for line in squeue("%i %T")), process)
    assert f"{job} {state} {comment}" in squeue("%i %T %k")


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
        "slurm": started(folders["slurm"], "--profile", "profiles/slurm", *settings, target=str(REFINED)),
        "generic": started(
            folders["generic"],
            *("--profile", "profiles/generic", "--seconds-between-status-checks", "2"),
            target=str(FITTED),
            SCHEDULER="slurm",
        ),
    }
    yield {name: (processes[name], folders[name]) for name in processes}
    for process in processes.values():
        process.terminate()
        process.wait(PATIENCE_S)


def same(found: dict, expected: dict, last: Path) -> None:
    assert last.relative_to(RESULTS).as_posix() in found
    assert found.keys() <= expected.keys()
    assert not differing(found, expected)


def test_what_is_cancelled_or_runs_out_of_time_goes_on_and_gives_the_same_bytes(local, campaigns):
    process, project = campaigns["slurm"]
    (late, late_comment, late_log), (unwanted, unwanted_comment, unwanted_log) = held(project, process, ("shear", "repose"))
    disturb(process, late, late_comment, "TIMEOUT", "scontrol", "update", f"JobId={late}", "EndTime=now+1")
    disturb(process, unwanted, unwanted_comment, "CANCELLED", "scancel", unwanted)
    ended_well(process, project)
    assert all("finished before, in" in log.read_text() for log in (late_log, unwanted_log))
    same(essence(project / RESULTS), local, REFINED)


def test_any_submit_command_gives_the_same_bytes(local, campaigns):
    process, project = campaigns["generic"]
    ended_well(process, project)
    assert (project / "logs" / "cluster").is_dir()
    same(essence(project / RESULTS), local, FITTED)
