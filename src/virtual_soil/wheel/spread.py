"""Does it matter under the wheel which of the equivalent soils is taken? Noise of beds against spread of soils.

A calibration leaves a family of parameter sets that serve as well as the optimum. Several of them carry the same wheel, each on
several beds. With x_ij a quantity (drawbar pull, torque, sinkage) of soil i on bed j:

    x_ij = m + a_i + e_ij,   Var(a) = S^2 (soils),   Var(e) = N^2 (beds)

one-way random effects, unequal numbers n_i of beds. N^2 is the mean square within soils; S^2 the variance of the soils' means less
N^2 / n_h, n_h the harmonic mean of n_i (Thomas & Hultquist 1978, Annals of Statistics 6, 582), not below zero. Intervals:
generalised pivotal quantities (Weerahandi 1993, J. Am. Stat. Assoc. 88, 899), which hold their level approximately.

The soils' means make an emulator over the design's coordinates that act under the wheel (not the radius, which the wheel's grains
do not share): a polynomial of the degree, 0 to 2, with the smallest error at soils left out. On the calibration's posterior it
gives what the calibration leaves of the quantity's uncertainty, and what a further measurement would leave of that
(`calibration.uncertainty.left_over`).

Limits: normal effects; an emulator from a few soils; the posterior's prior is uniform over the design.
"""

import itertools
from dataclasses import dataclass

import numpy as np

from virtual_soil.calibration.errors import demand
from virtual_soil.calibration.uncertainty import LEVELS

#: Draws of the pivotal quantities, and their seed.
DRAWS, SEED = 2**15, 2011
#: Degrees of the emulator that are tried.
DEGREES = (0, 1, 2)


@dataclass(frozen=True)
class Components:
    """Standard deviations in the quantity's unit with their 95 % intervals: beds of one soil, and soils.

    mean: over the soils. n_soils, n_runs.
    """

    mean: float
    beds_sd: float
    beds_low: float
    beds_high: float
    soils_sd: float
    soils_low: float
    soils_high: float
    n_soils: int
    n_runs: int


def components(values, soils) -> Components:
    """Standard deviations of beds and soils.

    values : (n,) a quantity, one per run. soils : (n,) the soil of each run. Raises CalibrationError for fewer than three soils or
    no soil with two beds.
    """
    values, soils = np.asarray(values, float), np.asarray(soils)
    groups = [values[soils == soil] for soil in dict.fromkeys(soils.tolist())]
    n_soils, within = len(groups), len(values) - len(groups)
    demand(n_soils >= 3, "number of soils with runs of the wheel", n_soils, "at least 3")
    demand(within >= 1, "beds of a soil", 1, "at least 2 for one soil: else the noise is not known")
    means = np.array([group.mean() for group in groups])
    squares = sum(float(((group - group.mean()) ** 2).sum()) for group in groups)
    per_soil = n_soils / sum(1.0 / len(group) for group in groups)
    between = float(means.var(ddof=1))
    generator = np.random.default_rng(SEED)
    beds = squares / generator.chisquare(within, DRAWS)
    of_soils = np.maximum((n_soils - 1) * between / generator.chisquare(n_soils - 1, DRAWS) - beds / per_soil, 0.0)
    low, high = (np.sqrt([np.quantile(beds, level), np.quantile(of_soils, level)]) for level in LEVELS)
    noise = squares / within
    return Components(
        mean=float(means.mean()),
        beds_sd=float(np.sqrt(noise)),
        beds_low=float(low[0]),
        beds_high=float(high[0]),
        soils_sd=float(np.sqrt(max(between - noise / per_soil, 0.0))),
        soils_low=float(low[1]),
        soils_high=float(high[1]),
        n_soils=n_soils,
        n_runs=len(values),
    )


@dataclass(frozen=True)
class Emulator:
    """A polynomial of total degree `degree` in k coordinates of the unit cube.

    loo_rmse: root mean square error at soils left out, in the quantity's unit; it includes the noise of their means.
    """

    degree: int
    coefficients: tuple[float, ...]
    loo_rmse: float

    def predict(self, unit) -> np.ndarray:
        """The quantity (m,) at coordinates (m, k)."""
        return monomials(np.atleast_2d(unit), self.degree) @ np.array(self.coefficients)


def monomials(unit: np.ndarray, degree: int) -> np.ndarray:
    """Columns of all monomials up to a total degree, of coordinates (m, k)."""
    powers = [p for p in itertools.product(range(degree + 1), repeat=unit.shape[1]) if sum(p) <= degree]
    return np.stack([np.prod(unit ** np.array(p), axis=1) for p in powers], axis=1)


def emulator(unit, means, n_beds) -> Emulator:
    """The polynomial with the smallest error at soils left out.

    unit : (a, k) coordinates of the soils. means : (a,) the quantity. n_beds : (a,) beds behind each mean, the fit's weights.
    A degree is tried if it has fewer coefficients than a - 1.
    """
    unit, means, weights = np.atleast_2d(unit), np.asarray(means, float), np.sqrt(np.asarray(n_beds, float))
    tried = []
    for degree in DEGREES:
        basis = monomials(unit, degree)
        if basis.shape[1] >= len(means) - 1:
            break
        errors = []
        for k in range(len(means)):
            kept = np.arange(len(means)) != k
            without = fitted(basis[kept], means[kept], weights[kept])
            errors.append(means[k] - basis[k] @ without)
        found = tuple(fitted(basis, means, weights).tolist())
        tried.append(Emulator(degree, found, float(np.sqrt(np.mean(np.square(errors))))))
    return min(tried, key=lambda model: model.loo_rmse)


def fitted(basis, means, weights) -> np.ndarray:
    """Weighted least squares."""
    return np.linalg.lstsq(basis * weights[:, None], means * weights, rcond=None)[0]
