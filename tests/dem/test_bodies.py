"""Bodies that turn, and meshes, in a simulation. What has a closed form is in the verification group "Bodies"."""

import numpy as np
import pytest

import dem
from dem import solids
from dem.shapes import placed

MATERIAL = dem.Material(density_kg_m3=2500.0, poisson_ratio=0.2, shear_modulus_pa=5e6)
RADIUS_M, PERIOD_M = 1e-3, 0.06
SQUARE = [(-0.05, -0.05), (0.05, -0.05), (0.05, 0.05), (-0.05, 0.05)]


def scene(walls=(), friction=0.5, rolling_friction=0.1, **settings):
    """All with a period along y and with a mesh far away: one kernel for this file, but for two threads."""
    touch = dem.Interaction(restitution=0.5, static_friction=friction, rolling_friction=rolling_friction)
    return dem.Simulation(
        materials={"soil": MATERIAL}, interactions={("soil", "soil"): touch}, walls=[FAR, *walls], smallest_radius_m=RADIUS_M,
        period_m=(0.0, PERIOD_M, 0.0), **settings,
    )  # fmt: skip


def body(shape, name="body", **motion):
    return dem.Body(name=name, material="soil", shape=shape, motion=dem.Motion(**motion))


FLOOR = dem.Box(name="floor", material="soil", low_m=(-1.0, -np.inf, -1.0), high_m=(1.0, np.inf, 0.0))


FAR = dem.Body(name="far", material="soil", shape=solids.box((2e-3, 2e-3, 2e-3), position_m=(0.0, 0.0, 0.3)))


def bed(threads=1):
    """A bed of two slabs, into which a turning wheel with grousers and a glued grain sinks across the periodic face."""
    wheel = solids.wheel(0.02, 0.016, 8, 3e-3, 2e-3, 40, position_m=(0.0, 0.5 * PERIOD_M, 0.0357))
    drive = dem.Drive(axis=2, applied_force_n=-0.5, mass_kg=0.02)
    simulation = scene([FLOOR], threads=threads)
    lattice = np.stack(np.meshgrid(np.arange(44), np.arange(28), np.arange(6), indexing="ij"), axis=-1).reshape(-1, 3)
    places = (lattice - (21.5, 0.0, 0.0)) * 2.1e-3 + (0.0, 1e-3, 1.0e-3)
    simulation.add_grains(places, RADIUS_M * np.random.default_rng(1).uniform(1.0, 1.04, len(places)), "soil")
    simulation.add_wall(body(wheel, "wheel", drives=(drive,), angular_velocity_rad_s=(0.0, 20.0, 0.0)))
    simulation.add_grains((0.0, 0.5 * PERIOD_M, 0.07), RADIUS_M, "soil")
    simulation.glue([len(places)], "wheel")
    return simulation


def numbers(simulation):
    grains, wheel = simulation.grains, simulation.wall("wheel")
    loads = simulation.mean_wall_forces_n | {f"{name} torque": v for name, v in simulation.mean_wall_torques_n_m.items()}
    parts = [grains.positions_m, grains.velocities_m_s, grains.angular_velocities_rad_s, *loads.values()]
    return np.concatenate([np.ravel(part) for part in (*parts, wheel.position_m, wheel.orientation, wheel.velocity_m_s)])


def test_two_threads_and_a_resumed_run_give_the_same_bytes(tmp_path):
    simulation = bed()
    simulation.advance(300)
    dem.save(simulation, tmp_path / "half.npz")
    simulation.advance(300)
    assert simulation.wall("wheel").velocity_m_s[2] < -1e-3
    assert np.abs(simulation.mean_wall_torques_n_m["wheel"]).min() > 0.0
    resumed = dem.load(tmp_path / "half.npz")
    resumed.advance(300)
    assert (numbers(resumed) == numbers(simulation)).all()
    other = bed(threads=2)
    other.advance(300)
    other.advance(300)
    assert (numbers(other) == numbers(simulation)).all()


