"""The public API on small systems: lists, history, factories, refusals."""

import copy
import re
import threading
from dataclasses import replace

import numba
import numpy as np
import psutil
import pytest
from callers import callable_from_python
from hypothesis import given, settings
from hypothesis import strategies as st

import dem
from dem import shapes
from dem.layout import BLOCK, INVERSE_MASS, MOTION, PLACE, RADIUS, GrainArrays, Period
from dem.lists import allowance, blocks, grid, history, pairs, slabs, storage, surfaces
from dem.step import loop, schedule

MATERIAL = dem.Material(density_kg_m3=2500.0, poisson_ratio=0.2, shear_modulus_pa=1e7)
ROUGH = dem.Interaction(restitution=0.5, static_friction=0.4, rolling_friction=0.1)
RADIUS_M = 1e-3


def make(walls=(), interaction=ROUGH, **options):
    options = {"smallest_radius_m": RADIUS_M, **options}
    return dem.Simulation(materials={"soil": MATERIAL}, interactions={("soil", "soil"): interaction}, walls=walls, **options)


def sticky(w):
    return replace(ROUGH, work_of_adhesion_j_m2=w)


def floor(**settings):
    return dem.Box(name="floor", material="soil", low_m=(-1.0, -1.0, 0.0), high_m=(1.0, 1.0, 0.0), **settings)


def tube(**settings):
    return dem.Tube(**{"name": "tube", "material": "soil", "radius_m": 5 * RADIUS_M, "bottom_m": 0.0, "top_m": 1.0} | settings)


def alone(**settings):
    """One grain at the origin."""
    motion = {name: settings.pop(name) for name in list(settings) if name.endswith(("velocities_m_s", "velocities_rad_s"))}
    simulation = make(**settings)
    simulation.add_grains([(0, 0, 0)], RADIUS_M, "soil", **motion)
    return simulation


def box_of_grains(seed=1, n=150, **settings):
    region, sizes = dem.TubeRegion(radius_m=5 * RADIUS_M, bottom_m=0.0), dem.Sizes(mean_m=RADIUS_M)
    made = {name: settings.pop(name) for name in ("time_s", "velocity_m_s", "velocity_sd_m_s") if name in settings}
    simulation = make([floor(), tube()], **settings)
    simulation.add_factory(dem.Factory(n_grains=n, region=region, sizes=sizes, material="soil", seed=seed, **made))
    return simulation


def all_pairs(positions, radii, period, skin):
    """Every pair closer than the sum of radii plus skin, the slow and obvious way."""
    pairs = set()
    for i in range(len(radii)):
        apart = positions[i] - positions
        for a in np.flatnonzero(period):
            apart[:, a] -= period[a] * np.round(apart[:, a] / period[a])
        near = np.linalg.norm(apart, axis=1) < radii[i] + radii + skin
        pairs |= {(i, int(j)) for j in np.flatnonzero(near) if j > i}
    return pairs


def find_pairs(positions, radii, period, skin, capacity, allowances=None):
    """(number of pairs or -1, row, partner, order, slab) of the fast search."""
    n = len(radii)
    place, motion, remainder = np.zeros((n, PLACE)), np.zeros((n, MOTION)), np.zeros((n, MOTION))
    place[:, :3], place[:, RADIUS], remainder[:, INVERSE_MASS] = positions, radii, 1.0
    grains = GrainArrays(place.ravel(), motion.ravel(), remainder.ravel())
    row, owner, partner = np.zeros((n, 2), np.int64), np.zeros(capacity, np.int32), np.zeros(capacity, np.int32)
    order, slab = np.zeros(n, np.int64), np.zeros(slabs.SLABS + 1, np.int64)
    period, outer = np.asarray(period, float), storage.Outer(row, owner, partner, np.zeros((capacity, 3)), order, slab)
    images = Period(period, grid.frequencies(period)) if period.any() else None
    allowances = np.full(n, 0.5 * skin) if allowances is None else allowances
    m = pairs.find_pairs(grains, None, period, images, allowances, 0.0, allowances.min(), outer)
    assert m < 0 or all((owner[begin:end] == i).all() for i, (begin, end) in enumerate(row))
    return m, row, partner, order, slab


@settings(max_examples=60, deadline=None)
@given(
    seed=st.integers(0, 2**32 - 1),
    n=st.integers(2, 250),
    largest_ratio=st.floats(1.0, 30.0),
    power=st.floats(1.0, 20.0),
    skin_ratio=st.floats(0.01, 1.0),
    width_ratios=st.tuples(*[st.one_of(st.just(0.0), st.floats(1.01, 4.0))] * 3),
)
def test_the_cell_list_finds_exactly_the_pairs_that_all_pairs_finds(seed, n, largest_ratio, power, skin_ratio, width_ratios):
    """Random clouds: numbers, sizes, skins, and periods from just over the smallest that is allowed (0: not periodic).

    power : the higher, the fewer large grains among small ones.
    """
    rng = np.random.default_rng(seed)
    radii = 1e-3 * (1.0 + (largest_ratio - 1.0) * rng.uniform(0.0, 1.0, n) ** power)
    skin = skin_ratio * 1e-3
    period = np.array(width_ratios) * 2.0 * (2.0 * radii.max() + skin)
    positions = rng.uniform(-9e-3, 9e-3, (n, 3))
    m, row, partner, _, _ = find_pairs(positions, radii, period, skin, n * n)
    found = [(min(i, j), max(i, j)) for i in range(n) for j in partner[row[i, 0] : row[i, 1]].tolist()]
    assert len(found) == m
    assert len(found) == len(set(found))
    assert set(found) == all_pairs(positions, radii, period, skin)


@settings(max_examples=40, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), n=st.integers(2, 250), width_ratios=st.tuples(*[st.sampled_from([0.0, 1.01, 1.6, 3.0])] * 3))
def test_grains_of_large_allowances_find_their_partners_over_several_cells(seed, n, width_ratios):
    """Fast grains have up to four times the least allowance, and any may be large."""
    rng = np.random.default_rng(seed)
    radii = 1e-3 * rng.choice([1.0, 1.3, 3.0], n, p=[0.8, 0.15, 0.05])
    allowances = 2e-4 * rng.choice([1.0, 2.0, 4.0], n, p=[0.85, 0.1, 0.05])
    period = np.array(width_ratios) * 2.0 * (2.0 * radii.max() + 2.0 * allowances.max())
    positions = rng.uniform(-9e-3, 9e-3, (n, 3))
    m, row, partner, _, _ = find_pairs(positions, radii, period, 0.0, n * n, allowances)
    found = [(min(i, j), max(i, j)) for i in range(n) for j in partner[row[i, 0] : row[i, 1]].tolist()]
    assert len(found) == m == len(set(found))
    assert set(found) == all_pairs(positions, radii + allowances, period, 0.0)


