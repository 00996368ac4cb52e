"""Factories: number, time, place and sizes of grains to be made (EDEM's notion)."""

import math
from dataclasses import dataclass, field

import numpy as np

from dem.clumps.mix import Shape
from dem.clumps.records import random_orientations
from dem.material import require, require_vector

#: Spacing of the layers in mean diameters of the largest grain: close, so that filling needs few steps, yet without contact.
SPACING_RATIO = 1.125
#: Random displacement in largest radii, less than half of the free space between neighbours.
JITTER_RATIO = 0.1


#: Distributions of the radii that a standard deviation describes.
DISTRIBUTIONS = ("normal", "log_normal")
#: Both are cut off at this number of standard deviations, of the radius or of its logarithm.
CUT_OFF = 2.0
#: Largest over smallest radius of the classes: the number of grains goes with its cube.
WIDEST_RATIO = 10.0


@dataclass(frozen=True, kw_only=True)
class Sizes:
    """Grain radii.

    mean_m : mean radius of all grains. sd_ratio : standard deviation over mean of the distribution before it is cut off (0: all
    equal). classes : in place of a distribution, pairs of a radius (in any unit: their mean is mean_m) and the share of the grains'
    mass that has it, as sieves give it.
    """

    mean_m: float
    sd_ratio: float = 0.0
    distribution: str = "normal"
    classes: tuple[tuple[float, float], ...] = ()

    def __post_init__(self):
        require(0 < self.mean_m < math.inf, "mean radius", self.mean_m, "a positive number")
        require(0 <= self.sd_ratio <= 0.4, "radius_sd_ratio", self.sd_ratio, "from 0 to 0.4")
        require(self.distribution in DISTRIBUTIONS, "distribution of radii", self.distribution, " or ".join(DISTRIBUTIONS))
        object.__setattr__(self, "classes", tuple((float(radius), float(mass)) for radius, mass in self.classes))
        if not self.classes:
            return
        require(self.sd_ratio == 0.0, "radius_sd_ratio", self.sd_ratio, "0 with classes of radii")
        radii, masses = zip(*self.classes, strict=True)
        require(all(0 < x < math.inf for x in (*radii, *masses)), "classes of radii", self.classes, "positive radii and shares")
        widest = max(radii) / min(radii)
        require(widest <= WIDEST_RATIO, "largest over smallest radius", f"{widest:.3g}", f"at most {WIDEST_RATIO:g}")

    @property
    def smallest_m(self) -> float:
        """Radius of the smallest grain that can occur."""
        return self.mean_m * self._ends()[0]

    @property
    def largest_m(self) -> float:
        """Radius of the largest grain that can occur."""
        return self.mean_m * self._ends()[1]

    @property
    def volume_ratio(self) -> float:
        """Mean volume of the grains over that of a grain of the mean radius; of a normal distribution as if it were not cut off."""
        if self.classes:
            ratios, shares = self._numbers()
            return float(shares @ ratios**3)
        if self.distribution == "log_normal":
            return self._log_moment(3.0) / self._log_moment(1.0) ** 3
        return 1.0 + 3.0 * self.sd_ratio**2

    def draw(self, n: int, rng: np.random.Generator) -> np.ndarray:
        """Radii of n grains in m, shape (n,)."""
        if self.classes:
            ratios, shares = self._numbers()
            ends = np.rint(n * np.cumsum(shares)).astype(int)  # exact shares, as random ones would differ in mass
            return self.mean_m * rng.permutation(np.repeat(ratios, np.diff(ends, prepend=0)))
        if self.sd_ratio == 0.0:
            return np.full(n, self.mean_m)
        deviations = rng.standard_normal(4 * n + 64)
        deviations = deviations[np.abs(deviations) <= CUT_OFF][:n]
        if self.distribution == "log_normal":
            return self.mean_m * np.exp(self._log_sd() * deviations) / self._log_moment(1.0)
        return self.mean_m * (1.0 + self.sd_ratio * deviations)

    def _ends(self) -> tuple[float, float]:
        """Smallest and largest radius over the mean."""
        if self.classes:
            ratios, _ = self._numbers()
            return float(ratios.min()), float(ratios.max())
        if self.distribution == "log_normal":
            reach, mean = CUT_OFF * self._log_sd(), self._log_moment(1.0)
            return math.exp(-reach) / mean, math.exp(reach) / mean
        return 1.0 - CUT_OFF * self.sd_ratio, 1.0 + CUT_OFF * self.sd_ratio

    def _numbers(self) -> tuple[np.ndarray, np.ndarray]:
        """Radii of the classes over their mean (k,), ascending, and the share of the grains' number in each (k,)."""
        radii, masses = np.array(sorted(self.classes)).T
        shares = masses / radii**3
        shares /= shares.sum()
        return radii / (shares @ radii), shares

    def _log_sd(self) -> float:
        """Standard deviation of the logarithm of a log-normal radius."""
        return math.sqrt(math.log(1.0 + self.sd_ratio**2))

    def _log_moment(self, power: float) -> float:
        """Mean of exp(power s z) for normal z cut off at CUT_OFF, s the deviation of the logarithm."""
        s = power * self._log_sd()

        def below(x: float) -> float:
            return 0.5 * (1.0 + math.erf(x / math.sqrt(2.0)))

        return math.exp(0.5 * s**2) * (below(CUT_OFF - s) - below(-CUT_OFF - s)) / (below(CUT_OFF) - below(-CUT_OFF))