def long_bed(waits=False, threads=1):
    """A bed of slabs enough for many steps at once, its lowest layer glued to the floor, under a turning wheel that is pressed.

    waits : with one more grain, on a wall that a force drives: then steps are made one by one, and grains wait for all loads.
    """
    shape, spacing = (150, 29, 29), np.array([1.999e-3, PERIOD_M / 29, 1.999e-3])
    places = spacing * np.stack(np.meshgrid(*map(np.arange, shape), indexing="ij"), -1).reshape(-1, 3)
    places += (0.0, 0.0, 0.9995e-3)
    lowest, top = np.flatnonzero(places[:, 2] < 1e-3), places[:, 2].max() + RADIUS_M
    walls, rng = [FLOOR], np.random.default_rng(1)
    velocities = rng.normal(0.0, 0.01, places.shape)
    velocities[lowest] = 0.0
    if waits:
        drive = dem.Drive(axis=0, applied_force_n=1.0, mass_kg=1.0)
        walls.append(dem.Box(name="away", material="soil", low_m=(5, -np.inf, 5), high_m=(6, np.inf, 6), drive=drive))
    simulation = scene(walls, threads=threads)
    simulation.add_grains(places, RADIUS_M, "soil", velocities)
    if waits:
        simulation.add_grains((4.0, 0.0, 4.0), RADIUS_M, "soil")
        simulation.glue([len(places)], "away")
    simulation.glue(lowest, "floor")
    wheel = solids.wheel(0.02, 0.02, 0, 0.0, 0.0, 120, position_m=(0.15, 0.5 * PERIOD_M, top + 0.02 - 0.05e-3))
    press = dem.Drive(axis=2, applied_force_n=-1.0, mass_kg=50.0)
    simulation.add_wall(
        body(wheel, "wheel", drives=(press,), velocity_m_s=(0.1, 0.0, -0.05), angular_velocity_rad_s=(0.0, 20.0, 0.0))
    )
    simulation.advance(96)
    return simulation


def test_steps_under_a_driven_wheel_that_turns_are_those_made_one_by_one():
    """But for rounding, and for the wheel's own change of speed within a few steps, far less than the grains feel."""
    at_once, one_by_one = long_bed(), long_bed(waits=True)
    n = at_once.n_grains
    for name, scale in (("velocities_m_s", 0.1), ("positions_m", RADIUS_M), ("angular_velocities_rad_s", 100.0)):
        a, b = (getattr(simulation.grains, name)[:n] for simulation in (at_once, one_by_one))
        assert np.abs(a - b).max() < 1e-4 * scale, name
    for name in ("wheel", "floor"):
        force, torque = at_once.mean_wall_forces_n[name], at_once.mean_wall_torques_n_m[name]
        assert force == pytest.approx(one_by_one.mean_wall_forces_n[name], rel=1e-4, abs=1e-4)
        assert torque == pytest.approx(one_by_one.mean_wall_torques_n_m[name], rel=1e-4, abs=1e-6)
    assert at_once.mean_wall_forces_n["wheel"][2] > 0.05
    a, b = (simulation.wall("wheel") for simulation in (at_once, one_by_one))
    assert a.velocity_m_s[2] == pytest.approx(b.velocity_m_s[2], rel=1e-7)
    assert a.velocity_m_s[2] != pytest.approx(-0.05, rel=1e-5)
    assert a.orientation == pytest.approx(b.orientation, abs=1e-12)
    assert a.position_m == pytest.approx(b.position_m, abs=1e-9)


def test_grains_see_the_nearest_image_of_a_mesh():
    def rolled(shift):
        simulation = scene([body(solids.box((0.03, 0.03, 0.01), position_m=(0.0, shift, -0.005)))])
        simulation.add_grains((0.0, 0.01, 0.999e-3), RADIUS_M, "soil", (0.1, 0.0, 0.0))
        simulation.advance(500)
        return np.concatenate([simulation.grains.positions_m[0], simulation.mean_wall_torques_n_m["body"]])

    for shift in (PERIOD_M, -2.0 * PERIOD_M):
        assert rolled(shift) == pytest.approx(rolled(0.0), rel=1e-6, abs=1e-12)
    assert rolled(0.5 * PERIOD_M)[2] < 0.99e-3  # it falls beside


