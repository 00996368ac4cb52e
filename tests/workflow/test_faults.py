"""Faults of disk, clock, processes and people while a campaign runs.

In each: a clear message, no partial file under a final name, and, when the cause is gone, a rerun that ends in the same bytes as
the campaign that nobody disturbed. Faults inside one simulation are in test_checkpoint.py, those of the kernel cache in
tests/dem/test_compiled.py. VIRTUAL_SOIL_FAULT_TRIES: how many times each fault that comes at a random moment is tried.
"""

import contextlib
import os
import re
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import psutil
import pyarrow.parquet as pq
import pytest
import yaml
from campaign import ENVIRONMENT, copy_project, counted, differing, essence

from virtual_soil.campaign.files import PART
from virtual_soil.campaign.manifest import differences

TRIES = int(os.environ.get("VIRTUAL_SOIL_FAULT_TRIES", "1"))
RESULTS = Path("results") / "tiny"
#: What the simulations are reduced to; everything behind it depends on their tables alone.
MEASURED = [str(RESULTS / name) for name in ("repose.parquet", "shear.parquet", "strength.parquet")]


def tiny(config: dict) -> dict:
    """The default configuration, as small as it can be while all rules still run."""
    point = {"static_friction": 0.8, "rolling_friction": 0.3}
    seeds = {"repose_seeds": [1], "shear_seeds": [1]}
    quick = {"lift_speed_m_s": 3e-2, "repose_stiffness_number": None, "shear_inertial_number": 0.05}
    grid = {"static_friction": [0.1, 0.4, 0.8], "rolling_friction": [0.05, 0.1, 0.3]}
    config["study"], config["experiments"] = "tiny", ["repose", "shear"]
    config["design"] |= {"grid": grid, "sweep": {"radius_m": [50e-6, 100e-6]}, "sweep_couples": [point], **seeds}
    config["screening"] |= {"base_seeds": [1, 2], "changed_seeds": [1], "factors": {"rolling_friction": 2.0}}
    config["fidelity"]["campaign"] |= quick | {"shear_stiffness_number": 1000.0}
    config["fidelity"]["reference"] |= quick | {"shear_stiffness_number": 2000.0}
    config["fidelity"]["check"] |= {"couples": [point], "normal_stresses_pa": [500.0], **seeds}
    # in a tube of five diameters rough grains may wedge and rise with it
    config["repose"] |= {"n_particles": 200, "tube_diameter_ratio": 7.0, "plate_half_width_ratio": 20.0}
    config["shear"] |= {
        "length_ratio": 14.0, "height_ratio": 8.0, "width_ratio": 5.0, "displacement_ratio": 1.0,
        "normal_stresses_pa": [250.0, 500.0, 1000.0],
    }  # fmt: skip
    for form in config["surrogate"].values():
        form["g"] = "log"
    config["soils"], config["optimise"]["cases"] = config["soils"][:1], config["optimise"]["cases"][:1]
    config["optimise"]["cases"][0]["weights"] = {"angle_of_repose": 1, "cohesion": 1, "friction_angle": 1}
    config["optimise"]["n_starts"] = 2
    config["uncertainty"] |= {"n_samples": 100, "n_equivalents": 3}
    config["refine"] |= {"points_per_case": 1, **seeds}
    config["verify"] |= {"repose_seeds": [101], "shear_seeds": [101], "more_seeds": 0}
    # heaps as stiff as they are take a second, and are saved often: whatever is stopped goes on from the middle
    # each has a job and a folder of its own, so that a fault can be aimed at one
    return config | {"checkpoint_interval_s": 0.05, "batch_minutes": 0}


def started(project: Path, *arguments: str) -> subprocess.Popen:
    """Start snakemake in a process group of its own; its output goes to `output` in the project."""
    command = [sys.executable, "-m", "snakemake", "-c2", *arguments]
    with open(project / "output", "w", encoding="utf-8") as file:
        return subprocess.Popen(command, cwd=project, env=ENVIRONMENT, stdout=file, stderr=file, start_new_session=True)


def ended(project: Path, *arguments: str) -> tuple[int, str]:
    """Run snakemake; exit status and output."""
    status = started(project, *arguments).wait()
    return status, (project / "output").read_text()


def reruns(project: Path, *targets: str) -> None:
    """Run what is missing, which must succeed; a lock that a killed run has left is removed."""
    if any((project / ".snakemake" / "locks").glob("*")):
        ended(project, "--unlock")
    status, output = ended(project, *targets)
    assert status == 0, output[-5000:]


def same(project: Path, reference: Path) -> None:
    """All results that were asked for are there, are those of the undisturbed campaign, and nothing is left of the fault."""
    mine, others = essence(project / RESULTS), essence(reference / RESULTS)
    if not (project / RESULTS / "report.html").exists():
        others = {name: content for name, content in others.items() if name.startswith("sims/") or name in mine}
        assert all((project / name).exists() for name in MEASURED)
    assert mine.keys() == others.keys()
    assert not differing(mine, others)
    assert not list((project / RESULTS).glob("checkpoints/*"))


