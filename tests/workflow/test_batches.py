"""Short simulations share a job: how they are shared out, and that what comes out does not depend on it."""

import hashlib
import json
import os
import signal

import numpy as np
import pandas as pd
import pytest
import yaml
from snakemake.utils import update_config

from virtual_soil.campaign import batches, simulate
from virtual_soil.campaign.code import ROOT
from virtual_soil.campaign.cost import expected_s
from virtual_soil.campaign.experiments.registry import BY_NAME
from virtual_soil.campaign.grains import empty_grains
from virtual_soil.campaign.measure import measured_table
from virtual_soil.campaign.simulate import one_row, run_batch
from virtual_soil.campaign.study import design_rows, experiment_settings, simulations
from virtual_soil.campaign.tables import TableError, folder_of, read_simulation, read_simulations, read_table, write_table


def names(n, first=0):
    """So many ids, as hashes are."""
    return [hashlib.sha256(str(first + k).encode()).hexdigest()[:10] for k in range(n)]


def shared(found):
    """The batches of more than one simulation."""
    return {batch: members for batch, members in found.items() if len(members) > 1}


def test_without_a_target_every_simulation_is_a_batch_called_by_its_id():
    expected = dict.fromkeys(names(20), 1.0)
    assert batches.batches(expected, 0.0, "") == {name: [name] for name in expected}


@pytest.mark.parametrize("n", [1, 50, 3000])
def test_every_simulation_is_in_just_one_batch_of_about_the_target(n):
    expected = {name: 1.0 + k % 3 for k, name in enumerate(names(n))}
    found = batches.batches(expected, 100.0, "")
    assert sorted(name for members in found.values() for name in members) == sorted(expected)
    times = [sum(expected[name] for name in members) for members in found.values()]
    assert max(times) <= 100.0 * batches.SPLIT_RATIO
    if n == 3000:  # hashes are spread evenly, but not exactly so
        assert 50.0 < np.median(times) < 142.0
        assert len(times) < 2 * sum(times) / 100.0


def test_batches_do_not_depend_on_the_order_of_the_simulations():
    expected = dict.fromkeys(names(500), 1.0)
    backwards = dict(reversed(expected.items()))
    assert batches.batches(expected, 30.0, "") == batches.batches(backwards, 30.0, "")


def test_one_new_simulation_changes_one_batch_at_most():
    expected, split = dict.fromkeys(names(1000), 1.0), 0
    before = batches.batches(expected, 25.0, "")
    for new in names(200, first=10_000):
        after = batches.batches(expected | {new: 1.0}, 25.0, "")
        gone = {batch for batch, members in before.items() if after.get(batch) != members}
        changed = [name for batch, members in after.items() if before.get(batch) != members for name in members]
        assert len(gone) <= 1
        assert set(changed) == {new}.union(*(before[batch] for batch in gone))
        split += len(after) > len(before) and bool(gone)
    assert split  # this happened too


def test_long_simulations_stay_alone_and_do_not_tear_short_ones_apart():
    expected = dict.fromkeys(names(40), 1.0) | dict.fromkeys(names(40, first=100), 1000.0)
    found = batches.batches(expected, 60.0, "")
    assert shared(found) == {"campaign": sorted(names(40))}
    assert all(found[name] == [name] for name in names(40, first=100))


@pytest.mark.parametrize(
    ("stage", "label"),
    [
        ("", "campaign"),
        ("/rounds/1", "round1"),
        ("/rounds/12", "round12"),
        ("/verification", "verification"),
        ("/verification/2", "verification2"),
    ],
)
def test_a_batch_is_called_by_its_stage_and_its_bits(stage, label):
    found = shared(batches.batches(dict.fromkeys(names(300), 1.0), 100.0, stage))
    assert len(found) > 1
    for batch, members in found.items():
        assert batch.startswith(f"{label}-")
        assert batches.stage_of(batch) == stage
        assert [name for name in names(300) if batches.may_hold(batch, name)] == [n for n in names(300) if n in members]
    assert not any(batches.may_hold(batch, "x" * 10) for batch in names(3))