def test_glued_grains_ride_on_a_turning_body_and_load_it():
    rate = np.array([3.0, -4.0, 12.0])
    simulation = scene([body(solids.box((0.01, 0.01, 0.01)), angular_velocity_rad_s=tuple(rate))], gravity_m_s2=(0, 0, 0))
    simulation.add_grains([(0.012, 0.0, 0.0), (0.012, 0.0, 2e-3)], RADIUS_M, "soil")
    simulation.glue([0], "body")
    start = simulation.grains.positions_m[0]
    simulation.advance(20_000)
    position, velocity = simulation.grains.positions_m[0], simulation.grains.velocities_m_s[0]
    assert np.linalg.norm(position) == pytest.approx(np.linalg.norm(start), rel=1e-9)
    assert position @ rate == pytest.approx(start @ rate, rel=1e-9)
    turned = np.linalg.norm(rate) * simulation.time_s
    axis = rate / np.linalg.norm(rate)
    along = axis * (axis @ start)
    expected = along + np.cos(turned) * (start - along) + np.sin(turned) * np.cross(axis, start)
    assert position == pytest.approx(expected, rel=1e-8, abs=1e-11)
    assert velocity == pytest.approx(np.cross(rate, position), rel=1e-3, abs=1e-6)
    assert simulation.grains.angular_velocities_rad_s[0] == pytest.approx(rate, rel=1e-6)


def test_a_load_on_a_glued_grain_turns_its_body():
    arm = 0.02
    simulation = scene([body(solids.box((0.01, 0.01, 0.01)))])
    simulation.add_grains([(arm, 0.0, 0.0), (arm, 0.0, 2e-3)], RADIUS_M, "soil")
    simulation.glue([0], "body")
    simulation.advance(20_000)
    force, torque = simulation.mean_wall_forces_n["body"], simulation.mean_wall_torques_n_m["body"]
    assert force[2] < 0.0
    simulation.advance(1)
    force, torque = simulation.mean_wall_forces_n["body"], simulation.mean_wall_torques_n_m["body"]
    assert torque[1] == pytest.approx(-arm * force[2], rel=0.1)


def test_drives_move_bodies_as_their_equations_say():
    drives = (
        dem.Drive(axis=0, applied_force_n=0.2, mass_kg=0.1),
        dem.Drive(axis=2, applied_force_n=-0.3, mass_kg=0.2, damping_kg_s=3.0),
    )
    turn = dem.TurnDrive(axis=(0, 2, 0), applied_torque_n_m=1e-4, inertia_kg_m2=2e-5, damping_n_m_s=0.0)
    slowed = dem.TurnDrive(axis=(1, 0, 0), applied_torque_n_m=1e-4, inertia_kg_m2=1e-7, damping_n_m_s=1e-5)
    simulation = scene(
        [body(solids.box((0.01, 0.01, 0.01)), drives=drives, turn=turn), body(solids.cone(0.01, 0.01), "top", turn=slowed)]
    )
    simulation.advance(20_000)
    t, moved = simulation.time_s, simulation.wall("body")
    assert moved.velocity_m_s[0] == pytest.approx(2.0 * t, rel=1e-9)
    assert moved.position_m[0] == pytest.approx(t * t, rel=1e-3)
    assert moved.velocity_m_s[2] == pytest.approx(-0.1 * (1.0 - np.exp(-15.0 * t)), rel=1e-3)
    assert moved.angular_velocity_rad_s == pytest.approx((0.0, 5.0 * t, 0.0), rel=1e-9)
    assert 2.0 * np.arctan2(moved.orientation[2], moved.orientation[0]) == pytest.approx(2.5 * t * t, rel=1e-3)
    assert simulation.wall("top").angular_velocity_rad_s[0] == pytest.approx(10.0, rel=1e-6)


def test_a_grain_keeps_its_spring_when_another_mesh_is_removed():
    def held(removes):
        tilted = solids.plate(SQUARE, 0.002, position_m=(0.0, 0.0, 0.0), orientation=(np.cos(0.1), 0.0, np.sin(0.1), 0.0))
        simulation = scene([body(tilted, "slope")], friction=1.0, rolling_friction=0.5)
        normal = np.array([np.sin(0.2), 0.0, np.cos(0.2)])
        simulation.add_grains(normal * 1.999e-3, RADIUS_M, "soil")
        simulation.advance(20_000)
        if removes:
            simulation.remove_wall("far")
        before = simulation.grains.positions_m[0]
        simulation.advance(200)
        return np.linalg.norm(simulation.grains.positions_m[0] - before), simulation.mean_wall_forces_n["slope"]

    moved, force = held(True)
    assert moved < 1e-9
    assert force == pytest.approx(held(False)[1], rel=1e-9)
    assert abs(force[0]) < 1e-3 * abs(force[2])


