"""The solid fraction of a vessel's core: lattices of known density, away from walls."""

import math

import numpy as np
import pytest

from dem.measure.packing import core_solid_fraction, slice_solid_fraction

LATTICES = {
    "simple cubic": ([[0, 0, 0]], 2.0, math.pi / 6.0),
    "face-centred cubic": (
        [[0, 0, 0], [0, 0.5, 0.5], [0.5, 0, 0.5], [0.5, 0.5, 0]],
        2.0 * math.sqrt(2.0),
        math.pi / math.sqrt(18.0),
    ),
}


def vessel(cell, edge, radius=12.0, height=40.0):
    """Spheres of radius 1 on a lattice inside a cylinder that stands on z = 0."""
    n = int(2 * height / edge)
    corners = np.stack(np.meshgrid(*[np.arange(-n, n)] * 3, indexing="ij"), axis=-1).reshape(-1, 1, 3)
    places = (edge * (corners + np.array(cell))).reshape(-1, 3)
    inside = (np.hypot(places[:, 0], places[:, 1]) < radius - 1.0) & (places[:, 2] > 1.0) & (places[:, 2] < height)
    return places[inside]


@pytest.mark.parametrize("name", LATTICES)
@pytest.mark.parametrize("unit_m", [1.0, 2.3e-3])
def test_a_lattice_has_its_density_whatever_its_walls(name, unit_m):
    cell, edge, density = LATTICES[name]
    places = vessel(cell, edge)
    found = core_solid_fraction(unit_m * places, np.full(len(places), unit_m), 12.0 * unit_m)
    assert found == pytest.approx(density, rel=0.01)  # the core cuts the lattice somewhere
    whole = len(places) * 4.0 / 3.0 / (12.0**2 * 40.0)
    assert whole < 0.97 * density  # with the layers along walls it would be less


def test_small_grains_between_large_ones_count():
    places = vessel([[0, 0, 0]], 2.0)
    small = 0.7  # touches the eight around it at 0.732
    both = np.vstack([places, places + 1.0])
    radii = np.concatenate([np.ones(len(places)), np.full(len(places), small)])
    assert core_solid_fraction(both, radii, 12.0) == pytest.approx(math.pi / 6.0 * (1.0 + small**3), rel=0.01)


def test_overlapping_spheres_of_clumps_count_once_and_layers_are_those_of_grains():
    places = vessel([[0, 0, 0]], 2.0)
    twice, n = np.repeat(places, 2, axis=0), len(places)
    assert core_solid_fraction(twice, np.ones(2 * n), 12.0, np.ones(n)) == pytest.approx(math.pi / 6.0, rel=0.01)
    # of a vessel whose outer half is empty; grains of thrice the radius leave more of it out
    inner = places[np.hypot(*places[:, :2].T) < 6.0]
    few = core_solid_fraction(inner, np.ones(len(inner)), 12.0)
    assert core_solid_fraction(inner, np.ones(len(inner)), 12.0, np.full(len(inner), 1.5)) > 1.3 * few


def test_a_low_filling_has_the_density_of_its_middle_and_no_grains_none():
    places = vessel([[0, 0, 0]], 2.0, height=10.0)
    assert core_solid_fraction(places, np.ones(len(places)), 12.0) == pytest.approx(math.pi / 6.0, rel=0.1)
    assert math.isnan(core_solid_fraction(np.zeros((0, 3)), np.zeros(0), 12.0))


@pytest.mark.parametrize("name", LATTICES)
def test_a_periodic_slice_has_the_density_of_its_lattice(name):
    """The slice cuts the lattice between two planes of cells; its end walls leave gaps that do not count."""
    cell, edge, density = LATTICES[name]
    n = np.array([16, 4, 16])
    corners = np.stack(np.meshgrid(*[np.arange(k) for k in n], indexing="ij"), axis=-1).reshape(-1, 1, 3)
    places = (edge * (corners + np.array(cell))).reshape(-1, 3) + [3.0, 0.0, 1.0]
    radii, length = np.ones(len(places)), places[:, 0].max() + 3.0
    found = slice_solid_fraction(places, radii, length, edge * n[1])
    assert found == pytest.approx(density, rel=0.01)
    assert slice_solid_fraction(places, radii, length, edge * (n[1] + 1)) < 0.9 * density  # of another period
    assert math.isnan(slice_solid_fraction(np.zeros((0, 3)), np.zeros(0), 1.0, 1.0))