def test_a_digest_changes_with_any_value_of_any_simulation():
    pair = ({"simulation_id": "a", "seed": 1}, {"setup": {"n": 3}})
    others = [[pair, pair], [({**pair[0], "seed": 2}, pair[1])], [(pair[0], {"setup": {"n": 4}})]]
    assert batches.digest([pair]) not in map(batches.digest, others)


def test_in_the_default_study_simulations_of_a_second_are_batched():
    config = yaml.safe_load((ROOT / "config" / "config.yaml").read_text()) | {"experiments": ["repose", "shear"]}
    rows = {name: row for name, row in simulations(config, design_rows(config)).items() if row["experiment"] == "shear"}
    expected = {name: expected_s(row, experiment_settings(config, row)) for name, row in rows.items()}
    found = batches.batches(expected, 1200.0, "")
    assert len(found) < len(rows) / 50
    update_config(config, yaml.safe_load((ROOT / "config" / "paper.yaml").read_text()))
    rows = simulations(config, design_rows(config))
    longer = {name: expected_s(row, experiment_settings(config, row)) for name, row in rows.items()}
    assert len(batches.batches(longer, 1200.0, "")) > len(found)


# Running a batch: with a stand-in for the simulation, so that it takes no time.


def heap(name, status="static"):
    """Tables of a heap, made from its id alone; a cone of grains, so that it can be measured."""
    rng = np.random.default_rng(int(name, 16))
    z = rng.uniform(0.0, 10e-3, 3000)
    angle, radius = rng.uniform(0.0, 2.0 * np.pi, 3000), np.sqrt(rng.random(3000)) * 2.0 * (10e-3 - z)
    columns = {
        "x_m": radius * np.cos(angle),
        "y_m": radius * np.sin(angle),
        "z_m": z,
        "radius_m": np.full(3000, 2e-4),
        "speed_m_s": np.zeros(3000),
    }
    grains = empty_grains() if status == "failed" else simulate.of_simulation(name, columns)
    run = {
        "simulation_id": name, "status": status, "reason": "blew up" if status == "failed" else "", "n_particles": 3000,
        "n_steps": 1, "simulated_time_s": np.nan if status == "failed" else 1.0, "max_overlap_ratio": 0.1,
        "energy_dissipated_j": np.nan, "energy_residual_ratio": np.nan, "n_lost": 0,
    }  # fmt: skip
    nothing = simulate.empty_columns(())
    tables = {"before": ("grains", grains), "after": ("grains", grains), "history": ("repose_history", nothing)}
    return {**tables, "run": ("repose_run", one_row(run))}


class Stand:
    """Simulates at once, fails where it should, and notes what it simulated."""

    def __init__(self, failed=(), broken=(), killed=(), asked=()):
        self.failed, self.broken, self.killed, self.asked, self.made = failed, broken, killed, asked, []

    def __call__(self, row, settings, checkpoint):
        name = row["simulation_id"]
        if name in self.killed:
            raise SystemExit(143)
        self.made.append(name)
        if name in self.asked:
            with checkpoint.on_signals():  # a signal after the last look
                os.kill(os.getpid(), signal.SIGTERM)
        if name in self.broken:
            raise KeyError("a bug")
        return heap(name, "failed" if name in self.failed else "static"), 1.5


def members(ids):
    return [({"simulation_id": name, "seed": 1}, {"setup": {}}) for name in ids]


def run(study, batch, ids, stand, engine="engine"):
    """Run a batch as the rule does; Snakemake deletes the outputs before."""
    folder = study / "sims" / "repose" / batch
    folder.mkdir(parents=True, exist_ok=True)
    output = {name: str(folder / f"{name}.parquet") for name in ("before", "after", "history", "run")}
    output["timing"] = str(folder / "timing.json")
    for path in folder.iterdir():
        path.unlink()
    run_batch(members(ids), engine, output, str(study / "checkpoints"), 300, stand)
    return folder


def contents(folder):
    return {path.name: path.read_bytes() for path in sorted(folder.iterdir())}


