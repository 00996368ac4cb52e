"""A check's verdict, and the table of many."""

import math

import pytest

from virtual_soil.verification import Check, table_of


def check(**values):
    return Check(**({"group": "g", "case": "c", "quantity": "q", "unit": "m", "source": "s"} | values))


@pytest.mark.parametrize(
    ("relation", "obtained", "passed"),
    [
        ("equal", 10.5, True),
        ("equal", 9.5, True),
        ("equal", 10.6, False),
        ("equal", 9.4, False),
        ("at least", 9.5, True),
        ("at least", 99.0, True),
        ("at least", 9.4, False),
        ("at most", 10.5, True),
        ("at most", -99.0, True),
        ("at most", 10.6, False),
    ],
)
def test_a_check_passes_within_its_tolerance_of_the_value_or_the_bound(relation, obtained, passed):
    assert check(expected=10.0, obtained=obtained, tolerance=0.5, relation=relation).passed is passed


@pytest.mark.parametrize("relation", ["equal", "at least", "at most"])
@pytest.mark.parametrize("obtained", [math.nan, math.inf, -math.inf])
def test_a_number_that_is_not_finite_never_passes(relation, obtained):
    assert not check(expected=0.0, obtained=obtained, tolerance=1e300, relation=relation).passed


def test_without_a_tolerance_only_the_value_itself_passes():
    assert check(expected=1.0, obtained=1.0).passed
    assert not check(expected=1.0, obtained=1.0 + 1e-15).passed


def test_a_table_has_a_row_per_check_with_its_verdict():
    table = table_of([check(expected=1.0, obtained=1.0), check(expected=1.0, obtained=2.0)])
    assert table["passed"].tolist() == [True, False]
    assert table["obtained"].tolist() == [1.0, 2.0]
