"""Simulations of a campaign begin with the seeds of their points."""

from types import SimpleNamespace

from virtual_soil.calibration.points import own_seed
from virtual_soil.campaign import simulate
from virtual_soil.campaign.resume import Checkpoint


def test_points_with_one_seed_are_simulated_with_specimens_of_their_own(monkeypatch, tmp_path):
    seeds = []
    monkeypatch.setattr(simulate, "soil_of", lambda row, settings: None)
    monkeypatch.setattr(simulate, "engine_of", lambda settings: None)
    job = SimpleNamespace(STAGES={}, run=lambda soil, setup, engine, seed, **callbacks: seeds.append(seed))
    rows = [{"seed": 1, "point_id": name} for name in ("a", "b", "a")]
    for row in rows:
        simulate.recorded(job, row, {"setup": {}}, Checkpoint(str(tmp_path / "none.npz"), 60.0, {}))
    assert seeds == [own_seed(row) for row in rows]
    assert seeds[0] == seeds[2] != seeds[1]