def test_a_batch_holds_its_simulations_one_after_another(tmp_path):
    ids = sorted(names(4))
    folder = run(tmp_path, "campaign", ids, Stand(failed=ids[1:2]))
    assert pd.read_parquet(folder / "run.parquet")["simulation_id"].tolist() == ids
    assert json.loads((folder / "timing.json").read_text()) == {"wall_time_s": dict.fromkeys(ids, 1.5)}
    found = dict(read_simulations(str(folder / "after.parquet"), "grains"))
    assert list(found) == [ids[0], ids[2], ids[3]]
    for name, frame in found.items():
        assert np.array_equal(frame["x_m"], heap(name)["after"][1]["x_m"])
        pd.testing.assert_frame_equal(read_simulation(str(folder / "after.parquet"), "grains", name), frame)
    assert len(read_simulation(str(folder / "after.parquet"), "grains", ids[1])) == 0
    assert not list((tmp_path / "checkpoints").iterdir())


def test_a_batch_that_was_killed_goes_on_after_its_last_finished_simulation(tmp_path):
    ids = sorted(names(5))
    undisturbed = contents(run(tmp_path / "undisturbed", "campaign", ids, Stand()))
    with pytest.raises(SystemExit):
        run(tmp_path / "killed", "campaign", ids, Stand(killed=ids[3:]))
    again = Stand()
    assert contents(run(tmp_path / "killed", "campaign", ids, again)) == undisturbed
    assert again.made == ids[3:]


@pytest.mark.parametrize("asked", [2, 4])
def test_a_batch_that_is_asked_to_end_after_a_simulations_last_look_ends_with_it_and_loses_nothing(asked, tmp_path, capsys):
    ids = sorted(names(5))
    undisturbed = contents(run(tmp_path / "undisturbed", "campaign", ids, Stand()))
    first, again = Stand(asked=ids[asked : asked + 1]), Stand()
    with pytest.raises(SystemExit) as ended:
        run(tmp_path / "asked", "campaign", ids, first)
    assert ended.value.code == 128 + signal.SIGTERM
    assert f"SIGTERM: ends after simulation {ids[asked]}" in capsys.readouterr().out
    assert contents(run(tmp_path / "asked", "campaign", ids, again)) == undisturbed
    assert first.made + again.made == ids


def test_a_fault_of_the_program_discards_no_sibling(tmp_path, capsys):
    ids = sorted(names(5))
    with pytest.raises(RuntimeError, match=f"1 of 5 simulations broke off: {ids[1]}; the others are kept"):
        run(tmp_path, "campaign", ids, Stand(broken=ids[1:2]))
    assert "KeyError: 'a bug'" in capsys.readouterr().err
    mended = Stand()
    folder = run(tmp_path, "campaign", ids, mended)
    assert mended.made == ids[1:2]
    assert pd.read_parquet(folder / "run.parquet")["simulation_id"].tolist() == ids


def test_what_was_simulated_alone_or_in_another_batch_is_not_simulated_again(tmp_path):
    ids = sorted(names(6))
    undisturbed = contents(run(tmp_path / "undisturbed", "campaign", ids, Stand()))
    run(tmp_path, ids[0], ids[:1], Stand())
    low, high = [name for name in ids[1:] if name < "8"], [name for name in ids[1:] if name >= "8"]
    run(tmp_path, "campaign-0", low, Stand())
    rest = Stand()
    assert contents(run(tmp_path, "campaign", ids, rest)) == undisturbed
    assert low
    assert rest.made == high
    alone = Stand()
    assert contents(run(tmp_path, high[0], high[:1], alone)) == contents(run(tmp_path / "alone", high[0], high[:1], Stand()))
    assert alone.made == []


def test_a_result_of_another_engine_or_of_half_its_files_is_not_taken_over(tmp_path):
    ids = sorted(names(4))
    for name, engine in zip(ids, ("old", "engine", "engine", "engine"), strict=True):
        run(tmp_path, name, [name], Stand(), engine)
    (tmp_path / "sims" / "repose" / ids[1] / "after.parquet").write_bytes(b"half")
    (tmp_path / "sims" / "repose" / ids[2] / "timing.json").write_text("{")
    stand = Stand()
    run(tmp_path, "campaign", ids, stand)
    assert stand.made == ids[:3]


