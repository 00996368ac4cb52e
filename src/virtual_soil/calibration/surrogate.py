"""Step 3: a response as f(grid variables) x g(sweep variable), the paper's Equations 2 and 3.

f: polynomial of total degree two, fitted on the grid points. g: for each swept variable x with reference x0, either
a + b (x/x0) + c (x/x0)^2 or 1 - b ln(x/x0), fitted on the sweep so that f(couple) g(x) meets the response of each couple. In this
fit f is the couple's own simulated response at x0. No ratios of responses are formed: near zero they are meaningless.
"""

import itertools
from dataclasses import dataclass

import numpy as np
import pandas as pd

from virtual_soil.calibration.errors import demand
from virtual_soil.calibration.response import Response


@dataclass(frozen=True)
class Factor:
    """g of one swept variable: form ("quadratic" or "log"), reference value, coefficients."""

    form: str
    reference: float
    coefficients: tuple[float, ...]

    def __call__(self, x):
        """Dimensionless factor at x (any shape)."""
        return factor_basis(self.form, np.asarray(x, float) / self.reference) @ self.coefficients + factor_offset(self.form)


def factor_basis(form: str, ratio) -> np.ndarray:
    """Columns that g is linear in, last axis."""
    ratio = np.asarray(ratio, float)
    if form == "quadratic":
        return np.stack([np.ones_like(ratio), ratio, ratio**2], axis=-1)
    return -np.log(ratio)[..., None]


def n_factor_terms(form: str) -> int:
    """Number of coefficients of g."""
    return factor_basis(form, 1.0).shape[-1]


def factor_offset(form: str) -> float:
    """Value of g if all its coefficients are zero."""
    return 0.0 if form == "quadratic" else 1.0


def summary(model) -> pd.Series:
    """Unit, ranges and errors of a fitted surrogate of either kind, by name."""
    ranges = {name: f"{low:.4g} to {high:.4g}" for name, (low, high) in model.ranges.items()}
    fit = {"points": model.n_points, "error at left-out points": f"{model.cv_rmse:.4g}"} if model.n_points else {}
    return pd.Series({"model": model.model, "unit": model.unit, **ranges, **fit})


@dataclass(frozen=True)
class Surrogate:
    """A fitted response; `predict` takes a mapping from variable to value(s). Errors of fit are in the response's unit.

    cv_rmse: root mean square error of points left out of the fit; cv_score: the same in units of the points' noise.
    """

    response: str
    unit: str
    grid_variables: tuple[str, ...]
    powers: tuple[tuple[int, ...], ...]
    coefficients: tuple[float, ...]
    g: dict[str, Factor]
    ranges: dict[str, tuple[float, float]]
    r_squared: float = float("nan")
    rmse: float = float("nan")
    cv_rmse: float = float("nan")
    cv_score: float = float("nan")
    n_points: int = 0

    model = "quadratic"

    def predict(self, values) -> np.ndarray:
        """Response in `unit`; values maps every variable to a number or to arrays of one shape."""
        grid = [np.asarray(values[name], float) for name in self.grid_variables]
        result = polynomial_basis(grid, self.powers) @ np.asarray(self.coefficients)
        for name, factor in self.g.items():
            result = result * factor(values[name])
        return result

    def predict_with_error(self, values) -> tuple[np.ndarray, np.ndarray]:
        """Response and its standard error: that of left-out points, uniform, as a polynomial does not know where it fails."""
        mean = self.predict(values)
        return mean, np.full(np.shape(mean), self.cv_rmse)

    def believing(self, values) -> "Surrogate":
        """The same surrogate: one more point hardly changes a polynomial over the whole design."""
        return self

    def _repr_html_(self) -> str:
        return summary(self).to_frame(self.response).to_html()


def polynomial_basis(grid: list[np.ndarray], powers) -> np.ndarray:
    """Monomials of the grid variables, last axis in the order of powers."""
    return np.stack([np.prod([x**p for x, p in zip(grid, exponents, strict=True)], axis=0) for exponents in powers], axis=-1)


