"""Mixes of clumps: numbers, masses and order of the kinds, and the virtual tests with them."""

import math
from dataclasses import replace

import numpy as np
import pytest

from dem import Box, BoxRegion, Clump, Factory, Interaction, Material, Mix, Simulation, Sizes, load, save
from dem.experiments import angle_of_repose, plane_shear, rotating_drum, specimen
from dem.experiments.soil import Engine, Soil
from dem.experiments.state import load_state, save_state

RADIUS_M = 1e-3
#: Unequal spheres, whose centre of mass is not the mean of their centres; as many as a trimer has.
PEAR = Clump.of_spheres([(0.0, 0.0, 0.0, 1.0), (0.9, 0.0, 0.0, 0.7), (0.5, 0.8, 0.0, 0.5)], name="pear")
SPHERE, DIMER, TRIMER = (Clump.preset(name) for name in ("sphere", "dimer", "trimer"))
MIX = Mix((SPHERE, DIMER, PEAR, TRIMER), (4.0, 3.0, 2.0, 1.0))
SOIL = Soil(
    radius_m=RADIUS_M, density_kg_m3=2500.0, poisson_ratio=0.2, shear_modulus_pa=2e6, static_friction=0.8, rolling_friction=0.1,
    restitution=0.5, radius_sd_ratio=0.1, shape=MIX,
)  # fmt: skip
HEAP = angle_of_repose.Setup(
    n_particles=300, tube_diameter_ratio=8.0, plate_half_width_ratio=16.0, lift_speed_m_s=0.04, max_time_s=1.0,
    scale_radius_m=RADIUS_M,
)  # fmt: skip
BED = plane_shear.Setup(
    length_ratio=12.0, height_ratio=10.0, width_ratio=8.0, normal_stress_pa=2000.0, preparation_friction_ratio=0.3,
    scale_radius_m=RADIUS_M, shear_strain=0.2, max_shear_strain=0.2, inertial_number=0.05,
)  # fmt: skip
ENGINE = Engine(time_step_rayleigh_ratio=0.4)
SAND = Material(density_kg_m3=2500.0, poisson_ratio=0.2, shear_modulus_pa=2e6)
REGION = BoxRegion(low_m=(0.0, 0.0), high_m=(0.03, 0.03), bottom_m=0.0)


@pytest.fixture
def no_kernels(monkeypatch):
    """Nothing moves."""
    monkeypatch.setattr("dem.compiled.ensure", lambda *_, **__: None)


def empty(**options):
    pair = Interaction(restitution=0.5, static_friction=0.5, rolling_friction=0.1)
    return Simulation(materials={"soil": SAND}, interactions={("soil", "soil"): pair}, smallest_radius_m=0.3e-3, **options)


def factory(seed=1, **changes):
    chosen = {"n_grains": 200, "region": REGION, "sizes": Sizes(mean_m=RADIUS_M, sd_ratio=0.1), "material": "soil", "shape": MIX}
    return Factory(**{**chosen, **changes}, seed=seed)


def dropped(seed=1, **changes):
    simulation = empty()
    simulation.add_factory(factory(seed, **changes))
    return simulation


def distances(places):
    """Distances (n, n) between places (n, 3)."""
    return np.linalg.norm(places[:, None] - places[None], axis=2)


def kinds_of(simulation):
    """Kinds of the clumps, by the first of their members."""
    return simulation.grains.kinds[[members[0] for members in simulation.clumps.members]]


# --- what is dropped --------------------------------------------------------------------------------------------------


def test_the_dropped_grains_have_the_shares_by_number_in_any_order_of_places(no_kernels):
    simulation = dropped()
    kinds, members = kinds_of(simulation), simulation.clumps.members
    assert np.bincount(kinds).tolist() == [80, 60, 40, 20]
    assert [len(own) for own in members] == [MIX.shapes[kind].n_spheres for kind in kinds]
    heights = simulation.clumps.positions_m[:, 2]
    lower = heights < np.median(heights)
    assert np.all(np.abs(np.bincount(kinds[lower]) - np.bincount(kinds[~lower])) < 25)  # no layers of kinds


def test_every_kind_has_the_mass_and_the_moments_of_its_shape(no_kernels):
    clumps, kinds = dropped().clumps, kinds_of(dropped())
    assert len(set(clumps.radii_m)) == 200
    assert clumps.masses_kg == pytest.approx(2500.0 * 4.0 / 3.0 * math.pi * clumps.radii_m**3)
    for kind, shape in enumerate(MIX.shapes):
        own = kinds == kind
        of_unit = clumps.moments_kg_m2[own] / (clumps.masses_kg * clumps.radii_m**2)[own, None]
        assert of_unit == pytest.approx(np.tile(shape.moments, (own.sum(), 1)))


