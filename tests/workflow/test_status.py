"""`make status`: a running, finished, empty and broken study, told from its files alone."""

import json
import os
import signal
import subprocess
import sys

import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from virtual_soil.campaign import status
from virtual_soil.campaign.tables import METADATA_KEY

NOW = 1_800_000_000.0


def write(path, columns, provenance=None):
    path.parent.mkdir(parents=True, exist_ok=True)
    pq.write_table(pa.table(columns).replace_schema_metadata({METADATA_KEY: json.dumps(provenance)}), path)


def plan(folder, experiments, fidelity="campaign", first=0):
    """A design with one simulation for each experiment given; returns their ids."""
    names = [f"{first + k:010x}" for k in range(len(experiments))]
    write(folder / "design.parquet", {"simulation_id": names, "experiment": experiments, "fidelity": [fidelity] * len(names)})
    return names


def finish(results, experiment, name, seconds=10.0, outcome="static", reason="", engine="a", age_s=0.0):
    folder = results / "sims" / experiment / name
    provenance = {"engine": engine, "simulations": {name: {"design": {}, "settings": {}}}}
    write(folder / "run.parquet", {"simulation_id": [name], "status": [outcome], "reason": [reason]}, provenance)
    os.utime(folder / "run.parquet", (NOW - age_s, NOW - age_s))
    (folder / "timing.json").write_text(json.dumps({"wall_time_s": {name: seconds}}))


def log(root, experiment, name, text, age_s):
    path = root / "logs" / "study" / experiment / f"{name}.log"
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text)
    os.utime(path, (NOW - age_s, NOW - age_s))


@pytest.fixture(autouse=True)
def expected(monkeypatch):
    """What a simulation is expected to take, as what it is made of stands nowhere here."""
    monkeypatch.setattr(status, "expected_s", lambda row, settings: 20.0)


@pytest.fixture
def results(tmp_path):
    folder = tmp_path / "results" / "study"
    folder.mkdir(parents=True)
    return folder


def counts(text, step):
    """The numbers of a step's line, by state."""
    line = next(line for line in text.splitlines() if line.startswith(step))
    return dict(zip(status.STATES, map(int, line[len(step) :].split()), strict=False))


def test_a_running_study_says_what_runs_what_failed_and_when_it_ends(results, tmp_path):
    a, b, c, d, e = plan(results, ["repose"] * 5)
    finish(results, "repose", a, seconds=100.0)
    finish(results, "repose", b, seconds=1.0, outcome="failed", reason="blew up")
    log(tmp_path, "repose", b, "Traceback (most recent call last):\nSimulationError: blew up\n", age_s=30.0)
    log(tmp_path, "repose", c, "fill: step 500\nlift: about 40 %\n", age_s=5.0)
    log(tmp_path, "repose", d, "lift: about 10 %\n", age_s=1000.0)
    text = status.report("study", tmp_path, NOW)
    assert counts(text, "campaign, heaps") == {"done": 1, "running": 1, "failed": 1, "stopped": 1, "waiting": 1, "outdated": 0}
    assert "2 of 5 planned simulations (40 %)" in text
    assert f"running: repose {c}: lift: about 40 %" in text
    assert f"failed: repose {b}: blew up" in text
    # the one that was stopped and the one that waits take 100 s each, the running one 50 s more; failed ones' times do not count
    assert "about 4.2 min one after another, 4.2 min at 1 at once" in text
    assert e not in text


def test_a_job_that_crashed_is_failed_and_named_with_its_log(results, tmp_path):
    (name,) = plan(results, ["shear"])
    log(tmp_path, "shear", name, "Traceback (most recent call last):\n  File ...\nKeyError: 'seed'\n", age_s=1.0)
    log(tmp_path, ".", "measure_shear", "Traceback (most recent call last):\nTableError: no column\n", age_s=1.0)
    text = status.report("study", tmp_path, NOW)
    assert counts(text, "campaign, shear tests")["failed"] == 1
    assert f"{name}.log: KeyError: 'seed'" in text
    assert "measure_shear.log: TableError: no column" in text
    assert text.endswith("1 simulations crashed and have no result: the campaign cannot end before they are run again.")


def test_a_finished_study_says_where_its_report_is(results, tmp_path):
    first, both = plan(results, ["repose", "shear"])
    finish(results, "repose", first)
    finish(results, "shear", both, outcome="done")
    # the same simulation in a later step counts once
    plan(results / "rounds" / "1", ["repose"])
    assert "all planned simulations are done; the report is not written yet" in status.report("study", tmp_path, NOW).lower()
    (results / "report.html").write_text("</html>")
    text = status.report("study", tmp_path, NOW)
    assert "2 of 2 planned simulations (100 %)" in text
    assert f"Finished: {results / 'report.html'}" in text
    assert "round 1" not in text


def test_an_old_report_does_not_end_a_study_that_goes_on(results, tmp_path):
    (results / "report.html").write_text("</html>")
    (name,) = plan(results, ["repose"])
    finish(results, "repose", name, seconds=7.0)
    plan(results / "verification", ["repose"], first=5)
    text = status.report("study", tmp_path, NOW)
    assert counts(text, "verification, heaps")["waiting"] == 1
    assert "about 7 s one after another, by" in text
    assert "Finished" not in text


