"""A simulation that is stopped, however and whenever, and run again writes the same tables as one that nobody disturbed."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

import dem
from virtual_soil.campaign import resume
from virtual_soil.campaign.resume import Checkpoint
from virtual_soil.campaign.simulate import run_batch

ROOT = Path(__file__).parents[2]
ROW = {
    "simulation_id": "0123456789", "point_id": "01234567", "fidelity": "campaign",
    "radius_m": 1e-3, "radius_sd_ratio": 0.1, "density_kg_m3": 2500.0,
    "poisson_ratio": 0.2, "shear_modulus_pa": 1e7, "static_friction": 0.6, "rolling_friction": 0.2, "restitution": 0.5, "seed": 1,
    "normal_stress_pa": 500.0,
}  # fmt: skip
ENGINE = {"rolling_model": "type_a", "damping_model": "edem", "precision": "float32", "gravity_m_s2": 9.81}
HEAP = {
    "n_particles": 80, "tube_diameter_ratio": 5.0, "plate_half_width_ratio": 30.0, "lift_speed_m_s": 0.05, "max_time_s": 0.5,
    "scale_radius_m": 1e-3,
}  # fmt: skip
BOX = {
    "length_ratio": 16.0, "height_ratio": 10.0, "width_ratio": 6.0, "displacement_ratio": 1.0, "frame_static_friction": 0.0,
    "preparation_friction_ratio": 0.3, "inertial_number": 0.005, "scale_radius_m": 1e-3, "normal_stress_pa": 500.0,
}  # fmt: skip
SETTINGS = {
    "repose": {
        "setup": HEAP,
        "engine": ENGINE | {"time_step_rayleigh_ratio": 0.2, "stiffness_reduction": 1.0},
    },
    "shear": {
        "setup": BOX,
        "engine": ENGINE | {"time_step_rayleigh_ratio": 0.3, "stiffness_reduction": 11.0},
    },
}
NAME = ROW["simulation_id"]
TABLES = ("history", "before", "after", "run")
EXPERIMENTS = ("repose", "shear")

# Runs a rule's script as Snakemake does: as the main program, with a `snakemake` among its globals.
JOB = """
import json, runpy, sys
from types import SimpleNamespace
job = {key: SimpleNamespace(**value) if key in ("params", "resources") else value for key, value in json.load(sys.stdin).items()}
runpy.run_path(sys.argv[1], {"snakemake": SimpleNamespace(**job)}, "__main__")
"""


def outputs(folder):
    return {name: str(folder / name) for name in (*TABLES, "timing")}


def simulate(experiment, folder, row=ROW, engine="engine", interval_s=300.0):
    """Run a script's main in this process."""
    folder.mkdir(exist_ok=True)
    members, output = [(row | {"experiment": experiment}, SETTINGS[experiment])], outputs(folder)
    run_batch(members, engine, output, str(folder / "saved"), interval_s)


def started(experiment, folder, interval_s):
    """Start a script as a job of its own."""
    folder.mkdir(exist_ok=True)
    job = {
        "params": {
            "members": [(ROW | {"experiment": experiment}, SETTINGS[experiment])],
            "engine": "engine",
            "checkpoints": str(folder / "saved"),
        },
        "resources": {"checkpoint_interval_s": interval_s},
        "output": outputs(folder),
        "log": [str(folder / "log")],
    }
    script = ROOT / "workflow" / "scripts" / "simulate.py"
    path = os.pathsep.join(map(str, (script.parent, ROOT / "src")))
    process = subprocess.Popen(
        [sys.executable, "-c", JOB, str(script)], stdin=subprocess.PIPE, text=True, env=os.environ | {"PYTHONPATH": path}
    )
    process.stdin.write(json.dumps(job))
    process.stdin.close()
    return process


def tables(experiment, folder):
    """Bytes of all tables of a simulation."""
    return {name: (folder / name).read_bytes() for name in TABLES}


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory):
    """Experiment -> bytes of its tables."""
    found = {}
    for experiment in EXPERIMENTS:
        folder = tmp_path_factory.mktemp(experiment)
        simulate(experiment, folder)
        found[experiment] = tables(experiment, folder)
    return found


@pytest.fixture
def stop_at(monkeypatch):
    """Has simulations get SIGTERM at their n-th look from now on; 0: never."""
    keep = Checkpoint.keep

    def stop(n):
        looks = []

        def counted(self, state):
            looks.append(state.stage)
            if len(looks) == n:
                os.kill(os.getpid(), signal.SIGTERM)
            keep(self, state)

        monkeypatch.setattr(Checkpoint, "keep", counted)
        return looks

    return stop


