"""A wheel on a small bed, and on one grain: balances, signs, determinism, and what is refused."""

import copy
import dataclasses
import itertools

import numpy as np
import pytest

import dem
from dem import solids
from dem.experiments import density, soil_bed, wheel, wheel_setup
from dem.experiments.soil import Engine, Soil
from dem.experiments.soil_bed import SoilBed
from dem.experiments.state import load_state, save_state
from dem.experiments.surface import layer_solid_fraction
from dem.experiments.wheel_setup import WheelShape, WheelTest
from dem.measure.blocks import N_BLOCKS
from dem.measure.rim import TORQUE, integrated, rim_stress, steady_loads
from dem.measure.wheel import rut, steady, steady_samples

SOIL = Soil(
    radius_m=1e-3, density_kg_m3=2500.0, poisson_ratio=0.2, shear_modulus_pa=1e6, static_friction=0.5, rolling_friction=0.1,
    restitution=0.3, radius_sd_ratio=0.05,
)  # fmt: skip
ENGINE = Engine(time_step_rayleigh_ratio=0.4)
SETUP = soil_bed.Setup(length_m=0.047, width_m=0.020, depth_m=0.015)
COLUMN = soil_bed.Setup(length_m=0.032, width_m=0.032, depth_m=0.015)
SHAPE = WheelShape(radius_m=0.010, width_m=0.008)
TEST = WheelTest(load_n=0.1, slip=0.5, speed_m_s=0.05, travel_ratio=1.2)


@pytest.fixture(scope="module")
def bed():
    return soil_bed.prepare(SOIL, SETUP, ENGINE, 1)


@pytest.fixture(scope="module")
def driven(bed):
    """A run, and its states in the middle of both stages."""
    states = {}

    def keep(state):
        if state.stage not in states or (state.stage == "travel" and len(state.notes["samples"]) % 100 == 0):
            states[state.stage] = copy.deepcopy(state)

    return wheel.drive(bed, SOIL, SHAPE, TEST, keep=keep), states


def test_the_momentum_of_grains_and_wheel_is_what_acted_on_them(driven):
    run, _ = driven
    assert run.status == "done"
    assert run.momentum_residual_ratio < 1e-5


def test_the_motor_gives_more_power_than_the_drawbar_takes(driven, bed):
    run, _ = driven
    found = steady(run.history, SHAPE.radius_m)
    assert found.power_balance_w > 5.0 * found.power_balance_error_w > 0.0
    begin, end = (
        (SOIL.density_kg_m3 * 4.0 / 3.0 * np.pi * grains.radii_m**3) @ grains.positions_m[:, 2]
        for grains in (bed.simulation.grains, run.moments["end"])
    )
    given = sum(run.work_j.values()) - 9.81 * (end - begin)  # a bed that packs gives, one that heaves takes
    assert 0.0 < run.dissipated_j < given
    assert run.dissipated_j == pytest.approx(given, rel=0.05)  # the rest moves
    assert run.work_j["motor"] > run.work_j["load"] > 0.0


def load_beside_momentum_n(history):
    """Mean force on the wheel that its load and its change of speed over the steady samples ask for."""
    (samples,) = np.nonzero(steady_samples(history["time_s"]))
    begin, end = samples[len(samples) % N_BLOCKS] - 1, samples[-1]  # as the mean of whole blocks
    speed = history["vertical_speed_m_s"]
    speeds = [speed[[k, min(k + 1, len(speed) - 1)]].mean() for k in (begin, end)]  # at a sample's end, of means between samples
    mass = TEST.load_n / 9.81
    return TEST.load_n + mass * (speeds[1] - speeds[0]) / (history["time_s"][end] - history["time_s"][begin])


def test_the_soil_carries_the_load_and_the_wheel_travels_as_held(driven):
    run, _ = driven
    found, travel = steady(run.history, SHAPE.radius_m), run.history["time_s"] > 0.0
    assert found.load_n == pytest.approx(load_beside_momentum_n(run.history), rel=2e-3)
    assert found.load_n == pytest.approx(TEST.load_n, rel=0.1)  # five grains under it: it bounces
    assert found.slip == pytest.approx(0.5, abs=1e-6)
    assert np.ptp(run.history["x_m"][travel]) == pytest.approx(TEST.travel_ratio * SHAPE.radius_m, rel=0.02)
    assert run.history["rim_rate_rad_s"][travel] == pytest.approx(10.0)
    assert (run.history["rim_rate_rad_s"][~travel] == 0.0).all()
    assert found.torque_n_m > 0.0
    assert 1e-3 < found.sinkage_m < 8e-3
    assert 120 <= found.n_samples <= 160


