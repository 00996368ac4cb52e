"""The progress lines of a simulation's log: what they say of how much is done is true."""

import re
from types import SimpleNamespace

import pytest

from dem.experiments import direct_shear
from virtual_soil.campaign import progress as module
from virtual_soil.campaign.experiments.repose.simulate import STAGES as HEAP
from virtual_soil.campaign.experiments.shear.simulate import STAGES as BOX


class Clock:
    """A clock that tests move."""

    def __init__(self):
        self.now = 100.0

    def monotonic(self):
        return self.now


@pytest.fixture
def clock(monkeypatch):
    moved = Clock()
    monkeypatch.setattr(module, "time", moved)
    return moved


def looked_at(bottom_m=0.0, top_m=1.0):
    """What a simulation shows at one look: 1000 grains, the highest of them ending at top_m, and the tube's rim."""
    return SimpleNamespace(
        n_steps=500, n_grains=1000, time_s=0.25, top_m=top_m, wall=lambda name: SimpleNamespace(bottom_m=bottom_m)
    )


def test_shearing_says_exactly_how_much_is_done_and_left(clock, capsys):
    progress = module.Progress(BOX)
    progress(looked_at(), "consolidate")
    for _ in range(direct_shear.N_SAMPLES):
        clock.now += 1.0
        progress(looked_at(), "shear")
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) == direct_shear.N_SAMPLES // 5
    percents = [int(re.match(r"shear: (\d+) %, t = ", line).group(1)) for line in lines]
    assert percents == [round(500 * k / direct_shear.N_SAMPLES) for k in range(1, len(lines) + 1)]
    assert lines[0].endswith(f", {direct_shear.N_SAMPLES - 5} s left")
    assert percents[-1] == 100
    assert not lines[-1].endswith("left")


def test_a_saved_test_that_goes_on_promises_nothing(clock, capsys):
    progress = module.Progress(BOX)
    for _ in range(2):
        clock.now += 10.0
        progress(looked_at(), "shear")
    assert all(line.startswith("shear: t = ") and "left" not in line for line in capsys.readouterr().out.splitlines())


def test_time_spent_before_the_stage_does_not_count_for_the_time_left(clock, capsys):
    progress = module.Progress(BOX)
    clock.now += 1000.0
    progress(looked_at(), "consolidate")
    clock.now += 1.0
    progress(looked_at(), "shear")
    clock.now += 10.0
    progress(looked_at(), "shear")
    last = capsys.readouterr().out.splitlines()[-1]
    assert last.endswith(f", {10 * (direct_shear.N_SAMPLES - 2)} s left")


def test_the_lift_says_how_far_the_tube_is_from_clear_and_promises_no_end(clock, capsys):
    progress = module.Progress(HEAP)
    for bottom, top in ((0.0, 1.0), (0.25, 1.0), (0.4, 0.8), (0.7, 0.6)):
        clock.now += 6.0
        progress(looked_at(bottom, top), "lift")
    _, quarter, half, clear = capsys.readouterr().out.splitlines()
    assert quarter == "lift: about 25 %, t = 0.2500 s, step 500, 0.0 M grain-steps/s, at least 18 s left"
    assert "about 50 %" in half
    assert "tube is clear, until nothing moves" in clear
    assert "left" not in clear


@pytest.mark.parametrize("stage", ["fill", "consolidate"])
def test_a_stage_that_ends_when_nothing_moves_has_no_percent(clock, capsys, stage):
    progress = module.Progress(HEAP if stage in HEAP else BOX)
    clock.now += 6.0
    progress(looked_at(), stage)
    line = capsys.readouterr().out
    assert line.startswith(f"{stage}: until nothing moves, t = ")
    assert "%" not in line


def test_a_quick_look_prints_nothing(clock, capsys):
    progress = module.Progress(BOX)
    clock.now += 0.9 * module.PROGRESS_S
    progress(looked_at(), "shear")
    assert capsys.readouterr().out == ""