def test_results_of_an_earlier_engine_are_outdated_not_done(results, tmp_path):
    names = plan(results, ["repose"] * 3)
    for name, engine, age_s in zip(names, ("old", "new", "old"), (500.0, 10.0, 400.0), strict=True):
        finish(results, "repose", name, seconds=40.0, engine=engine, age_s=age_s)
    (results / "report.html").write_text("</html>")
    text = status.report("study", tmp_path, NOW)
    found = counts(text, "campaign, heaps")
    assert (found["done"], found["outdated"], found["waiting"]) == (1, 2, 0)
    assert "1 of 3 planned simulations (33 %)" in text
    assert "about 80 s one after another" in text
    assert "Finished" not in text


def test_times_are_those_of_the_same_fidelity(results, tmp_path):
    (quick,) = plan(results, ["repose"])
    finish(results, "repose", quick, seconds=10.0)
    slow, _ = plan(results / "rounds" / "1", ["repose"] * 2, fidelity="reference", first=10)
    finish(results, "repose", slow, seconds=90.0)
    assert "about 90 s one after another" in status.report("study", tmp_path, NOW)


def test_before_anything_has_finished_no_time_is_said(results, tmp_path):
    plan(results, ["repose", "shear"])
    text = status.report("study", tmp_path, NOW)
    assert "2 simulations are of a kind of which none has finished" in text
    assert "one after another" not in text


def test_an_empty_study_and_one_that_does_not_exist(results, tmp_path):
    assert status.report("study", tmp_path, NOW) == "study: no simulation is planned yet."
    plan(results, ["repose"])
    with pytest.raises(SystemExit, match="there is no results/sudty; started studies: study"):
        status.report("sudty", tmp_path, NOW)


def test_a_broken_result_is_failed_and_a_broken_design_is_named(results, tmp_path):
    (name,) = plan(results, ["repose"])
    finish(results, "repose", name)
    (results / "sims" / "repose" / name / "run.parquet").write_bytes(b"half a file")
    text = status.report("study", tmp_path, NOW)
    assert counts(text, "campaign, heaps") == {"done": 0, "running": 0, "failed": 1, "stopped": 0, "waiting": 0, "outdated": 0}
    assert f"{name}: unreadable result" in text
    (results / "design.parquet").write_bytes(b"half a file")
    with pytest.raises(SystemExit, match=r"design\.parquet: not a readable table"):
        status.report("study", tmp_path, NOW)


def test_four_hundred_simulations_are_counted(results, tmp_path):
    for name in plan(results, ["repose"] * 200 + ["shear"] * 200):
        finish(results, "repose" if int(name, 16) < 200 else "shear", name)
    assert "400 of 400" in status.report("study", tmp_path, NOW)


def batch(results, experiment, name, members, seconds, where="sims"):
    """The result of a batch, or with `where` = checkpoints what one member of it has left."""
    folder = results / where / (experiment if where == "sims" else "") / name
    runs = {"simulation_id": members, "status": ["static"] * len(members), "reason": [""] * len(members)}
    write(folder / "run.parquet", runs, {"engine": "a", "simulations": {m: {"design": {}, "settings": {}} for m in members}})
    (folder / "timing.json").write_text(json.dumps({"wall_time_s": dict.fromkeys(members, seconds)}))


def test_members_of_a_batch_are_counted_one_by_one_while_it_runs(results, tmp_path):
    a, b, c, d = plan(results, ["repose"] * 4)
    batch(results, "repose", a, [a], 10.0, where="checkpoints")
    text = (
        f"simulation {a}: 1 of 4\nlift: about 90 %\nsimulation {b}: 2 of 4\nTraceback (most recent call last):\nKeyError: 'seed'\n"
    )
    log(tmp_path, "repose", "campaign-0", f"{text}simulation {c}: 3 of 4\nlift: about 40 %\n", age_s=5.0)
    found = status.report("study", tmp_path, NOW)
    expected = {"done": 1, "running": 1, "failed": 1, "waiting": 1, "stopped": 0, "outdated": 0}
    assert counts(found, "campaign, heaps") == expected
    assert f"running: repose {c}: lift: about 40 %" in found
    assert "campaign-0.log: KeyError: 'seed'" in found
    batch(results, "repose", "campaign-0", [a, b, c, d], 10.0)
    assert "4 of 4 planned simulations (100 %)" in status.report("study", tmp_path, NOW)


def test_a_batch_that_did_not_come_to_its_first_simulation_is_named(results, tmp_path):
    plan(results, ["repose"] * 2)
    log(tmp_path, "repose", "campaign", "Traceback (most recent call last):\nImportError: no numba\n", age_s=5.0)
    assert "failed: " + str(tmp_path / "logs/study/repose/campaign.log") + ": ImportError: no numba" in status.report(
        "study", tmp_path, NOW
    )


def test_the_cost_model_is_compared_with_what_simulations_took(results, tmp_path):
    names = plan(results, ["repose"] * 11)
    for name, seconds in zip(names, (5.0, 10.0, *[20.0] * 7, 40.0, 80.0), strict=True):
        finish(results, "repose", name, seconds=seconds)
    text = status.report("study", tmp_path, NOW)
    assert text.endswith("Expected over measured time, median (8 of 10 lie within): heaps 1.00 (0.50 to 2.00).")


def test_a_reader_that_closes_the_pipe_is_no_fault():
    read, write = os.pipe()
    os.close(read)
    done = subprocess.run([sys.executable, status.__file__, "--help"], stdout=write, stderr=subprocess.PIPE, check=False)
    os.close(write)
    assert (done.returncode, done.stderr) == (-signal.SIGPIPE, b"")