def nothing_partial(project: Path, reference: Path) -> None:
    """Every file of a simulation that has its final name is whole."""
    for path in (project / RESULTS / "sims").rglob("*.parquet"):
        assert path.name.startswith(PART) or path.read_bytes() == (reference / path.relative_to(project)).read_bytes()


def campaign(project: Path, experiment: str) -> list[Path]:
    """Folders of an experiment's simulations in the campaign's design, in its order."""
    design = pq.read_table(project / RESULTS / "design.parquet", columns=["experiment", "simulation_id"]).to_pylist()
    names = [row["simulation_id"] for row in design if row["experiment"] == experiment]
    return [project / RESULTS / "sims" / experiment / name for name in names]


def forget(project: Path, n: int) -> list[Path]:
    """Remove the last n simulations of each experiment in the campaign's design, and all that depends on them; their folders."""
    folders = [folder for experiment in ("repose", "shear") for folder in campaign(project, experiment)[-n:]]
    kept = ("design.parquet", "kernels.txt", "soil.parquet", "sims")
    others = [path for path in (project / RESULTS).iterdir() if path.name not in kept]
    for path in (*folders, *others):
        shutil.rmtree(path) if path.is_dir() else path.unlink()
    return folders


def running(head: subprocess.Popen, project: Path) -> list[psutil.Process]:
    """Wait for simulations that run under a head and have saved themselves; empty when it ended before."""
    while head.poll() is None:
        with contextlib.suppress(psutil.NoSuchProcess):
            jobs = [job for job in psutil.Process(head.pid).children() if any("simulate" in word for word in job.cmdline())]
            if jobs and list((project / RESULTS / "checkpoints").glob("*.npz")):
                return jobs
        time.sleep(0.02)
    return []


@pytest.fixture(scope="session")
def reference(tmp_path_factory):
    """A finished campaign that nobody disturbed."""
    project = copy_project(tmp_path_factory.mktemp("reference"))
    file = project / "config" / "config.yaml"
    file.write_text(yaml.safe_dump(tiny(yaml.safe_load(file.read_text())), sort_keys=False))
    reruns(project, "all")
    return project


@pytest.fixture
def project(reference, tmp_path):
    """A copy of the finished campaign, to disturb; file times are kept."""
    return Path(shutil.copytree(reference, tmp_path / "project", symlinks=True))


@pytest.fixture
def mounted():
    """Mounts something over a folder until the test ends; skips the test where that is not allowed."""
    done = []

    def mount(*arguments):
        result = subprocess.run(["mount", *map(str, arguments)], capture_output=True, text=True, check=False)
        if result.returncode:
            pytest.skip(f"cannot mount: {result.stderr.strip()}")
        done.append(arguments[-1])

    if shutil.which("mount") is None:
        pytest.skip("no mount on this machine")
    yield mount
    for folder in reversed(done):
        subprocess.run(["umount", "--lazy", str(folder)], check=False)


@pytest.mark.parametrize("seed", range(TRIES))
def test_snakemake_is_killed_at_a_random_moment(reference, project, seed):
    targets = MEASURED if seed else ["all"]
    forget(project, 2)
    head = started(project, *targets)
    assert running(head, project)
    time.sleep(np.random.default_rng(seed).uniform(0.0, 2.0))
    jobs = psutil.Process(head.pid).children()
    head.kill()
    head.wait()
    assert not psutil.wait_procs(jobs, timeout=60)[1]  # nobody works on for a head that is gone
    nothing_partial(project, reference)
    status, output = ended(project, *targets)
    assert status != 0
    assert "--unlock" in output
    reruns(project, *targets)
    same(project, reference)
    if seed == 0:
        assert differences(project / RESULTS) == []


@pytest.mark.parametrize("seed", range(TRIES))
@pytest.mark.parametrize("how", ["SIGKILL of a job", "SIGTERM of a job", "SIGTERM of snakemake", "SIGINT of all"])
def test_something_is_stopped_at_a_random_moment(reference, project, how, seed):
    forget(project, 2)
    head = started(project, *MEASURED)
    jobs = running(head, project)
    assert jobs
    time.sleep(np.random.default_rng(seed).uniform(0.0, 0.2))
    with contextlib.suppress(psutil.NoSuchProcess):
        if how.endswith("job"):
            jobs[0].send_signal(signal.Signals[how.split()[0]])
        elif how.endswith("snakemake"):
            head.send_signal(signal.SIGTERM)
        else:
            os.killpg(head.pid, signal.SIGINT)
    head.wait()
    nothing_partial(project, reference)
    reruns(project, *MEASURED)
    same(project, reference)


