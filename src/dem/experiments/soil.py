"""The virtual soil that both experiments test: one grain material, and the geometry it touches."""

import math
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from dem import (
    BoxRegion,
    Clump,
    Factory,
    Grains,
    Interaction,
    Material,
    Mix,
    Rich,
    Simulation,
    Sizes,
    TubeRegion,
    drawn_kinds,
    work_of_adhesion,
)


@dataclass(frozen=True, kw_only=True)
class Soil(Rich):
    """Grain parameters of the paper's Table 2, distribution of the radii (`dem.Sizes`), adhesion, shape. Units are in the names.

    adhesive_stress_pa : pull-off force of two mean grains over d^2. Strength scales with it whatever the radius, so it stands for
    a surface energy, which for the same cohesion would grow with r.
    shape : prototype of clumps, a mix of them, or None for spheres (and for clumps of one). Radii, in geometry and protocol of the
    tests too, are then those of the spheres of equal volume, and grains are whole clumps. d of the adhesive stress is the diameter
    of equal volume, since a plane cuts one grain on about d^2 whatever its shape; the force is that of one contact, between two
    spheres of the shape's mean radius. Grains that touch at two spheres hold with twice that.
    """

    radius_m: float
    density_kg_m3: float
    poisson_ratio: float
    shear_modulus_pa: float
    static_friction: float
    rolling_friction: float
    restitution: float
    adhesive_stress_pa: float = 0.0
    radius_sd_ratio: float = 0.0
    distribution: str = "normal"
    classes: tuple[tuple[float, float], ...] = ()
    shape: Clump | Mix | None = None

    def __post_init__(self):
        if self.shape is not None and self.shape.n_spheres == 1:
            object.__setattr__(self, "shape", None)
        elif isinstance(self.shape, Mix) and len(self.shape.shapes) == 1:
            object.__setattr__(self, "shape", self.shape.shapes[0])

    @property
    def sizes(self) -> Sizes:
        """Distribution of the radii."""
        return Sizes(mean_m=self.radius_m, sd_ratio=self.radius_sd_ratio, distribution=self.distribution, classes=self.classes)

    @property
    def grain_volume_m3(self) -> float:
        """Mean volume of a grain."""
        return 4.0 / 3.0 * math.pi * self.radius_m**3 * self.sizes.volume_ratio

    @property
    def n_spheres(self) -> float:
        """Number of spheres of a grain, of a mix the mean."""
        return 1 if self.shape is None else self.shape.n_spheres

    @property
    def smallest_sphere_m(self) -> float:
        """Radius of the smallest sphere that can occur, which sets the time step."""
        return self.sizes.smallest_m * (1.0 if self.shape is None else self.shape.smallest_ratio)

    @property
    def bounding_ratio(self) -> float:
        """Radius of the sphere around a grain over that of the sphere of equal volume."""
        return 1.0 if self.shape is None else self.shape.bounding_ratio

    @property
    def contact_radius_m(self) -> float:
        """Mean radius of the spheres of mean grains, the one of their contacts."""
        return self.radius_m * (1.0 if self.shape is None else self.shape.mean_ratio)

    @property
    def pressed_ratio(self) -> float:
        """Stress on the smallest sphere of a grain over that on the grain, at the same force: the square of the radii's ratio."""
        return 1.0 if self.shape is None else self.shape.smallest_ratio**-2

    def factory(self, n_grains: int, region: BoxRegion | TubeRegion, seed: int, velocity_sd_m_s: float = 0.0) -> Factory:
        """Factory of n grains of this soil, material "soil"."""
        return Factory(
            n_grains=n_grains,
            region=region,
            sizes=self.sizes,
            material="soil",
            seed=seed,
            velocity_sd_m_s=velocity_sd_m_s,
            shape=self.shape,
        )

    def kinds(self, n_grains: int, seed: int) -> np.ndarray:
        """Index of the shape of each of n grains (n,), as a factory draws them; 0 unless shapes are mixed."""
        return drawn_kinds(self.shape, n_grains, seed)

    def owners(self, spheres: Grains) -> np.ndarray:
        """Number (n,) of the whole grain, as `wholes` lists them, of every sphere that a simulation lists."""
        if self.shape is None:
            return np.arange(len(spheres))
        if isinstance(self.shape, Clump):
            return np.arange(len(spheres)) // self.shape.n_spheres
        return np.unique(spheres.wholes, return_inverse=True)[1]

    def wholes(self, spheres: Grains) -> Grains:
        """The grains whose spheres a simulation lists: of clumps their centres of mass, velocities and radii of equal volume.

        spheres : as in `Simulation.grains`, clump by clump; spheres that are grains come back as they are.
        """
        if self.shape is None:
            return spheres
        if isinstance(self.shape, Mix):
            return mixed_wholes(self.shape, spheres)
        n, share = self.shape.n_spheres, centre_shares(self.shape)
        positions, velocities = (
            np.einsum("k,bkt->bt", share, values.reshape(-1, n, 3)) for values in (spheres.positions_m, spheres.velocities_m_s)
        )
        radii = spheres.radii_m[::n] / self.shape.spheres[0][3]
        return Grains(positions, velocities, spheres.angular_velocities_rad_s[::n], radii)

    def softened(self, stiffness_reduction: float) -> Material:
        """The grains' material with its shear modulus divided by a number (1: as it is)."""
        return Material(
            density_kg_m3=self.density_kg_m3,
            poisson_ratio=self.poisson_ratio,
            shear_modulus_pa=self.shear_modulus_pa / stiffness_reduction,
        )

    def work_of_adhesion_j_m2(self, adhesion: str) -> float:
        """Work of adhesion of two grains under a law ("none": 0), so that two mean grains have the pull-off force sigma_a d^2."""
        pull_off_n = self.adhesive_stress_pa * (2.0 * self.radius_m) ** 2
        return work_of_adhesion(adhesion, pull_off_n, 0.5 * self.contact_radius_m)

    def interaction(
        self, static_friction: float | None = None, rolling_friction: float | None = None, adhesion: str = "none"
    ) -> Interaction:
        """Grain on grain; with numbers given, grain on a geometry of that friction. adhesion : its law; grains stick by it."""
        return Interaction(
            restitution=self.restitution,
            static_friction=self.static_friction if static_friction is None else static_friction,
            rolling_friction=self.rolling_friction if rolling_friction is None else rolling_friction,
            work_of_adhesion_j_m2=self.work_of_adhesion_j_m2(adhesion),
        )

    def prepared(self, ratio: float, adhesion: str = "none") -> Interaction:
        """Grain on grain with both frictions multiplied by a ratio, as while a specimen is prepared."""
        return self.interaction(ratio * self.static_friction, ratio * self.rolling_friction, adhesion)

    @property
    def contact_stress_pa(self) -> float:
        """Stress in Pa with which adhesion presses grains together: F_c / (pi r^2), as an external stress would."""
        return 4.0 / math.pi * self.adhesive_stress_pa


