"""The box of the design variables and the hull of points in it."""

import numpy as np
import pytest

from virtual_soil.calibration.space import Space, inside_hull

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
