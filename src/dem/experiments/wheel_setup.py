"""Wheel and test: its shape, what is done to it, and what is refused and warned of. `wheel` has the signs."""

import math
from dataclasses import dataclass, replace

import numpy as np

from dem import Mesh, Rich, solids
from dem.experiments.checks import require
from dem.experiments.soil import Soil
from dem.experiments.soil_bed import TOOL_MATERIAL, SoilBed

#: Radius and width of the wheel in mean grain diameters: refused below the first, warned of below the second.
RADIUS_DIAMETERS, WIDTH_DIAMETERS = (5.0, 14.0), (3.0, 12.0)
#: Height of grousers in mean grain diameters that is warned of.
GROUSER_DIAMETERS = 2.0
#: Least bed: length over the outer radius, width over the wheel's, depth over the radius.
LENGTH_RADII, WIDTH_WIDTHS, DEPTH_RADII = 4.0, 2.0, 0.5
#: Rut that the wheel must not reach again, in radii: the length under the wheel.
RUT_RADII = 2.0
#: Warned of: E* over the mean pressure W / (1.2 R b) below the first, inertial number of the slip above the second, v^2 / (g R)
#: above the third.
STIFFNESS_NUMBER, INERTIAL_NUMBER, FROUDE = 2000.0, 5e-3, 0.02
#: Depth over which the slip shears the soil, in mean grain diameters, for the inertial number.
SHEAR_DIAMETERS = 10.0

HELD = ("travel", "rim", "free")
RIMS = ("smooth", "sandpaper")


@dataclass(frozen=True, kw_only=True)
class WheelShape(Rich):
    """Wheel with its axle along y: radius of the rim, width, straight grousers; or a mesh (see `of_mesh`), with the same radius.

    rim: "smooth", or "sandpaper": a layer of the soil's grains of mean radius, glued to a drum, with their tops at radius_m.
    """

    radius_m: float
    width_m: float
    grousers: int = 0
    grouser_height_m: float = 0.0
    grouser_thickness_m: float = 0.0
    mesh: Mesh | None = None
    rim: str = "smooth"

    def __post_init__(self):
        require(self.rim in RIMS, "rim of the wheel", repr(self.rim), f"one of {list(RIMS)}")
        plain = self.rim == "smooth" or (self.mesh is None and not self.grousers)
        require(plain, "rim of the wheel", repr(self.rim), "'smooth' with grousers or a mesh")
        for name in ("radius_m", "width_m"):
            value = getattr(self, name)
            require(0.0 < value < math.inf, f"{name} of the wheel", value, "a positive number")
        require(self.grousers >= 0, "grousers of the wheel", self.grousers, "zero or more")
        for name in ("grouser_height_m", "grouser_thickness_m") if self.grousers else ():
            value = getattr(self, name)
            require(0.0 < value < math.inf, f"{name} of the wheel", value, "a positive number, with grousers")

    @classmethod
    def of_mesh(cls, mesh: Mesh, axis: str = "y", radius_m: float | None = None) -> "WheelShape":
        """The wheel of a mesh (`dem.read_mesh`) whose axle is `axis` of its frame, through the origin.

        radius_m : of the rim, to which the slip refers; by default the largest distance from the axle, grousers included.
        """
        require(axis in ("x", "y", "z"), "axis of the wheel's mesh", repr(axis), "'x', 'y' or 'z'")
        turned = np.roll(mesh.vertices_m, 1 - "xyz".index(axis), axis=1)
        shape = replace(mesh, vertices_m=turned, position_m=(0.0, 0.0, 0.0), orientation=(1.0, 0.0, 0.0, 0.0))
        outer = float(np.hypot(turned[:, 0], turned[:, 2]).max())
        middle = np.abs(0.5 * (turned.max(axis=0) + turned.min(axis=0))[[0, 2]]).max()
        found = f"{middle:.4g} m beside the middle of {mesh.source}"
        require(middle < 0.05 * outer, f"axle of the wheel (axis {axis})", found, "the middle, to 5 % of the radius")
        radius = outer if radius_m is None else radius_m
        require(radius <= outer * (1.0 + 1e-9), "radius_m of the wheel", radius, f"at most {outer:.4g}, that of {mesh.source}")
        return cls(radius_m=radius, width_m=float(np.ptp(turned[:, 1])), mesh=shape)

    @property
    def outer_radius_m(self) -> float:
        """Radius of the tips of the grousers."""
        if self.mesh is not None:
            return float(np.hypot(self.mesh.vertices_m[:, 0], self.mesh.vertices_m[:, 2]).max())
        if not self.grousers:
            return self.radius_m
        top = self.radius_m + self.grouser_height_m
        return top / math.cos(math.asin(0.5 * self.grouser_thickness_m / top))  # the tips are flat, see `dem.solids.wheel`

    def surface(self, smallest_m: float, position_m: tuple[float, float, float], lining_m: float = 0.0) -> Mesh:
        """The wheel's surface at a place; the rim is a polygon that a grain of the smallest radius does not feel.

        lining_m : thickness of what is glued to the rim.
        """
        if self.mesh is not None:
            return replace(self.mesh, position_m=position_m)
        sides = solids.sides_for(self.radius_m, smallest_m)
        grousers = (self.grousers, self.grouser_height_m, self.grouser_thickness_m)
        return solids.wheel(self.radius_m - lining_m, self.width_m, *grousers, sides, position_m=position_m)

    def lining(self, grain_radius_m: float) -> np.ndarray:
        """Centres (n, 3) from the axle's middle of the grains that cover the rim, in rows that touch, every other shifted."""
        at = self.radius_m - grain_radius_m
        n_around = math.floor(math.pi / math.asin(grain_radius_m / at))
        n_across = math.floor(0.5 * self.width_m / grain_radius_m * (1.0 + 1e-9))
        across, around = np.meshgrid(np.arange(n_across), np.arange(n_around), indexing="ij")
        angles = 2.0 * np.pi * (around + 0.5 * (across % 2)) / n_around
        y = 2.0 * grain_radius_m * (across - 0.5 * (n_across - 1))
        return np.stack([at * np.cos(angles), y, at * np.sin(angles)], axis=-1).reshape(-1, 3)


