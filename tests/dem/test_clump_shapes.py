"""Prototypes of clumps: volume and inertia of unions, presets, files, and what is refused."""

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import dem
from dem.clumps import union


def test_a_dimer_has_the_closed_forms_volume_and_moments():
    dimer = dem.Clump.preset("dimer")
    r = dimer.smallest_ratio  # in radii of the sphere of equal volume
    assert 4.0 / 3.0 / r**3 == pytest.approx(2.25, rel=1e-12)
    assert np.divide(dimer.moments, r**2) == pytest.approx([0.425, 0.7375, 0.7375], rel=1e-12)
    assert dimer.bounding_ratio / r == pytest.approx(1.5, rel=1e-12)


@pytest.mark.parametrize("aspect_ratio", [1.01, 1.5, 2.0])
def test_a_dimer_is_as_long_over_its_width_as_stated(aspect_ratio):
    (x, _, _, r), (far, *_) = dem.Clump.dimer(aspect_ratio).spheres
    assert (abs(far - x) + 2.0 * r) / (2.0 * r) == pytest.approx(aspect_ratio)
    assert (dem.Clump.dimer(1.5).spheres, dem.Clump.dimer(1.5).moments) == (
        dem.Clump.preset("dimer").spheres,
        dem.Clump.preset("dimer").moments,
    )


@pytest.mark.parametrize("aspect_ratio", [1.0, 2.1, -1.0, math.nan])
def test_a_dimer_of_no_or_of_two_spheres_is_refused(aspect_ratio):
    with pytest.raises(ValueError, match="aspect ratio of a dimer is .*; allowed: above 1 .*at most 2"):
        dem.Clump.dimer(aspect_ratio)


def test_columns_agree_with_exact_pairs_in_any_direction():
    rng = np.random.default_rng(1)
    for _ in range(8):
        direction = rng.normal(size=3)
        radii = np.array([1.0, rng.uniform(0.1, 1.0)])
        distance = rng.uniform(1.01 - radii[1], 1.0 + radii[1])
        centres = np.array([np.zeros(3), distance * direction / np.linalg.norm(direction)])
        exact, columns = union.solid_of_two(centres, radii), union.solid_of_columns(centres, radii)
        assert columns.volume == pytest.approx(exact.volume, rel=union.ERROR)
        assert columns.centre == pytest.approx(exact.centre, abs=union.ERROR)
        assert columns.inertia == pytest.approx(exact.inertia, abs=union.ERROR * np.linalg.eigvalsh(exact.inertia).max())


def test_two_spheres_agree_with_points_that_lie_in_them():
    centres, radii = np.array([[0.0, 0.0, 0.0], [0.4, 0.5, -0.3]]), np.array([1.0, 0.7])
    points = np.random.default_rng(2).uniform(-1.2, 1.2, (400_000, 3))
    inside = (np.linalg.norm(points[:, None] - centres, axis=2) < radii).any(axis=1)
    solid, points = union.solid_of_two(centres, radii), points[inside]
    assert solid.volume == pytest.approx(2.4**3 * inside.mean(), rel=0.01)
    assert solid.centre == pytest.approx(points.mean(axis=0), abs=0.01)
    away = points - points.mean(axis=0)
    inertia = (np.eye(3) * (away**2).sum(axis=1)[:, None, None] - away[:, :, None] * away[:, None]).mean(axis=0)
    assert solid.inertia / solid.volume == pytest.approx(inertia, abs=0.01)


