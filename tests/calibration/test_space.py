"""The box of the design variables and the hull of points in it."""

import numpy as np
import pytest

from virtual_soil.calibration.space import Space, filling, inside_hull, space_of

SPACE = Space(("radius_m", "rolling_friction"), {"radius_m": (25e-6, 500e-6), "rolling_friction": (0.0, 0.3)}, {"radius_m": 0.0})


def test_coordinates_and_back_are_the_same_values():
    unit = SPACE.crowd(64)
    values = SPACE.values(unit)
    assert SPACE.unit(values) == pytest.approx(unit)
    assert 25e-6 <= values["radius_m"].min() < values["radius_m"].max() <= 500e-6


def test_the_middle_of_a_swept_variable_is_the_geometric_mean():
    assert SPACE.values(np.array([[0.5, 0.5]]))["radius_m"][0] == pytest.approx(np.sqrt(25e-6 * 500e-6))


def test_an_offset_spaces_the_papers_levels_of_friction_nearly_evenly():
    levels = np.array([0.0, 0.1, 0.3, 0.5, 0.9, 1.3, 1.7])
    space = Space(("static_friction",), {"static_friction": (0.0, 1.7)}, {"static_friction": 0.1})
    unit = space.unit({"static_friction": levels})[:, 0]
    assert (unit[0], unit[-1]) == (0.0, 1.0)
    assert unit[1] == pytest.approx(np.log(2.0) / np.log(18.0))
    assert np.diff(unit).max() < 3 * np.diff(unit).min()
    assert space.values(unit[:, None])["static_friction"] == pytest.approx(levels)


def test_the_crowd_is_the_same_in_every_run():
    assert (SPACE.crowd(32) == SPACE.crowd(32)).all()


def test_the_hull_holds_convex_combinations_and_nothing_else():
    corners = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
    assert inside_hull(corners, np.array([0.3, 0.3]))
    assert inside_hull(corners, np.array([1.0, 0.0]))
    assert not inside_hull(corners, np.array([0.6, 0.6]))


def test_points_on_a_line_have_a_hull_too():
    line = np.array([[0.0, 0.0], [1.0, 1.0]])
    assert inside_hull(line, np.array([0.5, 0.5]))
    assert not inside_hull(line, np.array([0.5, 0.4]))


def test_points_fill_the_box_with_its_corners_if_they_are_few():
    space = space_of({"variables": ["a", "b"], "ranges": {"a": [0.0, 1.0], "b": [1e-4, 1e-2]}})
    assert space.offsets == {"a": 0.1, "b": 0.0}
    points = filling(space, 32)
    assert len({tuple(point.values()) for point in points}) == 32
    assert {(0.0, 1e-4), (0.0, 1e-2), (1.0, 1e-4), (1.0, 1e-2)} <= {(point["a"], point["b"]) for point in points}
    assert points[:20] == filling(space, 20)  # more points keep those that there are
    many = space_of({"variables": list("abcde"), "ranges": dict.fromkeys("abcde", [0.5, 2.0])})
    inside = filling(many, 80)
    assert all(0.5 < value < 2.0 for point in inside for value in point.values())  # 32 corners would be too many
    assert np.mean([point["a"] for point in inside]) == pytest.approx(1.5 / np.log(4.0), rel=0.03)  # even in the logarithm


def test_a_range_below_zero_is_linear():
    space = space_of({"variables": ["a"], "ranges": {"a": [-0.2, 0.4]}})
    assert space.offsets == {}
    assert space.unit({"a": 0.1}) == pytest.approx(0.5)
