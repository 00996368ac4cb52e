"""The handbook's rigid wheel (Wong & Reece 1967): sinkage, drawbar pull and torque from a plate's law and the soil's strength.

J.-Y. Wong & A. R. Reece, J. Terramechanics 4 (1967), 81-98 (driven) and 7-25 (towed), as textbooks give it; the originals were not
read. Under the rim, at an angle theta from the vertical, positive ahead of the axle:

    sigma = k [R (cos(f) - cos(theta_1))]^n      f = theta ahead of theta_m, theta_1 - (theta_1 - theta_m) theta / theta_m behind
    tau = sign(j) (c + sigma tan(phi)) (1 - exp(-|j| / K))            (Janosi & Hanamoto 1961)
    j = R [(theta_1 - theta) - v / (Omega R) (sin(theta_1) - sin(theta))]
    W = R b int (sigma cos + tau sin),  F = R b int (tau cos - sigma sin),  T = R^2 b int tau       from 0 to theta_1

| symbol | name here | meaning |
|---|---|---|
| R, b | radius_m, width_m | of the rim |
| s | slip | 1 - v / (Omega R) of a driven wheel, Omega R / v - 1 of one that skids |
| k, n | k_pa_m_n, n | law p = k z^n of a plate; z is the sinkage in m |
| c, phi | cohesion_pa, internal_friction_angle_deg | strength |
| K | shear_displacement_m | displacement at which 63 % of the strength is mobilised |
| theta_1, theta_m | - | where the rim enters the soil; where sigma is largest: (a0 + a1 s) theta_1 |

Signs: forces of the soil on the wheel, x forwards; the motor's torque; z downwards. Limits: rigid smooth rim, level soil, no side
walls, no slip-sinkage but by theta_m, the soil leaves the rim below the axle (theta_2 = 0), one k for any width. Skidding, j is
integrated from the entry on throughout; the towed wheel of the source has a transition between two shear zones instead.
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import scipy

from dem.measure.penetration import PowerLaw
from virtual_soil.calibration.errors import CalibrationError, demand

#: a0 and a1 of theta_m. Commonly quoted as 0.4, and 0 to 0.3 of which this is the middle (Ishigami et al. 2007, J. Field Robotics
#: 24, 233; not read).
LARGEST_STRESS = (0.4, 0.15)
#: Nodes of Gauss-Legendre quadrature on either side of theta_m; the stresses are smooth there.
N_NODES = 48
#: Angles in rad between which theta_1 is sought: a wheel cannot sink to its axle and roll.
ENTRY = (1e-4, 0.5 * math.pi)


@dataclass(frozen=True, kw_only=True)
class Strength:
    """Strength of the soil, and the displacement that mobilises it."""

    internal_friction_angle_deg: float
    cohesion_pa: float = 0.0
    shear_displacement_m: float = 0.01


class Rolling(NamedTuple):
    """A wheel in steady motion: sinkage in m, drawbar pull in N, torque in N m."""

    sinkage_m: float
    drawbar_pull_n: float
    torque_n_m: float


class Loads(NamedTuple):
    """Loads of the soil on the wheel: vertical and forward force in N, torque of the motor in N m."""

    vertical_n: float
    forward_n: float
    torque_n_m: float


def speed_ratio(slip: float) -> float:
    """Ratio v / (Omega R) at a slip above -1; raises CalibrationError for others: a locked wheel has none."""
    demand(-1.0 < slip < 1.0, "slip of the handbook's wheel", slip, "above -1 (locked) and below 1")
    return 1.0 - slip if slip >= 0.0 else 1.0 / (1.0 + slip)


def loads(
    entry_rad: float,
    slip: float,
    radius_m: float,
    width_m: float,
    law: PowerLaw,
    strength: Strength,
    largest: tuple[float, float] = LARGEST_STRESS,
) -> Loads:
    """Loads of a wheel that meets the soil at theta_1 = entry_rad; law : of a plate. largest : a0 and a1 of theta_m."""
    turn, summit = speed_ratio(slip), min(max(largest[0] + largest[1] * slip, 0.0), 1.0) * entry_rad
    nodes, weights = np.polynomial.legendre.leggauss(N_NODES)
    friction = math.tan(math.radians(strength.internal_friction_angle_deg))
    total = np.zeros(3)
    for low, high in ((0.0, summit), (summit, entry_rad)):
        if high <= low:
            continue
        theta, shares = low + 0.5 * (high - low) * (nodes + 1.0), 0.5 * (high - low) * weights
        ahead = theta if high > summit else entry_rad - (entry_rad - summit) * theta / summit
        depth = radius_m * np.maximum(np.cos(ahead) - math.cos(entry_rad), 0.0)
        sigma = law.k_pa_m_n * depth**law.n
        j = radius_m * ((entry_rad - theta) - turn * (math.sin(entry_rad) - np.sin(theta)))
        mobilised = -np.expm1(-np.abs(j) / strength.shear_displacement_m)
        tau = np.sign(j) * (strength.cohesion_pa + sigma * friction) * mobilised
        up, forward = sigma * np.cos(theta) + tau * np.sin(theta), tau * np.cos(theta) - sigma * np.sin(theta)
        total += [(shares * stress).sum() for stress in (up, forward, tau)]
    area = radius_m * width_m
    return Loads(float(area * total[0]), float(area * total[1]), float(area * radius_m * total[2]))


def wheel(
    slip: float,
    load_n: float,
    radius_m: float,
    width_m: float,
    law: PowerLaw,
    strength: Strength,
    largest: tuple[float, float] = LARGEST_STRESS,
) -> Rolling:
    """The wheel under a load at a slip.

    Raises
    ------
    CalibrationError : the slip has no wheel (`speed_ratio`), or the wheel sinks to its axle before the soil carries the load.
    """

    def missing(entry: float) -> float:
        return loads(entry, slip, radius_m, width_m, law, strength, largest).vertical_n - load_n

    carried = missing(ENTRY[1]) + load_n
    allowed = f"at most {carried:.4g} N, which this soil carries when the wheel has sunk to its axle"
    demand(carried >= load_n, f"load of the handbook's wheel at slip {slip:g}", f"{load_n:g} N", allowed)
    entry = float(scipy.optimize.brentq(missing, *ENTRY, xtol=1e-12))
    _, pull, torque = loads(entry, slip, radius_m, width_m, law, strength, largest)
    return Rolling(radius_m * (1.0 - math.cos(entry)), pull, torque)


def curve(slips: Iterable[float], load_n: float, radius_m: float, width_m: float, law: PowerLaw, strength: Strength) -> list[dict]:
    """Rows of slip, sinkage_m, drawbar_ratio and traction_coefficient (T / (W R)) for a figure; nan where `wheel` knows none."""
    rows = []
    for slip in slips:
        try:
            sinkage, pull, torque = wheel(slip, load_n, radius_m, width_m, law, strength)
        except CalibrationError:
            sinkage = pull = torque = math.nan
        ratios = {"drawbar_ratio": pull / load_n, "traction_coefficient": torque / (load_n * radius_m)}
        rows.append({"slip": slip, "sinkage_m": sinkage, **ratios})
    return rows