@pytest.mark.parametrize("periodic", [False, True])
def test_lists_miss_no_contact_of_a_few_fast_grains_among_many_at_rest(periodic):
    """The same motion as with lists that are made anew in every step, but for rounding; fast grains strike slow ones and a wall."""
    side, spacing_m = 9, 2.1 * RADIUS_M
    places = spacing_m * np.stack(np.meshgrid(*[np.arange(side)] * 3, indexing="ij"), -1).reshape(-1, 3) + RADIUS_M
    runs = []
    for chunk in (600, 1):
        s = make([floor()], period_m=(side * spacing_m if periodic else 0.0, 0.0, 0.0))
        velocities = np.zeros(places.shape)
        velocities[::61] = np.random.default_rng(1).normal(0.0, 0.004 * RADIUS_M / s.time_step_s, velocities[::61].shape)
        s.add_grains(places, RADIUS_M, "soil", velocities)
        for _ in range(600 // chunk):
            s.advance(chunk)
        runs.append(s.grains)
    moved = np.linalg.norm(runs[0].positions_m - places, axis=1)
    assert (moved > 0.2 * RADIUS_M).sum() > 20
    assert runs[0].positions_m == pytest.approx(runs[1].positions_m, abs=1e-4 * RADIUS_M)
    assert runs[0].velocities_m_s == pytest.approx(runs[1].velocities_m_s, abs=1e-3 * np.abs(velocities).max())


def test_a_pair_list_without_room_says_so():
    assert find_pairs(np.zeros((20, 3)), np.ones(20), (0, 0, 0), 0.1, capacity=5)[0] == -1


@pytest.mark.parametrize("largest", [1.0, 8.0])
@pytest.mark.parametrize("n", [20_000, 100_000])
@pytest.mark.parametrize("period_x", [0.0, 100.0])
def test_slabs_of_the_same_parity_share_no_grain(period_x, n, largest):
    """With few grains, slabs of several layers; with many, most are one layer, or as many as the largest grains reach over."""
    positions = np.random.default_rng(1).uniform(0, 1, (n, 3)) * (100.0, 60.0, 60.0)
    radii = np.full(n, 1.0)
    radii[:: n // 40] = largest
    m, row, partner, order, slab = find_pairs(positions, radii, (period_x, 0.0, 0.0), 0.2, 60 * n)
    assert m > n
    used = np.flatnonzero(np.diff(slab))
    assert len(used) >= (8 if largest == 1.0 else 4)
    of = np.empty(n, int)
    for s in used:
        of[order[slab[s] : slab[s + 1]]] = s
    owner = np.repeat(np.arange(n), row[:, 1] - row[:, 0])
    listed = np.concatenate([partner[begin:end] for begin, end in row])
    assert set((of[listed] - of[owner]) % len(used)) == {0, 1}  # its own grains, and those of the next
    touched = []
    for s in range(slabs.SLABS):
        owners = [i for i in order[slab[s] : slab[s + 1]].tolist() if row[i, 1] > row[i, 0]]
        touched.append(set(owners).union(*(partner[row[i, 0] : row[i, 1]].tolist() for i in owners)))
    for parity in (0, 1):
        sets = touched[parity::2]
        assert sum(map(len, sets)) == len(set().union(*sets))


def test_a_crowd_that_overflows_the_first_lists_runs_like_any_other():
    simulation = make([floor()], smallest_radius_m=0.2e-3)
    simulation.add_grains([(0, 0, 5e-3)], 5e-3, "soil")
    angles = np.linspace(0, 2 * np.pi, 60, endpoint=False)
    ring = np.column_stack([5.3e-3 * np.cos(angles), 5.3e-3 * np.sin(angles), np.full(60, 5e-3)])
    simulation.add_grains(ring, 0.25e-3, "soil")
    simulation._state.lengthen(loop.PAIRS_FULL)
    simulation.advance(200)
    assert simulation.n_grains == 61


def test_the_floor_carries_the_weight_of_a_settled_bed():
    simulation = box_of_grains()
    simulation.run(1.0, until=lambda s: s.is_static())
    simulation.advance(200)
    weight = 9.81 * simulation.n_grains * MATERIAL.density_kg_m3 * 4 / 3 * np.pi * RADIUS_M**3
    reaction = sum(force[2] for force in simulation.mean_wall_forces_n.values())
    assert -reaction == pytest.approx(weight, rel=1e-3)


@pytest.mark.parametrize("precision", ["float32", "float64"])
@pytest.mark.parametrize("rolling_model", ["type_a", "type_c"])
def test_a_bed_comes_to_rest_in_every_variant(precision, rolling_model):
    simulation = box_of_grains(precision=precision, rolling_model=rolling_model)
    assert simulation.run(1.0, until=lambda s: s.is_static(1e-6))
    assert simulation.largest_overlap_ratio() < 0.01


@pytest.mark.parametrize(("precision", "vector_code"), [("float32", True), ("float32", False), ("float64", True)])
def test_changes_far_smaller_than_the_rounding_of_a_velocity_add_up(precision, vector_code):
    speed, n_steps = 10.0, 2000
    gravity = 0.003 * speed * float(np.finfo(precision).eps) / make().time_step_s
    simulation = make(gravity_m_s2=(gravity, 0.0, 0.0), precision=precision, vector_code=vector_code)
    places = [(0, 3 * k * RADIUS_M, 0) for k in range(20)]  # some in whole vectors, some left over
    simulation.add_grains(places, RADIUS_M, "soil", velocities_m_s=(speed, 0.0, 0.0))
    simulation.advance(n_steps)
    motion, remainder = (x.reshape(20, MOTION)[:, 0].astype(np.longdouble) for x in simulation._state.grains[1:])
    expected = np.longdouble(gravity) * simulation.time_step_s * n_steps
    assert expected == pytest.approx(6 * speed * np.finfo(precision).eps)
    assert (np.abs((motion - speed) + remainder - expected) <= 1e-4 * expected).all()


@pytest.mark.parametrize("width_m", [0.0, 0.02])
def test_the_largest_overlap_and_the_top_are_those_of_the_grains(width_m):
    """Against all pairs; grains of three sizes, with and without a periodic face that they press through."""
    simulation = make([floor()], period_m=(0.0, width_m, 0.0))
    rows = [(0.0, y, 1.4e-3) for y in (-8e-3, -4e-3, 0.0, 4e-3, 8e-3)]
    simulation.add_grains(rows, [1e-3, 1.2e-3, 1e-3, 1.2e-3, 1.4e-3], "soil")
    faster = [(0, -0.1, 0), (0, 0, -0.1), (0, 0.1, 0)]
    simulation.add_grains([(0, y, 3.9e-3) for y in (-8.75e-3, -6e-3, 8.75e-3)], 1.2e-3, "soil", velocities_m_s=faster)
    deepest = np.zeros(2)
    for _ in range(30):
        simulation.advance(50)
        grains = simulation.grains
        i, j = np.triu_indices(len(grains), 1)
        apart = grains.positions_m[i] - grains.positions_m[j]
        if width_m:
            apart[:, 1] -= width_m * np.round(apart[:, 1] / width_m)
        depths = grains.radii_m[i] + grains.radii_m[j] - np.linalg.norm(apart, axis=1)
        expected = max(0.0, (depths / np.minimum(grains.radii_m[i], grains.radii_m[j])).max())
        deepest = np.maximum(deepest, [expected, depths[(i == 5) & (j == 7)].max()])
        assert simulation.largest_overlap_ratio() == pytest.approx(expected, rel=1e-9, abs=1e-15)
        assert simulation.top_m == (grains.positions_m[:, 2] + grains.radii_m).max()
    assert deepest[0] > 0
    assert (deepest[1] > 0) == (width_m > 0)  # the pair that meets across the face


def test_without_grains_nothing_overlaps_and_nothing_stands():
    assert (make().largest_overlap_ratio(), make().top_m) == (0.0, 0.0)


def test_the_same_seed_gives_the_same_bytes_and_another_seed_does_not():
    first, again, other = (box_of_grains(seed) for seed in (1, 1, 2))
    for simulation in (first, again, other):
        simulation.advance(2000)
    assert first.grains.positions_m.tobytes() == again.grains.positions_m.tobytes()
    assert first.grains.positions_m.tobytes() != other.grains.positions_m.tobytes()


def test_a_grain_beyond_the_edge_leaves_and_the_others_keep_their_contact_history():
    def pair_on_floor(with_stray):
        simulation = make([floor()], floor_m=-5e-3)
        if with_stray:
            simulation.add_grains([(2.0, 0.0, 0.0)], RADIUS_M, "soil")
        simulation.add_grains([(0, 0, 0.999e-3), (1.999e-3, 0, 0.999e-3)], RADIUS_M, "soil", velocities_m_s=(0.01, 0.002, 0.0))
        simulation.run(0.2)
        return simulation

    alone, accompanied = pair_on_floor(False), pair_on_floor(True)
    assert (accompanied.n_left, accompanied.n_grains) == (1, 2)
    assert accompanied.grains.positions_m == pytest.approx(alone.grains.positions_m, rel=1e-9)


def test_removing_a_wall_keeps_the_history_with_the_others():
    extra = dem.Box(name="extra", material="soil", low_m=(0.5, -1.0, 0.0), high_m=(0.5, 1.0, 1.0))

    def sliding(walls, remove):
        simulation = make(walls)
        simulation.add_grains([(0, 0, 0.99999e-3)], RADIUS_M, "soil", velocities_m_s=(0.001, 0.0, 0.0))
        simulation.advance(100)
        if remove:
            simulation.remove_wall("extra")
        simulation.advance(1000)
        return simulation.grains

    assert sliding([extra, floor()], True).positions_m.tobytes() == sliding([floor()], False).positions_m.tobytes()


def test_glued_grains_follow_their_wall_and_hand_it_their_load():
    simulation = make([floor()])
    simulation.add_grains([(0, 0, RADIUS_M), (0, 0, 2.999e-3)], RADIUS_M, "soil")
    simulation.glue([0], "floor")
    simulation.run(0.3)
    weight = 9.81 * MATERIAL.density_kg_m3 * 4 / 3 * np.pi * RADIUS_M**3
    assert simulation.mean_wall_forces_n["floor"][2] == pytest.approx(-weight, rel=1e-3)
    assert simulation.grains.positions_m[0].tolist() == [0, 0, RADIUS_M]
    simulation.move_wall("floor", (0.0, 0.0, 0.05))
    start = simulation.wall("floor").low_m[2]
    simulation.advance(100)
    assert simulation.grains.positions_m[0, 2] - RADIUS_M == pytest.approx(simulation.wall("floor").low_m[2] - start, rel=1e-9)


def test_a_lid_under_constant_force_presses_with_that_force():
    lid = dem.Box(
        name="lid", material="soil", low_m=(-1.0, -1.0, 0.02), high_m=(1.0, 1.0, 0.02),
        drive=dem.Drive(axis=2, applied_force_n=-0.02, mass_kg=1e-4, damping_kg_s=0.05),
    )  # fmt: skip
    simulation = box_of_grains(n=60)
    simulation.add_wall(lid)
    simulation.run(1.0, until=lambda s: s.time_s > 0.3 and s.is_static(1e-6))
    simulation.advance(500)
    assert simulation.mean_wall_forces_n["lid"][2] == pytest.approx(0.02, rel=1e-3)


def test_a_factory_waits_for_its_time_and_makes_the_sizes_asked_for():
    simulation = make([floor()], smallest_radius_m=0.6e-3)
    region = dem.BoxRegion(low_m=(-0.01, -0.01), high_m=(0.01, 0.01), bottom_m=0.0)
    sizes = dem.Sizes(mean_m=RADIUS_M, sd_ratio=0.2)
    simulation.add_factory(dem.Factory(n_grains=300, region=region, sizes=sizes, material="soil", seed=3, time_s=0.01))
    assert simulation.n_grains == 0
    simulation.run(0.011)
    radii = simulation.grains.radii_m
    assert len(radii) == 300
    assert radii.mean() == pytest.approx(RADIUS_M, rel=0.05)
    assert radii.std() / radii.mean() == pytest.approx(0.2 * 0.88, rel=0.1)  # a normal cut at two deviations keeps 0.88 of its SD
    assert sizes.smallest_m <= radii.min() < radii.max() <= sizes.largest_m


def test_factories_make_no_contacts():
    region = dem.TubeRegion(radius_m=0.01, bottom_m=0.0)
    factory = dem.Factory(n_grains=500, region=region, sizes=dem.Sizes(mean_m=RADIUS_M), material="soil", seed=1)
    positions, radii = factory.make()
    assert not all_pairs(positions, radii, np.zeros(3), 0.0)
    assert (np.hypot(*positions[:, :2].T) + radii).max() < 0.01
    assert (positions[:, 2] - radii).min() > 0


@pytest.mark.parametrize("seed", [1, 2])
def test_a_factory_scatters_velocities_about_the_one_it_is_given(seed):
    simulation = box_of_grains(n=600, seed=seed, velocity_m_s=(0.0, 0.1, -0.5), velocity_sd_m_s=0.2)
    velocities = simulation.grains.velocities_m_s
    assert velocities.mean(axis=0) == pytest.approx([0.0, 0.1, -0.5], abs=4 * 0.2 / np.sqrt(600))
    assert velocities.std(axis=0) == pytest.approx([0.2] * 3, rel=0.15)
    again = box_of_grains(n=600, seed=seed, velocity_m_s=(0.0, 0.1, -0.5), velocity_sd_m_s=0.2)
    assert (velocities == again.grains.velocities_m_s).all()


def test_a_blow_up_is_an_error_that_says_what_and_when():
    simulation = make([floor()])
    simulation.add_grains([(0, 0, 1e-3), (2e-3, 0, 1.1e-3)], RADIUS_M, "soil", velocities_m_s=[(30.0, 0, 0), (-30.0, 0, 0)])
    with pytest.raises(dem.SimulationError, match=r"blew up: grain \d moves at .* m/s after t = "):
        simulation.run(0.1, every_steps=10)


def small_plate(**settings):
    """A plate of 2 cm in the plane z = 0."""
    return dem.Box(name="plate", material="soil", low_m=(-0.01, -0.01, 0.0), high_m=(0.01, 0.01, 0.0), **settings)


def blame(simulation, seconds, **options):
    """Message of a simulation that blows up."""
    with pytest.raises(dem.SimulationError) as caught:
        simulation.run(seconds, **options)
    return str(caught.value)


WEIGHTLESS = {"gravity_m_s2": (0.0, 0.0, 0.0)}


def test_a_wall_that_is_too_fast_is_blamed_by_name():
    simulation = make([floor(), small_plate()], **WEIGHTLESS)
    simulation.add_grains([(0, 0, 3e-3)], RADIUS_M, "soil")
    simulation.move_wall("plate", (0, 0, 30.0))
    said = blame(simulation, 0.001)
    assert "blew up: wall 'plate' moves at 30 m/s after t = 0 s" in said
    assert said.endswith("move it more slowly, or reduce time_step_rayleigh_ratio")


def test_a_wall_that_its_force_throws_is_blamed_with_its_drive():
    lid = small_plate(drive=dem.Drive(axis=2, applied_force_n=-1.0, mass_kg=1e-6))
    simulation = make([floor(), lid], **WEIGHTLESS)
    simulation.add_grains([(0, 0, 0.5)], RADIUS_M, "soil")
    said = blame(simulation, 0.01)
    assert "blew up: wall 'plate' moves at " in said
    assert said.endswith("a force drives it along z: increase mass_kg or damping_kg_s of its Drive")


def test_a_grain_that_a_wall_has_struck_is_blamed_together_with_the_wall():
    simulation = make([small_plate(velocity_m_s=(0, 0, 0.9))], time_step_rayleigh_ratio=0.5, **WEIGHTLESS)
    limit = simulation._runner.speed_limit
    simulation.move_wall("plate", (0, 0, 0.9 * limit))
    simulation.add_grains([(0, 0, 1.2e-3)], RADIUS_M, "soil")
    said = blame(simulation, 0.001)
    assert "blew up: grain 0 moves at " in said
    assert said.endswith(f"; wall 'plate' moves at {0.9 * limit:.3g} m/s")


def test_a_grain_that_fell_off_its_plate_is_blamed_with_the_floor_that_lets_it_leave():
    """The second grain; in memory it may be any, so grains are sorted before."""
    simulation = make([small_plate()], gravity_m_s2=(0.0, 0.0, -1000.0))
    simulation.add_grains([(0, 0, RADIUS_M), (0.05, 0, RADIUS_M), (-5e-3, 0, RADIUS_M)], RADIUS_M, "soil")
    simulation._state.restructure(np.array([1, 2, 0]))
    said = blame(simulation, 1.0)
    assert "blew up: grain 1 moves at " in said
    assert "no wall is below it: if it fell off, set floor_m" in said
    with_floor = make([small_plate()], gravity_m_s2=(0.0, 0.0, -1000.0), floor_m=-0.01)
    with_floor.add_grains([(0, 0, RADIUS_M), (0.05, 0, RADIUS_M)], RADIUS_M, "soil")
    with_floor.run(0.1)
    assert (with_floor.n_left, with_floor.n_grains) == (1, 1)


def test_a_grain_that_is_only_too_fast_gets_no_advice_about_floors_and_walls():
    simulation = make([floor()])
    simulation.add_grains([(0, 0, 0.1)], RADIUS_M, "soil", velocities_m_s=(0, 0, -30.0))
    assert blame(simulation, 0.1, every_steps=1).endswith("of a radius in one step (18.3 m/s)")


def test_a_grain_too_far_away_is_blamed_with_its_position():
    simulation = make([floor()], **WEIGHTLESS)
    simulation.add_grains([(0, 0, 1.0), (0, 90.0, 150.0)], RADIUS_M, "soil")
    assert "blew up: grain 1 is at (0, 90, 150) m after t = 0 s, more than 100000 radii" in blame(simulation, 0.1)


@pytest.mark.parametrize(("name", "said"), [("walls", "of wall 'floor' is"), ("grains", "of grain 2 is")])
def test_what_is_not_a_number_has_not_left_but_blown_up(name, said):
    simulation = make([floor()])
    simulation.add_grains([(5e-3 * k, 0, RADIUS_M) for k in range(4)], RADIUS_M, "soil")
    if name == "walls":
        simulation._state.bodies.velocity[0, 2] = np.nan
    else:
        simulation._state.places[2, 0] = np.nan
    message = blame(simulation, 0.001)
    assert f"blew up: position or velocity {said} not finite" in message
    assert (simulation.n_left, simulation.n_grains) == (0, 4)


def test_grains_at_rest_are_static_without_gravity_and_grains_that_move_are_not():
    simulation = make([floor()], **WEIGHTLESS)
    assert simulation.is_static()
    simulation.add_grains([(0, 0, RADIUS_M), (0.01, 0, RADIUS_M)], RADIUS_M, "soil")
    assert simulation.is_static()
    simulation.add_grains([(0.02, 0, RADIUS_M)], RADIUS_M, "soil", velocities_m_s=(0, 0, 0.01))
    assert not simulation.is_static()
    simulation.glue([2], "floor")
    assert simulation.is_static()


def test_a_packing_under_a_lid_comes_to_rest_without_gravity():
    """Grains that no force chain holds drift on between the others, so the criterion is wider than by default."""
    simulation = box_of_grains(n=60, velocity_m_s=(0, 0, -0.1), **WEIGHTLESS)
    drive = dem.Drive(axis=2, applied_force_n=-0.02, mass_kg=1e-4, damping_kg_s=0.05)
    lid = dem.Box(name="lid", material="soil", low_m=(-1.0, -1.0, 0.02), high_m=(1.0, 1.0, 0.02), drive=drive)
    simulation.add_wall(lid)
    assert not simulation.is_static(1e-4)
    assert simulation.run(2.0, until=lambda s: s.is_static(1e-4))
    assert simulation.mean_wall_forces_n["lid"][2] == pytest.approx(0.02, rel=1e-2)


def test_glued_grains_alone_are_static():
    simulation = make([floor()])
    simulation.add_grains([(0, 0, RADIUS_M)], RADIUS_M, "soil")
    simulation.glue([0], "floor")
    assert simulation.is_static()


STEEL = dem.Material(density_kg_m3=7800, poisson_ratio=0.3, shear_modulus_pa=8e10)


def soil_and_steel(radii, **options):
    pairs = {("soil", "soil"): ROUGH, ("soil", "steel"): ROUGH, ("steel", "steel"): ROUGH}
    return dem.Simulation(materials={"soil": MATERIAL, "steel": STEEL}, interactions=pairs, smallest_radius_m=radii, **options)


def test_stiff_walls_do_not_shorten_the_step_of_soft_grains():
    simulation = soil_and_steel({"soil": RADIUS_M})
    assert simulation.time_step_s == make().time_step_s
    assert soil_and_steel(RADIUS_M).time_step_s < 0.1 * simulation.time_step_s
    with pytest.raises(ValueError, match="material of grains is 'steel'; allowed: one of \\['soil'\\]"):
        simulation.add_grains([(0, 0, 0)], RADIUS_M, "steel")
    balls = soil_and_steel({"soil": RADIUS_M, "steel": 20 * RADIUS_M})
    assert balls.time_step_s == pytest.approx(0.2 * dem.rayleigh_time(20 * RADIUS_M, STEEL))


def test_a_step_in_seconds_is_checked_against_all_pairs_that_can_meet():
    """Beside two like grains, E* of a soft grain on a hard body is twice theirs, sqrt(R*) is sqrt(2) and m* is 2 times theirs."""
    rayleigh = dem.rayleigh_time(RADIUS_M, MATERIAL)
    for radii in ({"soil": RADIUS_M}, {"soil": RADIUS_M, "steel": 1e3 * RADIUS_M}):
        limit = 0.5 * rayleigh * 2.0**-0.25
        assert soil_and_steel(radii, time_step_s=0.99 * limit).time_step_s == 0.99 * limit
        with pytest.raises(ValueError, match="time_step_s is .*; allowed: at most .* for 'soil' on 'steel'"):
            soil_and_steel(radii, time_step_s=1.01 * limit)


@pytest.mark.parametrize(
    ("make_it", "message"),
    [
        (lambda: dem.Material(density_kg_m3=-1, poisson_ratio=0.2, shear_modulus_pa=1e6), "density_kg_m3 is -1; allowed"),
        (lambda: dem.Material(density_kg_m3=1, poisson_ratio=0.5, shear_modulus_pa=1e6), "poisson_ratio is 0.5; allowed"),
        (lambda: dem.Material(density_kg_m3=1, poisson_ratio=0.2, shear_modulus_pa=0), "shear_modulus_pa is 0; allowed"),
        (lambda: dem.Interaction(restitution=0, static_friction=0, rolling_friction=0), "restitution is 0; allowed"),
        (lambda: dem.Interaction(restitution=1, static_friction=-0.1, rolling_friction=0), "static_friction is -0.1; allowed"),
        (lambda: dem.Sizes(mean_m=1e-3, sd_ratio=0.6), "radius_sd_ratio is 0.6; allowed"),
        (lambda: make(time_step_rayleigh_ratio=0.9), "time step over Rayleigh time is 0.9; allowed"),
        (
            lambda: make(smallest_radius_m={"mud": 1e-3}),
            "smallest_radius_m is {'mud': 0.001}; allowed: a radius, or one for some of",
        ),
        (lambda: make(smallest_radius_m={"soil": 0.0}), "smallest_radius_m of 'soil' is 0.0; allowed: a positive number"),
        (lambda: make(time_step_s=-1e-6), "time_step_s is -1e-06; allowed: a positive number"),
        (lambda: make(time_step_s=1e-3), "time_step_s is 0.001; allowed: at most"),
        (lambda: make(rolling_model="b"), "rolling_model is 'b'; allowed: one of ['type_a', 'type_c']"),
        (lambda: make().add_grains([(0, 0, np.nan)], RADIUS_M, "soil"), "positions_m is not finite"),
        (lambda: make().add_grains([(0, 0, 0)], 0.5 * RADIUS_M, "soil"), "smallest radius of grains is 0.0005; allowed"),
        (lambda: make().add_grains([(0, 0, 0)], RADIUS_M, "mud"), "material of grains is 'mud'; allowed"),
        (lambda: make([floor(), floor()]), "wall name is 'floor'; allowed"),
        (lambda: make().move_wall("lid", (0, 0, 0)), "wall is 'lid'; allowed"),
        (lambda: alone(period_m=(0.0, 4.2e-3, 0.0)).advance(1), "period_m along y is 0.0042; allowed"),
        (lambda: make(period_m=(0.0, -1.0, 0.0)), "period_m is (0.0, -1.0, 0.0); allowed"),
        (lambda: make(gravity_m_s2=(0.0, 0.0, np.nan)), "gravity_m_s2 is (0.0, 0.0, nan); allowed"),
        (lambda: sticky(-0.1), "work_of_adhesion_j_m2 is -0.1; allowed: zero or positive"),
        (lambda: sticky(np.nan), "work_of_adhesion_j_m2 is nan; allowed: zero or positive"),
        (lambda: make(adhesion="sticky"), "adhesion is 'sticky'; allowed: one of ['none', 'constant', 'jkr', 'capillary']"),
        (
            lambda: make().set_interaction("soil", "soil", sticky(0.1)),
            "work_of_adhesion_j_m2 of 'soil' with 'soil' is 0.1; allowed: 0 in a simulation with adhesion 'none'",
        ),
        (
            lambda: make(interaction=replace(sticky(0.1), bridge_volume_ratio=0.01)),
            "bridge_volume_ratio of 'soil' with 'soil' is 0.01; allowed: 0 in a simulation with adhesion 'constant'",
        ),
        (lambda: replace(ROUGH, bridge_volume_ratio=0.2), "bridge_volume_ratio is 0.2; allowed: zero to 0.1"),
        (lambda: make(damping_model="none"), "damping_model is 'none'; allowed: one of ['edem', 'no_pull']"),
        (lambda: alone(velocities_m_s=(0, np.inf, 0)), "velocities_m_s is not finite"),
        (lambda: alone(angular_velocities_rad_s=(0, np.nan, 0)), "angular_velocities_rad_s is not finite"),
        (lambda: alone().add_grains([(0, 0, 1.5e-3)], RADIUS_M, "soil"), "overlap of grains 0 and 1 is 0.5 of a radius; allowed"),
        (
            lambda: alone(period_m=(0.0, 0.02, 0.0)).add_grains([(0, 0.0181, 0)], RADIUS_M, "soil"),
            "overlap of grains 0 and 1 is 0.1 of a radius; allowed",
        ),
        (
            lambda: make([floor()]).add_grains([(5e-3, 0, 2e-3), (0, 0, 0.5e-3)], RADIUS_M, "soil"),
            "grain 1 at [0.0, 0.0, 0.0005] in wall 'floor': its overlap is 0.5 of a radius; allowed",
        ),
        (lambda: box_of_grains(n=0), "n_grains is 0; allowed: at least 1"),
        (lambda: alone(floor_m=1.0), "height of grain 0 is 0.0; allowed: at least floor_m = 1.0"),
        (lambda: make([floor()]).move_wall("floor", (0, 0, np.nan)), "velocity_m_s of wall 'floor' is (0, 0, nan); allowed"),
        (lambda: make([floor()]).move_wall("floor", 1.0), "velocity_m_s of wall 'floor' is 1.0; allowed: three finite numbers"),
        (lambda: floor(velocity_m_s=(0, np.nan, 0)), "velocity_m_s of wall 'floor' is (0, nan, 0); allowed"),
        (lambda: floor(velocity_m_s=(np.inf, 0, 0)), "velocity_m_s of wall 'floor' is (inf, 0, 0); allowed"),
        (lambda: dem.Box(name="a", material="soil", low_m=(0, 0, np.nan), high_m=(0, 0, 0)), "low_m of wall 'a' is (0, 0, nan)"),
        (lambda: dem.Box(name="a", material="soil", low_m=(0, 0), high_m=(0, 0)), "low_m of wall 'a' is (0, 0); allowed"),
        (lambda: dem.Box(name="a", material="soil", low_m=(0, 0, 1), high_m=(0, 0, 0)), "Box 'a': low_m (0, 0, 1) must not"),
        (lambda: tube(radius_m=np.inf), "radius_m of wall 'tube' is inf; allowed: a positive number"),
        (lambda: tube(centre_m=(0, np.nan)), "centre_m of wall 'tube' is (0, nan); allowed: two finite numbers"),
        (lambda: tube(top_m=np.nan), "Tube 'tube': bottom_m 0.0 must not exceed top_m nan"),
        (lambda: dem.Drive(axis=3, applied_force_n=1.0, mass_kg=1.0), "Drive.axis is 3; allowed"),
        (lambda: dem.Drive(axis=2, applied_force_n=np.nan, mass_kg=1.0), "Drive.applied_force_n is nan; allowed"),
        (lambda: dem.Drive(axis=2, applied_force_n=1.0, mass_kg=np.inf), "Drive.mass_kg is inf; allowed"),
        (lambda: dem.Drive(axis=2, applied_force_n=1.0, mass_kg=1.0, damping_kg_s=np.nan), "Drive.damping_kg_s is nan; allowed"),
        (lambda: box_of_grains(time_s=np.nan), "time_s of a factory is nan; allowed"),
        (lambda: box_of_grains(velocity_m_s=(0, 0, np.nan)), "velocity_m_s of a factory is (0, 0, nan); allowed"),
        (lambda: box_of_grains(velocity_sd_m_s=-1.0), "velocity_sd_m_s of a factory is -1.0; allowed: zero or positive"),
        (lambda: dem.TubeRegion(radius_m=np.nan, bottom_m=0.0), "radius_m of a region is nan; allowed"),
        (lambda: dem.BoxRegion(low_m=(0, np.nan), high_m=(1, 1), bottom_m=0.0), "low_m of a region is (0, nan); allowed"),
        (lambda: dem.BoxRegion(low_m=(0, 0), high_m=(1, 1), bottom_m=np.nan), "bottom_m of a region is nan; allowed"),
        (lambda: make(gravity_m_s2=(0.0, -9.81)), "gravity_m_s2 is (0.0, -9.81); allowed: three finite numbers"),
        (lambda: make(gravity_m_s2=("0", "0", "down")), "gravity_m_s2 is ('0', '0', 'down'); allowed"),
        (lambda: make(floor_m=np.nan), "floor_m is nan; allowed"),
        (lambda: alone().run(np.inf), "duration_s is inf; allowed: a finite number"),
        (lambda: alone().run(1.0, every_steps=0), "every_steps is 0; allowed: at least 1"),
        (lambda: alone().advance(-1), "n_steps is -1; allowed: zero or positive"),
    ],
)
def test_impossible_input_is_refused_with_name_value_and_what_is_allowed(make_it, message):
    with pytest.raises(ValueError, match=re.escape(message)):
        make_it()


def wide_bed(threads=1, period_x=0.0, n_grains=36_000):
    """Enough grains for more slabs than groups and for sorting in space, on their way down."""
    simulation = make([floor()], threads=threads, period_m=(period_x, 0.0, 0.0))
    region = dem.BoxRegion(low_m=(0.0, 0.0), high_m=(0.25, 0.08), bottom_m=0.0)
    sizes = dem.Sizes(mean_m=RADIUS_M)
    simulation.add_factory(dem.Factory(n_grains=n_grains, region=region, sizes=sizes, material="soil", seed=1))
    simulation.advance(2500)
    assert slabs.used_slabs(simulation._state.lists.pairs.outer.slab) > schedule.GROUPS
    return simulation


@pytest.mark.skipif(numba.config.NUMBA_NUM_THREADS < 2, reason="one processor core")
def test_any_number_of_threads_gives_the_same_bytes():
    one, two = (wide_bed(threads).grains for threads in (1, 2))
    assert one.velocities_m_s.any()
    for name in ("positions_m", "velocities_m_s", "angular_velocities_rad_s"):
        assert getattr(one, name).tobytes() == getattr(two, name).tobytes()


@pytest.mark.skipif(numba.config.NUMBA_NUM_THREADS < 2, reason="one processor core")
def test_several_threads_share_the_work():
    simulation = long_packing(threads=2)

    def of_others():
        times = {thread.id: thread.user_time for thread in psutil.Process().threads()}
        return sum(times.values()) - times[threading.get_native_id()], sum(times.values())

    before = of_others()
    while of_others()[1] - before[1] < 1.0:  # the clock's ticks are 10 ms
        simulation.advance(20)
    others, all_of_them = np.subtract(of_others(), before)
    assert others > 0.2 * all_of_them


@pytest.mark.parametrize("period_x", [0.0, 0.25])
def test_grains_that_move_at_once_move_as_when_all_wait_for_all_loads(period_x):
    results = []
    for at_once in (True, False):
        s = wide_bed(period_x=period_x)
        advance_by_hand(s, at_once, n_steps=20)
        results.append((b"".join(values.tobytes() for values in s._state.grains), s._state.lists.pairs.contacts.history.tobytes()))
        assert not s._state.loads.any()
    assert results[0] == results[1]


@pytest.mark.parametrize("shape", [(12, 12, 12), (40, 16, 16)])
@pytest.mark.parametrize("periodic", [(False, False, False), (True, False, False), (True, True, True)])
def test_grains_of_a_dense_packing_move_at_once_as_when_all_wait(shape, periodic):
    """A lattice of one slab of many blocks, and of four: every grain touches up to six others."""
    results = []
    for at_once in (True, False):
        spacing_m = 1.98 * RADIUS_M
        s = make(period_m=tuple(np.where(periodic, np.array(shape) * spacing_m, 0.0)))
        places = spacing_m * np.stack(np.meshgrid(*map(np.arange, shape), indexing="ij"), -1).reshape(-1, 3)
        rng = np.random.default_rng(1)
        s.add_grains(places, RADIUS_M, "soil", rng.normal(0, 0.05, places.shape), rng.normal(0, 10.0, places.shape))
        s.advance(1)
        advance_by_hand(s, at_once, n_steps=20)
        assert slabs.used_slabs(s._state.lists.pairs.outer.slab) == (4 if len(places) > 4000 else 1)
        assert s._state.lists.pairs.contacts.count.max() > 16 * BLOCK
        results.append((b"".join(values.tobytes() for values in s._state.grains), s._state.lists.pairs.contacts.history.tobytes()))
        assert not s._state.loads.any()
    assert results[0] == results[1]


def long_packing(threads=1, periodic=False, driven=False, n_steps=50, glued=False):
    """A lattice of slabs enough for most steps at once, slow enough too, and two grains about to meet; advanced by n_steps.

    Two walls move against the lattice. The two grains overlap after the first step.

    driven : with one more wall, far away, that a force drives and to which a grain is glued: then steps are made one by one, and
    grains wait for the loads of all. glued : the lowest layer belongs to the floor.
    """
    shape, spacing_m = (150, 29, 29), 1.999 * RADIUS_M
    size_m = np.array(shape) * spacing_m
    low_m, edge_m = (-1, -1, -1), -0.999 * RADIUS_M
    walls = [
        dem.Box(name="floor", material="soil", low_m=low_m, high_m=(1, 1, edge_m), velocity_m_s=(0.02, 0, 0.04)),
        dem.Box(name="side", material="soil", low_m=low_m, high_m=(1, edge_m, 1), velocity_m_s=(0, -0.02, 0)),
    ]
    if driven:
        drive = dem.Drive(axis=0, applied_force_n=1.0, mass_kg=1.0)
        walls.append(dem.Box(name="away", material="soil", low_m=(5, 5, 5), high_m=(6, 6, 6), drive=drive))
    s = make(walls, threads=threads, period_m=(size_m[0] if periodic else 0.0, 0.0, 0.0))
    places = spacing_m * np.stack(np.meshgrid(*map(np.arange, shape), indexing="ij"), -1).reshape(-1, 3)
    rng, lowest = np.random.default_rng(1), np.flatnonzero(places[:, 2] == 0.0)
    velocities, spins = rng.normal(0, 0.01, places.shape), rng.normal(0, 10.0, places.shape)
    if glued:
        velocities[lowest], spins[lowest] = walls[0].velocity_m_s, 0.0
    s.add_grains(places, RADIUS_M, "soil", velocities, spins)
    speed_m_s = 5e-4 * RADIUS_M / s.time_step_s
    pair = size_m / 2 + [[0, 0, size_m[2]], [2.0005 * RADIUS_M, 0, size_m[2]]]
    s.add_grains(pair, RADIUS_M, "soil", [[speed_m_s, 0, 0], [-speed_m_s, 0, 0]])
    s.add_grains(size_m / 2 + [0, 0, 2 * size_m[2]], RADIUS_M, "soil")
    if driven:
        s.glue([len(places) + 2], "away")
    if glued:
        s.glue(lowest, "floor")
    s.advance(n_steps)
    share, _ = allowance.allow_inner(s._state.grains, s._state.lists, s.time_step_s, s._runner.skin, s._runner.reach_m)
    assert loop.steps_within(1.0, share, slabs.used_slabs(s._state.lists.pairs.outer.slab)) == schedule.STEPS_AT_ONCE
    return s


@pytest.mark.parametrize(("periodic", "glued"), [(False, False), (True, False), (True, True)])
def test_steps_made_at_once_are_those_made_one_by_one(periodic, glued):
    """But for the order in which the loads on a grain are summed: its velocities are good to a few 1e-7."""
    at_once, one_by_one = (long_packing(periodic=periodic, driven=driven, glued=glued) for driven in (False, True))
    for name, scale in (("velocities_m_s", 0.1), ("positions_m", RADIUS_M), ("angular_velocities_rad_s", 100.0)):
        a, b = (getattr(s.grains, name)[:-1] for s in (at_once, one_by_one))  # all but the grain that is glued in one of them
        assert np.abs(a - b).max() < 1e-5 * scale, name
    for name, force in at_once.mean_wall_forces_n.items():
        assert np.abs(force).max() > 0.1
        assert force == pytest.approx(one_by_one.mean_wall_forces_n[name], rel=1e-5, abs=1e-5), name


@pytest.mark.skipif(numba.config.NUMBA_NUM_THREADS < 2, reason="one processor core")
def test_steps_made_at_once_give_the_same_bytes_for_any_number_of_threads():
    one, two = (long_packing(threads, glued=True) for threads in (1, 2))
    for a, b in zip(one._state.grains, two._state.grains, strict=True):
        assert a.tobytes() == b.tobytes()
    assert one.mean_wall_forces_n["floor"].tobytes() == two.mean_wall_forces_n["floor"].tobytes()


@pytest.mark.parametrize(
    ("way_m", "used", "n"),
    [(0.0, 36, 1), (1.9, 36, 1), (2.0, 36, 2), (4.0, 36, 3), (1e3, 36, 5), (1e3, 52, 7), (1e3, 128, 8), (1e3, 35, 1)],
)
def test_so_many_steps_at_once_that_grains_twice_as_fast_stay_within_the_way(way_m, used, n):
    assert loop.steps_within(way_m, 1.0, used) == n


def advance_by_hand(s, at_once, n_steps):
    """Steps without contacts with walls and without upkeep of the lists."""
    state, model = s._state, s._runner.model
    run = schedule.Run(state.view(), state.scene(), state.lists, model, s._runner.scratch())
    contacts = state.lists.pairs.contacts
    blocks.common_constants(run.state, contacts, model)
    state.lists.within[:] = state.places[:, RADIUS] + 0.05 * s._runner.skin
    state.lists.place[:] = state.grains.place
    assert schedule.prune(run.state, state.lists, model, None)
    assert contacts.count.sum() > 1000
    steps, move = callable_from_python(schedule.steps), callable_from_python(schedule.move)
    for _ in range(n_steps):
        steps(schedule.Plan(1, at_once), run, None)
        if not at_once:
            assert state.loads.any()
            move(run, None)


def test_contacts_with_walls_stand_wall_by_wall_and_keep_their_history():
    """More than a block of them with each of two walls, a few with a third, none with a fourth."""
    side = 20
    walls = [
        floor(),
        dem.Box(name="air", material="soil", low_m=(-1.0, -1.0, 0.5), high_m=(1.0, 1.0, 0.5)),
        dem.Box(name="lid", material="soil", low_m=(-1.0, -1.0, 2 * RADIUS_M), high_m=(1.0, 1.0, 1.0e-1)),
        dem.Box(name="side", material="soil", low_m=(-1.0, -1.0, 0.0), high_m=(-RADIUS_M, 1.0, 1.0)),
    ]
    simulation = make(walls)
    x, y = 2.2 * RADIUS_M * np.stack(np.meshgrid(np.arange(side), np.arange(side))).reshape(2, -1)
    simulation.add_grains(np.column_stack([x, y, np.full(side**2, RADIUS_M)]), RADIUS_M, "soil")
    simulation.advance(1)
    state, model = simulation._state, simulation._runner.model
    outer, _, contacts = state.lists.surfaces
    outer.history[:] = kept = np.random.default_rng(1).normal(size=outer.history.shape).astype(outer.history.dtype)
    state.lists.within[:] = RADIUS_M
    surfaces.prune_surfaces(state.view(), state.surfaces, None, state.lists, 0.1 * RADIUS_M, model, None)
    assert contacts.count.tolist() == [side**2, 0, side**2, side]
    used = []
    for w, wall in enumerate(state.walls):
        own = slice(contacts.begin[w], contacts.begin[w] + contacts.count[w])
        assert contacts.begin[w] % blocks.LINE == 0
        assert (contacts.second[own] == w).all()
        near = shapes.distance(wall, state.places[:, :3]) < 1.1 * RADIUS_M
        assert contacts.first[own].tolist() == np.flatnonzero(near).tolist()
        used += contacts.slot[own].tolist()
    assert len(set(used)) == len(used) == 2 * side**2 + side
    outer.history[:] = 0.0
    loop.save_at_surfaces(state.lists.surfaces)
    assert (outer.history[used] == kept[used]).all()
    assert not contacts.count.any()


def test_sorting_in_space_leaves_grains_and_contacts_as_they_were():
    simulation = box_of_grains()
    simulation.advance(3000)
    before, kept = simulation.grains, loop_history(simulation)
    simulation._runner.sort_in_space()
    after = simulation.grains
    assert (simulation._state.ids != np.arange(simulation.n_grains)).any()
    assert before.positions_m.tobytes() == after.positions_m.tobytes()
    assert loop_history(simulation) == kept
    assert any(any(h) for h in kept.values())


def loop_history(simulation):
    """{pair of grain ids: contact history}, pairs in the order of their ids."""
    history = {}
    for i in range(simulation.n_grains):
        for k in range(*simulation._state.lists.pairs.outer.row[i].tolist()):
            pair = int(simulation._state.ids[i]), int(simulation._state.ids[simulation._state.lists.pairs.outer.partner[k]])
            history[pair] = tuple(simulation._state.lists.pairs.outer.history[k].tolist())
    return history


def outer_list(rows, history):
    """An outer list of three grains: partners of each, and one history value per entry."""
    ends = np.cumsum([len(row) for row in rows])
    return storage.Outer(
        row=np.column_stack([ends - [len(row) for row in rows], ends]),
        owner=np.repeat(np.arange(3), [len(row) for row in rows]).astype(np.int32),
        partner=np.array([j for row in rows for j in row], np.int32),
        history=np.repeat(np.array(history, float)[:, None], 3, axis=1),
        order=np.arange(3),
        slab=np.zeros(slabs.SLABS + 1, np.int64),
    )


def test_the_history_of_a_pair_turns_its_sign_with_the_pair():
    old = outer_list([[1, 2], [2], []], [1.0, 2.0, 3.0])
    new = outer_list([[], [0], [1, 0]], [9.0, 9.0, 9.0])
    history.carry_history(old, new, True)
    assert new.history[:, 0].tolist() == [-1.0, -3.0, -2.0]
    same = outer_list([[2, 1], [], []], [9.0, 9.0])
    history.carry_history(old, same, True)
    assert same.history[:, 0].tolist() == [2.0, 1.0]


def test_the_history_with_walls_never_changes_hands():
    old = outer_list([[1], [], []], [1.0])  # grain 0 at wall 1
    new = outer_list([[], [0], []], [9.0])  # grain 1 at wall 0
    history.carry_history(old, new, False)
    assert new.history[:, 0].tolist() == [0.0]


def test_a_fast_wall_finds_a_grain_that_was_far_away():
    simulation = make([floor()], gravity_m_s2=(0.0, 0.0, 0.0))
    simulation.add_grains([(0.0, 0.0, 8 * RADIUS_M)], RADIUS_M, "soil")
    simulation.move_wall("floor", (0.0, 0.0, 0.5))
    simulation.run(20 * RADIUS_M / 0.5)
    assert simulation.grains.positions_m[0, 2] - simulation.wall("floor").low_m[2] > 0.9 * RADIUS_M
    assert simulation.grains.velocities_m_s[0, 2] > 0.5


@pytest.mark.parametrize("gap_ratio", [0.4, 0.6, 0.8, 1.0, 5.0])
def test_two_grains_that_fly_at_each_other_meet_in_time(gap_ratio):
    """Whether or not the outer list of the start holds the pair: they rebound with their coefficient of restitution."""
    simulation = make(gravity_m_s2=(0.0, 0.0, 0.0), time_step_rayleigh_ratio=0.1)
    for side in (-1.0, 1.0):
        place = (side * (1.0 + 0.5 * gap_ratio) * RADIUS_M, 0.0, 0.0)
        simulation.add_grains([place], RADIUS_M, "soil", [(-0.5 * side, 0.0, 0.0)])
    simulation.run((gap_ratio + 1.0) * RADIUS_M / 0.5)
    assert simulation.grains.velocities_m_s[:, 0] == pytest.approx([-0.25, 0.25], rel=0.02)


def test_a_glued_grain_meets_a_free_one_in_time():
    """It moves with its wall, not as free grains do, and is as heavy: the free one leaves with 1 + e times its speed."""
    simulation = make([floor()], gravity_m_s2=(0.0, 0.0, 0.0), time_step_rayleigh_ratio=0.1)
    simulation.add_grains([(0.0, 0.0, 1.5 * RADIUS_M), (0.0, 0.0, 4.3 * RADIUS_M)], RADIUS_M, "soil")
    simulation.glue([0], "floor")
    simulation.move_wall("floor", (0.0, 0.0, 0.5))
    simulation.run(3 * RADIUS_M / 0.5)
    assert simulation.grains.velocities_m_s[1, 2] == pytest.approx(0.75, rel=0.02)


def test_a_glued_grain_stays_where_it_is_on_a_wall_that_changes_its_speed():
    simulation = make([floor()])
    simulation.add_grains([(0.0, 0.0, 1.5 * RADIUS_M)], RADIUS_M, "soil")
    simulation.glue([0], "floor")
    above = simulation.grains.positions_m[0, 2] - simulation.wall("floor").high_m[2]
    for speed_m_s in (0.5, -0.2, 0.0, 0.1):
        simulation.move_wall("floor", (0.0, 0.0, speed_m_s))
        simulation.advance(3)
        assert simulation.grains.positions_m[0, 2] - simulation.wall("floor").high_m[2] == pytest.approx(above, abs=1e-9)
    assert simulation.grains.velocities_m_s[0, 2] == pytest.approx(0.1)


@pytest.mark.parametrize("state", ["falling", "at rest", "floor strikes", "tube lifted", "tube far away"])
def test_lists_that_last_give_the_steps_of_lists_made_for_each_step(state):
    """Every `advance` begins with new inner lists. A contact felt a step late would change velocities by far more than rounding."""
    lasting = box_of_grains(precision="float64")
    lasting.run(0.04 if state == "falling" else 0.3)
    walls = {"floor strikes": ("floor", 0.3), "tube lifted": ("tube", 0.05), "tube far away": ("tube", 5.0)}
    if state in walls:
        name, speed_m_s = walls[state]
        lasting.move_wall(name, (0.0, 0.0, speed_m_s))
    if state.startswith("tube"):
        lasting.run(0.02)
    each_step = copy.deepcopy(lasting)
    lasting.advance(400)
    for _ in range(400):
        each_step.advance(1)
    a, b = lasting.grains, each_step.grains
    assert np.abs(a.velocities_m_s - b.velocities_m_s).max() < 1e-8
    assert np.abs(a.positions_m - b.positions_m).max() < 1e-8 * RADIUS_M


@pytest.mark.parametrize(("pair", "e"), [(("a", "a"), 0.9), (("a", "b"), 0.2)])
def test_equal_grains_of_two_materials_keep_their_own_interactions(pair, e):
    def touch(restitution):
        return dem.Interaction(restitution=restitution, static_friction=0.0, rolling_friction=0.0)

    simulation = dem.Simulation(
        materials={"a": MATERIAL, "b": MATERIAL},
        interactions={("a", "a"): touch(0.9), ("a", "b"): touch(0.2), ("b", "b"): touch(0.9)},
        smallest_radius_m=RADIUS_M,
        gravity_m_s2=(0.0, 0.0, 0.0),
    )
    for material, side in zip(pair, (-1, 1), strict=True):
        simulation.add_grains([(side * 1.1 * RADIUS_M, 0.0, 0.0)], RADIUS_M, material, velocities_m_s=[(-side * 0.1, 0.0, 0.0)])
    simulation.run(0.02)
    assert abs(simulation.grains.velocities_m_s[0, 0]) / 0.1 == pytest.approx(e, abs=0.1)


def test_a_copy_of_a_simulation_goes_on_by_itself():
    simulation = box_of_grains()
    simulation.advance(200)
    twin = copy.deepcopy(simulation)
    twin.advance(200)
    assert (twin.n_steps, simulation.n_steps) == (400, 200)
    simulation.advance(200)
    assert simulation.grains.positions_m.tobytes() == twin.grains.positions_m.tobytes()


def test_removed_grains_are_gone_and_the_others_keep_order_and_contacts():
    """A grain dragged over its static contact oscillates on the tangential spring: without its history it would go elsewhere."""

    def row():
        simulation = make([floor()])
        places = [(4e-3 * k, 0.0, 0.9999 * RADIUS_M) for k in range(5)]
        simulation.add_grains(places, RADIUS_M, "soil", velocities_m_s=[(1e-3 * (k + 1), 0.0, 0.0) for k in range(5)])
        simulation.advance(30)
        return simulation

    left, whole = row(), row()
    left.remove_grains([3, 0, 0])
    assert np.array_equal(left.grains.positions_m, whole.grains.positions_m[[1, 2, 4]])
    for simulation in (left, whole):
        simulation.advance(100)
    assert left.grains.velocities_m_s == pytest.approx(whole.grains.velocities_m_s[[1, 2, 4]], rel=1e-5, abs=1e-12)
    assert left.n_left == 0
    with pytest.raises(ValueError, match=r"grains to remove is \[3\]; allowed: indices from 0 to 2"):
        left.remove_grains([3])
