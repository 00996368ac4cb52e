"""Moving pictures and files for ParaView: they show the simulation that was run, grain by grain."""

from types import SimpleNamespace
from xml.etree import ElementTree

import meshio
import numpy as np
import pandas as pd
import pytest
import yaml
from matplotlib.figure import Figure
from PIL import Image

import grains_vtu
from dem import Box, Grains, Tube, solids
from virtual_soil.campaign import recording
from virtual_soil.campaign.code import ROOT
from virtual_soil.campaign.grains import empty_grains, grain_table
from virtual_soil.campaign.study import base_simulation, design_rows, experiment_settings
from virtual_soil.campaign.tables import TableError, write_table
from virtual_soil.report import film
from virtual_soil.report.experiments import EXPERIMENTS
from virtual_soil.report.paraview import write_series
from virtual_soil.report.study import base_point

CONFIG = yaml.safe_load((ROOT / "config" / "config.yaml").read_text()) | {"experiments": [test.NAME for test in EXPERIMENTS]}


def grains_at(places, wholes=None):
    places = np.array(places, float)
    return Grains(places, np.zeros_like(places), np.zeros_like(places), np.full(len(places), 1e-3), wholes)


def filmed(*states):
    shot = recording.Film("lift")
    for k, grains in enumerate(states):
        shot(SimpleNamespace(grains=grains, time_s=0.01 * k, wall_names=[]), "lift")
    return [frame.numbers.tolist() for frame in shot.frames]


def test_grains_that_fell_off_the_plate_do_not_change_the_others_numbers():
    before = grains_at([[k, 0, 0.1] for k in range(5)], np.array([2, 3, 5, 6, 9]))
    after = grains_at([[k, 0, 0.1] for k in range(3)], np.array([2, 5, 9]))
    assert filmed(before, after, after) == [[0, 1, 2, 3, 4], [0, 2, 4], [0, 2, 4]]


def test_clumps_of_unequal_numbers_of_spheres_are_gone_with_all_of_them():
    before = grains_at([[k, 0, 0.2] for k in range(7)], np.array([0, 0, 1, 2, 2, 2, 3]))
    after = grains_at([[k, 0, 0.2] for k in range(3)], np.array([0, 0, 3]))
    assert filmed(before, after) == [[0, 1, 2, 3, 4, 5, 6], [0, 1, 6]]


def test_a_mesh_is_drawn_by_its_edges_where_it_is_in_space():
    """A square tube about the y axis: all edges on its four sides, seen along y, and a spoke."""
    tube = solids.tube(2e-3, 1e-2, 4, name="drum", material="m", orientation=(0.5**0.5, 0.5**0.5, 0.0, 0.0))
    axes = Figure().subplots()
    film.draw_wall(axes, tube)
    *edges, spoke = axes.collections[0].get_segments()
    assert len(edges) == 8 + 2 * 4  # open ones, and those along the axis from both faces; no diagonals
    corners = np.concatenate(edges)
    assert np.abs(corners).sum(axis=1) == pytest.approx(2.0)  # mm, on |x| + |z| = 2
    assert corners.min(axis=0) == pytest.approx([-2.0, -2.0])
    assert spoke[0] == pytest.approx([0.0, 0.0])
    assert np.abs(spoke[1]).sum() == pytest.approx(2.0)


def test_a_film_shows_one_stage_evenly_from_its_first_look_to_its_last():
    shot = recording.Film("lift")
    grains = grains_at([[0, 0, 1]])
    for k in range(1000):
        shot(SimpleNamespace(grains=grains, time_s=0.1 * k, wall_names=[]), "fill" if k < 100 else "lift")
    times = [frame.time_s for frame in shot.shown()]
    assert len(times) == recording.N_FRAMES
    assert (times[0], times[-1]) == (pytest.approx(10.0), pytest.approx(99.9))
    assert np.ptp(np.diff(times)) < 0.11


def test_a_film_is_a_gif_in_which_the_grains_move(tmp_path):
    walls = {
        "tube": Tube(name="tube", material="m", radius_m=2e-3, bottom_m=0.0, top_m=1.0),
        "plate": Box(name="plate", material="m", low_m=(-1, -1, 0), high_m=(1, 1, 0)),
    }
    frames = [recording.Frame(k, grains_at([[1e-3 * k, 0.1, 1e-3], [0, 0.1, 5e-3]]), np.arange(2), walls) for k in (0, 1, 2)]
    path = tmp_path / "film.gif"
    film.write_gif(str(path), frames, np.array([0.0, 1.0]), lambda frame: f"{frame.time_s} s")
    with Image.open(path) as picture:
        assert picture.n_frames == 3
        pictures = []
        for k in range(3):
            picture.seek(k)
            pictures.append(np.asarray(picture.convert("RGB"), int))
    # two grains in viridis' first and last colour, the dark one further right in each picture
    yellow, dark = np.array([253, 231, 36]), np.array([68, 1, 84])
    columns = [np.nonzero((np.abs(picture - dark) < 12).all(axis=2))[1].mean() for picture in pictures]
    assert columns[0] + 5 < columns[1] < columns[2] - 5
    assert all((np.abs(picture - yellow) < 12).all(axis=2).sum() > 50 for picture in pictures)


