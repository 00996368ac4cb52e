"""The virtual soil that both experiments test: one grain material, and the geometry it touches."""

import math
from dataclasses import asdict, dataclass
from typing import Any

from dem import Interaction, Material, Rich, Simulation, Sizes, work_of_adhesion


@dataclass(frozen=True, kw_only=True)
class Soil(Rich):
    """Grain parameters of the paper's Table 2, the distribution of the radii (`dem.Sizes`), adhesion. Units are in the names.

    adhesive_stress_pa : pull-off force of two mean grains over d^2. Strength scales with it whatever the radius, so it stands for
    a surface energy, which for the same cohesion would grow with r.
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

    @property
    def sizes(self) -> Sizes:
        """Distribution of the radii."""
        return Sizes(mean_m=self.radius_m, sd_ratio=self.radius_sd_ratio, distribution=self.distribution, classes=self.classes)

    @property
    def grain_volume_m3(self) -> float:
        """Mean volume of a grain."""
        return 4.0 / 3.0 * math.pi * self.radius_m**3 * self.sizes.volume_ratio

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
        return work_of_adhesion(adhesion, pull_off_n, 0.5 * self.radius_m)

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


@dataclass(frozen=True, kw_only=True)
class Engine(Rich):
    """Numerical settings common to all experiments; the names are those of `dem.Simulation`.

    adhesion : law of soils that have an adhesive stress; the others have none.
    """

    rolling_model: str = "type_a"
    damping_model: str = "edem"
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