def mixed_wholes(mix: Mix, spheres: Grains) -> Grains:
    """As `Soil.wholes`, for grains of several shapes."""
    first = np.flatnonzero(np.diff(spheres.wholes, prepend=-1))
    kinds = spheres.kinds[first]
    shares = [centre_shares(shape) for shape in mix.shapes]
    share = np.concatenate([np.zeros(0), *(shares[kind] for kind in kinds)])[:, None]
    positions, velocities = (np.add.reduceat(share * values, first) for values in (spheres.positions_m, spheres.velocities_m_s))
    radii = spheres.radii_m[first] / np.array([shape.spheres[0][3] for shape in mix.shapes])[kinds]
    return Grains(positions, velocities, spheres.angular_velocities_rad_s[first], radii, spheres.wholes[first], kinds)


def centre_shares(shape: Clump) -> np.ndarray:
    """Shares (n,) of the places of a clump's spheres, of sum 1, that add up to its centre of mass, whatever its orientation."""
    spheres = np.array(shape.spheres)
    equations = np.vstack([spheres[:, :3].T, np.ones(len(spheres))])
    return np.linalg.lstsq(equations, np.array([0.0, 0.0, 0.0, 1.0]), rcond=None)[0]


@dataclass(frozen=True, kw_only=True)
class Engine(Rich):
    """Numerical settings common to all experiments; the names are those of `dem.Simulation`.

    adhesion : law of soils that have an adhesive stress; the others have none.
    """

    rolling_model: str = "type_a"
    damping_model: str = "edem"
    tangential_model: str = "edem"
    adhesion: str = "constant"
    precision: str = "float32"
    vector_code: bool = True
    energy_ledger: bool = False
    gravity_m_s2: float = 9.81
    time_step_rayleigh_ratio: float = 0.2
    stiffness_reduction: float = 1.0

    def options(self, soil: Soil) -> dict[str, Any]:
        """All settings as keyword arguments of `dem.Simulation`; `stiffness_reduction` is not one, it changes the material."""
        values = asdict(self)
        del values["stiffness_reduction"]
        adhesion = self.adhesion if soil.adhesive_stress_pa > 0.0 else "none"
        return values | {"adhesion": adhesion, "gravity_m_s2": (0.0, 0.0, -self.gravity_m_s2)}


def energy_balance(simulation: Simulation, engine: Engine) -> dict[str, float]:
    """Energy that a test dissipated in J, and the ledger's residual over it; NaN without a ledger."""
    if not engine.energy_ledger:
        return {"energy_dissipated_j": math.nan, "energy_residual_ratio": math.nan}
    energies = simulation.energies_j
    return {"energy_dissipated_j": energies["dissipated"], "energy_residual_ratio": energies["residual"] / energies["dissipated"]}