def test_the_wheel_is_lowered_not_dropped(driven, bed):
    run, _ = driven
    lowering = run.history["time_s"] <= 0.0
    slowest = wheel.lowering_speed_m_s(SHAPE, bed.simulation)
    assert slowest == pytest.approx(0.06 * np.sqrt(10.0 / 58.0), rel=0.02)
    assert (run.history["vertical_speed_m_s"][lowering] > -1.02 * slowest).all()
    assert run.history["vertical_force_n"][lowering][-1] == pytest.approx(TEST.load_n, rel=0.15)


def test_a_rut_stays_behind_and_the_bed_is_as_it_was(driven, bed):
    run, _ = driven
    cells = np.linspace(0.0, SETUP.length_m, len(bed.heights_m), endpoint=False)
    behind = (cells > run.axles["lowered"][0] - 4e-3) & (cells < run.axles["end"][0] - 4e-3)
    change, _ = rut(bed.heights_m, soil_bed.surface(run.moments["end"], SOIL, SETUP), behind)
    assert change[len(change) // 2] < change[0] - 0.5e-3
    assert change[len(change) // 2] < -0.5e-3
    again = soil_bed.surface(bed.simulation.grains, SOIL, SETUP)
    assert np.array_equal(again, bed.heights_m)
    assert list(run.moments) == ["lowered", "middle", "flow_begins", "flow_ends", "end"]
    assert run.axles["lowered"][0] < run.axles["middle"][0] < run.axles["end"][0]


def test_stresses_along_the_rim_add_up_to_force_and_torque_at_the_same_instants(driven):
    """Bins of 5 degrees turn forces by 2.5 at most; only rubbing on the wheel's sides has a shorter arm than the radius."""
    run, _ = driven
    loads, time = steady_loads(run.rim, run.history["time_s"]), run.history["time_s"]
    used = len(loads) // 5 * 5  # whole blocks
    rows = np.flatnonzero(steady_samples(time))[-used:]
    forces = np.array([run.rim["forces_n"][run.rim["sample"] == row].sum(axis=0) for row in rows]).mean(axis=0)
    found = integrated(rim_stress(loads, SHAPE.radius_m, SHAPE.width_m), SHAPE.radius_m, SHAPE.width_m)
    assert found["load_n"] == pytest.approx(forces[2], rel=2e-3)
    assert found["drawbar_pull_n"] == pytest.approx(forces[0], abs=2e-3 * forces[2])
    torque = loads[-used:, :, TORQUE].sum(axis=1).mean()
    assert torque <= found["torque_n_m"] < 1.05 * torque
    means = steady(run.history, SHAPE.radius_m)
    assert found["load_n"] == pytest.approx(means.load_n, abs=4.0 * means.load_error_n)
    assert found["drawbar_pull_n"] == pytest.approx(means.drawbar_pull_n, abs=4.0 * means.drawbar_pull_error_n)
    assert torque == pytest.approx(means.torque_n_m, abs=4.0 * means.torque_error_n_m)


def test_the_wheel_is_pressed_in_front_of_its_lowest_point(driven):
    run, _ = driven
    found = rim_stress(steady_loads(run.rim, run.history["time_s"]), SHAPE.radius_m, SHAPE.width_m)
    normal, theta = found.normal_stress_pa, found.theta_deg
    assert 0.0 < (normal * theta).sum() / normal.sum() < 45.0
    pressed = normal > 0.1 * normal.max()  # elsewhere what touches the edges counts, whose normals are not radial
    assert (np.abs(found.shear_stress_pa[pressed]) <= 1.05 * TEST.wheel_static_friction * normal[pressed]).all()
    arms, forces = run.rim["arms_m"], run.rim["forces_n"]
    tread = np.abs(arms[:, 1]) < 0.5 * SHAPE.width_m - 1e-6
    radial = -(forces[:, [0, 2]] * arms[:, [0, 2]]).sum(axis=1) / np.hypot(arms[:, 0], arms[:, 2])
    rubbing = np.sqrt(np.maximum((forces**2).sum(axis=1) - radial**2, 0.0))
    widest = np.tan(np.arctan(TEST.wheel_static_friction) + np.radians(3.0))  # facets are less than 6 degrees wide
    assert np.count_nonzero(tread) > 1000
    assert (rubbing[tread] <= widest * np.abs(radial[tread])).all()  # a dashpot pulls a little as grains leave
    assert normal[np.abs(theta) > 100.0] == pytest.approx(0.0)


def test_a_world_sixteen_times_as_large_gives_the_same_bytes_times_powers_of_two(driven):
    """Lengths 16, times 4, shear modulus 16, gravity and density as they are: a constant with a unit would show."""
    large = dataclasses.replace(SOIL, radius_m=16.0 * SOIL.radius_m, shear_modulus_pa=16.0 * SOIL.shear_modulus_pa)
    setup = soil_bed.Setup(length_m=16.0 * SETUP.length_m, width_m=16.0 * SETUP.width_m, depth_m=16.0 * SETUP.depth_m)
    shape = WheelShape(radius_m=16.0 * SHAPE.radius_m, width_m=16.0 * SHAPE.width_m)
    test = dataclasses.replace(TEST, load_n=16.0**3 * TEST.load_n, speed_m_s=4.0 * TEST.speed_m_s)
    run, again = driven[0], wheel.drive(soil_bed.prepare(large, setup, ENGINE, 1), large, shape, test)
    factors = {"_s": 4.0, "_m": 16.0, "_n": 16.0**3, "_n_m": 16.0**4, "_rad_s": 0.25, "_m_s": 4.0, "_j": 16.0**4, "_ratio": 1.0}
    for name, values in run.history.items():
        unit = max((unit for unit in factors if name.endswith(unit)), key=len)
        assert np.array_equal(again.history[name], factors[unit] * values), name
    assert np.array_equal(again.moments["end"].positions_m, 16.0 * run.moments["end"].positions_m)


def numbers(run):
    noted = [*run.history.values(), *run.rim.values(), *(grains.positions_m for grains in run.moments.values())]
    return np.concatenate([np.ravel(values) for values in noted])


def through_a_file(state, path):
    """A state as another process finds it."""
    save_state(state, path)
    return load_state(path)


def test_runs_of_all_slips_go_on_from_the_same_lowered_wheel(driven, bed, tmp_path):
    """The bytes are those of a wheel that is lowered anew; another slip and what else acts on the travel alone play no part."""
    first = dataclasses.replace(TEST, slip=-0.2, held="rim", speed_m_s=0.2)
    lowered = wheel.lower(bed, SOIL, SHAPE, first)
    assert lowered.stage == "lowered"
    again = wheel.drive(bed, SOIL, SHAPE, TEST, state=through_a_file(lowered, tmp_path / "lowered.npz"))
    assert np.array_equal(numbers(again), numbers(driven[0]))
    assert (again.n_steps, again.work_j, again.momentum_residual_ratio) == (
        driven[0].n_steps,
        driven[0].work_j,
        driven[0].momentum_residual_ratio,
    )


def test_a_wheel_that_the_soil_does_not_carry_in_time_does_not_travel(bed, monkeypatch):
    monkeypatch.setattr(wheel, "LOWERING_RADII", 0.05)
    run = wheel.drive(bed, SOIL, SHAPE, TEST)
    assert run.status == "not_lowered"
    assert list(run.moments) == ["end"]
    assert (run.history["time_s"] <= 0.0).all()
    assert (run.history["speed_m_s"] == 0.0).all()


def test_a_file_without_a_state_is_no_test_in_progress(bed, tmp_path):
    soil_bed.save_bed(bed, tmp_path / "bed.npz")
    with pytest.raises(dem.CheckpointError, match=r"bed\.npz holds no test in progress; delete it to begin anew"):
        load_state(tmp_path / "bed.npz")


@pytest.mark.parametrize("stage", ["lower", "travel"])
def test_a_run_that_was_interrupted_ends_with_the_same_bytes(driven, bed, stage, tmp_path):
    run, states = driven
    again = wheel.drive(bed, SOIL, SHAPE, TEST, state=through_a_file(states[stage], tmp_path / "half.npz"))
    assert np.array_equal(numbers(again), numbers(run))
    assert (again.n_steps, again.dissipated_j, again.momentum_residual_ratio) == (
        run.n_steps,
        run.dissipated_j,
        run.momentum_residual_ratio,
    )


def test_a_stored_bed_and_two_threads_give_the_same_bytes(driven, bed, tmp_path):
    soil_bed.save_bed(bed, tmp_path / "bed.npz")
    stored = soil_bed.load_bed(tmp_path / "bed.npz")
    assert stored.setup == bed.setup
    assert stored.level_m == bed.level_m
    assert wheel.start(stored, SOIL, SHAPE, TEST, threads=2).simulation._runner.threads == 2
    again = wheel.drive(stored, SOIL, SHAPE, TEST, threads=2)
    assert np.array_equal(numbers(again), numbers(driven[0]))


@pytest.mark.parametrize("stage", ["settle", "rest"])
def test_a_preparation_that_was_interrupted_gives_the_same_bed(bed, stage, tmp_path):
    class Stop(Exception):
        pass

    def keep(state):
        if state.stage == stage:
            states.append(through_a_file(state, tmp_path / "half.npz"))
            raise Stop

    states = []
    with pytest.raises(Stop):
        soil_bed.prepare(SOIL, SETUP, ENGINE, 1, keep=keep)
    again = soil_bed.prepare(SOIL, SETUP, ENGINE, 1, state=states[0])
    assert np.array_equal(again.simulation.grains.positions_m, bed.simulation.grains.positions_m)
    assert np.array_equal(again.glued, bed.glued)
    assert (again.solid_fraction, again.max_overlap_ratio) == (bed.solid_fraction, bed.max_overlap_ratio)


def test_a_file_that_holds_no_bed_is_refused(bed, tmp_path):
    dem.save(bed.simulation, tmp_path / "other.npz")
    with pytest.raises(ValueError, match=r"content of .*other.npz is .*; allowed: a bed"):
        soil_bed.load_bed(tmp_path / "other.npz")


def unevenness(seed):
    """Standard deviation of the solid fraction of slices, 1.2 diameters thick, of a bed 15 diameters deep."""
    setup = soil_bed.Setup(length_m=0.024, width_m=0.024, depth_m=0.030)
    bed = soil_bed.prepare(SOIL, setup, ENGINE, seed)
    grains, slices = bed.simulation.grains, itertools.pairwise(np.linspace(0.2, 0.8, 9) * bed.level_m)
    return np.std([layer_solid_fraction(grains.positions_m, grains.radii_m, setup.area_m2, low, high) for low, high in slices])


def test_the_layers_in_which_grains_are_made_do_not_stay(monkeypatch):
    stirred = np.mean([unevenness(seed) for seed in (1, 2)])
    monkeypatch.setattr(soil_bed, "STIRRED_RATIO", 0.0)
    assert stirred < 0.6 * np.mean([unevenness(seed) for seed in (1, 2)])


def test_less_friction_while_it_settles_makes_the_bed_denser():
    rough, tamped = (
        soil_bed.prepare(SOIL, dataclasses.replace(COLUMN, preparation_friction_ratio=ratio), ENGINE, 1) for ratio in (1.0, 0.1)
    )
    assert rough.status == tamped.status == "done"
    assert 0.5 < rough.solid_fraction < tamped.solid_fraction - 0.02 < 0.64
    assert rough.bulk_density_kg_m3 == pytest.approx(2500.0 * rough.solid_fraction)
    mean = 4.0 / 3.0 * np.pi * (rough.simulation.grains.radii_m**3).sum() / (COLUMN.area_m2 * rough.level_m)
    assert mean == pytest.approx(rough.solid_fraction, rel=0.1)  # looser along floor and surface
    assert mean < rough.solid_fraction


def test_the_preparation_of_a_wanted_density_is_found_or_refused():
    ratio, found = density.preparation_for(SOIL, SETUP, ENGINE, 1, 0.6, tolerance=0.01)
    assert 0.0 < ratio < 1.0
    assert found == pytest.approx(0.6, abs=0.01)
    tamped = soil_bed.prepare(SOIL, dataclasses.replace(COLUMN, preparation_friction_ratio=ratio), ENGINE, 2)
    assert tamped.solid_fraction == pytest.approx(0.6, abs=0.02)
    with pytest.raises(ValueError, match=r"solid_fraction of the bed is 0.7; allowed: 0.5\d+ to 0.6\d+, as these grains pack"):
        density.preparation_for(SOIL, SETUP, ENGINE, 1, 0.7)


def on_one_grain(x_m):
    """A bed of a single grain in a pit that holds it, under the middle of a wheel's rim."""
    touch = dem.Interaction(restitution=0.3, static_friction=5.0, rolling_friction=0.1)
    material = dem.Material(density_kg_m3=2500.0, poisson_ratio=0.2, shear_modulus_pa=2e7)
    r, inf = SOIL.radius_m, np.inf
    corners = {"left": ((-inf, -inf, 0.0), (x_m - r, inf, r)), "right": ((x_m + r, -inf, 0.0), (inf, inf, r))}
    corners["floor"] = ((-inf, -inf, 0.0), (inf, inf, 0.0))
    walls = [dem.Box(name=name, material="plate", low_m=low, high_m=high) for name, (low, high) in corners.items()]
    simulation = dem.Simulation(
        materials={"soil": material, "frame": material, "plate": material}, walls=walls, smallest_radius_m=r,
        interactions={("soil", "plate"): touch, ("soil", "soil"): touch}, period_m=(SETUP.length_m, SETUP.width_m, 0.0),
    )  # fmt: skip
    simulation.add_grains((x_m, 0.5 * SETUP.width_m, r), r, "soil")
    return SoilBed(SETUP, simulation, "done", 2.0 * r, np.array([[2.0 * r]]), 0.5, 1250.0, np.zeros(0, int), 1, 0.0)


@pytest.mark.parametrize(
    ("held", "slip", "travel_ratio", "sign"), [("rim", 0.999, 1e-4, 1.0), ("travel", -1.0, 1e-2, -1.0)], ids=["spins", "locked"]
)
def test_a_wheel_that_slips_on_one_grain_has_friction_times_load(monkeypatch, held, slip, travel_ratio, sign):
    """F = mu W, T = mu W R; the grain is under the axle in the middle of the steady stretch. The rim is a fine polygon."""
    monkeypatch.setattr(wheel, "FLOOR_DIAMETERS", 0.0)
    round_wheel = WheelShape.of_mesh(solids.wheel(SHAPE.radius_m, SHAPE.width_m, sides=720))
    test = WheelTest(load_n=0.05, slip=slip, held=held, speed_m_s=0.02, travel_ratio=travel_ratio, wheel_static_friction=0.3)
    travel = travel_ratio * SHAPE.radius_m
    bed = on_one_grain(0.5 * (SETUP.length_m - travel) + 0.8 * travel)
    found = steady(wheel.drive(bed, SOIL, round_wheel, test).history, SHAPE.radius_m)
    assert found.drawbar_ratio == pytest.approx(sign * 0.3, rel=1e-2)
    assert found.traction_coefficient == pytest.approx(sign * 0.3, rel=1e-2)
    assert found.load_n == pytest.approx(test.load_n, rel=0.1)  # the wheel swings on the grain's spring


def test_contacts_along_the_rim_are_seen_from_the_axle_also_a_period_away(monkeypatch):
    monkeypatch.setattr(wheel, "FLOOR_DIAMETERS", 0.0)
    test = WheelTest(load_n=0.05, slip=0.5, held="rim", speed_m_s=0.02, travel_ratio=1e-3)
    run = wheel.drive(on_one_grain(1.5 * SETUP.length_m), SOIL, SHAPE, test)
    assert len(run.rim["sample"]) > 10
    assert run.rim["arms_m"] == pytest.approx(np.tile([0.0, 0.0, -SHAPE.radius_m], (len(run.rim["sample"]), 1)), abs=3e-4)


def test_a_wheel_above_the_bed_feels_nothing(bed):
    simulation = wheel.start(bed, SOIL, SHAPE, TEST).simulation
    simulation.drive_wall("wheel")
    simulation.turn_wall("wheel", (0.0, 20.0, 0.0))
    simulation.advance(200)
    assert (simulation.mean_wall_forces_n["wheel"] == 0.0).all()
    assert (simulation.mean_wall_torques_n_m["wheel"] == 0.0).all()
    simulation.move_wall("wheel", (0.0, 0.0, -0.1))  # it starts just above the highest grain
    simulation.advance(200)
    assert simulation.mean_wall_forces_n["wheel"][2] > 0.0


def test_another_drive_keeps_velocity_and_springs(driven):
    _, states = driven
    before, after = (copy.deepcopy(states["travel"]).simulation for _ in range(2))
    after.drive_wall("wheel", *after.wall("wheel").drives)
    assert after.wall("wheel").velocity_m_s == before.wall("wheel").velocity_m_s
    for simulation in (before, after):
        simulation.advance(1)
    forces = [simulation.mean_wall_forces_n["wheel"] for simulation in (before, after)]
    assert forces[1] == pytest.approx(forces[0], rel=1e-5)
    assert np.abs(forces[0][[0, 2]]).min() > 1e-3


def test_the_rim_or_the_axle_is_held(bed):
    test = WheelTest(load_n=0.1, slip=-0.2, held="rim", speed_m_s=0.04, travel_ratio=0.5)
    run = wheel.drive(bed, SOIL, SHAPE, test)
    found = steady(run.history, SHAPE.radius_m)
    assert run.history["rim_rate_rad_s"][-1] == pytest.approx(4.0)
    assert run.history["speed_m_s"][-1] == pytest.approx(0.05)
    assert found.slip == pytest.approx(-0.2, abs=1e-6)
    assert found.drawbar_pull_n < -5.0 * found.drawbar_pull_error_n < 0.0
    assert run.momentum_residual_ratio < 1e-5


def test_a_free_wheel_slips_more_the_more_it_pulls(bed):
    slips = []
    for pull in (-0.03, 0.005):
        test = WheelTest(load_n=0.1, held="free", drawbar_load_n=pull, speed_m_s=0.05, travel_ratio=1.2)
        run = wheel.drive(bed, SOIL, SHAPE, test)
        found = steady(run.history, SHAPE.radius_m)
        slips += [found.slip]
        assert found.drawbar_pull_n == pytest.approx(pull, abs=0.005)
        assert run.dissipated_j > 0.0
    assert slips[1] > slips[0] + 0.05


def test_grousers_and_meshes_are_wheels(bed, tmp_path):
    lugged = WheelShape(radius_m=0.010, width_m=0.008, grousers=8, grouser_height_m=1.5e-3, grouser_thickness_m=1e-3)
    assert lugged.outer_radius_m == pytest.approx(np.hypot(11.5e-3, 0.5e-3), rel=1e-4)
    surface = lugged.surface(SOIL.smallest_sphere_m, (0.0, 0.0, 0.0))
    assert np.hypot(*surface.vertices_m[:, [0, 2]].T).max() == pytest.approx(lugged.outer_radius_m)
    along_z = dataclasses.replace(surface, vertices_m=surface.vertices_m[:, [2, 0, 1]])
    dem.write_mesh(along_z, tmp_path / "wheel.stl")
    read = WheelShape.of_mesh(dem.read_mesh(tmp_path / "wheel.stl", "m"), axis="z", radius_m=0.010)
    assert (read.radius_m, read.width_m) == (0.010, pytest.approx(0.008))
    assert read.outer_radius_m == pytest.approx(lugged.outer_radius_m)
    test = dataclasses.replace(TEST, travel_ratio=0.3)
    of_shape, of_mesh = (steady(wheel.drive(bed, SOIL, shape, test).history, 0.010) for shape in (lugged, read))
    assert of_mesh.drawbar_pull_n == pytest.approx(of_shape.drawbar_pull_n, abs=0.02)
    assert of_mesh.sinkage_m == pytest.approx(of_shape.sinkage_m, abs=5e-4)


def test_sandpaper_drives_the_soil_however_slippery_the_wheel_is(bed):
    """A rim of glued grains shears the soil; the bare wheel slides on it. Momentum, torque and rim stresses count glued grains."""
    test = dataclasses.replace(TEST, wheel_static_friction=0.05, travel_ratio=0.8)
    rough = dataclasses.replace(SHAPE, rim="sandpaper")
    runs = [wheel.drive(bed, SOIL, shape, test) for shape in (SHAPE, rough)]
    bare, lined = (steady(run.history, SHAPE.radius_m) for run in runs)
    assert lined.traction_coefficient > 3.0 * bare.traction_coefficient > 0.0
    assert runs[1].momentum_residual_ratio < 1e-5
    assert lined.load_n == pytest.approx(load_beside_momentum_n(runs[1].history), rel=5e-3)
    stress = rim_stress(steady_loads(runs[1].rim, runs[1].history["time_s"]), SHAPE.radius_m, SHAPE.width_m)
    found = integrated(stress, SHAPE.radius_m, SHAPE.width_m)
    assert found["load_n"] == pytest.approx(lined.load_n, abs=4.0 * lined.load_error_n)
    assert found["torque_n_m"] == pytest.approx(lined.torque_n_m, rel=0.15)
    assert len(runs[1].moments["end"]) == bed.n_particles


def test_grains_that_cannot_roll_along_the_rim_give_it_more_traction(bed, driven):
    slides = wheel.drive(bed, SOIL, SHAPE, dataclasses.replace(TEST, wheel_rolling_friction=1.0))
    rolls, traction = (steady(run.history, SHAPE.radius_m) for run in (driven[0], slides))
    assert traction.drawbar_pull_n > rolls.drawbar_pull_n + 2.0 * rolls.drawbar_pull_error_n
    assert traction.torque_n_m > 1.1 * rolls.torque_n_m


def test_the_grains_of_sandpaper_touch_and_end_at_radius_and_width():
    places = dataclasses.replace(SHAPE, rim="sandpaper").lining(1e-3)
    assert np.hypot(places[:, 0], places[:, 2]) == pytest.approx(0.009)
    assert np.abs(places[:, 1]).max() + 1e-3 == pytest.approx(0.004)
    apart = np.linalg.norm(places[:, None] - places, axis=-1) + np.eye(len(places))
    assert 2e-3 * (1.0 - 1e-9) < apart.min() < 2.05e-3
    assert len(places) == 4 * 28


def test_sandpaper_is_refused_with_grousers_meshes_and_clumps():
    allowed = r"rim of the wheel is 'sandpaper'; allowed: 'smooth'"
    with pytest.raises(ValueError, match=f"{allowed} with grousers or a mesh"):
        WheelShape(radius_m=0.01, width_m=0.008, rim="sandpaper", grousers=8, grouser_height_m=1e-3, grouser_thickness_m=1e-3)
    with pytest.raises(ValueError, match=r"rim of the wheel is 'rough'; allowed: one of"):
        WheelShape(radius_m=0.01, width_m=0.008, rim="rough")
    bed = SoilBed(SETUP, None, "done", 0.015, np.zeros((1, 1)), 0.5, 1250.0, np.zeros(0, int), 1, 0.0)
    clumps = dataclasses.replace(SOIL, shape=dem.Clump.preset("dimer"))
    with pytest.raises(ValueError, match=f"{allowed} in a soil of clumps"):
        wheel_setup.check(bed, clumps, dataclasses.replace(SHAPE, rim="sandpaper"), TEST)


def test_a_wheel_that_is_too_heavy_for_the_bed_stops_above_the_floor(bed):
    run = wheel.drive(bed, SOIL, SHAPE, dataclasses.replace(TEST, load_n=0.5, slip=0.9))
    assert run.status == "bottomed"
    assert run.axles["end"][2] - SHAPE.radius_m == pytest.approx(wheel.FLOOR_DIAMETERS * 2e-3, abs=0.5e-3)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"slip": 1.0}, r"slip of the wheel is 1.0; allowed: from -1 \(locked\) to below 1\."),
        ({"slip": -1.01}, r"slip of the wheel is -1.01; allowed: from -1"),
        ({"slip": None}, r"slip of the wheel is None; allowed: from -1"),
        ({"slip": -1.0, "held": "rim"}, r"slip of the wheel is -1.0; allowed: .*-1 excluded where the rim's speed is held"),
        ({"held": "free"}, r"slip of the wheel is 0.5; allowed: none where held is 'free'"),
        ({"held": "torque"}, r"held of the wheel is 'torque'; allowed: one of"),
        ({"drawbar_load_n": 1.0}, r"drawbar_load_n is 1.0; allowed: 0 unless held is 'free'"),
        ({"load_n": 0.0}, r"load_n of the wheel is 0.0; allowed: a positive number"),
        ({"speed_m_s": -0.1}, r"speed_m_s of the wheel is -0.1; allowed: a positive number"),
        ({"mass_kg": 0.0}, r"mass_kg of the wheel is 0.0; allowed: a positive number"),
        ({"wheel_static_friction": -0.1}, r"wheel_static_friction is -0.1; allowed: zero or positive"),
        ({"wheel_rolling_friction": -0.1}, r"wheel_rolling_friction is -0.1; allowed: zero or positive"),
    ],
)
def test_tests_that_make_no_sense_are_refused(change, message):
    with pytest.raises(ValueError, match=message):
        dataclasses.replace(TEST, **change)