def test_every_grain_is_made_of_the_spheres_of_its_shape(no_kernels):
    simulation = dropped()
    grains, clumps = simulation.grains, simulation.clumps
    for members, kind, radius in zip(clumps.members, kinds_of(simulation), clumps.radii_m, strict=True):
        spheres = radius * np.array(MIX.shapes[kind].spheres)
        assert grains.radii_m[members] == pytest.approx(spheres[:, 3])
        assert distances(grains.positions_m[members]) == pytest.approx(distances(spheres[:, :3]), abs=1e-9)


def test_the_same_seed_drops_the_same_grains_and_another_seed_others(no_kernels):
    one, same, other = dropped().grains, dropped().grains, dropped(seed=2).grains
    for name in vars(one):
        assert np.array_equal(getattr(one, name), getattr(same, name)), name
    assert not np.array_equal(one.kinds[: len(other)], other.kinds[: len(one)])


def test_positions_and_radii_do_not_depend_on_the_shares(no_kernels):
    one, other = dropped(), dropped(shape=replace(MIX, shares=(1.0, 1.0, 1.0, 1.0)))
    assert np.array_equal(one.clumps.positions_m, other.clumps.positions_m)
    assert np.array_equal(one.clumps.radii_m, other.clumps.radii_m)
    assert np.bincount(kinds_of(other)).tolist() == [50, 50, 50, 50]


# --- spheres of a mix -------------------------------------------------------------------------------------------------


def bounced(clump):
    """One sphere thrown aslant on a plate with a spin, as a clump or not: positions, velocity and spin."""
    floor = Box(name="floor", material="soil", low_m=(-1.0, -1.0, 0.0), high_m=(1.0, 1.0, 0.0))
    simulation = empty(walls=[floor])
    motion = {"velocities_m_s": (0.2, 0.1, -0.5), "angular_velocities_rad_s": (30.0, -20.0, 50.0)}
    if clump:
        simulation.add_clumps(SPHERE, [(0.0, 0.0, 1.05e-3)], RADIUS_M, "soil", **motion)
    else:
        simulation.add_grains([(0.0, 0.0, 1.05e-3)], RADIUS_M, "soil", **motion)
    simulation.run(0.05)
    grains = simulation.grains
    return grains.positions_m[0], grains.velocities_m_s[0], grains.angular_velocities_rad_s[0]


def test_a_clump_of_one_sphere_moves_as_a_sphere():
    for as_clump, free in zip(bounced(True), bounced(False), strict=True):
        assert as_clump == pytest.approx(free, rel=1e-4, abs=1e-6)


def test_a_mix_of_spheres_is_spheres_and_of_one_shape_that_shape():
    assert replace(SOIL, shape=Mix((SPHERE, SPHERE), (1.0, 2.0))).shape is None
    assert replace(SOIL, shape=Mix((DIMER,), (3.0,))).shape is DIMER


# --- whole grains -----------------------------------------------------------------------------------------------------


def test_grains_as_wholes_are_the_clumps_also_after_some_are_removed(no_kernels):
    simulation = dropped()
    simulation.remove_grains(np.arange(0, simulation.n_grains, 7))
    clumps, grains = simulation.clumps, simulation.grains
    assert 0 < len(clumps) < 200
    wholes = SOIL.wholes(grains)
    assert np.allclose(wholes.positions_m, clumps.positions_m, atol=1e-6 * RADIUS_M, rtol=0.0)
    assert np.allclose(wholes.radii_m, clumps.radii_m)
    assert np.array_equal(wholes.kinds, kinds_of(simulation))
    owners = SOIL.owners(grains)
    assert [np.flatnonzero(owners == k).tolist() for k in range(len(clumps))] == [own.tolist() for own in clumps.members]
    nothing = type(grains)(**{name: values[:0] for name, values in vars(grains).items()})
    assert len(SOIL.wholes(nothing)) == 0


def test_glued_grains_of_a_mix_are_still_wholes(no_kernels):
    simulation = specimen.filled(SOIL, BED, ENGINE, 1, [])
    before = SOIL.wholes(simulation.grains)
    simulation.glue([0, 5], "floor")
    assert len(simulation.clumps) < len(before)
    assert np.array_equal(SOIL.wholes(simulation.grains).positions_m, before.positions_m)


def test_means_of_a_mix_are_those_of_its_grains():
    counts, radii = [], []
    for share, shape in zip((0.4, 0.3, 0.2, 0.1), MIX.shapes, strict=True):
        counts.append(share * shape.n_spheres)
        radii += [(share, r) for *_, r in shape.spheres]
    assert SOIL.n_spheres == pytest.approx(sum(counts))
    assert SOIL.contact_radius_m == pytest.approx(RADIUS_M * sum(share * r for share, r in radii) / sum(counts))
    assert SOIL.smallest_sphere_m == pytest.approx(SOIL.sizes.smallest_m * PEAR.smallest_ratio)
    assert SOIL.bounding_ratio == max(shape.bounding_ratio for shape in MIX.shapes)
    assert replace(SOIL, shape=DIMER).contact_radius_m == DIMER.smallest_ratio * RADIUS_M


