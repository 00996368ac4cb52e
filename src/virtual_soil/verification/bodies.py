"""Bodies: surfaces of triangles, surfaces that turn, forces and torques on them, driven and free motion.

Rolling sphere (moment 2/5 m r^2). On a plate of velocity V it slides at mu g for 2 V / (7 mu g) and then rolls at 2/7 V. On a
table that turns at Omega, its centre circles at 2/7 Omega (Weckesser 1997, Am. J. Phys. 65, 736). In a drum it rests where
tan(theta) = mu_r. In a V groove of half angle alpha each plane carries m g / (2 sin alpha). Over the edge of a box a sphere turns
as a pendulum upside down: v^2 = 10/7 g r (1 - cos phi).

A free body of moments 1, 2, 3 turns about its middle axis with the e-folding rate Omega sqrt(1/3).
"""

import math
from typing import cast

import numpy as np
from scipy.spatial.transform import Rotation

import dem
from dem import shapes, solids
from virtual_soil.verification import closed_forms, patches
from virtual_soil.verification.check import Check
from virtual_soil.verification.rest import GRAVITY_M_S2, RADIUS_M, TIME_STEP_S
from virtual_soil.verification.scene import SOFT, mass_kg, record, scene

GROUP = "Bodies"
RIGID_BODY, EQUILIBRIUM, SAME = "closed form (rigid bodies)", "closed form (equilibrium)", "the same floor as a box"

MASS_KG = mass_kg(SOFT, RADIUS_M)
WEIGHT_N = MASS_KG * GRAVITY_M_S2
DOWN = (0.0, 0.0, -GRAVITY_M_S2)

#: Half the edge of a square floor.
HALF_M = 0.2
SQUARE = [(-HALF_M, -HALF_M), (HALF_M, -HALF_M), (HALF_M, HALF_M), (-HALF_M, HALF_M)]

#: Overlap of a sphere that lies on a floor under its weight.
OVERLAP_M = (WEIGHT_N / closed_forms.on_wall(SOFT, RADIUS_M, 1.0).stiffness) ** (2.0 / 3.0)


def checks() -> list[Check]:
    """Run all cases of bodies."""
    return [
        nearest_point(),
        *same_floor(),
        *seams(),
        *incline(),
        *moving_plate(),
        *turntable(),
        *drum(),
        *spinning_wheel(),
        *over_an_edge(),
        *groove(),
        *box_of_grains(),
        *free_body(),
        world_times_sixteen(),
        *patches.checks(),
    ]


def check(case: str, quantity: str, unit: str, source: str, expected: float, obtained, tolerance: float = 0.0, **more) -> Check:
    """One check of this group."""
    return Check(
        group=GROUP, case=case, quantity=quantity, unit=unit, source=source, expected=expected, obtained=float(obtained),
        tolerance=tolerance, **more,
    )  # fmt: skip


def on(walls, *, friction=(0.5, 0.0), gravity_m_s2=DOWN, restitution=0.5, **settings) -> dem.Simulation:
    """Soft spheres on some bodies of rigid material under gravity."""
    static, rolling = friction
    rough = {"restitution": restitution, "static_friction": static, "rolling_friction": rolling}
    return scene(SOFT, RADIUS_M, TIME_STEP_S, gravity_m_s2=gravity_m_s2, walls=walls, **rough | settings)


def body(shape: dem.Wall, name: str = "floor", **motion) -> dem.Body:
    """A body of rigid material."""
    return dem.Body(name=name, material="rigid", shape=shape, motion=dem.Motion(**motion))


