"""The trade-off of two responses: the front is known in closed form."""

import numpy as np
import pytest

from virtual_soil.calibration.space import Space
from virtual_soil.calibration.trade_off import non_dominated, trade_off


class Plane:
    """A response that is linear in the variables."""

    def __init__(self, a, b):
        self.a, self.b = a, b

    def predict(self, values):
        return self.a * values["x"] + self.b * values["y"]


def test_of_five_points_those_that_none_beats_are_found():
    errors = np.array([[0.0, 3.0], [1.0, 1.0], [3.0, 0.0], [2.0, 2.0], [1.0, 1.0]])
    assert non_dominated(errors).tolist() == [True, True, True, False, True]


def test_the_front_of_two_responses_in_conflict_is_the_line_between_their_targets():
    """With responses x and x + y and targets 0 and 2 no point has both: errors |x| and 2 - x - y are traded along y = 1."""
    space = Space(("x", "y"), {"x": (0.0, 1.0), "y": (0.0, 1.0)})
    table = trade_off({"first": Plane(1.0, 0.0), "second": Plane(1.0, 1.0)}, space, {"first": (0.0, 1.0), "second": (2.0, 0.5)})
    front = table[table["on_front"]]
    assert 1 < len(front) < 0.1 * len(table)
    assert (front["y"] > 0.9).mean() > 0.8  # the others have the smallest x of all
    assert front["first"].max() - front["first"].min() > 0.9
    best = front[front["y"] > 0.9].sort_values("first")
    assert (np.diff(best["second"]) > 0).all()  # less of one error is more of the other
    assert best["second"].to_numpy() == pytest.approx(1.0 + best["first"].to_numpy(), abs=0.1)