@dataclass(frozen=True, kw_only=True)
class WheelTest(Rich):
    """What is done to the wheel.

    load_n: on the axle, the wheel's weight included; its inertia is load / gravity unless mass_kg is given.
    held: "travel": speed_m_s is the axle's, the rim's follows from the slip; "rim": speed_m_s is the rim's, the axle's follows from
    the slip; "free": speed_m_s is the rim's, and the axle travels as it can against drawbar_load_n (no slip is given then).
    travel_ratio: travel in radii; of a free wheel, travel of the rim. wheel_static_friction, wheel_rolling_friction: of grains on
    the wheel, to which they do not stick; without the second they roll on it as on each other.
    """

    load_n: float
    slip: float | None = None
    held: str = "travel"
    speed_m_s: float = 0.1
    drawbar_load_n: float = 0.0
    travel_ratio: float = 2.2
    wheel_static_friction: float = 0.5
    wheel_rolling_friction: float | None = None
    mass_kg: float | None = None

    def __post_init__(self):
        require(self.held in HELD, "held of the wheel", repr(self.held), f"one of {list(HELD)}")
        for name in ("load_n", "speed_m_s", "travel_ratio"):
            value = getattr(self, name)
            require(0.0 < value < math.inf, f"{name} of the wheel", value, "a positive number")
        require(self.mass_kg is None or 0.0 < self.mass_kg < math.inf, "mass_kg of the wheel", self.mass_kg, "a positive number")
        for name in ("wheel_static_friction", "wheel_rolling_friction"):
            mu = getattr(self, name)
            require(mu is None or 0.0 <= mu < math.inf, name, mu, "zero or positive")
        require(math.isfinite(self.drawbar_load_n), "drawbar_load_n", self.drawbar_load_n, "a finite number")
        if self.held == "free":
            require(self.slip is None, "slip of the wheel", self.slip, "none where held is 'free'")
            return
        require(self.drawbar_load_n == 0.0, "drawbar_load_n", self.drawbar_load_n, "0 unless held is 'free'")
        sound = self.slip is not None and -1.0 <= self.slip < 1.0 and not (self.held == "rim" and self.slip == -1.0)
        allowed = "from -1 (locked) to below 1" + (", -1 excluded where the rim's speed is held" if self.held == "rim" else "")
        require(sound, "slip of the wheel", self.slip, allowed)

    def speeds(self) -> tuple[float, float]:
        """Speed of the axle and of the rim in m/s; of a free wheel at the beginning."""
        s = 0.0 if self.slip is None else self.slip
        ratio = 1.0 / (1.0 - s) if s >= 0.0 else 1.0 + s  # rim over axle
        return (self.speed_m_s, self.speed_m_s * ratio) if self.held == "travel" else (self.speed_m_s / ratio, self.speed_m_s)

    def duration_s(self, radius_m: float) -> float:
        """Duration of the travel."""
        axle, rim = self.speeds()
        return self.travel_ratio * radius_m / (rim if self.held == "free" else axle)