@dataclass(frozen=True, kw_only=True)
class TubeRegion:
    """Upright cylinder around centre_m (x, y), filled from bottom_m upwards."""

    radius_m: float
    bottom_m: float
    centre_m: tuple[float, float] = (0.0, 0.0)

    def __post_init__(self):
        require(0 < self.radius_m < math.inf, "radius_m of a region", self.radius_m, "a positive number")
        require(math.isfinite(self.bottom_m), "bottom_m of a region", self.bottom_m, "a finite number")
        require_vector(self.centre_m, 2, "centre_m of a region")

    def layer(self, spacing, margin, rng) -> np.ndarray:
        """Horizontal positions (k, 2) of one layer: a square lattice, turned and shifted at random."""
        half = math.ceil(self.radius_m / spacing) + 2
        axis = np.arange(-half, half + 1) * spacing
        points = np.stack(np.meshgrid(axis, axis), axis=-1).reshape(-1, 2)
        angle = rng.uniform(0.0, 2.0 * np.pi)
        turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
        points = points @ turn + rng.uniform(-0.5 * spacing, 0.5 * spacing, 2)
        return points[np.hypot(*points.T) < self.radius_m - margin] + self.centre_m


@dataclass(frozen=True, kw_only=True)
class BoxRegion:
    """Upright box from low_m to high_m (x, y), filled from bottom_m upwards; periodic_x, periodic_y: grains may wrap there."""

    low_m: tuple[float, float]
    high_m: tuple[float, float]
    bottom_m: float
    periodic_x: bool = False
    periodic_y: bool = False

    def __post_init__(self):
        require_vector(self.low_m, 2, "low_m of a region")
        require_vector(self.high_m, 2, "high_m of a region")
        require(math.isfinite(self.bottom_m), "bottom_m of a region", self.bottom_m, "a finite number")

    def layer(self, spacing, margin, rng) -> np.ndarray:
        """Horizontal positions (k, 2) of one layer: a square lattice stretched to fill the box, shifted at random."""
        sides = zip(self.low_m, self.high_m, (self.periodic_x, self.periodic_y), strict=True)
        x, y = (row(low, high, spacing, margin, rng if periodic else None) for low, high, periodic in sides)
        return np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)