def test_the_disk_is_full(reference, project, mounted):
    results = project / "results"
    kept = results.rename(project / "kept")
    results.mkdir()
    need = sum(path.stat().st_size for path in kept.rglob("*"))
    mounted("-t", "tmpfs", "-o", f"size={need + 2**24}", "tmpfs", results)
    shutil.copytree(kept, results, dirs_exist_ok=True)
    folders = forget(project, 1)
    free = os.statvfs(results)
    (results / "ballast").write_bytes(bytes((free.f_bavail - 1) * free.f_frsize))  # one block is left
    status, output = ended(project, *MEASURED)
    assert status != 0
    lines = [line.strip() for line in output.splitlines() if line.startswith("error: ")]
    assert lines
    assert "Traceback" not in output
    for line in lines:
        assert re.fullmatch(r"error: results/tiny/.*: cannot be written \(No space left on device\)\. Make room .*", line), line
    assert not any((folder / "run.parquet").exists() for folder in folders)
    nothing_partial(project, reference)
    (results / "ballast").unlink()
    reruns(project, *MEASURED)
    same(project, reference)


def test_the_results_are_read_only(reference, project, mounted):
    forget(project, 1)
    results = project / "results"
    mounted("--bind", results, results)
    mounted("-o", "remount,ro,bind", results)
    status, output = ended(project, *MEASURED)
    assert status != 0
    assert re.search(r"Read-only file system: 'results/tiny|Write-protected output files", output), output[-3000:]
    subprocess.run(["mount", "-o", "remount,rw,bind", str(results)], check=True)
    reruns(project, *MEASURED)
    same(project, reference)


def truncated(path):
    path.write_bytes(path.read_bytes()[:-100])


def emptied(path):
    path.write_bytes(b"")


def of_another_program(path):
    table = pq.read_table(path)
    pq.write_table(table.rename_columns([f"{name}_" for name in table.column_names]), path)


def of_another_simulation(path):
    other = next(folder for folder in sorted(path.parents[1].iterdir()) if folder != path.parent)
    shutil.copyfile(other / path.name, path)


@pytest.mark.parametrize(
    ("harm", "experiment", "file", "says"),
    [
        (truncated, "repose", "run.parquet", "not a readable Parquet file"),
        (emptied, "shear", "history.parquet", "not a readable Parquet file"),
        (of_another_program, "shear", "run.parquet", "column 'simulation_id' is missing"),
        (of_another_simulation, "repose", "after.parquet", "made by other simulations"),
        (truncated, "shear", "timing.json", "not the wall times of its simulations"),
    ],
)
def test_a_result_is_damaged(reference, project, harm, experiment, file, says):
    path = campaign(project, experiment)[0] / file
    harm(path)
    status, output = ended(project, *MEASURED)
    assert status != 0
    (line,) = {line.strip() for line in output.splitlines() if says in line}
    assert line.startswith(f"error: {path.relative_to(project)}: ")
    assert line.endswith("Delete it and run again.")
    assert "Traceback" not in output
    path.unlink()
    reruns(project, *MEASURED)
    same(project, reference)


def test_the_design_of_a_later_stage_is_damaged(reference, project):
    path = project / RESULTS / "rounds" / "1" / "design.parquet"
    content = path.read_bytes()
    truncated(path)
    status, output = ended(project, "-n", "all")
    assert status != 0
    assert f"{path.relative_to(project)}: not a readable Parquet file" in output
    assert "Delete it and run again." in output
    path.unlink()
    reruns(project, str(RESULTS / "rounds" / "1" / "design.parquet"))
    assert path.read_bytes() == content


def test_two_campaigns_in_one_folder(reference, project):
    forget(project, 2)
    head = started(project, *MEASURED)
    assert running(head, project)
    os.kill(head.pid, signal.SIGSTOP)  # held: where the second starts slowly, the first would have ended before
    status, output = ended(project, *MEASURED)
    os.kill(head.pid, signal.SIGCONT)
    assert status != 0
    assert "Directory cannot be locked" in output
    assert head.wait() == 0
    same(project, reference)


@pytest.mark.parametrize("days", [-400, 400])
def test_the_clock_jumps(reference, project, days):
    """A clock that was wrong while half of the simulations ran leaves files from past or future: the files alone are imitated."""
    ids = sorted((project / RESULTS / "sims").glob("*/*"))
    for folder in ids[: len(ids) // 2]:
        for path in folder.iterdir():
            os.utime(path, (time.time() + days * 86400.0,) * 2)
    reruns(project, *MEASURED)
    same(project, reference)
    status, output = ended(project, "-n", *MEASURED)
    assert status == 0
    assert "Nothing to be done" in output


def test_the_configuration_is_edited_while_it_runs(reference, project):
    forget(project, 2)
    file = project / "config" / "config.yaml"
    content = file.read_text()
    head = started(project, *MEASURED)
    assert running(head, project)
    file.write_text(yaml.safe_dump(yaml.safe_load(content) | {"repose": yaml.safe_load(content)["repose"] | {"max_time_s": 0.2}}))
    assert head.wait() == 0
    same(project, reference)
    status, output = ended(project, "-n", *MEASURED)
    assert status == 0
    # the edit counts from the next run on, for the heaps alone: the other order of the keys changes nothing
    assert counted(output) == {"simulate_repose": len(campaign(project, "repose")), "measure_repose": 1}
    file.write_text(content)
    assert "Nothing to be done" in ended(project, "-n", *MEASURED)[1]
