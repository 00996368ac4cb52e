"""Clumps in a simulation. What has a closed form (tops, impacts, rest, conservation, order, energy, packing) is in the verification
group "Clumps", which `tests/verification/test_groups.py` runs.
"""

import os
import subprocess
import sys

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import dem
from dem import jit
from dem.checkpoint import arrays_of
from dem.clumps import members as plain
from dem.clumps import motion, records, vectors
from dem.clumps.records import BLOCK
from dem.layout import RADIUS, USE

MATERIAL = dem.Material(density_kg_m3=2500.0, poisson_ratio=0.2, shear_modulus_pa=1e7)
FLOOR = dem.Box(name="floor", material="soil", low_m=(-1.0, -1.0, 0.0), high_m=(1.0, 1.0, 0.0))
RADIUS_M = 1e-3
MOMENTA = slice(records.MOMENTUM, records.MOMENTUM + 3)
DIMER, TETRA, TRIMER = (dem.Clump.preset(name) for name in ("dimer", "tetra", "trimer"))


def size_of(shape):
    """Equivalent radius with members of RADIUS_M."""
    return RADIUS_M / shape.smallest_ratio


def scene(walls=(FLOOR,), restitution=0.5, static_friction=0.4, rolling_friction=0.1, **settings):
    touch = dem.Interaction(restitution=restitution, static_friction=static_friction, rolling_friction=rolling_friction)
    return dem.Simulation(
        materials={"soil": MATERIAL}, interactions={("soil", "soil"): touch}, walls=walls, smallest_radius_m=RADIUS_M, **settings
    )


def poured(n=60, shape=TETRA, radius_m=8e-3, **settings):
    """Clumps, and a few spheres, that fall into a tube; a factory makes more of them later."""
    tube = dem.Tube(name="tube", material="soil", radius_m=radius_m, bottom_m=0.0, top_m=1.0)
    simulation = scene(walls=(FLOOR, tube), **settings)
    region, sizes = dem.TubeRegion(radius_m=radius_m, bottom_m=0.0), dem.Sizes(mean_m=1.1 * size_of(shape), sd_ratio=0.04)
    simulation.add_factory(dem.Factory(n_grains=n, region=region, sizes=sizes, material="soil", seed=1, shape=shape))
    top = float(simulation.grains.positions_m[:, 2].max()) + 3.0 * RADIUS_M
    simulation.add_grains([(0.0, 0.0, top), (0.0, 3e-3, top)], RADIUS_M, "soil")
    above = dem.TubeRegion(radius_m=4e-3, bottom_m=top + 0.05)
    late = dem.Factory(
        n_grains=5, region=above, sizes=dem.Sizes(mean_m=size_of(DIMER)), material="soil", seed=2, shape=DIMER, time_s=0.01
    )
    simulation.add_factory(late)
    return simulation


def rigid(simulation):
    """Largest distance in m of any member from where its clump's centre and orientation put it; members in the shape's order."""
    clumps, grains, worst = simulation.clumps, simulation.grains, 0.0
    turns = Rotation.from_quat(clumps.orientations, scalar_first=True)
    for k, members in enumerate(clumps.members):
        shape = {4: TETRA, 2: DIMER, 1: dem.Clump.preset("sphere")}[len(members)]
        arms = clumps.radii_m[k] * np.array(shape.spheres)[:, :3]
        found = clumps.positions_m[k] + turns[k].apply(arms)
        worst = max(worst, np.abs(grains.positions_m[members] - found).max())
        relative = np.cross(clumps.angular_velocities_rad_s[k], turns[k].apply(arms))
        assert grains.velocities_m_s[members] == pytest.approx(clumps.velocities_m_s[k] + relative, abs=1e-6)
        assert grains.angular_velocities_rad_s[members] == pytest.approx(
            np.tile(clumps.angular_velocities_rad_s[k], (len(members), 1)), rel=1e-5, abs=1e-3
        )
    return worst