def grid_floor(places_x, places_y, shear: float = 0.0) -> dem.Mesh:
    """A floor of 2 triangles per cell of a grid; shear moves every vertex inside by this share of its cell, at random."""
    x, y = np.meshgrid(places_x, places_y, indexing="ij")
    inside = np.zeros(x.shape)
    inside[1:-1, 1:-1] = shear
    rng = np.random.default_rng(5)
    cell_x, cell_y = np.diff(places_x).min(), np.diff(places_y).min()
    x, y = x + inside * cell_x * rng.uniform(-1, 1, x.shape), y + inside * cell_y * rng.uniform(-1, 1, y.shape)
    number = np.arange(x.size).reshape(x.shape)
    a, b, c, d = (part.ravel() for part in (number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]))
    triangles = np.concatenate([np.column_stack([a, b, c]), np.column_stack([a, c, d])])
    vertices = np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)])
    return dem.Mesh(vertices_m=vertices, triangles=triangles, source="floor")


def floors() -> dict[str, dem.Mesh]:
    """The same square floor as 2, 200 and irregular triangles."""
    places = np.linspace(-HALF_M, HALF_M, 11)
    return {
        "2 triangles": solids.plate(SQUARE),
        "200 triangles": grid_floor(places, places),
        "irregular triangles": grid_floor(places, places, shear=0.4),
    }


