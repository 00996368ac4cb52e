"""The largest stable time step.

Rayleigh time: how long a surface wave takes around a grain, T_R = pi r sqrt(rho / G) / (0.1631 nu + 0.8766).
Source: Li, Xu, Thornton 2005 (Powder Technol. 160, 53); EDEM recommends 0.2 to 0.4 of it.
"""

import math

from dem.material import Material, require

#: Steps above this fraction of the Rayleigh time are refused.
LARGEST_RAYLEIGH_RATIO = 0.5


def rayleigh_time(radius_m: float, material: Material) -> float:
    """Rayleigh time in s of a grain of this radius and material."""
    wave = math.sqrt(material.density_kg_m3 / material.shear_modulus_pa)
    return math.pi * radius_m * wave / (0.1631 * material.poisson_ratio + 0.8766)


def stable_time_step(radius_m: float, material: Material, rayleigh_ratio: float) -> float:
    """Time step in s as a fraction of the Rayleigh time; refuses a fraction that is not in (0, 0.5]."""
    allowed = f"above 0, at most {LARGEST_RAYLEIGH_RATIO} (beyond, contacts gain energy)"
    require(0 < rayleigh_ratio <= LARGEST_RAYLEIGH_RATIO, "time step over Rayleigh time", rayleigh_ratio, allowed)
    return rayleigh_ratio * rayleigh_time(radius_m, material)