def check(bed: SoilBed, soil: Soil, shape: WheelShape, test: WheelTest) -> None:
    """Raise ValueError, naming the size, if the grains are too large for the wheel or the wheel for the bed."""
    d, setup, outer = 2.0 * soil.radius_m, bed.setup, shape.outer_radius_m
    spheres = shape.rim == "smooth" or soil.shape is None
    require(spheres, "rim of the wheel", repr(shape.rim), "'smooth' in a soil of clumps")
    for name, size, (least, _) in (("radius_m", shape.radius_m, RADIUS_DIAMETERS), ("width_m", shape.width_m, WIDTH_DIAMETERS)):
        found = f"{size:.4g} m, {size / d:.3g} grain diameters"
        require(size >= least * d * (1.0 - 1e-9), f"{name} of the wheel", found, f"at least {least:g}: smaller grains")
    for name, size, least in (
        ("length_m", setup.length_m, LENGTH_RADII * outer),
        ("width_m", setup.width_m, WIDTH_WIDTHS * shape.width_m),
        ("depth_m", setup.depth_m, DEPTH_RADII * shape.radius_m),
    ):
        require(size >= least * (1.0 - 1e-9), f"{name} of the bed", size, f"at least {least:.4g} for this wheel")
    travel = test.travel_ratio * shape.radius_m
    free_m = setup.length_m - RUT_RADII * outer
    allowed = f"at most {free_m / shape.radius_m:.3g}: the periodic bed would bring the wheel to its own rut"
    require(travel <= free_m * (1.0 + 1e-9), "travel_ratio of the wheel", test.travel_ratio, allowed)


def warnings_of(bed: SoilBed, soil: Soil, shape: WheelShape, test: WheelTest) -> list[str]:
    """Warnings of a test that is coarse, too soft or too fast."""
    return coarse(soil, shape) + hasty(bed, soil, shape, test)


def coarse(soil: Soil, shape: WheelShape) -> list[str]:
    """Warnings of a wheel that is coarse beside its grains."""
    d, height = 2.0 * soil.radius_m, shape.grouser_height_m
    sizes = [("radius", shape.radius_m, RADIUS_DIAMETERS[1]), ("width", shape.width_m, WIDTH_DIAMETERS[1])]
    sizes += [("height of the grousers", height, GROUSER_DIAMETERS)] if shape.grousers else []
    return [
        f"{name} of the wheel is {size / d:.3g} grain diameters; results depend on the grain size below {least:g}"
        for name, size, least in sizes
        if size < least * d * (1.0 - 1e-9)
    ]


def hasty(bed: SoilBed, soil: Soil, shape: WheelShape, test: WheelTest) -> list[str]:
    """Warnings of grains that are too soft for the load, and of a test that is too fast to be quasi-static."""
    material, g = bed.simulation.materials[TOOL_MATERIAL], -bed.simulation.gravity_m_s2[2]
    pressure = test.load_n / (1.2 * shape.radius_m * shape.width_m)
    axle, rim = test.speeds()
    numbers = (
        ("stiffness E*/p", -material.shear_modulus_pa / (1.0 - material.poisson_ratio) / pressure, -STIFFNESS_NUMBER, "softness"),
        ("inertial number", abs(rim - axle) / SHEAR_DIAMETERS * math.sqrt(soil.density_kg_m3 / pressure), INERTIAL_NUMBER, "speed"),
        ("v^2/(g R)", axle**2 / (g * shape.radius_m), FROUDE, "speed"),
    )
    return [
        f"{name} under the wheel is {abs(value):.3g}; results depend on the {why} {'above' if most > 0 else 'below'} {abs(most):g}"
        for name, value, most, why in numbers
        if value > most * (1.0 + 1e-9)
    ]
