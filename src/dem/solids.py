"""Parametric meshes, in SI; each returns a `dem.Mesh`, the shape of a `dem.Body`.

Further arguments are attributes of `dem.Mesh`: name, material, position_m, orientation and so on. Curves are polygons of `sides`
sides, whose corners lie on the curve; `sides_for` says how many a grain does not feel.
"""

import math

import numpy as np

from dem.material import require
from dem.shapes.mesh import Mesh

#: Sagitta of a side in grain radii that a grain does not feel.
SAGITTA_RATIO = 0.01


def sides_for(radius_m: float, grain_radius_m: float) -> int:
    """Number of sides of a circle whose sagitta R (1 - cos(pi / n)) is at most 0.01 grain radii."""
    return math.ceil(math.pi / math.sqrt(2.0 * SAGITTA_RATIO * grain_radius_m / radius_m))


def box(size_m: tuple[float, float, float], **wall) -> Mesh:
    """Box of edges (x, y, z) about the origin."""
    x, y, z = (0.5 * positive(size, "edge of a box") for size in size_m)
    return prism([(-x, -y), (x, -y), (x, y), (-x, y)], 2.0 * z, **{"source": "box"} | wall)


def cylinder(radius_m: float, height_m: float, sides: int = 96, **wall) -> Mesh:
    """Cylinder with caps about the z axis, its centre at the origin."""
    return frustum(radius_m, radius_m, height_m, sides, **{"source": "cylinder"} | wall)


def cone(radius_m: float, height_m: float, sides: int = 96, **wall) -> Mesh:
    """Cone with a base, its axis along z, the tip at the origin and the base above it."""
    profile = [(0.0, 0.0), (positive(radius_m, "radius of a cone"), height_m), (0.0, height_m)]
    return revolved(profile, sides, **{"source": "cone"} | wall)


def frustum(bottom_radius_m: float, top_radius_m: float, height_m: float, sides: int = 96, **wall) -> Mesh:
    """Frustum of a cone with caps about the z axis, its centre at the origin."""
    half = 0.5 * positive(height_m, "height of a frustum")
    bottom, top = (positive(radius, "radius of a frustum") for radius in (bottom_radius_m, top_radius_m))
    return revolved([(0.0, -half), (bottom, -half), (top, half), (0.0, half)], sides, **{"source": "frustum"} | wall)


def tube(radius_m: float, height_m: float, sides: int = 96, **wall) -> Mesh:
    """Open tube without thickness about the z axis, its centre at the origin."""
    half, radius = 0.5 * positive(height_m, "height of a tube"), positive(radius_m, "radius of a tube")
    return revolved([(radius, -half), (radius, half)], sides, **{"source": "tube"} | wall)


def wheel(
    radius_m: float,
    width_m: float,
    grousers: int = 0,
    grouser_height_m: float = 0.0,
    grouser_thickness_m: float = 0.0,
    sides: int = 96,
    **wall,
) -> Mesh:
    """Wheel with its axle along y through the origin, and straight grousers of equal spacing on its rim.

    sides : of the rim without grousers; with them, of the arcs between them together.
    """
    require(grousers >= 0, "grousers", grousers, "zero or more")
    angles = 2.0 * np.pi * np.arange(sides) / sides
    outline = [(radius_m, angle) for angle in angles]
    if grousers:
        half = 0.5 * positive(grouser_thickness_m, "grouser_thickness_m")
        top = radius_m + positive(grouser_height_m, "grouser_height_m")
        foot, pitch = math.asin(half / radius_m), 2.0 * math.pi / grousers
        require(2.0 * foot < pitch, "grouser_thickness_m", grouser_thickness_m, f"less than {radius_m * pitch:.3g}, the pitch")
        crown, arcs = math.asin(half / top), max(1, round(sides / grousers))
        gaps = np.linspace(foot, pitch - foot, arcs + 1)
        one = [(top, -crown), (top, crown), *((radius_m, angle) for angle in gaps)]
        one_radius = [(top / math.cos(crown) if r == top else r, angle) for r, angle in one]
        outline = [(r, k * pitch + angle) for k in range(grousers) for r, angle in one_radius]
    points = [(r * math.cos(angle), r * math.sin(angle)) for r, angle in outline]
    made = prism(points, positive(width_m, "width_m"), **{"source": "wheel"} | wall)
    turned = made.vertices_m[:, [1, 2, 0]]  # the prism's axis z becomes y
    return Mesh(**{"source": "wheel"} | wall, vertices_m=turned, triangles=made.triangles)


