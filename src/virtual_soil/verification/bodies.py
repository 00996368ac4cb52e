"""Bodies: surfaces of triangles beside boxes and closed forms; with `bodies_turning` and `patches` the group "Bodies".

Rolling sphere (moment 2/5 m r^2). On a plate of velocity V it slides at mu g for 2 V / (7 mu g) and then rolls at 2/7 V. In a V
groove of half angle alpha each plane carries m g / (2 sin alpha). Over the edge of a box a sphere turns as a pendulum upside down:
v^2 = 10/7 g r (1 - cos phi).
"""

import math

import numpy as np
from scipy.spatial.transform import Rotation

import dem
from dem import shapes, solids
from virtual_soil.verification import bodies_turning, closed_forms, patches
from virtual_soil.verification.bodies_scene import (
    DOWN,
    HALF_M,
    OVERLAP_M,
    RIGID_BODY,
    WEIGHT_N,
    body,
    check,
    on,
    vee,
)
from virtual_soil.verification.check import Check
from virtual_soil.verification.rest import GRAVITY_M_S2, RADIUS_M, TIME_STEP_S
from virtual_soil.verification.scene import SOFT, mass_kg, record

EQUILIBRIUM, SAME = "closed form (equilibrium)", "the same floor as a box"

MASS_KG = mass_kg(SOFT, RADIUS_M)
SQUARE = [(-HALF_M, -HALF_M), (HALF_M, -HALF_M), (HALF_M, HALF_M), (-HALF_M, HALF_M)]


def checks() -> list[Check]:
    """Run all cases of bodies."""
    return [
        nearest_point(),
        *same_floor(),
        *seams(),
        *incline(),
        *moving_plate(),
        *over_an_edge(),
        *groove(),
        *box_of_grains(),
        *bodies_turning.checks(),
        *patches.checks(),
    ]


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
    simulation.run(3.0)  # grains that only rub roll for long
    simulation.advance(2000)
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
