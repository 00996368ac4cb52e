"""Materials and how two of them interact, as a person writes them."""

import math
from dataclasses import dataclass

import numpy as np

from dem.html import Rich


def require(condition: bool, name: str, value, allowed: str) -> None:
    """Raise ValueError naming the quantity, its value and what is allowed, unless the condition holds."""
    if not condition:
        raise ValueError(f"{name} is {value}; allowed: {allowed}.")


def require_vector(values, n: int, name: str, endless: bool = False) -> None:
    """Raise ValueError naming the quantity unless it is n (2 or 3) finite numbers; endless: they may be infinite, but not NaN."""
    try:
        array = np.asarray(values, float)
    except (TypeError, ValueError):
        array = np.zeros(0)
    sound = array.shape == (n,) and not (np.isnan(array) if endless else ~np.isfinite(array)).any()
    allowed = f"{('two', 'three')[n - 2]} " + ("numbers, infinite where endless" if endless else "finite numbers")
    require(sound, name, values, allowed)


@dataclass(frozen=True, kw_only=True)
class Material(Rich):
    """An isotropic elastic solid: density (kg/m3), Poisson's ratio, shear modulus (Pa)."""

    density_kg_m3: float
    poisson_ratio: float
    shear_modulus_pa: float

    def __post_init__(self):
        require(0 < self.density_kg_m3 < math.inf, "density_kg_m3", self.density_kg_m3, "a positive number")
        require(-1 < self.poisson_ratio < 0.5, "poisson_ratio", self.poisson_ratio, "between -1 and 0.5, both excluded")
        require(0 < self.shear_modulus_pa < math.inf, "shear_modulus_pa", self.shear_modulus_pa, "a positive number")


@dataclass(frozen=True, kw_only=True)
class Interaction(Rich):
    """Interaction of two materials: coefficients of restitution, static and rolling friction, work of adhesion (J/m2).

    The work of adhesion w is that of the pair, 2 gamma where two surfaces of energy gamma meet. bridge_volume_ratio : volume of a
    liquid bridge over the cube of the effective radius, for adhesion "capillary".
    """

    restitution: float
    static_friction: float
    rolling_friction: float
    work_of_adhesion_j_m2: float = 0.0
    bridge_volume_ratio: float = 0.0

    def __post_init__(self):
        require(0 < self.restitution <= 1, "restitution", self.restitution, "above 0, at most 1")
        require(0 <= self.static_friction < math.inf, "static_friction", self.static_friction, "zero or positive")
        require(0 <= self.rolling_friction < math.inf, "rolling_friction", self.rolling_friction, "zero or positive")
        w = self.work_of_adhesion_j_m2
        require(0 <= w < math.inf, "work_of_adhesion_j_m2", w, "zero or positive")
        require(0 <= self.bridge_volume_ratio <= 0.1, "bridge_volume_ratio", self.bridge_volume_ratio, "zero to 0.1")
