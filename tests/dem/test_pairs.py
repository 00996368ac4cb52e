"""The list of neighbours beside all pairs: sizes, speeds, periodic faces; and the width of cells."""

import numpy as np
import pytest

import dem
from dem.layout import PLACE, RADIUS
from dem.lists import pairs, slabs
from dem.runner import Runner
from dem.simulation import SORT_STEPS
from dem.step import loop

RADIUS_M = 1e-3
MATERIALS = {"grain": dem.Material(density_kg_m3=2500.0, shear_modulus_pa=1e6, poisson_ratio=0.25)}
RUBBING = dem.Interaction(restitution=0.5, static_friction=0.5, rolling_friction=0.1)


def nearest_image(apart, period):
    """Separations (..., 3) to the nearest images; period (3,), 0 where not periodic."""
    return apart - np.where(period > 0.0, period * np.round(apart / np.where(period > 0.0, period, 1.0)), 0.0)


def packed(size_m, period, least, n_large, large, rng):
    """Places (n, 3) and radii (n,): grains between `least` and 1 RADIUS_M near a lattice, pushed out by n_large larger ones."""
    pitch = 2.05 * RADIUS_M
    number = (size_m / pitch).astype(int)
    corners = (np.stack(np.meshgrid(*map(np.arange, number), indexing="ij"), axis=-1).reshape(-1, 3) + 0.5) * size_m / number
    radii = RADIUS_M * rng.uniform(least, 1.0, len(corners))
    places = corners + rng.uniform(-0.5, 0.5, corners.shape) * (pitch - 2.0 * radii[:, None])
    centres = np.empty((0, 3))
    while len(centres) < n_large:
        centre = rng.uniform(large * RADIUS_M, np.array(size_m) - large * RADIUS_M)
        if (np.linalg.norm(nearest_image(centres - centre, period), axis=1) > 2.0 * large * RADIUS_M).all():
            centres = np.vstack([centres, centre])
    for centre in centres:
        free = np.linalg.norm(nearest_image(places - centre, period), axis=1) > radii + large * RADIUS_M
        places, radii = places[free], radii[free]
    order = rng.permutation(len(radii) + n_large)
    return np.vstack([places, centres])[order], np.append(radii, np.full(n_large, large * RADIUS_M))[order]


def moving(places, radii, period, fastest_m_s, rng, bullets=(), step_s=4e-6, wall_m=-8.0):
    """A simulation of grains of which few are fast; bullets : numbers of those that move at 1 m/s along -x, to a wall at wall_m."""
    walls = [dem.Box(name="wall", material="grain", low_m=(-9.0, -9.0, -9.0), high_m=(wall_m, 9.0, 9.0))]
    simulation = dem.Simulation(
        materials=MATERIALS,
        interactions={("grain", "grain"): RUBBING},
        smallest_radius_m=float(radii.min()),
        time_step_s=step_s,
        gravity_m_s2=(0.0, 0.0, 0.0),
        period_m=tuple(period),
        walls=walls,
    )
    directions = rng.normal(size=places.shape)
    speeds = fastest_m_s * rng.random(len(radii)) ** 4 / np.linalg.norm(directions, axis=1)
    velocities = speeds[:, None] * directions
    velocities[list(bullets)] = [-1.0, 0.0, 0.0]
    simulation.add_grains(places, radii, "grain", velocities_m_s=velocities)
    return simulation


def listed(outer):
    """Pairs of an outer list (k, 2), the smaller number first, as often as they are in it."""
    found = [(i, outer.partner[k]) for i, (begin, end) in enumerate(outer.row) for k in range(begin, end)]
    return np.sort(np.array(found), axis=1)


def near(origin, radii, allowances, period):
    """All pairs (k, 2) closer than their cutoff, in order; origin (n, 3)."""
    found = []
    for i in range(len(origin) - 1):
        apart = nearest_image(origin[i + 1 :] - origin[i], period)
        cutoff = radii[i] + allowances[i] + radii[i + 1 :] + allowances[i + 1 :]
        found += [(i, i + 1 + j) for j in np.flatnonzero((apart**2).sum(axis=1) < cutoff**2)]
    return np.array(found)


#: Sides (in RADIUS_M), which are periodic, least radius, number of larger grains and their radius, fastest (m/s).
CASES = {
    "equal grains at rest": ((32, 32, 32), (0, 0, 0), 1.0, 0, 1.0, 0.0),
    "spread radii, all speeds": ((32, 32, 32), (0, 0, 0), 0.8, 0, 1.0, 20.0),
    "many are twice as large": ((36, 32, 32), (0, 0, 0), 0.95, 200, 2.0, 20.0),
    "few are five times as large": ((40, 32, 32), (0, 0, 0), 0.9, 9, 5.0, 20.0),
    "ring of slabs": ((64, 30, 26), (1, 1, 0), 0.8, 0, 1.0, 20.0),
    "ring of slabs, two sizes": ((190, 24, 24), (1, 1, 0), 0.9, 200, 2.0, 20.0),
    "all faces periodic, few are large": ((40, 24, 24), (1, 1, 1), 0.8, 9, 3.0, 10.0),
}