@pytest.mark.parametrize("experiment", EXPERIMENTS)
def test_a_simulation_stopped_at_any_look_goes_on_bit_for_bit(experiment, undisturbed, tmp_path, stop_at, capsys):
    looks = stop_at(0)
    simulate(experiment, tmp_path / "counted")
    assert tables(experiment, tmp_path / "counted") == undisturbed[experiment]
    first, later = looks.index(looks[0]), looks.index(looks[-1])
    assert looks[0] != looks[-1]  # both stages are long enough to be stopped
    for n in (first + 1, later, later + 1, later + 2, (later + len(looks)) // 2, len(looks)):
        folder = tmp_path / str(n)
        stop_at(n)
        with pytest.raises(SystemExit) as ended:
            simulate(experiment, folder)
        assert ended.value.code == 128 + signal.SIGTERM
        assert not (folder / "run").exists()
        stop_at(0)
        simulate(experiment, folder)
        assert "goes on from" in capsys.readouterr().out
        assert tables(experiment, folder) == undisturbed[experiment]
        assert not list((folder / "saved").iterdir())


@pytest.mark.parametrize("experiment", EXPERIMENTS)
def test_a_simulation_stopped_again_and_again_goes_on_bit_for_bit(experiment, undisturbed, tmp_path, stop_at):
    for _ in range(200):
        stop_at(7)
        try:
            simulate(experiment, tmp_path)
            break
        except SystemExit:
            pass
    assert tables(experiment, tmp_path) == undisturbed[experiment]


@pytest.mark.parametrize("experiment", EXPERIMENTS)
def test_a_job_that_is_killed_at_random_moments_goes_on_bit_for_bit(experiment, undisturbed, tmp_path):
    checkpoint, delays, logs = tmp_path / "saved" / f"{NAME}.npz", np.random.default_rng(1), ""
    for wait_s in (0.0, *delays.uniform(0.0, 0.3, 3), 1e9):  # the first kill comes before a fast job can end
        before = checkpoint.stat().st_mtime_ns if checkpoint.exists() else 0
        process = started(experiment, tmp_path, 0.0)
        while process.poll() is None and (not checkpoint.exists() or checkpoint.stat().st_mtime_ns == before):
            time.sleep(0.002)
        if wait_s == 1e9:
            assert process.wait() == 0
        else:
            time.sleep(wait_s)
            process.kill()
            process.wait()
        logs += (tmp_path / "log").read_text()  # every attempt begins its log anew
        if process.returncode == 0:
            break
    assert process.returncode == 0
    assert "goes on from" in logs
    assert tables(experiment, tmp_path) == undisturbed[experiment]
    assert not list((tmp_path / "saved").iterdir())


def test_a_job_that_is_asked_to_end_saves_first_and_fails(undisturbed, tmp_path):
    process = started("repose", tmp_path, 0.0)
    while not (tmp_path / "saved" / f"{NAME}.npz").exists():
        assert process.poll() is None
        time.sleep(0.002)
    process.terminate()
    assert process.wait() == 128 + signal.SIGTERM
    log = (tmp_path / "log").read_text()
    assert "SIGTERM: ends at step" in log
    step = int(log.split("ends at step ")[1].split(",")[0])
    assert started("repose", tmp_path, 300.0).wait() == 0
    assert f"step {step}, after" in (tmp_path / "log").read_text()
    assert tables("repose", tmp_path) == undisturbed["repose"]


def test_wall_time_counts_the_attempts_before(tmp_path, stop_at):
    stop_at(5)
    with pytest.raises(SystemExit):
        simulate("repose", tmp_path)
    path = tmp_path / "saved" / f"{NAME}.npz"
    simulation, notes = dem.checkpoint.load_with_notes(path)
    notes["job"]["spent_s"] = 1000.0
    dem.save(simulation, path, notes)
    stop_at(0)
    simulate("repose", tmp_path)
    assert json.loads((tmp_path / "timing").read_text())["wall_time_s"][NAME] > 1000.0


def truncated(path):
    path.write_bytes(path.read_bytes()[:-1000])


def emptied(path):
    path.write_bytes(b"")


def one_byte_changed(path):
    """One byte of the largest array; what lies between the arrays, and is read by nobody, may change."""
    with np.load(path) as archive:
        largest = max(archive.values(), key=lambda array: array.nbytes)
    content = bytearray(path.read_bytes())
    content[content.index(largest.tobytes()) + largest.nbytes // 2] ^= 1
    path.write_bytes(content)


def another_engine(path):
    with np.load(path) as archive:
        arrays = dict(archive)
    arrays["description"] = np.array(json.dumps(json.loads(str(arrays["description"])) | {"engine": "0" * 16}))
    with open(path, "wb") as file:
        np.savez(file, **arrays)


def not_ours(path):
    simulation, _ = dem.checkpoint.load_with_notes(path)
    dem.save(simulation, path)


def left(folder, stop_at, **others):
    """The checkpoint that a stopped simulation, which may differ in something, leaves."""
    stop_at(20)
    with pytest.raises(SystemExit):
        simulate("repose", folder, **others)
    stop_at(0)
    return folder / "saved" / f"{NAME}.npz"


@pytest.mark.parametrize("harm", [truncated, emptied, one_byte_changed, another_engine, not_ours])
def test_a_checkpoint_that_cannot_be_used_is_named_and_the_simulation_begins_anew(harm, undisturbed, tmp_path, stop_at, capsys):
    harm(left(tmp_path, stop_at))
    capsys.readouterr()
    simulate("repose", tmp_path)
    lines = [line for line in capsys.readouterr().out.splitlines() if "checkpoint" in line]
    assert len(lines) == 1
    assert lines[0].startswith("begins anew: ")
    assert tables("repose", tmp_path) == undisturbed["repose"]


@pytest.mark.parametrize("others", [{"row": ROW | {"seed": 2}}, {"row": ROW | {"restitution": 0.4}}, {"engine": "other"}])
def test_a_checkpoint_of_another_simulation_is_not_gone_on_from(others, undisturbed, tmp_path, stop_at, capsys):
    left(tmp_path, stop_at, **others)
    capsys.readouterr()
    simulate("repose", tmp_path)
    assert capsys.readouterr().out.count("begins anew: ") == 1
    assert tables("repose", tmp_path) == undisturbed["repose"]


def test_a_full_disk_does_not_end_the_simulation(undisturbed, tmp_path, monkeypatch, capsys):
    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(resume, "save_state", full)
    simulate("repose", tmp_path, interval_s=0.0)
    assert "no checkpoint at step 500: [Errno 28] No space left on device" in capsys.readouterr().out
    assert tables("repose", tmp_path) == undisturbed["repose"]