def quadratic_powers(n: int) -> tuple[tuple[int, ...], ...]:
    """Exponents of all monomials of n variables up to total degree two."""
    return tuple(p for p in itertools.product(range(3), repeat=n) if sum(p) <= 2)


def least_squares(basis: np.ndarray, observed: np.ndarray, name: str) -> np.ndarray:
    """Coefficients of a linear fit; refuses too few points and designs that do not determine all coefficients."""
    n, k = basis.shape
    demand(n > k, f"{name}: number of points to fit", n, f"more than the {k} coefficients; failed simulations do not count")
    demand(bool(np.isfinite(observed).all()), f"{name}: responses", "not all finite", "finite numbers")
    coefficients, _, rank, _ = np.linalg.lstsq(basis, observed, rcond=None)
    demand(rank == k, f"{name}: rank of the design", rank, f"{k}; the points do not determine all coefficients")
    return coefficients


def fit_surrogate(response: Response, points: pd.DataFrame, design: dict, material: dict, form: dict) -> Surrogate:
    """Fit f on the grid and g on the sweeps.

    points : one row per simulated point with all variables and the response's column; seeds already averaged. Points off the grid
    and off the sweeps do not enter. design, material : those parts of the study's configuration.
    form : {"f": "quadratic", "g": "quadratic" or "log"}. Raises CalibrationError for too few points.
    """
    names = tuple(design["grid"])
    grid = points[on_grid(points, design, material)]
    powers = quadratic_powers(len(names))
    basis = polynomial_basis([grid[name].to_numpy() for name in names], powers)
    observed = grid[response.column].to_numpy()
    coefficients = least_squares(basis, observed, response.name)
    residuals = observed - basis @ coefficients
    spread = float(((observed - observed.mean()) ** 2).sum())
    return Surrogate(
        response=response.name,
        unit=response.unit,
        grid_variables=names,
        powers=powers,
        coefficients=tuple(coefficients.tolist()),
        g={variable: fit_factor(response, points, grid, design, material, variable, form["g"]) for variable in design["sweep"]},
        ranges={name: (float(min(values)), float(max(values))) for name, values in {**design["grid"], **design["sweep"]}.items()},
        r_squared=1.0 - float((residuals**2).sum()) / spread if spread > 0 else float("nan"),
        rmse=float(np.sqrt((residuals**2).mean())),
        n_points=len(grid),
    )


def on_grid(points: pd.DataFrame, design: dict, material: dict) -> np.ndarray:
    """Mask (n,) of the points that belong to the full factorial at the base values of the swept variables."""
    at_base = [np.isclose(points[name], material[name]) for name in design["sweep"]]
    return np.logical_and.reduce([*at_base, *(np.isin(points[name], design["grid"][name]) for name in design["grid"])])


def on_sweep(points: pd.DataFrame, design: dict) -> np.ndarray:
    """Mask (n,) of the points that belong to a sweep."""
    at = [
        np.logical_and.reduce([np.isclose(points[name], value) for name, value in couple.items()])
        for couple in design["sweep_couples"]
    ]
    return np.logical_or.reduce(at) if design["sweep"] else np.zeros(len(points), bool)


def fit_factor(response: Response, points, grid, design, material, variable, form) -> Factor:
    """Fit g of one swept variable: response(couple, x) = response(couple, x0) g(x), by least squares over all couples."""
    column, names, reference = response.column, list(design["grid"]), material[variable]
    bases, targets = [], []
    for couple in design["sweep_couples"]:
        rows = points[np.logical_and.reduce([np.isclose(points[name], couple[name]) for name in names])]
        home = grid[np.logical_and.reduce([np.isclose(grid[name], couple[name]) for name in names])]
        if home.empty:
            continue
        level = float(home[column].iloc[0])
        bases.append(level * factor_basis(form, rows[variable].to_numpy() / reference))
        targets.append(rows[column].to_numpy() - level * factor_offset(form))
    demand(bool(bases), f"{response.name}: sweep couples with a result at {variable} = {reference}", 0, "at least one")
    coefficients = least_squares(np.concatenate(bases), np.concatenate(targets), f"{response.name}, g({variable})")
    return Factor(form, float(reference), tuple(coefficients.tolist()))