# --- tests with a mix -------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def heap():
    return angle_of_repose.run(SOIL, HEAP, ENGINE, 1)


def test_a_heap_of_a_mix_counts_whole_grains(heap):
    wholes = SOIL.wholes(heap.grains)
    assert heap.status == "static"
    assert np.bincount(SOIL.wholes(heap.filled).kinds).tolist() == [120, 90, 60, 30]
    assert len(heap.filled_radii_m) == HEAP.n_particles
    assert 0 < heap.n_lost == HEAP.n_particles - len(wholes)  # some fell off the plate
    assert np.isin(heap.grains.wholes, heap.filled.wholes).all()


def test_an_interrupted_heap_of_a_mix_ends_with_the_same_bytes(heap, tmp_path):
    class Stopped(Exception):
        pass

    def keep(state):
        if state.stage == "lift":
            save_state(state, tmp_path / "state.npz")
            raise Stopped

    with pytest.raises(Stopped):
        angle_of_repose.run(SOIL, HEAP, ENGINE, 1, keep=keep)
    state = load_state(tmp_path / "state.npz")
    again = angle_of_repose.run(SOIL, HEAP, ENGINE, 1, state=state)
    assert again.n_lost == heap.n_lost
    for name in vars(heap.grains):
        assert np.array_equal(getattr(again.grains, name), getattr(heap.grains, name)), name


def test_a_factory_of_a_mix_that_waits_is_part_of_a_checkpoint(no_kernels, tmp_path):
    simulation = empty()
    simulation.add_factory(factory(time_s=1.0))
    save(simulation, tmp_path / "state.npz")
    (waiting,) = load(tmp_path / "state.npz")._state.factories
    assert waiting == factory(time_s=1.0)
    assert np.array_equal(waiting.kinds(), factory().kinds())


def test_a_sheared_bed_of_a_mix_has_the_volume_of_its_grains():
    sheared = plane_shear.run(SOIL, BED, ENGINE, 1)
    n = specimen.n_grains(SOIL, BED)
    assert sheared.n_particles == n
    volume = 4.0 / 3.0 * math.pi * float((SOIL.sizes.draw(n, np.random.default_rng(1)) ** 3).sum())
    assert sheared.history["solid_fraction"] * BED.area_m2 * sheared.history["lid_height_m"] == pytest.approx(volume)
    assert 0.5 < sheared.solid_fraction < 0.72
    assert sheared.velocity_profile[0] > 0.8  # the floor drags the grains that are glued to it


def test_a_drum_pours_the_kinds_of_all_its_grains(no_kernels):
    setup = rotating_drum.Setup(
        diameter_ratio=40.0, thickness_ratio=7.0, fill_ratio=0.4, froude_number=0.05, turns=0.7, scale_radius_m=RADIUS_M
    )
    state = rotating_drum.start(SOIL, setup, ENGINE, 1)
    poured = SOIL.wholes(rotating_drum.soil_of(state))
    assert np.array_equal(poured.kinds, SOIL.kinds(rotating_drum.n_grains(SOIL, setup), 1)[: len(poured)])
    assert set(poured.kinds) == {0, 1, 2, 3}


# --- refusals ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("shapes", "shares", "message"),
    [
        ((), (), r"shapes of a mix is \[\]; allowed: at least one"),
        ((SPHERE, DIMER), (1.0,), "number of shares of a mix is 1; allowed: 2, one for each shape"),
        ((SPHERE, DIMER), (1.0, -0.5), r"shares of a mix is \[1.0, -0.5\]; allowed: positive numbers"),
        ((SPHERE, DIMER), (1.0, 0.0), "shares of a mix is .*; allowed: positive numbers"),
        ((SPHERE, DIMER), (1.0, math.inf), "shares of a mix is .*; allowed: positive numbers"),
    ],
)
def test_mixes_that_are_none_are_refused(shapes, shares, message):
    with pytest.raises(ValueError, match=message):
        Mix(shapes, shares)


def test_spheres_of_too_different_sizes_are_refused():
    dust = Clump("dust", tuple((0.04 * k, 0.0, 0.0, 0.04) for k in range(3)), (1.0, 1.0, 1.0))
    with pytest.raises(ValueError, match="largest over smallest radius of a mix is .*; allowed: at most 20"):
        Mix((SPHERE, dust), (1.0, 1.0))


@pytest.mark.parametrize(
    ("kinds", "message"), [(None, "kinds of a mix is None"), ([0, 4], "kinds is .* from 0 to 3"), ([0], "kinds")]
)
def test_clumps_of_a_mix_need_their_kinds(no_kernels, kinds, message):
    with pytest.raises(ValueError, match=message):
        empty().add_clumps(MIX, [(0.0, 0.0, 0.1), (0.0, 0.0, 0.2)], RADIUS_M, "soil", kinds=kinds)