def plate(polygon_m, thickness_m: float = 0.0, **wall) -> Mesh:
    """Plate of a simple polygon (n, 2) in the xy plane about z = 0; without thickness an open sheet."""
    if thickness_m > 0.0:
        return prism(polygon_m, thickness_m, **{"source": "plate"} | wall)
    points = counter_clockwise(polygon_m)
    vertices = np.column_stack([points, np.zeros(len(points))])
    return Mesh(**{"source": "plate"} | wall, vertices_m=vertices, triangles=np.array(ears(points)))


def prism(polygon_m, height_m: float, **wall) -> Mesh:
    """Prism over a simple polygon (n, 2) in the xy plane, its middle at z = 0."""
    points, half = counter_clockwise(polygon_m), 0.5 * positive(height_m, "height of a prism")
    n = len(points)
    vertices = np.concatenate([np.column_stack([points, np.full(n, z)]) for z in (-half, half)])
    caps = np.array(ears(points))
    following = np.roll(np.arange(n), -1)
    sides = [(k, following[k], n + k) for k in range(n)] + [(following[k], n + following[k], n + k) for k in range(n)]
    return Mesh(**{"source": "prism"} | wall, vertices_m=vertices, triangles=np.concatenate([caps[:, ::-1], caps + n, sides]))


def revolved(profile_m, sides: int, **wall) -> Mesh:
    """Surface of a profile (n, 2) of radius and height, turned about the z axis; from the bottom up, normals point outwards.

    Ends on the axis close the surface.
    """
    require(sides >= 3, "sides", sides, "at least 3")
    angles = 2.0 * np.pi * np.arange(sides) / sides
    rings = [[(r * math.cos(a), r * math.sin(a), z) for a in angles] if r else [(0.0, 0.0, z)] for r, z in profile_m]
    first = np.cumsum([0] + [len(ring) for ring in rings])
    triangles = []
    for k in range(len(rings) - 1):
        for s in range(sides):
            lower, upper = ([first[j] + (s + t) % sides if len(rings[j]) > 1 else first[j] for t in range(2)] for j in (k, k + 1))
            if lower[0] != lower[1]:
                triangles.append((lower[0], lower[1], upper[0]))
            if upper[0] != upper[1]:
                triangles.append((lower[1], upper[1], upper[0]))
    return Mesh(**{"source": "revolved profile"} | wall, vertices_m=np.concatenate(rings), triangles=np.array(triangles))


def positive(value: float, name: str) -> float:
    """The value, which must be positive and finite."""
    require(0 < value < math.inf, name, value, "a positive number")
    return value


def counter_clockwise(polygon_m) -> np.ndarray:
    """Corners (n, 2) of a polygon in counter-clockwise order."""
    points = np.asarray(polygon_m, float)
    sound = points.ndim == 2 and len(points) >= 3 and points.shape[1] == 2
    require(sound, "shape of polygon_m", points.shape, "corners (n, 2), three or more")
    return points if doubled_area(points) > 0 else points[::-1]


def doubled_area(points: np.ndarray) -> float:
    """Twice the area of a polygon (n, 2), positive counter-clockwise."""
    following = np.roll(points, -1, axis=0)
    return float((points[:, 0] * following[:, 1] - points[:, 1] * following[:, 0]).sum())


def ears(points: np.ndarray) -> list[tuple[int, int, int]]:
    """Triangles of a simple polygon (n, 2) in counter-clockwise order, by clipping ears (Meisters 1975, Am. Math. Mon. 82, 648)."""
    left, triangles = list(range(len(points))), []
    while len(left) > 3:
        for k in range(len(left)):
            a, b, c = left[k - 1], left[k], left[(k + 1) % len(left)]
            others = points[[p for p in left if p not in (a, b, c)]]
            if doubled_area(points[[a, b, c]]) > 0 and not any(within(points[[a, b, c]], others)):
                triangles.append((a, b, c))
                del left[k]
                break
        else:
            raise ValueError("polygon_m crosses itself or has corners on a line; allowed: a simple polygon.")
    return [*triangles, (left[0], left[1], left[2])]


def within(corners: np.ndarray, points: np.ndarray) -> np.ndarray:
    """True for points (n, 2) in or on a triangle (3, 2) in counter-clockwise order."""
    inside = np.ones(len(points), bool)
    for k in range(3):
        u, v = corners[(k + 1) % 3] - corners[k], points - corners[k]
        inside &= u[0] * v[:, 1] - u[1] * v[:, 0] >= 0
    return inside