def test_members_stay_where_their_clump_puts_them_and_other_grains_move_by_themselves():
    simulation = poured()
    assert simulation.n_grains == 4 * 60 + 2
    assert rigid(simulation) < 1e-15
    simulation.run(0.05)
    assert len(simulation.clumps) == 65
    assert simulation.n_grains == 4 * 60 + 2 + 2 * 5
    assert rigid(simulation) < 1e-14
    assert np.abs(np.linalg.norm(simulation.clumps.orientations, axis=1) - 1.0).max() < 1e-15
    assert simulation.grains.positions_m[:, 2].min() > 0.9 * RADIUS_M
    assert simulation.kinetic_energy_j > 0.0


def test_members_of_a_clump_are_no_pair_and_all_other_neighbours_are():
    simulation = poured()
    simulation.run(0.1)
    state = simulation._state
    outer, owner = state.lists.pairs.outer, state.clumps.owner
    listed = {frozenset((i, outer.partner[k])) for i in range(state.n_grains) for k in range(*outer.row[i])}
    places, touching = state.places, set()
    for i in range(state.n_grains):
        for j in range(i):
            near = np.linalg.norm(places[i, :3] - places[j, :3]) < places[i, RADIUS] + places[j, RADIUS]
            if near and (owner[i] < 0 or owner[i] != owner[j]):
                touching.add(frozenset((i, j)))
    assert len(touching) > 50
    assert touching <= listed
    assert not [pair for pair in listed if len({owner[i] for i in pair} - {-1}) == 1 and -1 not in {owner[i] for i in pair}]
    assert simulation.largest_overlap_ratio() < 0.02


def test_turning_keeps_quaternion_and_angular_momentum_and_agrees_with_a_fine_twin():
    rng = np.random.default_rng(4)
    n, dt, steps = 300, 1e-2, 1600
    quaternions = records.random_orientations(n, rng)
    table = np.zeros((n, records.ROWS))
    table[:, 3:7], table[:, records.INV_MASS] = quaternions, 1.0
    table[:, MOMENTA] = rng.normal(size=(n, 3))
    table[:, records.INV_MOMENTS : records.INV_MOMENTS + 3] = rng.uniform(0.3, 1.0, (n, 3))
    table[:, records.ROTATION : records.ROTATION + 9] = records.rotation_of(quaternions).reshape(n, 9)
    none = np.zeros(0, np.int64)

    def turned(dt, steps):
        clumps = records.clumps_of(table, np.zeros(n, np.int64), none, np.zeros((0, 4)), 0)
        for _ in range(steps):
            for block in range(len(clumps.blocks)):
                in_block = min(BLOCK, n - BLOCK * block)
                motion.turn_block(in_block, clumps.blocks[block], dt)
                motion.rotate_block(in_block, clumps.blocks[block])
        return records.table_of(clumps)

    after = turned(dt, steps)
    assert np.abs(np.linalg.norm(after[:, 3:7], axis=1) - 1.0).max() < 1e-15
    assert (after[:, MOMENTA] == table[:, MOMENTA]).all()
    energy = [(values[:, MOMENTA] * records.angular_velocities(values)).sum(axis=1) for values in (table, after)]
    assert energy[1] == pytest.approx(energy[0], rel=1e-4)
    once, twin = turned(0.05, 1)[:, 3:7], twins(table, 0.05)
    assert once == pytest.approx(twin, abs=2e-4)
    assert np.abs(once - quaternions).max() > 0.02


def twins(table, duration, n=400):
    """Quaternions of free bodies after a time, by many small rotations about the mean axis of a step."""
    quaternions, dt = table[:, 3:7].copy(), duration / n
    inverse, momentum = table[:, records.INV_MOMENTS : records.INV_MOMENTS + 3], table[:, MOMENTA]

    def spin(turn):
        return turn.apply(inverse * turn.inv().apply(momentum))

    turn = Rotation.from_quat(quaternions, scalar_first=True)
    for _ in range(n):
        half = Rotation.from_rotvec(0.5 * dt * spin(turn)) * turn
        turn = Rotation.from_rotvec(dt * spin(half)) * turn
    found = turn.as_quat(scalar_first=True)
    return found * np.sign((found * quaternions).sum(axis=1))[:, None]