@pytest.mark.parametrize(
    ("shape", "test", "message"),
    [
        ({"radius_m": 0.009}, {}, r"radius_m of the wheel is 0.009 m, 4.5 grain diameters; allowed: at least 5: smaller grains"),
        ({"width_m": 0.005}, {}, r"width_m of the wheel is 0.005 m, 2.5 grain diameters; allowed: at least 3"),
        ({"radius_m": 0.012}, {}, r"length_m of the bed is 0.047; allowed: at least 0.048 for this wheel"),
        ({"width_m": 0.011}, {}, r"width_m of the bed is 0.02; allowed: at least 0.022 for this wheel"),
        ({}, {"travel_ratio": 2.8}, r"travel_ratio of the wheel is 2.8; allowed: at most 2.7: .* its own rut"),
    ],
)
def test_wheels_that_do_not_fit_grains_and_bed_are_refused(shape, test, message):
    bed = SoilBed(SETUP, None, "done", 0.015, np.zeros((1, 1)), 0.5, 1250.0, np.zeros(0, int), 1, 0.0)
    with pytest.raises(ValueError, match=message):
        wheel_setup.check(bed, SOIL, dataclasses.replace(SHAPE, **shape), dataclasses.replace(TEST, **test))


def test_a_mesh_whose_axle_is_elsewhere_is_refused():
    shifted = solids.wheel(0.01, 0.008)
    shifted = dataclasses.replace(shifted, vertices_m=shifted.vertices_m + [0.002, 0.0, 0.0])
    with pytest.raises(ValueError, match=r"axle of the wheel \(axis y\) is 0.002 m beside the middle of wheel; allowed"):
        WheelShape.of_mesh(shifted)
    with pytest.raises(ValueError, match=r"radius_m of the wheel is 0.02; allowed: at most 0.01, that of wheel"):
        WheelShape.of_mesh(solids.wheel(0.01, 0.008), radius_m=0.02)