def spring(simulation):
    """Elongations in m of the tangential springs of the only grain, of all patches that it is near."""
    outer = simulation._state.lists.surfaces.outer
    return np.linalg.norm(outer.history[outer.row[0, 0] : outer.row[0, 1], :3], axis=1)


def test_the_spring_goes_with_a_grain_over_a_crease():
    """A sphere rolls down a slope of 25 degrees to a ridge, where the slope of 65 behind it takes over, as its number is lower."""
    down = [np.array([np.cos(angle), 0.0, -np.sin(angle)]) for angle in np.radians([25.0, 65.0])]
    side = np.array([0.0, 0.01, 0.0])
    vertices = np.array([-0.02 * down[0] - side, -0.02 * down[0] + side, -side, side, 0.02 * down[1] - side, 0.02 * down[1] + side])
    roof = dem.Mesh(vertices_m=vertices, triangles=np.array([(2, 4, 5), (2, 5, 3), (0, 2, 3), (0, 3, 1)]), source="roof")
    simulation = scene([body(roof, "roof")], friction=0.9, rolling_friction=0.0)
    simulation.add_grains(-2e-4 * down[0] + 0.9995e-3 * np.array([-down[0][2], 0.0, down[0][0]]), RADIUS_M, "soil")
    simulation.advance(300)
    lengths, patches = [], set()
    while simulation.grains.positions_m[0, 0] < 0.5e-3:
        simulation.advance(1)
        found = spring(simulation)
        assert (found > 0.0).sum() == 1
        outer = simulation._state.lists.surfaces.outer
        patches.add(int(outer.partner[outer.row[0, 0] + found.argmax()]))
        lengths.append(found.max())
    assert len(patches) == 2
    assert np.min(np.array(lengths[1:]) / lengths[:-1]) > 0.8


def test_a_list_of_triangles_that_is_too_short_grows():
    ends = []
    for capacity in (1, 4096):
        simulation = scene([body(solids.cylinder(0.02, 0.01, 40, position_m=(0.0, 0.0, -0.005)))])
        simulation.add_grains([(0.003 * k, 0.0, 0.9999e-3) for k in range(-3, 4)], RADIUS_M, "soil", (0.1, 0.0, 0.0))
        simulation._runner.n_triangles = capacity
        simulation.advance(50)
        assert simulation._runner.n_triangles >= 14
        ends.append(simulation.grains.positions_m)
    assert (ends[0] == ends[1]).all()
    assert np.ptp(ends[0][:, 0]) > 0.0


def test_a_wall_begins_to_turn_under_grains():
    table = dem.Box(name="table", material="soil", low_m=(-1.0, -np.inf, 0.0), high_m=(1.0, np.inf, 0.0))
    simulation = scene([table], rolling_friction=0.0)
    simulation.add_grains((0.02, 0.0, 0.9999e-3), RADIUS_M, "soil")
    simulation.advance(200)
    simulation.turn_wall("table", (0.0, 0.0, 10.0))
    simulation.advance(200)
    assert simulation.grains.velocities_m_s[0, 1] > 1e-3
    simulation.turn_wall("table", (0.0, 0.0, 0.0))
    assert not simulation.wall("table").turns


def test_a_grain_that_is_pressed_into_a_solid_ends_the_simulation():
    """The ram is softer than the grain on the floor, which therefore stays where it is until its centre is inside."""
    ram = dem.Drive(axis=2, applied_force_n=-200.0, mass_kg=5.0, damping_kg_s=2000.0)
    block = solids.box((0.02, 0.02, 0.01), position_m=(0.0, 0.0, 7.1e-3))
    touch = dem.Interaction(restitution=0.5, static_friction=0.5, rolling_friction=0.1)
    simulation = dem.Simulation(
        materials={"soil": MATERIAL, "soft": dem.Material(density_kg_m3=2500.0, poisson_ratio=0.2, shear_modulus_pa=5e4)},
        interactions={("soil", "soil"): touch, ("soil", "soft"): touch}, smallest_radius_m=RADIUS_M, period_m=(0.0, PERIOD_M, 0.0),
        walls=[FLOOR, dem.Body(name="ram", material="soft", shape=block, motion=dem.Motion(drives=(ram,)))],
    )  # fmt: skip
    simulation.add_grains((0.0, 0.0, 1e-3), RADIUS_M, "soil")
    with pytest.raises(dem.SimulationError, match=r"grain 0 at \(.*\) m is inside a solid mesh after t = .*: stiffer grains"):
        simulation.advance(20_000)


