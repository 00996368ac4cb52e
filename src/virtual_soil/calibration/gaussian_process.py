"""Step 3, the alternative to the paper's polynomials: a response as a Gaussian process over the design variables.

    y(x) = m + Z(x) + noise,   cov(Z(x), Z(x')) = s^2 k(d),   d^2 = sum_i ((u_i - u_i')/l_i)^2

k is the Matern kernel with nu = 5/2, u the coordinates in the unit cube of the design, m an unknown mean (a constant kernel, ten
times the data's scatter wide). Amplitude s and lengths l maximise the likelihood; the noise of every point is known from the seeds'
scatter. Source: Rasmussen & Williams 2006, Gaussian Processes for Machine Learning, chapters 2 and 5; computed by scikit-learn.

Far from all points it returns to the data's mean and says so with an error of s: unlike a polynomial it does not extrapolate in
silence.
"""

import warnings
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from sklearn.exceptions import ConvergenceWarning
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import ConstantKernel, Matern

from virtual_soil.calibration.errors import demand
from virtual_soil.calibration.space import Space, inside_hull
from virtual_soil.calibration.surrogate import summary

#: Allowed lengths, in extents of the design: shorter ones would be noise, longer ones are a constant.
LENGTHS = (0.1, 20.0)
AMPLITUDES = (1e-3, 1e3)
RESTARTS = 4
#: Variance of the unknown mean, in those of the data.
MEAN_VARIANCE = 100.0


@dataclass(frozen=True)
class GaussianProcess:
    """A fitted process: its data in SI units and the response's unit, and its hyperparameters.

    points (n, k) in the order of space.variables, observed (n,), noise (n,) standard errors of observed, amplitude s in the
    response's unit, lengths (k,) in extents of the design. cv_rmse: root mean square error of points left out (with the same
    hyperparameters); cv_score: the same in units of the points' noise, at the design's points; cv_calibration: in units of the
    standard deviations that it predicts (1: the errors are as large as it says).
    """

    response: str
    unit: str
    space: Space
    points: tuple[tuple[float, ...], ...]
    observed: tuple[float, ...]
    noise: tuple[float, ...]
    amplitude: float
    lengths: tuple[float, ...]
    cv_rmse: float = float("nan")
    cv_score: float = float("nan")
    cv_calibration: float = float("nan")

    model = "gaussian_process"

    def __repr__(self):
        variables = ", ".join(self.space.variables)
        return f"GaussianProcess({self.response} of {variables}; {self.n_points} points; left out: {self.cv_rmse:.4g} {self.unit})"

    def _repr_html_(self) -> str:
        return summary(self).to_frame(self.response).to_html()

    @property
    def n_points(self) -> int:
        """Number of points that it is fitted to."""
        return len(self.observed)

    @property
    def ranges(self) -> dict[str, tuple[float, float]]:
        """Simulated range of every variable."""
        return self.space.ranges

    @cached_property
    def process(self) -> GaussianProcessRegressor:
        """scikit-learn's process with these hyperparameters, of the response less its centre over its scale."""
        centre, scale = self.normal
        kernel = ConstantKernel(MEAN_VARIANCE) + ConstantKernel((self.amplitude / scale) ** 2) * Matern(self.lengths, nu=2.5)
        fitted = GaussianProcessRegressor(kernel, alpha=(np.array(self.noise) / scale) ** 2 + 1e-10, optimizer=None)
        values = dict(zip(self.space.variables, np.array(self.points).T, strict=True))
        return fitted.fit(self.space.unit(values), (np.array(self.observed) - centre) / scale)

    @property
    def normal(self) -> tuple[float, float]:
        """Mean and standard deviation of the data, which make it dimensionless."""
        return float(np.mean(self.observed)), float(np.std(self.observed)) or 1.0

    def predict(self, values) -> np.ndarray:
        """Response in `unit`; values maps every variable to a number or to arrays of one shape. NaN at impossible values."""
        return self.predict_with_error(values, with_error=False)[0]

    def predict_with_error(self, values, with_error: bool = True) -> tuple[np.ndarray, np.ndarray]:
        """Response and its standard error (of the mean over seeds, not of a single run)."""
        with np.errstate(all="ignore"):
            unit = self.space.unit(values)
        known = np.isfinite(unit).all(axis=1)
        mean, error = np.full((2, len(unit)), np.nan)
        if known.any() and with_error:
            mean[known], error[known] = self.process.predict(unit[known], return_std=True)
        elif known.any():  # the same without scikit-learn's checks, which cost an optimiser more than the kernel
            mean[known] = self.process.kernel_(unit[known], self.process.X_train_) @ self.process.alpha_
        shape, (centre, scale) = np.shape(values[self.space.variables[0]]), self.normal
        return (centre + scale * mean).reshape(shape), (scale * error).reshape(shape)

    def surrounds(self, values) -> bool:
        """True if a prediction at one point interpolates: if the point lies in the hull of the process's points."""
        points = dict(zip(self.space.variables, np.array(self.points).T, strict=True))
        return inside_hull(self.space.unit(points), self.space.unit(values)[0])

    def without(self, k: int) -> "GaussianProcess":
        """The same process without its point number k."""
        drop = [tuple(np.delete(np.array(field), k, axis=0).tolist()) for field in (self.observed, self.noise)]
        return replace(self, points=self.points[:k] + self.points[k + 1 :], observed=drop[0], noise=drop[1])

    def believing(self, values) -> "GaussianProcess":
        """The same process as if its own prediction at one point had been simulated, with the median noise."""
        return replace(
            self,
            points=(*self.points, tuple(float(values[name]) for name in self.space.variables)),
            observed=(*self.observed, float(self.predict(values))),
            noise=(*self.noise, float(np.median(self.noise))),
        )


