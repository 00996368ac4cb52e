"""Files, parametric shapes and faults of meshes; no kernel of the time loop."""

import sys
from pathlib import Path

import numpy as np
import pytest
import trimesh

import dem
from dem import solids
from dem.meshes.topology import topology_of, volume
from dem.shapes import distance


def test_files_of_all_kinds_give_the_same_surface_in_metres(tmp_path):
    made = solids.wheel(0.02, 0.01, 6, 2e-3, 1e-3, 24)
    surface = trimesh.Trimesh(made.vertices_m * 1e3, made.triangles, process=False)
    for kind in ("stl", "obj", "ply"):
        surface.export(tmp_path / f"wheel.{kind}")
        read = dem.read_mesh(tmp_path / f"wheel.{kind}", "mm", name="wheel", material="steel")
        assert read.solid
        assert read.source == f"wheel.{kind}"
        assert len(read.vertices_m) == len(made.vertices_m)
        assert read.corners_m == pytest.approx(made.corners_m, rel=1e-5, abs=1e-8)


def test_step_files_are_read_in_metres_where_cascadio_is_installed(tmp_path):
    """A cube of 10 mm, in millimetres."""
    pytest.importorskip("cascadio")
    cube = dem.read_mesh(Path(__file__).parent / "cube.step", "m")
    assert cube.solid
    assert volume(cube.vertices_m, cube.triangles) == pytest.approx(1e-6, rel=1e-6)
    with pytest.raises(ValueError, match="unit of cube.step is 'mm'; allowed: 'm'"):
        dem.read_mesh(Path(__file__).parent / "cube.step", "mm")
    (tmp_path / "part.step").write_text("no step file")
    with pytest.raises(ValueError, match="part.step is no readable mesh|number of triangles of part.step"):
        dem.read_mesh(tmp_path / "part.step", "m")


def test_step_files_without_cascadio_say_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "cascadio", None)
    with pytest.raises(
        ValueError, match=r"cube.step: STEP files need cascadio; install it with `pip install virtual-soil\[step\]`"
    ):
        dem.read_mesh(Path(__file__).parent / "cube.step", "m")


def test_a_mesh_is_written_where_it_is(tmp_path):
    moved = solids.box((0.01, 0.02, 0.03), position_m=(1.0, 2.0, 3.0), orientation=(0.5**0.5, 0.0, 0.0, 0.5**0.5))
    for kind in ("stl", "ply", "obj"):
        dem.write_mesh(moved, tmp_path / f"box.{kind}")
        read = dem.read_mesh(tmp_path / f"box.{kind}", "m")
        assert np.ptp(read.vertices_m, axis=0) == pytest.approx((0.02, 0.01, 0.03), rel=1e-4)
        assert read.vertices_m.mean(axis=0) == pytest.approx((1.0, 2.0, 3.0))
    with pytest.raises(ValueError, match="allowed: a name that ends in one of"):
        dem.write_mesh(moved, tmp_path / "box.vtk")


def written(folder, vertices, triangles, name="part.ply"):
    trimesh.Trimesh(vertices, triangles, process=False).export(folder / name)
    return folder / name


CUBE = trimesh.creation.box((1.0, 1.0, 1.0))


@pytest.mark.parametrize(
    ("vertices", "triangles", "options", "match"),
    [
        (CUBE.vertices, CUBE.faces[1:], {"solid": True}, "solid of part.ply is True; allowed: False, since the surface is open"),
        (CUBE.vertices, CUBE.faces[:, ::-1], {"solid": True}, "reverse the winding"),
        (CUBE.vertices, np.vstack([CUBE.faces[:1, ::-1], CUBE.faces[1:]]), {}, "winding of the triangles of part.ply is not"),
        (CUBE.vertices, np.vstack([CUBE.faces, CUBE.faces[3:4]]), {}, r"duplicate triangles in part.ply is 1 \(first: number 3\)"),
        (CUBE.vertices, np.vstack([CUBE.faces, [[0, 1, 1]]]), {}, r"triangles without area in part.ply is 1 \(first: number 12\)"),
        (np.eye(5)[:, :3] - np.eye(5)[:, 3:4], [(0, 1, 2), (1, 0, 3), (0, 1, 4)], {}, "more than two faces in part.ply"),
        ([(0, 0, 0), (1, 0, 0), (0, 1, np.nan)], [(0, 1, 2)], {}, "vertices of part.ply is not finite"),
    ],
)  # fmt: skip
def test_faulty_surfaces_are_refused_with_file_and_fault(tmp_path, vertices, triangles, options, match):
    path = written(tmp_path, np.asarray(vertices, float), triangles)
    with pytest.raises(ValueError, match=match) as caught:
        dem.read_mesh(path, "m", **options)
    assert "\n" not in str(caught.value)


def test_files_that_cannot_be_read_are_named(tmp_path):
    (tmp_path / "bad.stl").write_bytes(b"solid nothing")
    (tmp_path / "part.xyz").write_text("0 0 0")
    for name, unit, match in (
        ("bad.stl", "mm", "bad.stl"),
        ("part.xyz", "mm", "kind of part.xyz is '.xyz'"),
        ("none.stl", "mm", "mesh file is .*none.stl; allowed: a file that exists"),
        ("bad.stl", "miles", "unit of bad.stl is 'miles'; allowed: one of"),
    ):
        with pytest.raises(ValueError, match=match):
            dem.read_mesh(tmp_path / name, unit)
    with pytest.raises(TypeError, match="unit"):
        dem.read_mesh(tmp_path / "bad.stl")


@pytest.mark.parametrize(
    ("mesh", "expected"),
    [
        (solids.box((1.0, 2.0, 3.0)), 6.0),
        (solids.cylinder(1.0, 2.0, 400), 2.0 * np.pi),
        (solids.cone(1.0, 3.0, 400), np.pi),
        (solids.frustum(1.0, 2.0, 3.0, 400), 7.0 * np.pi),
        (solids.wheel(1.0, 0.5, 8, 0.1, 0.05, 800), 0.5 * (np.pi + 8 * 0.1 * 0.05)),
        (solids.plate([(0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2)], 0.5), 1.5),
    ],
)
def test_parametric_shapes_are_closed_and_have_their_volume(mesh, expected):
    assert mesh.solid
    assert volume(mesh.vertices_m, mesh.triangles) == pytest.approx(expected, rel=1e-3)


def test_patches_end_at_creases():
    for mesh, n in ((solids.box((1, 1, 1)), 6), (solids.cylinder(1.0, 1.0, 107), 3), (solids.cylinder(1.0, 1.0, 8), 10)):
        topology = topology_of(mesh.vertices_m, mesh.triangles, 30.0)
        assert topology.patch.max() + 1 == n
    assert solids.sides_for(23.0, 1.0) == 107


def test_distances_are_negative_behind_the_surface_of_a_solid():
    cube = solids.box((2.0, 2.0, 2.0))
    points = np.array([(0.0, 0.0, 1.5), (0.0, 0.0, 0.75), (2.0, 2.0, 0.0), (0.9, 0.95, 0.99), (2.0, 2.0, 2.0)])
    assert distance(cube, points) == pytest.approx([0.5, -0.25, np.sqrt(2.0), -0.01, np.sqrt(3.0)])
    inside = np.random.default_rng(1).uniform(-0.99, 0.99, (200, 3))
    assert (distance(solids.cone(1.0, 2.0, 12), inside * (0.2, 0.2, 0.1) + (0.0, 0.0, 1.5)) < 0.0).all()