@pytest.mark.parametrize(("name", "n"), [("sphere", 1), ("dimer", 2), ("trimer", 3), ("tetra", 4)])
def test_presets_are_centred_and_have_the_volume_of_the_unit_sphere(name, n):
    clump = dem.Clump.preset(name)
    table = np.array(clump.spheres)
    assert table.shape == (n, 4)
    solid = union.solid_of(table[:, :3], table[:, 3])
    assert solid.volume == pytest.approx(4.0 / 3.0 * math.pi, rel=1e-9)
    assert solid.centre == pytest.approx(np.zeros(3), abs=1e-9)
    assert solid.inertia / solid.volume == pytest.approx(np.diag(clump.moments), abs=2 * union.ERROR)
    distances = np.linalg.norm(table[:, None, :3] - table[None, :, :3], axis=2)[np.triu_indices(n, 1)]
    assert distances == pytest.approx(np.full(n * (n - 1) // 2, table[0, 3]))


def test_a_file_gives_the_same_shape_in_any_unit_position_and_direction(tmp_path):
    turn = Rotation.from_rotvec([0.3, -1.0, 0.7])
    spheres = np.array([[0.0, 0.0, 0.0, 1.0], [1.3, 0.0, 0.0, 0.8], [1.3, 0.9, 0.0, 0.6]])
    moved = spheres.copy()
    moved[:, :3] = turn.apply(spheres[:, :3]) + (5.0, -3.0, 2.0)
    (tmp_path / "a.txt").write_text("# x y z r\n" + "\n".join(" ".join(map(str, row)) for row in spheres))
    (tmp_path / "b.csv").write_text("\n\n".join(",".join(map(str, row)) for row in 1e3 * moved))
    first, second = dem.Clump.read(tmp_path / "a.txt"), dem.Clump.read(tmp_path / "b.csv")
    assert np.sort(first.moments) == pytest.approx(np.sort(second.moments), abs=2e-4)
    assert [row[3] for row in first.spheres] == pytest.approx([row[3] for row in second.spheres], rel=1e-4)
    apart = [np.linalg.norm(np.subtract(clump.spheres[0], clump.spheres[2])[:3]) for clump in (first, second)]
    assert apart[0] == pytest.approx(apart[1], rel=1e-4)


@pytest.mark.parametrize(
    ("spheres", "message"),
    [
        ([], "clump 'c' is 0 spheres"),
        ([(0, 0, 0)], "allowed: at least one, as x, y, z, r"),
        ([(0, 0, 0, 1), (0, 0, math.nan, 1)], "sphere 2 of clump 'c' is .*nan.*allowed: finite numbers"),
        ([(0, 0, 0, 1), (0, 0, 1, 0)], "sphere 2 of clump 'c' is .*a positive radius"),
        ([(0, 0, 0, 1), (3, 0, 0, 1)], "sphere 2 of clump 'c' is apart from sphere 1"),
        ([(0, 0, 0, 1), (1, 0, 0, 1), (5, 0, 0, 1), (6, 0, 0, 1)], "sphere 3 of clump 'c' is apart from sphere 1"),
        ([(0, 0, 0, 1), (0.2, 0, 0, 0.5)], "sphere 2 of clump 'c' is inside sphere 1"),
        ([(0, 0, 0, 1), (0, 0, 0, 1)], "sphere 1 of clump 'c' is inside sphere 2"),
        ([(0, 0, 0, 1), (1, 0, 0, 0.04)], "largest over smallest radius of clump 'c' is 25; allowed: at most 20"),
    ],
)
def test_spheres_that_make_no_clump_are_refused(spheres, message):
    with pytest.raises(ValueError, match=message) as caught:
        dem.Clump.of_spheres(spheres, name="c")
    assert "\n" not in str(caught.value)


def test_bad_files_and_unknown_presets_are_refused_by_name_and_line(tmp_path):
    file = tmp_path / "shape.txt"
    file.write_text("0 0 0 1\n\n1 0 0\n")
    with pytest.raises(ValueError, match=r"shape\.txt, line 3 is '1 0 0'; allowed: four numbers x y z r"):
        dem.Clump.read(file)
    file.write_text("0 0 0 one")
    with pytest.raises(ValueError, match=r"shape\.txt, line 1 is '0 0 0 one'"):
        dem.Clump.read(file)
    file.write_text("# nothing\n")
    with pytest.raises(ValueError, match=r"shape\.txt' is 0 spheres"):
        dem.Clump.read(file)
    with pytest.raises(ValueError, match=r"preset of a clump is 'cube'; allowed: one of \['sphere', 'dimer', 'trimer', 'tetra'\]"):
        dem.Clump.preset("cube")