def drawn_kinds(shape: Shape | None, n: int, seed: int) -> np.ndarray:
    """Kinds (n,) of n grains of a shape, see `dem.Mix.draw`."""
    return np.zeros(n, np.int64) if shape is None else shape.draw(n, np.random.default_rng((seed, 2)))


def row(low: float, high: float, spacing: float, margin: float, rng) -> np.ndarray:
    """Evenly spaced positions (k,) from low to high: at a distance from both ends, or, with rng, periodic and shifted at random."""
    if rng is None:
        return np.linspace(low + margin, high - margin, max(1, int((high - low - 2.0 * margin) / spacing) + 1))
    n = max(1, int((high - low) / spacing))
    return low + (np.arange(n) + rng.uniform()) * (high - low) / n


@dataclass(frozen=True, kw_only=True)
class Factory:
    """Makes n_grains of a material at time_s, in layers from the bottom of a region, without contacts.

    seed makes it reproducible; velocity_m_s is what the grains start with, and velocity_sd_m_s the standard deviation of what is
    added to each component at random: layers that fall as such come to rest as layers of different density. shape : None for
    spheres, the prototype of clumps, or a mix of them in random order; sizes are then radii of spheres of equal volume, and
    orientations are random.
    """

    n_grains: int
    region: TubeRegion | BoxRegion
    sizes: Sizes
    material: str
    seed: int
    time_s: float = 0.0
    velocity_m_s: tuple[float, float, float] = field(default=(0.0, 0.0, 0.0))
    velocity_sd_m_s: float = 0.0
    shape: Shape | None = None

    def __post_init__(self):
        require(self.n_grains > 0, "n_grains", self.n_grains, "at least 1")
        require(math.isfinite(self.time_s), "time_s of a factory", self.time_s, "a finite number")
        require_vector(self.velocity_m_s, 3, "velocity_m_s of a factory")
        require(0.0 <= self.velocity_sd_m_s < math.inf, "velocity_sd_m_s of a factory", self.velocity_sd_m_s, "zero or positive")

    @property
    def smallest_m(self) -> float:
        """Radius of the smallest sphere that can occur."""
        return self.sizes.smallest_m * (1.0 if self.shape is None else self.shape.smallest_ratio)

    def kinds(self) -> np.ndarray:
        """Index of the shape of every grain (n,), 0 unless shapes are mixed."""
        return drawn_kinds(self.shape, self.n_grains, self.seed)

    def orientations(self) -> np.ndarray:
        """Random quaternions (n, 4), see `dem.clumps.records`."""
        return random_orientations(self.n_grains, np.random.default_rng((self.seed, 1)))

    def velocities(self) -> np.ndarray:
        """Velocities (n, 3) in m/s of all grains."""
        random = np.random.default_rng((self.seed, 3)).standard_normal((self.n_grains, 3))
        return np.asarray(self.velocity_m_s) + self.velocity_sd_m_s * random

    def make(self) -> tuple[np.ndarray, np.ndarray]:
        """Positions (n, 3) and radii (n,) in m; of clumps those of their centres, and of equal volume.

        Raises ValueError when not a single grain fits into a layer.
        """
        rng = np.random.default_rng(self.seed)
        radii = self.sizes.draw(self.n_grains, rng)
        r = self.sizes.largest_m * (1.0 if self.shape is None else self.shape.bounding_ratio)
        spacing, jitter = 2.0 * SPACING_RATIO * r, JITTER_RATIO * r
        layers, n, z = [], 0, self.region.bottom_m + r + 2.0 * jitter
        while n < self.n_grains:
            plane = self.region.layer(spacing, r + 1.5 * jitter, rng)
            require(len(plane) > 0, "region of a factory", self.region, "space for at least one grain")
            rng.shuffle(plane)
            shift = rng.uniform(-jitter, jitter, (len(plane), 3))
            layers.append(np.column_stack([plane, np.full(len(plane), z)]) + shift)
            n += len(plane)
            z += spacing
        return np.concatenate(layers)[: self.n_grains], radii