def test_a_cut_shows_only_the_half_behind_the_plane():
    drawn = []
    frame = recording.Frame(0.0, grains_at([[0, -1, 0], [0, 1, 0], [1, 2, 0]]), np.array([0, 2, 3]), {})
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(film, "draw_grains", lambda axes, grains, colour, **_: drawn.append((grains, colour)))
        axes = SimpleNamespace(clear=lambda: None, set=lambda **_: None)
        film.draw_frame(axes, frame, np.array([0.0, 1.0, 2.0, 3.0]), ((0, 1), (0, 1)), "", cut=True)
    ((grains, colour),) = drawn
    assert grains["y_m"].tolist() == [1.0, 2.0]
    assert colour.tolist() == [2.0, 3.0]


@pytest.mark.parametrize("experiment", [experiment.NAME for experiment in EXPERIMENTS])
def test_the_film_is_of_the_simulation_that_the_report_draws(experiment):
    rows = design_rows(CONFIG)
    table = pd.DataFrame([row for row in rows if row["experiment"] == experiment])
    at_base = base_point(table, CONFIG)
    shown = at_base[at_base["seed"] == at_base["seed"].iloc[0]].iloc[-1]
    assert base_simulation(CONFIG, rows, experiment)["simulation_id"] == shown["simulation_id"]


@pytest.mark.parametrize("experiment", EXPERIMENTS, ids=lambda experiment: experiment.NAME)
def test_each_experiment_is_filmed(experiment, tmp_path, monkeypatch):
    monkeypatch.setattr(recording, "N_FRAMES", 4)
    monkeypatch.setattr(film, "LAST_REPEATED", 1)
    row = base_simulation(CONFIG, design_rows(CONFIG), experiment.NAME)
    settings = experiment_settings(CONFIG, row)
    small = {
        "repose": {"n_particles": 150, "tube_diameter_ratio": 6.0, "max_time_s": 0.02, "lift_speed_m_s": 5e-2},
        "shear": {"length_ratio": 16.0, "height_ratio": 10.0, "displacement_ratio": 1.0},
        "plane_shear": {
            "length_ratio": 12.0,
            "height_ratio": 12.0,
            "width_ratio": 8.0,
            "shear_strain": 0.5,
            "max_shear_strain": 0.5,
        },
    }
    small["slope"] = {"height_ratio": 12.0, "length_ratio": 30.0, "thickness_ratio": 6.0, "tolerance_deg": 20.0}
    small["draw_down"] = {"length_ratio": 52.0, "slot_ratio": 12.0, "height_ratio": 26.0, "thickness_ratio": 6.0}
    small["rotating_drum"] = {"diameter_ratio": 40.0, "thickness_ratio": 6.0, "turns": 0.1, "froude_number": 0.1}
    settings["setup"] |= small[experiment.NAME]
    path = tmp_path / "film.gif"
    frames = film.animate(experiment, row, settings, str(path))
    assert len(frames) == 4
    with Image.open(path) as picture:
        assert picture.n_frames == 4


def test_grains_for_paraview_are_read_back_as_they_were_stored(tmp_path):
    grains = grains_at(np.random.default_rng(1).random((5, 3)))
    write_table(grain_table(grains, "0123456789") | {"speed_m_s": np.arange(5.0)}, str(tmp_path / "grains.parquet"), "grains", {})
    grains_vtu.main(str(tmp_path / "grains.parquet"), "0123456789", str(tmp_path / "grains.vtu"))
    mesh = meshio.read(tmp_path / "grains.vtu")
    assert np.array_equal(mesh.points, grains.positions_m)
    data = {name: values.tolist() for name, values in mesh.point_data.items()}
    assert data == {"radius_m": [1e-3] * 5, "speed_m_s": [0.0, 1.0, 2.0, 3.0, 4.0]}
    assert [(block.type, block.data.ravel().tolist()) for block in mesh.cells] == [("vertex", [0, 1, 2, 3, 4])]


def test_a_film_for_paraview_names_its_files_with_their_times_and_holds_the_moving_grains(tmp_path):
    places = np.random.default_rng(1).random((2, 5, 3))
    moments = [(0.5, grains_at(places[0], places[1]), np.arange(5)), (0.625, grains_at(places[1, 1:]), np.arange(1, 5))]
    write_series(tmp_path / "film.pvd", tmp_path / "film", moments)
    index = ElementTree.parse(tmp_path / "film.pvd").getroot()
    assert (index.tag, index.get("type")) == ("VTKFile", "Collection")
    entries = [(float(entry.get("timestep")), entry.get("file")) for entry in index.iter("DataSet")]
    assert [time_s for time_s, _ in entries] == [0.5, 0.625]
    for (_, file), (_, grains, numbers) in zip(entries, moments, strict=True):
        mesh = meshio.read(tmp_path / file)  # named as seen from the index's own folder
        assert np.array_equal(mesh.points, grains.positions_m)
        assert np.array_equal(mesh.point_data["velocity_m_s"], grains.velocities_m_s)
        assert mesh.point_data["number"].tolist() == numbers.tolist()


def test_a_failed_simulation_has_nothing_for_paraview_and_says_so(tmp_path):
    write_table(empty_grains(), str(tmp_path / "grains.parquet"), "grains", {})
    with pytest.raises(TableError, match="holds no grains of 0123456789, as it failed"):
        grains_vtu.main(str(tmp_path / "grains.parquet"), "0123456789", str(tmp_path / "grains.vtu"))