def refused(make, match):
    with pytest.raises(ValueError, match=match) as caught:
        make()
    assert "\n" not in str(caught.value)


def test_bodies_that_make_no_sense_are_refused_in_one_line():
    cube = solids.box((0.01, 0.01, 0.01), position_m=(0.0, 0.0, 0.005))
    spin = {"angular_velocity_rad_s": (0.0, 1.0, 0.0)}
    simulation = scene([FLOOR])
    simulation.add_grains((0.0, 0.0, 0.005), RADIUS_M, "soil")
    refused(lambda: simulation.add_wall(body(cube)), "grain 0 at .* in wall 'body': its overlap is 6 of a radius")
    refused(lambda: simulation.add_wall(cube), "wall name is ''")
    refused(lambda: dem.Box(low_m=(0, 0, 0), high_m=(1, 1, 1), **spin), "axis of turning")
    refused(lambda: dem.Tube(radius_m=1.0, bottom_m=0.0, top_m=1.0, **spin), "allowed: z, the axis of the tube")
    refused(lambda: dem.TurnDrive(axis=(0, 0, 0), applied_torque_n_m=1.0, inertia_kg_m2=1.0), "TurnDrive.axis")
    refused(lambda: dem.TurnDrive(axis=(0, 0, 1), applied_torque_n_m=1.0, inertia_kg_m2=0.0), "inertia_kg_m2 is 0.0")
    refused(lambda: dem.FreeTurn(moments_kg_m2=(1.0, 1.0, 3.0)), "moments_kg_m2")
    drives = (dem.Drive(axis=0, applied_force_n=1.0, mass_kg=1.0),) * 2
    refused(lambda: body(cube, drives=drives).as_wall(), "axes of the drives")
    turn = dem.TurnDrive(axis=(0, 0, 1), applied_torque_n_m=1.0, inertia_kg_m2=1.0)
    refused(lambda: body(cube, turn=turn, **spin).as_wall(), "a multiple of the drive's axis")
    refused(lambda: scene(energy_ledger=True), "energy_ledger is True")
    refused(lambda: scene().add_wall(body(solids.box((10.0, 0.1, 0.1)))), r"size of box is 10 m, 1e\+04 radii")
    refused(lambda: scene().add_wall(body(solids.box((0.02, 0.02, 0.00005)))), "thickness of box is 5e-05 m behind triangle")
    long = scene([body(solids.box((0.01, 0.0599, 0.01)))])
    long.add_grains((0.0, 0.0, 0.1), RADIUS_M, "soil")
    refused(lambda: long.advance(1), "extent of wall 'body' along y is -0.02995 to 0.02995 m")


def test_a_mesh_longer_than_the_period_has_no_seam():
    simulation = scene([body(solids.box((0.05, 0.2, 0.01), position_m=(0.0, 0.0, -0.005)))], friction=0.0)
    simulation.add_grains((0.0, 0.02, 0.9999e-3), RADIUS_M, "soil", (0.0, 1.0, 0.0))
    simulation.advance(20_000)
    y, z = simulation.grains.positions_m[0, 1:]
    assert y > PERIOD_M
    assert z == pytest.approx(RADIUS_M, rel=1e-2)


def test_a_body_is_a_wall_with_its_attributes():
    tube = dem.Tube(radius_m=0.02, bottom_m=0.0, top_m=0.1)
    made = body(tube, "drum", angular_velocity_rad_s=(0.0, 0.0, 2.0)).as_wall()
    same = dem.Tube(name="drum", material="soil", radius_m=0.02, bottom_m=0.0, top_m=0.1, angular_velocity_rad_s=(0.0, 0.0, 2.0))
    assert made == same
    assert placed(made, [1.0, 2.0, 3.0, 1.0, 2.0, 4.0, 0.02]).pivot == (1.0, 2.0, 3.5)
