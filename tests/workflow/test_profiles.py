"""The profiles for clusters: what the scripts of the generic one say to stand-ins of the schedulers."""

import os
import subprocess
from pathlib import Path

import pytest
import yaml

PROFILES = Path(__file__).parents[2] / "profiles"

#: What the schedulers' programs print; every call is noted.
PROGRAM = """#!/bin/sh
echo "$(basename "$0") $*" >> "$CALLS"
case $(basename "$0") in
bsub) echo "Job <4711> is submitted to queue <normal>." ;;
qsub | sbatch) echo 4711 ;;
esac
"""


@pytest.fixture
def schedulers(tmp_path, monkeypatch):
    """Stand-ins for the programs of PBS, SGE and LSF."""
    for name in ("qsub", "bsub", "sbatch", "qdel", "bkill", "scancel"):
        program(tmp_path / name, PROGRAM)
    monkeypatch.setenv("PATH", f"{tmp_path}{os.pathsep}{os.environ['PATH']}")
    monkeypatch.setenv("CALLS", str(tmp_path / "calls"))
    monkeypatch.chdir(tmp_path)
    return tmp_path


def program(path, text):
    path.write_text(text)
    path.chmod(0o755)


def call(script, *arguments, scheduler):
    command = [str(PROFILES / "generic" / script), *map(str, arguments)]
    environment = os.environ | {"SCHEDULER": scheduler}
    return subprocess.run(command, env=environment, capture_output=True, text=True, check=False)


@pytest.mark.parametrize(
    ("scheduler", "asked"),
    [
        ("pbs", "qsub -N rule -j oe -o logs/cluster/ -l select=1:ncpus=2:mem=1500mb -l walltime=5400 job.sh"),
        ("sge", "qsub -terse -cwd -V -N rule -j y -o logs/cluster/ -pe smp 2 -l h_vmem=750M,h_rt=5400 job.sh"),
        ("lsf", "bsub -J rule -n 2 -R span[hosts=1] rusage[mem=1500MB] -W 90 -o logs/cluster/%J.log sh job.sh"),
        ("slurm", "sbatch --parsable -J rule -c 2 --mem 1500 -t 90 -o logs/cluster/%j.log job.sh"),
    ],
)
def test_a_job_is_submitted_with_its_threads_memory_and_time(schedulers, scheduler, asked):
    result = call("submit", 2, 1500, 90, "rule", "job.sh", scheduler=scheduler)
    assert (result.returncode, result.stdout) == (0, "4711\n")
    assert (schedulers / "calls").read_text() == asked + "\n"


@pytest.mark.parametrize(
    ("scheduler", "programs", "status"),
    [
        ("pbs", {"qstat": "echo '    job_state = R'"}, "running"),
        ("pbs", {"qstat": "echo '    Exit_status = 0'"}, "success"),
        ("pbs", {"qstat": "echo '    Exit_status = 143'"}, "failed"),
        ("pbs", {"qstat": "echo '    Exit_status = -29'"}, "failed"),
        ("pbs", {"qstat": "exit 1"}, "running"),
        ("sge", {"qstat": "exit 0", "qacct": "echo 'exit_status  0'"}, "running"),
        ("sge", {"qstat": "exit 1", "qacct": "echo 'exit_status  0'"}, "success"),
        ("sge", {"qstat": "exit 1", "qacct": "echo 'exit_status  137'"}, "failed"),
        ("sge", {"qstat": "exit 1", "qacct": "exit 1"}, "running"),
        ("lsf", {"bjobs": "echo PEND"}, "running"),
        ("lsf", {"bjobs": "echo DONE"}, "success"),
        ("lsf", {"bjobs": "echo EXIT"}, "failed"),
        ("slurm", {"squeue": "echo PENDING"}, "running"),
        ("slurm", {"squeue": "echo COMPLETING"}, "running"),
        ("slurm", {"squeue": "echo COMPLETED"}, "success"),
        ("slurm", {"squeue": "echo TIMEOUT"}, "failed"),
        ("slurm", {"squeue": "exit 1"}, "running"),
    ],
)
def test_the_state_of_a_job_is_told_in_snakemakes_words(schedulers, scheduler, programs, status):
    for name, body in programs.items():
        program(schedulers / name, f"#!/bin/sh\n{body}\n")
    assert call("status", 4711, scheduler=scheduler).stdout == f"{status}\n"


@pytest.mark.parametrize(
    ("scheduler", "asked"), [("pbs", "qdel 1 2"), ("sge", "qdel 1 2"), ("lsf", "bkill 1 2"), ("slurm", "scancel 1 2")]
)
def test_jobs_are_cancelled(schedulers, scheduler, asked):
    call("cancel", 1, 2, scheduler=scheduler)
    assert (schedulers / "calls").read_text() == asked + "\n"


@pytest.mark.parametrize("script", ["submit", "status"])
def test_an_unknown_scheduler_is_refused(script, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    result = call(script, 2, 1500, 90, "rule", "job.sh", scheduler="condor")
    assert result.returncode == 2
    assert result.stderr == "SCHEDULER is 'condor'; allowed: pbs, sge, lsf, slurm.\n"


@pytest.mark.parametrize("name", ["slurm", "generic"])
def test_what_was_interrupted_is_submitted_again(name):
    profile = yaml.safe_load((PROFILES / name / "config.yaml").read_text())
    assert profile["retries"] >= 1
    assert profile["config"] == ["batch_minutes=20"]
    assert {text.split("=")[0] for text in profile["default-resources"]} == {"mem_mb", "runtime"}