def projected(corners: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Distances of points (n, 3) from a triangle (3, 3), by the projection on every side and on the face."""
    a, b, c = corners
    found = []
    for p, q in ((a, b), (b, c), (c, a)):
        share = np.clip((points - p) @ (q - p) / ((q - p) @ (q - p)), 0.0, 1.0)
        found.append(np.linalg.norm(points - p - share[:, None] * (q - p), axis=1))
    sides = np.column_stack([b - a, c - a])
    shares = np.linalg.lstsq(sides, (points - a).T, rcond=None)[0]
    foot = (sides @ shares).T + a
    inside = (shares >= 0).all(axis=0) & (shares.sum(axis=0) <= 1)
    found.append(np.where(inside, np.linalg.norm(points - foot, axis=1), np.inf))
    return np.min(found, axis=0)


def nearest_point() -> Check:
    """Distances of a million random points from a triangle: they lie in all seven regions."""
    rng = np.random.default_rng(1)
    corners = rng.normal(size=(3, 3))
    mesh = dem.Mesh(vertices_m=corners, triangles=np.array([[0, 1, 2]]), source="triangle")
    points = rng.normal(0.0, 2.0, (1_000_000, 3))
    error = np.abs(shapes.distance(mesh, points) - projected(corners, points)).max()
    size = np.linalg.norm(corners - np.roll(corners, 1, axis=0), axis=1).max()
    case = "distance of 1e6 points from a triangle"
    return check(case, "largest error over the longest edge", "-", "brute force", 0.0, error / size, 1e-12)


def thrown(floor: dem.Body, gravity, velocity, places, n_steps: int = 3000, looks: int = 5) -> np.ndarray:
    """Positions, spins over r and loads of three spheres that bounce, slide and roll."""
    simulation = on([floor], gravity_m_s2=gravity)
    simulation.add_grains(places, [RADIUS_M, 1.2 * RADIUS_M, 2.0 * RADIUS_M], "grain", velocity)
    rows = []
    for _ in range(looks):
        simulation.advance(n_steps)
        grains = simulation.grains
        rows.append(np.concatenate([grains.positions_m, grains.angular_velocities_rad_s, [simulation.mean_wall_forces_n["floor"]]]))
    return np.array(rows)


def same_floor() -> list[Check]:
    """Spheres on a floor of triangles move as on a box: the same bytes if it is level and unmoved, else up to rounding."""
    places = np.array([(-0.0101, 0.0003, 1.0e-3), (0.0121, 0.0123, 1.4e-3), (0.02, -0.03, 3.0e-3)])
    velocity, gravity = np.array([0.1, 0.02, 0.0]), np.array([1.0, 0.3, -9.81])
    box = dem.Box(low_m=(-HALF_M, -HALF_M, 0.0), high_m=(HALF_M, HALF_M, 0.0))
    expected = thrown(body(box), gravity, velocity, places)
    found = []
    for name, mesh in floors().items():
        differs = thrown(body(mesh), gravity, velocity, places) != expected
        found.append(check(f"level floor of {name}", "numbers that differ from those on a box", "-", SAME, 0, differs.sum()))
    turn, shift = Rotation.from_quat([0.8, 0.3, -0.2, 0.4], scalar_first=True), np.array([0.013, -0.007, 0.021])
    rotation, quaternion = turn.as_matrix(), turn.as_quat(scalar_first=True)
    mesh = floors()["irregular triangles"]
    turned = body(
        dem.Mesh(vertices_m=mesh.vertices_m, triangles=mesh.triangles, position_m=tuple(shift), orientation=tuple(quaternion))
    )
    obtained = thrown(turned, rotation @ gravity, rotation @ velocity, places @ rotation.T + shift, 20_000)
    straight = thrown(body(box), gravity, velocity, places, 20_000)
    error = np.abs((obtained[-1, :3] - shift) @ rotation - straight[-1, :3]).max() / RADIUS_M
    return [*found, check("turned floor of irregular triangles, 1e5 steps", "position", "r", SAME, 0.0, error, 1e-6)]


def seams() -> list[Check]:
    """A sphere rolls over 100 seams, along one, and through vertices: it does not feel them."""
    places = np.linspace(-HALF_M, HALF_M, 201)
    mesh, v, steps = grid_floor(places, np.linspace(-HALF_M, HALF_M, 11)), 0.5, 100
    ways = {"over 100 seams": (1.0, 0.13, 0.0007), "along a seam": (1.0, 0.0, 0.0), "through vertices": (1.0, 1.0, 0.0)}
    found = []
    for name, (x, y, off) in ways.items():
        simulation = on([body(mesh)], restitution=1.0)
        direction = np.array([x, y, 0.0]) / math.hypot(x, y)
        start = np.array([-0.05, off if y == 0.13 else -0.05 * y, RADIUS_M - OVERLAP_M])
        spin = np.cross([0.0, 0.0, 1.0], direction) * v / start[2]
        simulation.add_grains(start, RADIUS_M, "grain", v * direction, spin)
        run = record(simulation, round(0.1 / v / TIME_STEP_S / steps), steps)
        case = f"sphere rolls {name}"
        speed = np.abs(run.velocities_m_s[:, 0] - v * direction).max() / v
        turn = np.abs(run.spins_rad_s[:, 0] - spin).max() * RADIUS_M / v
        height = np.ptp(run.positions_m[:, 0, 2]) / OVERLAP_M
        force = np.abs(run.floor_forces_n[1:, 2] / WEIGHT_N + 1.0).max()
        found += [
            check(case, "change of velocity over v", "-", RIGID_BODY, 0.0, speed, 1e-6),
            check(case, "change of spin times r over v", "-", RIGID_BODY, 0.0, turn, 1e-6),
            check(case, "change of height over overlap", "-", RIGID_BODY, 0.0, height, 1e-6),
            check(case, "change of floor force over weight", "-", RIGID_BODY, 0.0, force, 1e-5),
        ]
    return found


def incline() -> list[Check]:
    """A sphere on a slope of triangles rolls at 5/7 g sin(slope), or slides at g (sin - mu cos)."""
    slope, found = 0.3, []
    mesh = floors()["irregular triangles"]
    tilted = dem.Mesh(
        vertices_m=mesh.vertices_m, triangles=mesh.triangles, orientation=(math.cos(0.5 * slope), 0.0, math.sin(0.5 * slope), 0.0)
    )
    down, normal = np.array([math.cos(slope), 0.0, -math.sin(slope)]), np.array([math.sin(slope), 0.0, math.cos(slope)])
    limit = 2.0 / 7.0 * math.tan(slope)
    for mu, name in ((1.05 * limit, "rolls"), (0.8 * limit, "slides")):
        simulation = on([body(tilted)], friction=(mu, 0.0))
        simulation.add_grains(normal * (RADIUS_M - 0.97 * OVERLAP_M), RADIUS_M, "grain")
        run = record(simulation, 40, round(0.2 / TIME_STEP_S / 40))
        rate = np.polyfit(run.times_s[10:], run.velocities_m_s[10:, 0] @ down, 1)[0]
        expected = GRAVITY_M_S2 * (5.0 / 7.0 * math.sin(slope) if name == "rolls" else math.sin(slope) - mu * math.cos(slope))
        case = f"slope of triangles, 0.3 rad, µs {mu / limit:.2f} of 2/7 tan: {name}"
        found.append(check(case, "acceleration", "m/s²", RIGID_BODY, expected, rate, 1e-3 * expected))
    return found


def moving_plate() -> list[Check]:
    """A plate begins to move at V under a sphere at rest."""
    v, mu = 0.2, 0.3
    mesh = floors()["200 triangles"]
    simulation = on([body(mesh, velocity_m_s=(v, 0.0, 0.0))], friction=(mu, 0.0))
    simulation.add_grains((0.0, 0.0, RADIUS_M - OVERLAP_M), RADIUS_M, "grain")
    sticks = 2.0 * v / (7.0 * mu * GRAVITY_M_S2)
    run = record(simulation, 400, max(1, round(2.0 * sticks / TIME_STEP_S / 400)))
    speeds, sliding = run.velocities_m_s[:, 0, 0], (run.times_s > 0.1 * sticks) & (run.times_s < 0.9 * sticks)
    case, rate = "plate of triangles that moves at V under a sphere", mu * GRAVITY_M_S2
    slide = np.polyfit(run.times_s[sliding], speeds[sliding], 1)[0]
    rolls = run.times_s[np.argmax(speeds > 2.0 / 7.0 * v * (1.0 - 1e-3))]
    return [
        check(case, "acceleration while it slides", "m/s²", RIGID_BODY, rate, slide, 2e-3 * rate),
        check(case, "time when it begins to roll", "s", RIGID_BODY, sticks, rolls, 5e-3 * sticks + 2.0 * run.times_s[1]),
        check(case, "speed after that", "m/s", RIGID_BODY, 2.0 / 7.0 * v, speeds[-1], 2e-3 * v),
    ]


def turntable() -> list[Check]:
    """A sphere rolls on a table that turns at Omega: it circles at 2/7 Omega, here with a period of pi seconds over 10."""
    rate, found = 70.0, []
    quarter = 2.0 * math.pi / (2.0 / 7.0 * rate)
    box = dem.Box(low_m=(-HALF_M, -HALF_M, 0.0), high_m=(HALF_M, HALF_M, 0.0))
    for name, shape in (("box", box), ("disc of triangles", solids.cylinder(0.1, 0.01, position_m=(0.0, 0.0, -0.005)))):
        simulation = on([body(shape, angular_velocity_rad_s=(0.0, 0.0, rate))], restitution=1.0)
        v, radius = 0.2, 0.2 / (2.0 / 7.0 * rate)
        # rolling: v + w x (-r z) = Omega x c, with the sphere's centre at (0, radius) relative to the centre of its circle
        place = np.array([0.01, 0.005, RADIUS_M - OVERLAP_M])
        velocity, under = np.array([v, 0.0, 0.0]), np.cross([0.0, 0.0, rate], place * (1, 1, 0))
        spin = np.cross([0.0, 0.0, 1.0], velocity - under) / (RADIUS_M - OVERLAP_M)
        simulation.add_grains(place, RADIUS_M, "grain", velocity, spin)
        looks = 40
        run = record(simulation, looks, round(quarter / TIME_STEP_S / looks))
        centre, size = circle_through(run.positions_m[:, 0, :2])
        angles = np.unwrap(np.arctan2(*(run.positions_m[:, 0, :2] - centre).T[::-1]))
        turning = abs(np.polyfit(run.times_s, angles, 1)[0])
        away = np.linalg.norm(run.positions_m[:, 0, :2] - centre, axis=1)
        case = f"sphere on a turning table ({name})"
        found += [
            check(case, "rate of its circle over Omega", "-", RIGID_BODY, 2.0 / 7.0, turning / rate, 1e-3),
            check(case, "radius of its circle", "m", RIGID_BODY, radius, size, 2e-3 * radius),
            check(case, "change of the radius over it", "-", RIGID_BODY, 0.0, np.ptp(away) / size, 2e-3),
        ]
    return found


def circle_through(points: np.ndarray) -> tuple[np.ndarray, float]:
    """Centre (2,) and radius of the circle that fits points (n, 2) best (Kasa's method)."""
    terms = np.column_stack([2.0 * points, np.ones(len(points))])
    x, y, rest = np.linalg.lstsq(terms, (points**2).sum(axis=1), rcond=None)[0]
    return np.array([x, y]), math.sqrt(rest + x * x + y * y)


def drum() -> list[Check]:
    """A sphere in a drum that turns: type A, rests at tan(theta) = mu_r and spins at Omega R / r."""
    radius, rate, found = 0.05, 2.0, []
    sides = 360
    ripple = math.pi / sides  # angle between a side and the arc at its ends
    tube = dem.Tube(radius_m=radius, bottom_m=-0.1, top_m=0.1)
    facets = solids.tube(radius, 0.2, sides)
    for name, shape, mu_r, slack in (
        ("tube", tube, 0.1, 0.0), ("tube", tube, 0.0, 0.0), (f"{sides} facets", facets, 0.1, ripple),
    ):  # fmt: skip
        wall = body(shape, "drum", angular_velocity_rad_s=(0.0, 0.0, rate))
        simulation = on([wall], friction=(0.5, mu_r), gravity_m_s2=(0.0, -GRAVITY_M_S2, 0.0))
        angle = math.atan(mu_r)
        reach = radius - RADIUS_M + OVERLAP_M
        place = (reach * math.sin(angle), -reach * math.cos(angle), 0.0)
        simulation.add_grains(place, RADIUS_M, "grain", angular_velocities_rad_s=(0.0, 0.0, rate * radius / RADIUS_M))
        simulation.run(0.5)
        run = record(simulation, 50, round(0.25 / TIME_STEP_S / 50))
        x, y = run.positions_m[:, 0, 0].mean(), run.positions_m[:, 0, 1].mean()
        spin = run.spins_rad_s[:, 0, 2].mean() * RADIUS_M / (rate * radius)
        case, tolerance = f"sphere in a turning drum ({name}), µr = {mu_r:g}", 2e-3 + slack
        torque = simulation.mean_wall_torques_n_m["drum"][2] / (WEIGHT_N * radius)
        found += [
            check(case, "angle", "rad", RIGID_BODY, angle, math.atan2(x, -y), tolerance),
            check(case, "spin times r over Omega R", "-", RIGID_BODY, 1.0, spin, 5e-3 + slack),
            check(case, "torque on the drum over weight and radius", "-", RIGID_BODY, -math.sin(angle), torque, tolerance),
        ]
    return found


def spinning_wheel() -> list[Check]:
    """A wheel under a load spins over a sphere in a rough groove below its axle: F = mu W forwards, T = mu W R."""
    radius, mu, load, sides, rate = 0.02, 0.4, 0.05, 720, 5.0
    drive = dem.Drive(axis=2, applied_force_n=-load, mass_kg=load / GRAVITY_M_S2, damping_kg_s=2.0)
    shape = solids.wheel(radius, 0.01, sides=sides, position_m=(0.0, 0.0, radius + 3.0 * RADIUS_M))
    wheel = body(shape, "wheel", drives=(drive,), angular_velocity_rad_s=(0.0, rate, 0.0))
    rough = dem.Interaction(restitution=0.5, static_friction=10.0, rolling_friction=0.0)
    simulation = on([], friction=(mu, 0.0), gravity_m_s2=(0.0, 0.0, 0.0))
    simulation.set_interaction("grain", "grain", rough)
    simulation.add_wall(dem.Body(name="groove", material="grain", shape=vee(math.radians(30.0))))
    simulation.add_wall(wheel)
    simulation.add_grains((0.0, 0.0, 2.0 * RADIUS_M), RADIUS_M, "grain")
    simulation.run(0.3)
    simulation.advance(round(20 * 2.0 * math.pi / sides / rate / simulation.time_step_s))
    force, torque = simulation.mean_wall_forces_n, simulation.mean_wall_torques_n_m["wheel"]
    case = "loaded wheel spins over one held sphere"
    return [
        check(case, "load carried over load", "-", RIGID_BODY, 1.0, force["wheel"][2] / load, 2e-3),
        check(case, "pull over load", "-", RIGID_BODY, mu, force["wheel"][0] / load, 2e-3),
        check(case, "torque over load and radius", "-", RIGID_BODY, -mu, torque[1] / (load * radius), 2e-3),
        check(case, "force on the groove over load", "-", RIGID_BODY, -mu, force["groove"][0] / load, 2e-3),
    ]


def vee(half_angle_rad: float) -> dem.Mesh:
    """A groove of two planes along y, its bottom at the origin."""
    x, z, y = 0.02 * math.sin(half_angle_rad), 0.02 * math.cos(half_angle_rad), 0.02
    vertices = np.array([(0, -y, 0), (0, y, 0), (x, -y, z), (x, y, z), (-x, -y, z), (-x, y, z)])
    return dem.Mesh(vertices_m=vertices, triangles=np.array([(0, 2, 3), (0, 3, 1), (0, 1, 5), (0, 5, 4)]), source="groove")


def over_an_edge() -> list[Check]:
    """A sphere turns over the edge of a box from rest at 1 degree: energy stays, and nothing jumps."""
    cube = solids.box((0.04, 0.04, 0.04), position_m=(0.0, 0.0, -0.02))
    simulation = on([body(cube, "cube")], friction=(1.0, 0.0), restitution=1.0)
    start = math.radians(1.0)
    reach = RADIUS_M - OVERLAP_M
    edge = np.array([0.02, 0.0, 0.0])
    simulation.add_grains(edge + reach * np.array([math.sin(start), 0.0, math.cos(start)]), RADIUS_M, "grain")
    stiffness = closed_forms.on_wall(SOFT, RADIUS_M, 1.0).stiffness
    rows, angle = [], start
    while angle < math.radians(40.0):
        simulation.advance(20)
        grains = simulation.grains
        v, w = grains.velocities_m_s[0], grains.angular_velocities_rad_s[0]
        # velocities lag by half a step
        arm = grains.positions_m[0] - edge - 0.5 * simulation.time_step_s * v
        angle, distance = math.atan2(arm[0], arm[2]), math.hypot(arm[0], arm[2])
        kinetic = 0.5 * MASS_KG * (v @ v + 0.4 * RADIUS_M**2 * (w @ w))
        spring = 0.4 * stiffness * (RADIUS_M - distance) ** 2.5
        rows.append((angle, kinetic + WEIGHT_N * arm[2] + spring, w[1], np.linalg.norm(v)))
    table = np.array(rows)
    drop = WEIGHT_N * reach * (1.0 - math.cos(angle))
    rolling = math.sqrt(10.0 / 7.0 * GRAVITY_M_S2 * reach * (math.cos(start) - math.cos(angle)))
    case = "sphere turns over the edge of a box, from 1° to 40°"
    turned = np.abs(np.diff(table[:, 2])).max() / table[-1, 2]
    return [
        check(case, "change of energy over what it fell", "-", RIGID_BODY, 0.0, np.ptp(table[:, 1]) / drop, 1e-4),
        check(case, "speed at the end", "m/s", RIGID_BODY, rolling, table[-1, 3], 2e-3 * rolling),
        check(case, "largest change of spin in 20 steps over the last", "-", RIGID_BODY, 0.0, turned, 0.02),
    ]


def groove() -> list[Check]:
    """A sphere at rest in a V groove."""
    found = []
    for alpha in (math.radians(30.0), math.radians(60.0)):
        simulation = on([body(vee(alpha), "groove")], friction=(0.0, 0.0))
        height = RADIUS_M / math.sin(alpha)
        simulation.add_grains((0.0, 0.0, height), RADIUS_M, "grain")
        simulation.run(1.0)
        sunk = height - simulation.grains.positions_m[0, 2]
        carried = closed_forms.on_wall(SOFT, RADIUS_M, 1.0).stiffness * (sunk * math.sin(alpha)) ** 1.5
        force = simulation.mean_wall_forces_n["groove"]
        case = f"sphere in a V groove, half angle {math.degrees(alpha):.0f}°"
        expected = WEIGHT_N / (2.0 * math.sin(alpha))
        found += [
            check(
                case, "force of a side by its overlap over weight", "-", EQUILIBRIUM, expected / WEIGHT_N, carried / WEIGHT_N, 1e-6
            ),
            check(case, "force on the groove over weight", "-", EQUILIBRIUM, -1.0, force[2] / WEIGHT_N, 1e-6),
        ]
    return found


def box_of_grains() -> list[Check]:
    """A box of grains as one mesh: its force is their weight, its torque that of their weights."""
    inner = solids.box((0.02, 0.016, 0.06))
    tray = dem.Mesh(vertices_m=inner.vertices_m, triangles=inner.triangles[:, ::-1], position_m=(0.05, 0.02, 0.04), solid=False)
    simulation = on([body(tray, "tray")], friction=(0.5, 0.0))
    rng = np.random.default_rng(2)
    lattice = np.stack(np.meshgrid(*[np.arange(n) for n in (7, 6, 6)], indexing="ij"), axis=-1).reshape(-1, 3)
    places = np.array([0.05, 0.02, 0.02]) + (lattice - (3.0, 2.5, 0.0)) * 2.3e-3
    radii = RADIUS_M * rng.uniform(1.0, 1.1, len(places))
    simulation.add_grains(places, radii, "grain", rng.normal(0.0, 0.05, places.shape))
    simulation.run(1.5)
    simulation.advance(200)
    weights = mass_kg(SOFT, radii)[:, None] * np.array(DOWN)
    arms = simulation.grains.positions_m - tray.position_m
    total, torque = weights.sum(axis=0), np.cross(arms, weights).sum(axis=0)
    force, moment = simulation.mean_wall_forces_n["tray"], simulation.mean_wall_torques_n_m["tray"]
    scale = np.linalg.norm(total)
    size = scale * 0.01
    case = f"{len(radii)} grains in a box of triangles"
    return [
        check(case, "error of the force over weight", "-", EQUILIBRIUM, 0.0, np.linalg.norm(force - total) / scale, 1e-5),
        check(
            case,
            "error of the torque over weight and half width",
            "-",
            EQUILIBRIUM,
            0.0,
            np.linalg.norm(moment - torque) / size,
            1e-4,
        ),
    ]


def free_body() -> list[Check]:
    """A body of moments 1, 2, 3 turns freely about its middle axis, until it leaves it."""
    moments = np.array([1.0, 2.0, 3.0]) * 1e-6
    rate, tilt = 30.0, 1e-6
    shape = solids.box((0.02, 0.01, 0.005), position_m=(0.0, 0.0, 0.1))
    free = dem.FreeTurn(moments_kg_m2=tuple(moments))
    simulation = on([body(shape, "top", angular_velocity_rad_s=(tilt * rate, rate, 0.0), turn=free)])
    growth, times, energy, momentum = [], [], [], []
    for _ in range(60):
        simulation.run(0.01)
        top = cast(dem.Mesh, simulation.wall("top"))
        turn = Rotation.from_quat(top.orientation, scalar_first=True).as_matrix()
        spin = turn.T @ top.angular_velocity_rad_s
        growth.append(math.hypot(spin[0], math.sqrt(3.0) * spin[2]) / rate)
        times.append(simulation.time_s)
        energy.append(0.5 * spin @ (moments * spin))
        momentum.append(turn @ (moments * spin))
    energies, momenta = np.array(energy), np.array(momentum)
    small = np.array(growth) < 0.05
    late = small & (np.array(times) > 0.15)
    slope = np.polyfit(np.array(times)[late], np.log(np.array(growth)[late]), 1)[0] / rate
    case = "free body, moments 1, 2, 3, about its middle axis"
    change = np.linalg.norm(momenta - momenta[0], axis=1).max() / np.linalg.norm(momenta[0])
    return [
        check(case, "change of angular momentum, relative", "-", "conservation", 0.0, change, 1e-12),
        check(case, "change of energy, relative", "-", "conservation", 0.0, np.abs(energies / energies[0] - 1.0).max(), 1e-6),
        check(case, "rate of leaving the axis over Omega", "-", "closed form (Euler)", math.sqrt(1.0 / 3.0), slope, 2e-3),
    ]


def stirred(scale: float) -> np.ndarray:
    """State after a wheel with grousers stirred grains, in a world of lengths times `scale`, times times its square root."""
    length, time = scale, math.sqrt(scale)
    material = dem.Material(density_kg_m3=2500.0, poisson_ratio=0.25, shear_modulus_pa=5e6 * scale)
    touch = dem.Interaction(restitution=0.5, static_friction=0.5, rolling_friction=0.1)
    wheel = solids.wheel(
        length * 8e-3, length * 6e-3, 6, length * 2e-3, length * 1e-3, 24, name="wheel", material="soil",
        position_m=(0.0, 0.0, length * 18e-3), velocity_m_s=(0.0, 0.0, -0.1 * length / time),
        angular_velocity_rad_s=(0.0, 20.0 / time, 0.0),
    )  # fmt: skip
    tray = solids.box((length * 0.02, length * 0.012, length * 0.06), solid=False, name="tray", material="soil")
    simulation = dem.Simulation(
        materials={"soil": material}, interactions={("soil", "soil"): touch}, walls=[tray], smallest_radius_m=length * 1e-3,
        precision="float64",
    )  # fmt: skip
    lattice = np.stack(np.meshgrid(*[np.arange(n) for n in (8, 5, 5)], indexing="ij"), axis=-1).reshape(-1, 3)
    places = ((lattice - (3.5, 2.0, 0.0)) * 2.2e-3 + (0.0, 0.0, -28e-3)) * length
    simulation.add_grains(places, length * 1e-3, "soil")
    simulation.advance(3000)
    simulation.add_wall(shapes.placed(wheel, [0.0, 0.0, length * -7e-3, 0.0, 0.0, 0.0, 0.0]))
    simulation.advance(4000)
    grains = simulation.grains
    mass = scale**3
    force = simulation.mean_wall_forces_n["wheel"] / (mass * length / time**2)
    torque = simulation.mean_wall_torques_n_m["wheel"] / (mass * length**2 / time**2)
    return np.concatenate(
        [
            (grains.positions_m / length).ravel(),
            (grains.velocities_m_s / (length / time)).ravel(),
            (grains.angular_velocities_rad_s * time).ravel(),
            force,
            torque,
        ]
    )


def world_times_sixteen() -> Check:
    """A wheel stirs grains in a world 16 times as large: every number is a power of two times the other's."""
    small, large = stirred(1.0), stirred(16.0)
    assert np.abs(small[-3:]).max() > 0.0
    case = "wheel with grousers in a tray of grains, world × 16"
    return check(case, "numbers that are not the same", "-", "dimensional analysis", 0, (small != large).sum())
