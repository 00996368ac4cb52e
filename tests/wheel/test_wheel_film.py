"""The film of a wheel: every frame in one period of the bed, as many as asked for, files for ParaView beside it."""

from dataclasses import replace
from xml.etree import ElementTree

import meshio
import numpy as np
import pytest
from PIL import Image
from test_wheel_runs import JOB, lowered_on

from dem.experiments.state import save_state
from virtual_soil.campaign.resume import Checkpoint
from virtual_soil.errors import InputError
from virtual_soil.report.film import edges_m, limits_mm
from virtual_soil.report.wheel_film import write_film
from virtual_soil.wheel import film
from virtual_soil.wheel.runs import BROKE_OFF, lowered_of, prepare_bed


@pytest.fixture(scope="module")
def bed(tmp_path_factory):
    """File of a bed."""
    folder = tmp_path_factory.mktemp("bed")
    prepare_bed(JOB, 1, str(folder / "bed.npz"), Checkpoint(str(folder / "preparation.npz"), 300, {}))
    return str(folder / "bed.npz")


@pytest.fixture(scope="module")
def frames(bed, tmp_path_factory):
    job = JOB | {"wheel": JOB["wheel"] | {"travel_ratio": 0.2}}
    lowered = lowered_on(bed, str(tmp_path_factory.mktemp("wheel") / "lowered.npz"), job)
    return film.film_wheel(job, "0.5", bed, lowered)


def test_every_frame_has_the_travel_and_the_bed_in_one_period_about_the_wheels_middle(frames):
    assert 30 <= len(frames) <= 41
    length, width = JOB["bed"]["length_m"], JOB["bed"]["width_m"]
    for frame in frames:
        places = frame.grains.positions_m
        assert (places[:, 0].min() >= 0.0, places[:, 0].max() <= length) == (True, True)
        assert np.abs(places[:, 1]).max() <= 0.5 * width
        assert frame.walls["wheel"].pivot[1] == pytest.approx(0.0, abs=1e-12)
        assert list(frame.walls) == ["wheel"]
    moved = frames[-1].walls["wheel"].pivot[0] - frames[0].walls["wheel"].pivot[0]
    assert moved == pytest.approx(0.2 * 0.010, rel=0.05)


def test_a_film_shows_the_edges_of_the_rim_and_a_spoke_that_turns(frames):
    wheels = [frame.walls["wheel"] for frame in (frames[0], frames[-1])]
    drawn = [edges_m(wheel) for wheel in wheels]
    turned = []
    for wheel, edges in zip(wheels, drawn, strict=True):
        radii = np.hypot(*(edges - wheel.position_m)[..., [0, 2]].transpose(2, 0, 1))
        assert radii[:-1] == pytest.approx(0.010, rel=0.01)  # none across the flat sides
        assert radii[-1] == pytest.approx([0.0, 0.010], rel=0.01, abs=1e-12)
        turned.append(np.arctan2(*(edges[-1, 1] - wheel.position_m)[[0, 2]]))
    assert turned[1] - turned[0] == pytest.approx(0.2 / (1.0 - 0.5), rel=0.06)


def test_a_film_and_files_for_paraview_are_written(frames, tmp_path):
    names = (tmp_path / name for name in ("film.gif", "film.pvd", "film", "film_wheel.pvd"))
    write_film(frames[:3], "sand, slip 0.5", *(str(name) for name in names))
    with Image.open(tmp_path / "film.gif") as image:
        assert image.n_frames == 3
    for index, number in (("film", len(frames[0].grains)), ("film_wheel", None)):
        files = [entry.get("file") for entry in ElementTree.parse(tmp_path / f"{index}.pvd").iter("DataSet")]
        assert len(files) == 3
        read = meshio.read(tmp_path / files[-1])
        places = frames[2].grains.positions_m if number else frames[2].walls["wheel"].corners_m.reshape(-1, 3)
        assert read.points == pytest.approx(places)


def test_the_whole_wheel_is_in_the_picture(frames):
    _, (low, high) = limits_mm(frames, ["wheel"])
    assert high > 1e3 * (frames[0].walls["wheel"].pivot[2] + JOB["wheel"]["shape"]["radius_m"])
    assert limits_mm(frames)[1] == (low, pytest.approx(1e3 * frames[0].grains.positions_m[:, 2].max() + 4.2, abs=0.5))


def test_the_first_look_and_every_nth_after_it_are_recorded():
    seen = []

    class Recorder:
        stage = "travel"

        def __call__(self, simulation, stage):
            seen.append(simulation)

    thinned = film.Thinned(Recorder(), 3)
    for look, stage in enumerate(["lower", "lower", *["travel"] * 8]):
        thinned(look, stage)
    assert seen == [2, 5, 8]


def test_a_wheel_that_the_soil_does_not_carry_or_that_broke_off_has_no_film(bed, monkeypatch, tmp_path):
    monkeypatch.setattr(film.wheel, "LOWERING_RADII", 1e-3)
    lowered = lowered_on(bed, str(tmp_path / "lowered.npz"))
    with pytest.raises(InputError, match=r"The wheel at slip 0.5 did not travel: the soil did not carry it\."):
        film.film_wheel(JOB, "0.5", bed, lowered)
    state = lowered_of(lowered)
    state.begin(BROKE_OFF, 0)
    save_state(replace(state, notes=state.notes | {"reason": "grains fell"}), lowered)
    with pytest.raises(InputError, match="The wheel broke off while it was lowered: grains fell"):
        film.film_wheel(JOB, "0.5", bed, lowered)