def fit_process(response: str, unit: str, space: Space, points, observed, noise) -> GaussianProcess:
    """Fit a process to n points (n, k), observed (n,) with standard errors noise (n,).

    Raises CalibrationError for fewer points than hyperparameters, or for values that are not finite.
    """
    observed, noise = np.asarray(observed, float), np.asarray(noise, float)
    k = len(space.variables)
    demand(len(observed) > k + 1, f"{response}: number of points to fit", len(observed), f"more than the {k + 1} hyperparameters")
    demand(bool(np.isfinite([observed, noise]).all()), f"{response}: responses", "not all finite", "finite numbers")
    start = GaussianProcess(
        response, unit, space, tuple(map(tuple, np.asarray(points, float).tolist())), tuple(observed.tolist()),
        tuple(noise.tolist()), 1.0, (1.0,) * k,
    )  # fmt: skip
    centre, scale = start.normal
    kernel = ConstantKernel(MEAN_VARIANCE, "fixed") + ConstantKernel(1.0, AMPLITUDES) * Matern((1.0,) * k, (LENGTHS,) * k, nu=2.5)
    search = GaussianProcessRegressor(kernel, alpha=(noise / scale) ** 2 + 1e-10, n_restarts_optimizer=RESTARTS, random_state=0)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ConvergenceWarning)  # a length at its limit: the response does not depend on that variable
        search.fit(space.unit(dict(zip(space.variables, np.array(start.points).T, strict=True))), (observed - centre) / scale)
    amplitude = scale * float(np.sqrt(search.kernel_.k2.k1.constant_value))
    lengths = tuple(np.atleast_1d(search.kernel_.k2.k2.length_scale).tolist())
    fitted = replace(start, amplitude=amplitude, lengths=lengths)
    predicted, error = left_out(fitted)
    residual = observed - predicted
    return replace(
        fitted,
        cv_rmse=float(np.sqrt((residual**2).mean())),
        cv_calibration=float(np.sqrt((residual**2 / (error**2 + noise**2)).mean())),
    )


def left_out(process: GaussianProcess) -> tuple[np.ndarray, np.ndarray]:
    """Prediction and standard error at every point from all others, with the same hyperparameters."""
    columns = np.array(process.points).T
    results = [
        process.without(k).predict_with_error(dict(zip(process.space.variables, columns[:, k], strict=True)))
        for k in range(process.n_points)
    ]
    return tuple(np.array(results, float).T)