def test_the_newest_folder_that_holds_a_simulation_is_found(tmp_path):
    ids = sorted(names(3))
    sims = tmp_path / "sims" / "repose"
    run(tmp_path, ids[0], ids[:1], Stand())
    assert folder_of(sims, ids[0]) == sims / ids[0]
    run(tmp_path, "campaign", ids[:2], Stand())
    assert folder_of(sims, ids[0]) == folder_of(sims, ids[1]) == sims / "campaign"
    with pytest.raises(TableError, match=f"there is no result of simulation {ids[2]}"):
        folder_of(sims, ids[2])


def test_measured_tables_are_the_same_bytes_whatever_the_batches(tmp_path, monkeypatch):
    config = yaml.safe_load((ROOT / "config" / "config.yaml").read_text())
    few = {
        "experiment": ["repose"],
        "radius_m": [5e-5],
        "static_friction": [0.0, 0.9],
        "rolling_friction": [0.0, 0.05, 0.2],
        "seed": [1],
    }
    rows = [row for row in design_rows(config) if all(row[key] in values for key, values in few.items())]
    design = pd.DataFrame(rows)
    design["normal_stress_pa"] = design["normal_stress_pa"].astype(float)
    write_table(design, str(tmp_path / "design.parquet"), "design", {})
    ids, stand = sorted(design["simulation_id"].unique()), Stand(failed=[rows[2]["simulation_id"]])
    measured = []
    for target_s in (10.0, 2.0, 0.0):
        shares = batches.batches(dict.fromkeys(ids, 1.0), target_s, "")
        study = tmp_path / str(len(shares))
        folders = [run(study, batch, share, stand) for batch, share in shares.items()]
        kept = [[str(folder / file) for folder in folders] for file in ("run.parquet", "after.parquet", "timing.json")]
        table = measured_table("repose", read_table(str(tmp_path / "design.parquet"), "design"), *kept, config["repose"])
        write_table(table, str(study / "repose.parquet"), "repose", {})
        measured.append((study / "repose.parquet").read_bytes())
    assert sorted(path.name for path in tmp_path.glob("[0-9]*")) == ["1", "3", "4"]
    assert len(set(measured)) == 1
    table = pd.read_parquet(tmp_path / "1" / "repose.parquet")
    assert table["simulation_id"].tolist() == design["simulation_id"].tolist()
    assert table.groupby("simulation_id").size().sort_values().tolist() == [1, 1, 1, 3]
    assert table["angle_of_repose_deg"].notna().sum() == 3
    monkeypatch.setattr(BY_NAME["repose"], "DENSITIES", {"load_kg_m2": "heap_height_m"})
    again = measured_table("repose", read_table(str(tmp_path / "design.parquet"), "design"), *kept, config["repose"])
    counts = again["status"].isin(BY_NAME["repose"].SOUND)
    assert 0 < counts.sum() < len(again)
    assert again.loc[counts, "load_kg_m2"].tolist() == (3000.0 * again.loc[counts, "heap_height_m"]).tolist()
    assert again.loc[~counts, "load_kg_m2"].isna().all()


def test_batches_of_another_design_are_refused_by_name(tmp_path):
    settings = yaml.safe_load((ROOT / "config" / "config.yaml").read_text())["repose"]
    ids = names(4)
    design = pd.DataFrame({"experiment": "repose", "simulation_id": ids})
    folder = run(tmp_path, "campaign", ids[1:], Stand())
    kept = [[str(folder / file)] for file in ("run.parquet", "after.parquet", "timing.json")]
    with pytest.raises(TableError, match=f"^{folder}: 1 of the planned simulations missing, {ids[0]} the first; "):
        measured_table("repose", design, *kept, settings)
    with pytest.raises(TableError, match=f"^no batch: 4 of the planned simulations missing, {min(ids)} the first"):
        measured_table("repose", design, [], [], [], settings)