def test_what_is_coarse_soft_or_fast_is_warned_of(driven):
    run, _ = driven
    said = " | ".join(run.warnings)
    assert "radius of the wheel is 5 grain diameters; results depend on the grain size below 14" in said
    assert "width of the wheel is 4 grain diameters" in said
    assert "stiffness E*/p under the wheel is 1.2e+03; results depend on the softness below 2000" in said
    assert "v^2/(g R) under the wheel is 0.0255; results depend on the speed above 0.02" in said
    short = WheelShape(radius_m=0.1, width_m=0.1, grousers=8, grouser_height_m=3e-3, grouser_thickness_m=1e-3)
    assert wheel_setup.coarse(SOIL, short) == [
        "height of the grousers of the wheel is 1.5 grain diameters; results depend on the grain size below 2"
    ]


@pytest.mark.parametrize(
    ("setup", "message"),
    [
        ({"length_m": 0.015}, r"length_m of the bed is 0.015 m, 7.5 grain diameters; allowed: at least 8 grain diameters"),
        ({"depth_m": 0.009}, r"depth_m of the bed is 0.009 m, 4.5 grain diameters; allowed: at least 5"),
        ({"width_m": -1.0}, r"width_m of the bed is -1.0; allowed: a positive number"),
        ({"preparation_friction_ratio": -1.0}, r"preparation_friction_ratio of the bed is -1.0; allowed"),
    ],
)
def test_beds_that_make_no_sense_are_refused(setup, message):
    with pytest.raises(ValueError, match=message):
        soil_bed.check(SOIL, dataclasses.replace(SETUP, **setup), ENGINE)


def test_an_energy_ledger_is_refused_before_the_bed_is_made():
    with pytest.raises(ValueError, match="energy_ledger is True; allowed: False with beds for tools"):
        soil_bed.check(SOIL, SETUP, dataclasses.replace(ENGINE, energy_ledger=True))