@pytest.mark.skipif(jit.DISABLED, reason="vector code is compiled only")
def test_vector_code_sums_and_places_as_plain_code_does():
    simulation = poured(n=82, shape=dem.Mix((TETRA, DIMER, TRIMER), (1.0, 1.0, 1.0)))
    grains, clumps = simulation._state.grains, simulation._state.clumps
    rng = np.random.default_rng(5)
    loads = rng.normal(size=simulation._state.loads.shape).astype(np.float32)
    loads.reshape(-1, 8)[:, 3] = 0.0
    three = (len(clumps.blocks), 3 * BLOCK)
    clumps.blocks[:, records.VELOCITY * BLOCK : records.MOMENTUM * BLOCK] = rng.normal(size=three)
    clumps.blocks[:, records.SPIN * BLOCK :] = rng.normal(size=three)
    found = []
    n, use = len(clumps.begin) - 1, rng.uniform(0.1, 1.0, len(clumps.owner)).astype(np.float32)
    assert n % records.FOUR
    assert len(set(np.diff(clumps.begin))) == 3
    for module, which in ((plain, (0, n)), (vectors, ())):
        left, members = loads.copy(), clumps.owner >= 0
        module.sum_members(grains, left, clumps, *which)
        assert not left.reshape(-1, 8)[members].any()
        assert (left.reshape(-1, 8)[~members] == loads.reshape(-1, 8)[~members]).all()
        grains.place.reshape(-1, 4)[members, :3] = 0.0
        grains.motion.reshape(-1, 8)[members] = 0.0
        grains.motion.reshape(-1, 8)[:, USE] = use
        used = module.place_members(grains, clumps, *which)
        found.append((records.table_of(clumps), grains.place.copy(), grains.motion.copy(), used))
    (sums, places, speeds, used), (other_sums, other_places, other_speeds, other_used) = found
    of_step = slice(records.FORCE, records.BRAKE + 1)
    assert np.abs(sums[:, of_step]).min() > 0.0
    assert other_sums[:, of_step] == pytest.approx(sums[:, of_step], abs=1e-12)
    assert other_places == pytest.approx(places, abs=1e-15)
    assert other_speeds == pytest.approx(speeds, abs=1e-6)
    assert other_used == pytest.approx(used)
    assert used == pytest.approx((np.linalg.norm(speeds.reshape(-1, 8)[:, :3], axis=1) * use).max(), rel=1e-6)


def state(simulation):
    """Bytes of everything that the future depends on."""
    arrays = {name: array.tobytes() for name, array in arrays_of(simulation._state).items()}
    return arrays | {"clock": (simulation.time_s, simulation.n_steps, simulation.n_left)}


def test_a_loaded_simulation_goes_on_bit_for_bit(tmp_path):
    straight, stopped = poured(floor_m=-1e-3), poured(floor_m=-1e-3)
    for n in (800, 900, 1000):
        straight.advance(n)
        stopped.advance(n)
        dem.save(stopped, tmp_path / "state.npz")
        stopped = dem.load(tmp_path / "state.npz")
    assert len(stopped.clumps) == 65
    assert state(stopped) == state(straight)


def test_many_clumps_are_sorted_in_space_and_stay_whole():
    simulation = poured(n=300, radius_m=12e-3)
    before = simulation.clumps
    simulation._runner.sort_in_space()
    order = simulation._state.ids.copy()
    assert (np.diff(order) < 0).any()
    for name in ("positions_m", "orientations", "radii_m"):
        assert (getattr(simulation.clumps, name) == getattr(before, name)).all()
    assert all((a == b).all() for a, b in zip(simulation.clumps.members, before.members, strict=True))
    assert rigid(simulation) < 1e-15
    simulation.advance(2000)
    assert rigid(simulation) < 1e-14


def test_clumps_leave_as_a_whole_when_their_centre_is_below_the_floor():
    simulation = scene(walls=(), floor_m=-0.01, energy_ledger=False)
    upright = (np.sqrt(0.5), 0.0, np.sqrt(0.5), 0.0)
    simulation.add_clumps(
        DIMER, [(0, 0, 0), (0.1, 0, 0)], size_of(DIMER), "soil", orientations=upright, velocities_m_s=[(0, 0, -1), (0, 0, 1)]
    )
    simulation.add_grains([(0.2, 0, 0)], RADIUS_M, "soil", (0, 0, 1))
    lowest = np.inf
    while simulation.n_left == 0:
        lowest = simulation.grains.positions_m[:, 2].min()
        simulation.advance(10)
    assert lowest < -0.01 - 0.3 * RADIUS_M  # its lower sphere was below before
    assert simulation.n_left == 2
    assert simulation.n_grains == 3
    assert [list(members) for members in simulation.clumps.members] == [[0, 1]]
    assert simulation.clumps.positions_m[0, 0] == 0.1


