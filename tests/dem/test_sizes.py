"""Distributions of the radii: mean, volume and ends are what they say, and classes hold the mass that they are given."""

import numpy as np
import pytest

from dem import Sizes

N = 200_000
SIEVES = ((1.0, 0.2), (2.0, 0.5), (4.0, 0.3))


@pytest.mark.parametrize(
    "sizes",
    [
        Sizes(mean_m=2e-3, sd_ratio=0.3, distribution="log_normal"),
        Sizes(mean_m=2e-3, sd_ratio=0.05, distribution="log_normal"),
        Sizes(mean_m=2e-3, classes=SIEVES),
        Sizes(mean_m=2e-3),
    ],
)
def test_the_mean_radius_volume_and_ends_are_right(sizes):
    radii = sizes.draw(N, np.random.default_rng(1))
    assert radii.shape == (N,)
    assert radii.mean() == pytest.approx(2e-3, rel=3e-3)
    assert (radii**3).mean() / 2e-3**3 == pytest.approx(sizes.volume_ratio, rel=6e-3)
    assert sizes.smallest_m * (1 - 1e-12) <= radii.min() <= radii.max() <= sizes.largest_m * (1 + 1e-12)


def test_a_log_normal_radius_is_symmetric_in_its_logarithm():
    sizes = Sizes(mean_m=1.0, sd_ratio=0.3, distribution="log_normal")
    logarithms = np.log(sizes.draw(N, np.random.default_rng(2)))
    assert np.median(logarithms) == pytest.approx(logarithms.mean(), abs=3e-3)
    assert sizes.largest_m / np.exp(np.median(logarithms)) == pytest.approx(
        np.exp(np.median(logarithms)) / sizes.smallest_m, rel=1e-2
    )


def test_classes_hold_the_mass_that_the_sieves_say():
    radii = Sizes(mean_m=5e-4, classes=SIEVES).draw(10_000, np.random.default_rng(3))
    values = np.unique(radii)
    assert values / values[0] == pytest.approx([1.0, 2.0, 4.0])
    masses = np.array([(radii[radii == value] ** 3).sum() for value in values]) / (radii**3).sum()
    assert masses == pytest.approx([0.2, 0.5, 0.3], abs=0.02)
    assert not (np.diff(radii) >= 0).all()  # mixed, not in layers


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"distribution": "uniform"}, "distribution of radii is uniform; allowed: normal or log_normal"),
        ({"classes": ((1.0, 0.5), (11.0, 0.5))}, "largest over smallest radius is 11; allowed: at most 10"),
        ({"classes": ((1.0, -0.5), (2.0, 0.5))}, "classes of radii is .*; allowed: positive radii and shares"),
        ({"classes": SIEVES, "sd_ratio": 0.1}, "radius_sd_ratio is 0.1; allowed: 0 with classes of radii"),
    ],
)
def test_impossible_distributions_are_refused(arguments, message):
    with pytest.raises(ValueError, match=message):
        Sizes(mean_m=1e-3, **arguments)
