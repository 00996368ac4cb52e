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


def largest_time_step(a: tuple[Material, float], b: tuple[Material, float]) -> float:
    """Largest time step in s that is accepted for contacts of two bodies, each a material and a radius in m (infinite: a wall).

    That of a grain's contacts with its like, over the ratio of the frequencies w^2 = k / m*, with k proportional to
    E* sqrt(R* delta) and overlaps delta that are one fraction of the smaller radius. So a rigid wall costs a soft grain a sixth of
    its step, whatever the Rayleigh time of the wall's material.
    """
    steps = []
    for material, radius in (a, b):
        if math.isfinite(radius):
            like = (material, radius)
            steps.append(rayleigh_time(radius, material) * math.sqrt(stiffness_over_mass(like, like) / stiffness_over_mass(a, b)))
    return LARGEST_RAYLEIGH_RATIO * min(steps, default=math.inf)


def stiffness_over_mass(a: tuple[Material, float], b: tuple[Material, float]) -> float:
    """E* sqrt(R* r) / m* of two bodies, r the smaller radius; each a material and a radius in m (infinite: a wall, at rest)."""
    compliance, curvature, inverse_mass = 0.0, 0.0, 0.0
    for material, radius in (a, b):
        compliance += (1.0 - material.poisson_ratio) / (2.0 * material.shear_modulus_pa)
        curvature += 1.0 / radius
        inverse_mass += 3.0 / (4.0 * math.pi * material.density_kg_m3 * radius**3)
    return inverse_mass / compliance * math.sqrt(min(a[1], b[1]) / curvature)