def test_a_clump_is_glued_as_a_whole_and_its_load_acts_on_the_wall():
    simulation = scene()
    simulation.add_clumps(DIMER, [(0, 0, RADIUS_M), (0.1, 0, RADIUS_M)], size_of(DIMER), "soil")
    simulation.add_clumps(DIMER, [(0, 0, 3 * RADIUS_M)], size_of(DIMER), "soil")
    simulation.glue([1], "floor")
    assert len(simulation.clumps) == 2
    simulation.run(0.5)
    force = simulation.mean_wall_forces_n["floor"][2]
    assert force == pytest.approx(-9.81 * simulation.clumps.masses_kg.sum(), rel=1e-4)
    simulation.move_wall("floor", (0.0, 0.01, 0.0))
    simulation.advance(1)
    assert simulation.grains.velocities_m_s[:2, 1] == pytest.approx([0.01, 0.01])
    assert simulation.grains.velocities_m_s[2:, 1] == pytest.approx(np.zeros(4), abs=1e-4)


def test_removing_a_member_removes_its_clump():
    simulation = scene(gravity_m_s2=(0.0, 0.0, 0.0))
    simulation.add_clumps(TETRA, [(0.0, 0.0, 5e-3), (0.0, 0.0, 15e-3)], size_of(TETRA), "soil")
    simulation.add_grains([(0.0, 0.0, 25e-3)], RADIUS_M, "soil")
    kept = simulation.clumps.positions_m[1]
    simulation.remove_grains([2])
    assert (simulation.n_grains, len(simulation.clumps.radii_m)) == (5, 1)
    assert (simulation.clumps.positions_m[0] == kept).all()


def test_is_static_counts_clumps():
    simulation = scene()
    simulation.add_clumps(DIMER, [(0, 0, RADIUS_M)], size_of(DIMER), "soil", velocities_m_s=(0.1, 0, 0))
    assert not simulation.is_static()
    simulation.run(1.0, until=dem.Simulation.is_static)
    assert simulation.time_s < 1.0


def test_factories_turn_clumps_at_random_and_keep_them_apart():
    simulation = scene()
    region = dem.BoxRegion(low_m=(-0.02, -0.02), high_m=(0.02, 0.02), bottom_m=0.0)
    factory = dem.Factory(n_grains=800, region=region, sizes=dem.Sizes(mean_m=size_of(DIMER)), material="soil", seed=3, shape=DIMER)
    simulation.add_factory(factory)
    clumps, grains = simulation.clumps, simulation.grains
    assert len(clumps) == 800
    assert clumps.masses_kg.sum() == pytest.approx(800 * 2500.0 * 2.25 * np.pi * 1e-9)
    axes = Rotation.from_quat(clumps.orientations, scalar_first=True).apply([1.0, 0.0, 0.0])
    assert axes.T @ axes / 800 == pytest.approx(np.eye(3) / 3, abs=0.05)
    apart = np.linalg.norm(grains.positions_m[:, None] - grains.positions_m[None], axis=2)
    apart[np.arange(1600) // 2 == (np.arange(1600) // 2)[:, None]] = np.inf
    assert apart.min() > 2 * RADIUS_M
    assert grains.positions_m[:, 2].min() > RADIUS_M
    again = scene()
    again.add_factory(factory)
    assert (again.grains.positions_m == grains.positions_m).all()


def test_a_seed_draws_orientations_and_any_length_of_a_quaternion_will_do():
    simulation = scene()
    simulation.add_clumps(DIMER, [(0, 0, 0.01)], size_of(DIMER), "soil", orientations=(2.0, 0.0, 2.0, 0.0))
    simulation.add_clumps(DIMER, [(0, 0, 0.02), (0, 0, 0.03)], size_of(DIMER), "soil", seed=1)
    found = simulation.clumps.orientations
    assert found[0] == pytest.approx([np.sqrt(0.5), 0.0, np.sqrt(0.5), 0.0])
    assert np.abs(found[1] - found[2]).max() > 0.1
    assert simulation.grains.positions_m[:2, 2] == pytest.approx([0.01 + 0.5e-3, 0.01 - 0.5e-3])


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"equivalent_radii_m": 0.8e-3}, "smallest radius of grains is .*; allowed: at least smallest_radius_m"),
        ({"equivalent_radii_m": 0.0}, "equivalent_radii_m is .*; allowed: positive"),
        ({"positions_m": [(0, 0, np.nan)]}, "positions_m is not finite"),
        ({"positions_m": [(0, 0, 0.5e-3)]}, "in wall 'floor'"),
        ({"positions_m": [(0, 0, 5e-3), (0, 0.5e-3, 5e-3)]}, "overlap of grains 0 and 2"),
        ({"material": "clay"}, "material of clumps is 'clay'"),
        ({"orientations": (0.0, 0.0, 0.0, 0.0)}, "orientations is zero or not finite"),
        ({"orientations": (1.0, 0.0, 0.0)}, r"shape of orientations is \(3,\)"),
        ({"orientations": (1.0, 0.0, 0.0, 0.0), "seed": 1}, "seed beside orientations is 1"),
    ],
)
def test_bad_clumps_are_refused_in_one_line_and_nothing_changes(change, message):
    simulation = scene()
    values = {"clump": DIMER, "positions_m": [(0, 0, 5e-3)], "equivalent_radii_m": size_of(DIMER), "material": "soil"} | change
    with pytest.raises(ValueError, match=message) as caught:
        simulation.add_clumps(**values)
    assert "\n" not in str(caught.value)
    assert simulation.n_grains == 0
    assert len(simulation.clumps) == 0


