"""The virtual soil that both experiments test: one grain material, and the geometry it touches."""

import math
from dataclasses import asdict, dataclass
from typing import Any

from dem import Interaction, Material, Rich, Simulation, Sizes


@dataclass(frozen=True, kw_only=True)
class Soil(Rich):
    """Grain parameters of the paper's Table 2, plus the distribution of the radii (`dem.Sizes`). Units are in the names."""

    radius_m: float
    density_kg_m3: float
    poisson_ratio: float
    shear_modulus_pa: float
    static_friction: float
    rolling_friction: float
    restitution: float
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

    def interaction(self, static_friction: float | None = None, rolling_friction: float | None = None) -> Interaction:
        """Grain on grain; with numbers given, grain on a geometry of that friction."""
        return Interaction(
            restitution=self.restitution,
            static_friction=self.static_friction if static_friction is None else static_friction,
            rolling_friction=self.rolling_friction if rolling_friction is None else rolling_friction,
        )

    def prepared(self, ratio: float) -> Interaction:
        """Grain on grain with both frictions multiplied by a ratio, as while a specimen is prepared."""
        return self.interaction(ratio * self.static_friction, ratio * self.rolling_friction)


@dataclass(frozen=True, kw_only=True)
class Engine(Rich):
    """Numerical settings common to both experiments; the names are those of `dem.Simulation`."""

    rolling_model: str = "type_a"
    damping_model: str = "edem"
    precision: str = "float32"
    vector_code: bool = True
    energy_ledger: bool = False
    gravity_m_s2: float = 9.81
    time_step_rayleigh_ratio: float = 0.2
    stiffness_reduction: float = 1.0

    @property
    def options(self) -> dict[str, Any]:
        """All settings as keyword arguments of `dem.Simulation`; `stiffness_reduction` is not one, it changes the material."""
        values = asdict(self)
        del values["stiffness_reduction"]
        return values | {"gravity_m_s2": (0.0, 0.0, -self.gravity_m_s2)}


def energy_balance(simulation: Simulation, engine: Engine) -> dict[str, float]:
    """Energy that a test dissipated in J, and the ledger's residual over it; NaN without a ledger."""
    if not engine.energy_ledger:
        return {"energy_dissipated_j": math.nan, "energy_residual_ratio": math.nan}
    energies = simulation.energies_j
    return {"energy_dissipated_j": energies["dissipated"], "energy_residual_ratio": energies["residual"] / energies["dissipated"]}