@pytest.mark.parametrize("name", CASES)
def test_the_list_has_every_pair_that_is_near_once(name):
    sides, is_periodic, *grains, fastest_m_s = CASES[name]
    rng, size_m = np.random.default_rng(7), RADIUS_M * np.array(sides)
    period = size_m * is_periodic
    places, radii = packed(size_m, period, *grains, rng)
    simulation = moving(places, radii, period, fastest_m_s, rng)
    simulation.advance(1)
    state, lists = simulation._state, simulation._state.lists
    found = listed(lists.pairs.outer)
    expected = near(lists.origin.reshape(-1, PLACE)[:, :3], state.places[:, RADIUS], lists.allowance, state.period)
    assert len(expected) > len(radii)
    assert np.array_equal(found[np.lexsort((found[:, 1], found[:, 0]))], expected)
    assert slabs.used_slabs(lists.pairs.outer.slab) > 1 or not name.startswith("ring")
    if fastest_m_s:  # they do not end the list of the others
        assert lists.allowance.max() > 1.5 * lists.allowance.min()


def test_cells_are_as_wide_as_the_search_costs_least():
    """Few large grains leave cells small; many make them wide enough for all, or nearly."""
    rng, allowance = np.random.default_rng(3), 1e-3
    widths = []
    for n_large in (3, 400):
        places, radii = packed(np.full(3, 40 * RADIUS_M), np.zeros(3), 1.0, n_large, 2.0, rng)
        grains = moving(places, radii, np.zeros(3), 0.0, rng)._state.grains
        widths.append(pairs.cell_of(grains, np.full(len(radii), allowance), 0.0, allowance))
    assert widths[0] == pytest.approx(2.0 * (RADIUS_M + allowance))
    assert 1.2 * widths[0] < widths[1] <= 2.0 * (2.0 * RADIUS_M + allowance) * (1.0 + 1e-6)


def slab_starts(simulation):
    """Least x in m of the grains of each slab (s,)."""
    simulation.advance(1)
    outer, x = simulation._state.lists.pairs.outer, simulation._state.places[:, 0]
    used = slabs.used_slabs(outer.slab)
    return np.array([x[outer.order[outer.slab[s] : outer.slab[s + 1]]].min() for s in range(used)])


@pytest.mark.parametrize("before", ["a slab", "the last slab", "a wall"])
def test_grains_that_are_hit_meet_others_though_the_lists_were_made_earlier(before, monkeypatch):
    """Slabs of grains that used up their allowance choose their contacts again; beside it all lists are made in every step.

    One grain near the start of a slab flies towards what is before it; whom it hits meets a grain or a wall there.
    """
    sides = RADIUS_M * np.array([200.0, 30.0, 30.0])
    period, made, found = sides * [before == "the last slab", 0, 0], [], []
    places, radii = packed(sides, period, 0.95, 0, 1.0, np.random.default_rng(11))
    starts = slab_starts(moving(places, radii, period, 0.002, np.random.default_rng(12)))
    start = starts[len(starts) // 2 if before == "a slab" else 0]
    wall_m = float((places[:, 0] - radii).min()) - 0.05 * RADIUS_M if before == "a wall" else -8.0
    bullets = [np.flatnonzero(np.abs(places[:, 0] - start - 3.0 * RADIUS_M) < RADIUS_M)[100]]
    scratch = Runner.scratch
    monkeypatch.setattr(Runner, "scratch", lambda self: made.append(scratch(self)) or made[-1])
    for calls in (4, 400):
        simulation = moving(places, radii, period, 0.002, np.random.default_rng(12), bullets, 2e-5, wall_m)
        for _ in range(calls):
            simulation.advance(400 // calls)
        found.append(simulation.grains.positions_m)
    assert len(starts) >= 4
    assert any(scratch.pace[loop.AGAIN] > 0 for scratch in made[:4])
    moved = np.linalg.norm(found[0] - places, axis=1)
    assert np.count_nonzero(moved > 0.1 * RADIUS_M) > 5
    assert np.abs(found[0] - found[1]).max() < 1e-4 * RADIUS_M


def test_grains_lie_in_memory_in_the_order_of_the_cells_of_the_list():
    rng, period = np.random.default_rng(7), np.zeros(3)
    places, radii = packed(np.array([0.03, 0.03, 0.03]), period, 0.4, 20, 3.0, rng)
    simulation = moving(places, radii, period, 0.0, rng)
    simulation.advance(SORT_STEPS)  # sorted before there is a list
    simulation.advance(1)
    assert (np.diff(simulation._state.lists.pairs.outer.order) == 1).all()
