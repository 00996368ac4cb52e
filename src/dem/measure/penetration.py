"""What plates and cones tell: pressure at a sinkage, the law p = k z^n, Bekker's moduli, and the gradient of the cone index."""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import scipy

from dem.html import Rich
from dem.measure.blocks import block_means

#: Half of the window around a sinkage in which the pressure is a line, as a share of the sinkage.
WINDOW = 0.2
#: Shares of the depth between which a cone index has its gradient.
GRADIENT_SHARES = (0.1, 0.3)
#: Blocks of the curve whose means the gradient is fitted to.
N_BLOCKS = 8
#: Exponents n between which the law is sought.
EXPONENTS = (0.05, 5.0)
#: Least samples of a fit.
LEAST_SAMPLES = 4


@dataclass(frozen=True, kw_only=True)
class PowerLaw(Rich):
    """Parameters of p = k z^n.

    k_pa_m_n: pressure in Pa at a sinkage of 1 m. residual_ratio: root mean square residual over the mean pressure.
    """

    k_pa_m_n: float
    n: float
    residual_ratio: float


def sinkage_from(depth_m, pressure_pa, zero_pressure_pa: float) -> np.ndarray:
    """Sinkage in m (n,) from the depth at which the pressure first reaches a value, a common zero; nan if it never does.

    A plate touches the highest grain first: its mean pressure is nothing until it is down by a diameter.
    """
    z, p = np.asarray(depth_m, float), np.asarray(pressure_pa, float)
    reached = p >= zero_pressure_pa
    return z - z[np.argmax(reached)] if reached.any() else np.full(z.shape, math.nan)


def pressure_at(sinkage_m, pressure_pa, at_m: float) -> tuple[float, float]:
    """Pressure in Pa at a sinkage, and its standard error as if samples were independent, from a line through those nearby.

    sinkage_m, pressure_pa : (n,). Nan where fewer than LEAST_SAMPLES are within WINDOW of the sinkage, or none is beyond it.
    """
    z, p = np.asarray(sinkage_m, float), np.asarray(pressure_pa, float)
    near = np.abs(z - at_m) <= WINDOW * at_m
    if near.sum() < LEAST_SAMPLES or z.max(initial=-math.inf) < at_m * (1.0 - 1e-9):
        return math.nan, math.nan
    slope, value = np.polyfit(z[near] - at_m, p[near], 1)
    apart, n = z[near] - at_m, int(near.sum())
    scatter = math.sqrt(float(((p[near] - value - slope * apart) ** 2).sum()) / (n - 2))
    spread = float(((apart - apart.mean()) ** 2).sum())
    return float(value), scatter * math.sqrt(1.0 / n + float(apart.mean()) ** 2 / spread)


def power_law(sinkage_m, pressure_pa, low_m: float, high_m: float) -> PowerLaw:
    """The law of least squares through the samples (n,) between two sinkages above 0; n is sought within EXPONENTS.

    Of the pressures themselves: logarithms would weigh the errors of small pressures most. Nan with fewer than LEAST_SAMPLES.
    """
    z, p = np.asarray(sinkage_m, float), np.asarray(pressure_pa, float)
    counts = (z >= low_m) & (z <= high_m) & (z > 0.0)
    if counts.sum() < LEAST_SAMPLES:
        return PowerLaw(k_pa_m_n=math.nan, n=math.nan, residual_ratio=math.nan)
    p, scale_m = p[counts], float(z[counts].max())
    ratio = z[counts] / scale_m

    def modulus(n: float) -> float:
        return float((p * ratio**n).sum() / (ratio ** (2.0 * n)).sum())

    def residual(n: float) -> float:
        return float(((p - modulus(n) * ratio**n) ** 2).mean())

    n = float(scipy.optimize.minimize_scalar(residual, bounds=EXPONENTS, method="bounded", options={"xatol": 1e-9}).x)
    return PowerLaw(k_pa_m_n=modulus(n) / scale_m**n, n=n, residual_ratio=math.sqrt(residual(n)) / float(np.abs(p).mean()))


def bekker(laws: Mapping[float, PowerLaw], at_m: float) -> tuple[float, float, float]:
    """Bekker's n, k_c and k_phi of round plates, diameter in m -> law: p = (k_c / b + k_phi) z^n, b the radius.

    n is the mean of the plates'; the moduli are the line through k' = p(at_m) / at_m^n over 1 / b, at_m a sinkage within the tests.
    A soil whose larger plates carry a higher pressure has k_c < 0, which the model did not mean. Nan with fewer than two plates.
    """
    if len(laws) < 2:
        return math.nan, math.nan, math.nan
    n = float(np.mean([law.n for law in laws.values()]))
    moduli = [law.k_pa_m_n * at_m ** (law.n - n) for law in laws.values()]
    k_c, k_phi = np.polyfit([2.0 / diameter for diameter in laws], moduli, 1)
    return n, float(k_c), float(k_phi)


def cone_gradient(depth_m, resistance_pa, deepest_m: float) -> tuple[float, float]:
    """Gradient of the cone's resistance in Pa/m between GRADIENT_SHARES of deepest_m, and its standard error.

    A line through the means of N_BLOCKS blocks of the curve, which contain its fluctuations. Nan with fewer than two samples each.
    """
    z, q = np.asarray(depth_m, float), np.asarray(resistance_pa, float)
    low, high = (share * deepest_m for share in GRADIENT_SHARES)
    counts = (z >= low) & (z <= high)
    if counts.sum() < 2 * N_BLOCKS:
        return math.nan, math.nan
    x, y = block_means(np.column_stack([z[counts], q[counts]]), N_BLOCKS).T
    slope, value = np.polyfit(x, y, 1)
    scatter = math.sqrt(float(((y - slope * x - value) ** 2).sum()) / (N_BLOCKS - 2))
    return float(slope), scatter / math.sqrt(float(((x - x.mean()) ** 2).sum()))
