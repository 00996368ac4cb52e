"""Closed forms for the impact of two spheres, or of a sphere on a rigid wall, independent of the engine's code.

Symbols: delta overlap, E*, R*, m* effective modulus, radius, mass; v normal speed of approach; e restitution; k = 4/3 E* sqrt(R*).

Elastic (Hertz 1882; Timoshenko & Goodier, Theory of Elasticity, art. 140), from m* v^2 / 2 = 2/5 k delta_max^(5/2):
    delta_max = (5 m* v^2 / 4k)^(2/5), F_max = k delta_max^(3/2), duration = 2 sqrt(pi) Gamma(7/5) / Gamma(9/10) delta_max / v.

With a dashpot, m* delta'' + sqrt(5) beta sqrt(m* k) delta^(1/4) delta' + k delta^(3/2) = 0 (Antypov & Elliott 2011, EPL 94, 50004).
With y = delta^(5/4) and ds = sqrt(5)/2 sqrt(k/m*) delta^(1/4) dt it becomes y_ss + 2 beta y_s + y = 0, a linear oscillator: v is
proportional to y_s, and y = 0 again at s = pi / w with w = sqrt(1 - beta^2). Hence, with a = asin(beta),
    e = exp(-pi beta / w) at any speed, hence beta = -ln e / sqrt(ln^2 e + pi^2): exact when the contact lasts until delta = 0;
    the force becomes attractive at w s = pi - 2a, at the speed e_push v with e_push = exp(-(pi - 2a) beta / w) > e;
    the largest overlap is the elastic one times exp(-0.8 beta (pi/2 - a) / w).
"""

import math
from dataclasses import dataclass

from scipy.special import gamma

import dem
from virtual_soil.verification.scene import mass_kg

#: Duration of an elastic impact over delta_max / v: 2 times the integral of (1 - x^(5/2))^(-1/2) from 0 to 1.
HERTZ_DURATION = 2.0 * math.sqrt(math.pi) * gamma(1.4) / gamma(0.9)

#: Force-weighted mean overlap over delta_max: integrating delta F dt = m* v^2 dt by parts gives the integral of sqrt(1 - x^(5/2))
#: from 0 to 1.
HERTZ_MEAN_OVERLAP = 0.4 * gamma(0.4) * gamma(1.5) / gamma(1.9)


@dataclass(frozen=True, kw_only=True)
class Impact:
    """A central impact: effective modulus E* (Pa), radius (m), mass (kg), normal speed (m/s), restitution."""

    modulus_pa: float
    radius_m: float
    mass_kg: float
    speed_m_s: float
    restitution: float = 1.0

    @property
    def stiffness(self) -> float:
        """Stiffness k in N m^(-3/2)."""
        return 4.0 / 3.0 * self.modulus_pa * math.sqrt(self.radius_m)

    @property
    def beta(self) -> float:
        """Dashpot ratio."""
        log_e = math.log(self.restitution)
        return -log_e / math.sqrt(log_e**2 + math.pi**2)

    @property
    def elastic_overlap_m(self) -> float:
        """Largest overlap without dashpot."""
        return (1.25 * self.mass_kg * self.speed_m_s**2 / self.stiffness) ** 0.4

    @property
    def largest_overlap_m(self) -> float:
        """Largest overlap."""
        beta = self.beta
        return self.elastic_overlap_m * math.exp(-0.8 * beta * math.acos(beta) / math.sqrt(1.0 - beta**2))

    @property
    def largest_force_n(self) -> float:
        """Largest force without dashpot."""
        return self.stiffness * self.elastic_overlap_m**1.5

    @property
    def duration_s(self) -> float:
        """Duration without dashpot."""
        return HERTZ_DURATION * self.elastic_overlap_m / self.speed_m_s

    @property
    def push_restitution(self) -> float:
        """e_push: speed over impact speed when the force becomes attractive; Coulomb's limit is zero from then on."""
        beta = self.beta
        return math.exp(-2.0 * math.acos(beta) * beta / math.sqrt(1.0 - beta**2))

    @property
    def mean_overlap_m(self) -> float:
        """Force-weighted mean overlap during the impact, without dashpot; lever arms are shorter by this amount."""
        return HERTZ_MEAN_OVERLAP * self.elastic_overlap_m


def on_wall(material: dem.Material, radius_m: float, speed_m_s: float, restitution: float = 1.0) -> Impact:
    """Impact of a sphere on a rigid wall: E* = E / (1 - nu^2) = 2 G / (1 - nu)."""
    return Impact(
        modulus_pa=2.0 * material.shear_modulus_pa / (1.0 - material.poisson_ratio),
        radius_m=radius_m,
        mass_kg=mass_kg(material, radius_m),
        speed_m_s=speed_m_s,
        restitution=restitution,
    )


def of_spheres(material: dem.Material, radius_i_m: float, radius_j_m: float, speed_m_s: float, restitution: float = 1.0) -> Impact:
    """Impact of two spheres of one material that approach each other at speed_m_s: E* = G / (1 - nu)."""
    mass_i, mass_j = mass_kg(material, radius_i_m), mass_kg(material, radius_j_m)
    return Impact(
        modulus_pa=material.shear_modulus_pa / (1.0 - material.poisson_ratio),
        radius_m=radius_i_m * radius_j_m / (radius_i_m + radius_j_m),
        mass_kg=mass_i * mass_j / (mass_i + mass_j),
        speed_m_s=speed_m_s,
        restitution=restitution,
    )


def elastic_step_error(steps_per_contact: float) -> float:
    """Bound on the relative error of an elastic impact with a given number of steps.

    The leapfrog's phase error over half a period of n steps is (pi/n)^2 / 24, the error of sampling the peak (pi/n)^2 / 8.
    """
    return (math.pi / steps_per_contact) ** 2


def damped_step_error(steps_per_contact: float) -> float:
    """Bound on the relative error of a damped impact with n steps: the dashpot uses velocities half a step old, pi/2n."""
    return 0.5 * math.pi / steps_per_contact