def test_a_clump_that_could_touch_its_own_image_is_refused():
    simulation = scene(walls=(), period_m=(0.0, 5e-3, 0.0))
    row = dem.Clump.of_spheres([(1.5 * k, 0, 0, 1) for k in range(4)])
    simulation.add_clumps(row, [(0, 0, 0)], size_of(row), "soil")
    with pytest.raises(ValueError, match="period_m along y is 0.005; allowed: 0 or more than .*its own image"):
        simulation.advance(1)


TWINS = """
import dem
touch = dem.Interaction(restitution=0.5, static_friction=0.4, rolling_friction=0.1)
for shape in (None, dem.Clump.preset("sphere")):
    simulation = dem.Simulation(
        materials={"soil": dem.Material(density_kg_m3=2500.0, poisson_ratio=0.2, shear_modulus_pa=1e6)},
        interactions={("soil", "soil"): touch}, smallest_radius_m=1e-3, period_m=(0.02, 0.0, 0.0), rolling_model="type_c",
        walls=[dem.Box(name="floor", material="soil", low_m=(-1, -1, 0), high_m=(1, 1, 0))], vector_code=False, precision="float64",
    )
    places = [(0.0, 1e-4, 1.0e-3), (0.0, 1.2e-4, 3.0e-3), (0.0186, 1.55e-3, 1.0e-3)]
    velocities = [(0.02, 0, -0.05), (0.02, 0, -0.05), (0.1, 0.0, 0.0)]
    motion = {"velocities_m_s": velocities, "angular_velocities_rad_s": (30.0, 0.0, 10.0)}
    if shape is None:
        simulation.add_grains(places, 1e-3, "soil", **motion)
    else:
        simulation.add_clumps(shape, places, 1e-3, "soil", **motion)
    simulation.advance(400)
    print(*simulation.grains.positions_m.ravel(), *simulation.grains.angular_velocities_rad_s.ravel())
"""


def test_clumps_of_one_sphere_are_spheres_in_a_periodic_domain_with_type_c():
    environment = os.environ | {"NUMBA_DISABLE_JIT": "1"}
    done = subprocess.run([sys.executable, "-c", TWINS], env=environment, capture_output=True, text=True, check=True)
    spheres, clumps = (np.array(line.split(), float) for line in done.stdout.splitlines())
    assert clumps == pytest.approx(spheres, rel=1e-9, abs=1e-12)
    assert np.abs(spheres[9:]).max() > 1.0
