"""Pictures of cones of grains whose angle is known, for the reader of photographs."""

from dataclasses import dataclass

import numpy as np
from PIL import Image
from scipy.ndimage import gaussian_filter, map_coordinates

#: Width and height of a picture in pixels, and the row of the ground on which the cone stands, before the camera turns.
SIZE = (480, 360)
GROUND = 270.0
SAND, DARK, WHITE = (200, 170, 120), (60, 50, 45), (225, 225, 220)


@dataclass(frozen=True, kw_only=True)
class Scene:
    """A picture: angles in degrees, lengths in pixels, light and shadow from 0 to 1, noise in steps of 256; `clutter` things."""

    angle_deg: float = 30.0
    tilt_deg: float = 0.0
    half_width: float = 140.0
    grain_radius: float = 2.5
    heap: tuple = SAND
    wall: tuple = (90, 105, 125)
    plate: tuple = (60, 60, 66)
    side_light: float = 0.4
    shadow: float = 0.0
    clutter: int = 0
    blur: float = 0.7
    noise: float = 4.0
    seed: int = 1


def cone_grains(scene: Scene, rng) -> np.ndarray:
    """Spheres (n, 4: across, towards the camera, up, radius) that touch the cone from inside; its axis is at the origin."""
    slope = np.tan(np.radians(scene.angle_deg))
    r = scene.grain_radius
    height = scene.half_width * slope
    n = int(2.5 * scene.half_width**2 / np.cos(np.radians(scene.angle_deg)) / r**2)
    distance = scene.half_width * np.sqrt(rng.uniform(0.0, 1.0, n))
    azimuth = rng.uniform(0.0, 2.0 * np.pi, n)
    sunk = r / np.cos(np.radians(scene.angle_deg))
    up = height - distance * slope - sunk
    grains = np.column_stack([distance * np.cos(azimuth), distance * np.sin(azimuth), up, np.full(n, r)])
    return grains[up > r]


def paint_grains(colours: np.ndarray, grains: np.ndarray, scene: Scene, rng) -> np.ndarray:
    """Paint spheres seen along y, far ones first, lit from above and the left; returns the mask of what they cover."""
    covered = np.zeros(colours.shape[:2], dtype=bool)
    light = np.array([-scene.side_light, 0.5, 0.7])
    light /= np.linalg.norm(light)
    for x, y, z, r in grains[np.argsort(grains[:, 1])]:
        centre = np.array([0.5 * SIZE[0] + x, GROUND - z])
        first = np.floor(centre - r).astype(int)
        n = int(2 * r + 2)
        u = np.arange(first[0], first[0] + n)[None, :] - centre[0]
        v = centre[1] - np.arange(first[1], first[1] + n)[:, None]
        square = r**2 - u**2 - v**2
        inside = square > 0.0
        normal = np.stack(np.broadcast_arrays(u, np.sqrt(np.maximum(square, 0.0)), v), axis=-1) / r
        # neighbours shade a grain as they do the heap's surface
        flank = np.array([0.7 * x, 0.7 * max(y, 0.0), 0.7 * np.hypot(x, y)]) / max(np.hypot(x, y), r)
        shade = 0.45 + 0.75 * np.clip(0.5 * (normal + flank) @ light, 0.0, None)
        painted = np.array(scene.heap) * rng.uniform(0.7, 1.2) * shade[..., None]
        box = (slice(first[1], first[1] + n), slice(first[0], first[0] + n))
        colours[box][inside] = painted[inside]
        covered[box] |= inside
    return covered


def paint_background(scene: Scene, rng) -> np.ndarray:
    """Wall and plate; things on a bench stand before the wall if the scene is cluttered."""
    rows, columns = np.mgrid[: SIZE[1], : SIZE[0]]
    colours = np.where((rows < GROUND)[..., None], np.array(scene.wall, float), np.array(scene.plate, float))
    colours *= (1.0 + 0.15 * (columns - 0.5 * SIZE[0]) / SIZE[0])[..., None]
    for _ in range(scene.clutter):
        width, height = rng.integers(20, 90), rng.integers(30, 200)
        left = rng.integers(-20, SIZE[0])
        bottom = int(GROUND) - rng.integers(0, 40)
        colours[max(0, bottom - height) : bottom, max(0, left) : max(0, left + width)] = rng.uniform(30, 230, 3)
    if scene.clutter:
        colours = gaussian_filter(colours, (3.0, 3.0, 0.0))
    return colours


def cast_shadow(colours: np.ndarray, scene: Scene) -> None:
    """Darken the wall beside the cone and the plate before its foot: light from the left."""
    rows, columns = np.mgrid[: SIZE[1], : SIZE[0]]
    x, up = columns - 0.5 * SIZE[0], GROUND - rows
    slope = np.tan(np.radians(scene.angle_deg))
    on_wall = (up >= 0) & (up < 0.45 * slope * (scene.half_width - np.abs(x - 0.7 * scene.half_width)))
    on_plate = (up < 0) & ((x - 0.25 * scene.half_width) ** 2 / (1.15 * scene.half_width) ** 2 + up**2 / 35.0**2 < 1.0)
    dark = gaussian_filter((on_wall | on_plate).astype(float), 4.0)
    colours *= (1.0 - scene.shadow * dark)[..., None]


def turned(colours: np.ndarray, tilt_deg: float) -> np.ndarray:
    """Turn a picture so that its ground rises by `tilt_deg` to the right; the rim is filled with what is nearest."""
    rows, columns = np.mgrid[: SIZE[1], : SIZE[0]].astype(float)
    t = np.radians(tilt_deg)
    x, y = columns - 0.5 * SIZE[0], rows - 0.5 * SIZE[1]
    at = [0.5 * SIZE[1] + x * np.sin(t) + y * np.cos(t), 0.5 * SIZE[0] + x * np.cos(t) - y * np.sin(t)]
    return np.stack([map_coordinates(colours[..., k], at, order=1, mode="nearest") for k in range(3)], axis=-1)


def photograph(scene: Scene, grains: np.ndarray | None = None) -> Image.Image:
    """A picture of a scene; grains (n, 4) in pixels take the cone's place if given."""
    rng = np.random.default_rng(scene.seed)
    colours = paint_background(scene, rng)
    if scene.shadow:
        cast_shadow(colours, scene)
    paint_grains(colours, cone_grains(scene, rng) if grains is None else grains, scene, rng)
    colours = gaussian_filter(turned(colours, scene.tilt_deg), (scene.blur, scene.blur, 0.0))
    colours += rng.normal(0.0, scene.noise, colours.shape)
    return Image.fromarray(np.clip(np.rint(colours), 0, 255).astype(np.uint8))
