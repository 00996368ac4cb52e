"""What the workflow makes of a configuration before anything runs."""

import pytest

from _study import repose_softening


@pytest.mark.parametrize(("reduction", "grown", "expected"), [(100.0, 1.0, 100.0), (100.0, 10.0, 10.0), (5.0, 10.0, 1.0)])
def test_heaps_of_larger_grains_are_softened_in_proportion_less(reduction, grown, expected):
    assert repose_softening(reduction, grown) == expected


def test_the_papers_own_stiffness_is_kept_for_every_radius():
    assert {repose_softening(1.0, grown) for grown in (0.5, 1.0, 2.0, 10.0)} == {1.0}
