"""Mohr-Coulomb line tau_max = c + p tan(phi) (Equation 1): weighted linear regression with standard errors.

The scatter of shear strengths is proportional to the strength, so the tests are weighted by 1/tau^2. Otherwise the highest
stresses would dominate the intercept, i.e. the cohesion. tau is that of the line, found by iteration (McCullagh & Nelder 1989,
Generalized Linear Models, section 8.3): by its own strength, a test that comes out low by chance would count for more than one that
comes out high, and a line through strengths that scatter by 10 % lies 2 % too low in cohesion and 0.6 degrees in friction angle.
"""

from dataclasses import dataclass

import numpy as np
import pandas as pd

from virtual_soil.calibration.errors import demand
from virtual_soil.calibration.noise import student
from virtual_soil.campaign.experiments.common import MATERIAL_KEYS

#: Minimum number of distinct normal stresses for a line with a standard error.
LEAST_STRESSES = 3
#: The weights follow the line until it changes by no more than this ratio of the largest strength, at most so many times.
TOLERANCE, MOST_ITERATIONS = 1e-10, 1000
#: From this iteration on they follow half-way: lines through strengths that scatter wildly may swing between two states.
HALF_WAY = 20


@dataclass(frozen=True)
class StrengthLine:
    """Cohesion (Pa), friction angle (deg), their standard errors, R^2 of the weighted line, number of tests.

    relative_scatter: standard deviation of the strengths about the line, relative to the strength; both standard errors are
    proportional to it.
    """

    cohesion_pa: float
    cohesion_se_pa: float
    friction_angle_deg: float
    friction_angle_se_deg: float
    r_squared: float
    relative_scatter: float
    n_runs: int


#: Fields that are responses or their errors.
VALUES = [name for name in StrengthLine.__dataclass_fields__ if name.endswith(("_pa", "_deg"))]


def fit_line(normal_stress_pa: np.ndarray, shear_strength_pa: np.ndarray) -> StrengthLine:
    """Fit n shear strengths to their normal stresses, arrays (n,), by weighted regression.

    The standard errors have Student's factor for n - 2 degrees of freedom (see `noise.student`): a line through few tests can be
    straight by chance.

    Raises CalibrationError for fewer than three distinct stresses or for values that are not finite.
    """
    p, tau = np.asarray(normal_stress_pa, float), np.asarray(shear_strength_pa, float)
    demand(bool(np.isfinite(p).all() and np.isfinite(tau).all()), "strengths", "not all finite", "finite stresses in Pa")
    n_stresses = len(np.unique(np.round(p, 6)))
    demand(n_stresses >= LEAST_STRESSES, "number of distinct normal stresses", n_stresses, f"at least {LEAST_STRESSES}")
    design = np.column_stack([np.ones_like(p), p])
    c, slope, weights = weighted_line(design, tau)
    normal = design.T @ (weights[:, None] * design)
    residuals = tau - design @ (c, slope)
    mean = np.average(tau, weights=weights)
    squares = float(weights @ residuals**2)
    covariance = np.linalg.inv(normal) * squares / (len(p) - 2) * student(len(p) - 2) ** 2
    return StrengthLine(
        cohesion_pa=float(c),
        cohesion_se_pa=float(np.sqrt(covariance[0, 0])),
        friction_angle_deg=float(np.degrees(np.arctan(slope))),
        friction_angle_se_deg=float(np.degrees(np.sqrt(covariance[1, 1]) / (1.0 + slope**2))),
        r_squared=1.0 - squares / float(weights @ (tau - mean) ** 2),
        relative_scatter=float(np.sqrt(squares / (len(p) - 2))),
        n_runs=len(p),
    )


def weighted_line(design: np.ndarray, tau: np.ndarray) -> tuple[float, float, np.ndarray]:
    """Intercept, slope and weights (n,) of the line whose weights follow from itself; design (n, 2), tau (n,).

    A line far below a strength says nothing of its scatter: at least half of the strength itself counts.
    """
    least = np.maximum(0.5 * np.abs(tau), 1e-3 * np.abs(tau).max() + 1e-300)
    line, expected = np.zeros(2), np.maximum(np.abs(tau), least)
    for k in range(MOST_ITERATIONS):
        weights = 1.0 / expected**2
        before, line = line, np.linalg.solve(design.T @ (weights[:, None] * design), design.T @ (weights * tau))
        if np.abs(design @ (line - before)).max() <= TOLERANCE * np.abs(tau).max():
            break
        expected *= (np.maximum(design @ line, least) / expected) ** (1.0 if k < HALF_WAY else 0.5)
    return float(line[0]), float(line[1]), weights


def strength_table(runs: pd.DataFrame, columns: tuple[str, str], by_seed: bool = False, prefix: str = "") -> pd.DataFrame:
    """Return one row per design point and fidelity (and seed, if by_seed) with its material values and its strength line.

    runs : the tests that count; points with fewer than three distinct applied stresses are omitted. columns : shear strength and
    normal stress of a test. prefix : of the columns of cohesion, friction angle and their errors.
    """
    keys = ["point_id", "fidelity", *(["seed"] if by_seed else [])]
    kept = ["fidelity", "point_id", *sorted(set(MATERIAL_KEYS) & set(runs.columns)), *keys[2:]]
    tau_column, p_column = columns
    rows = []
    for _, tests in runs.groupby(keys, sort=False):
        if tests["normal_stress_pa"].nunique() >= LEAST_STRESSES:
            purposes = ",".join(dict.fromkeys(",".join(tests["purposes"]).split(",")))
            line = fit_line(tests[p_column].to_numpy(), tests[tau_column].to_numpy())
            rows.append({**tests.iloc[0][kept].to_dict(), "purposes": purposes, **vars(line)})
    table = pd.DataFrame(rows, columns=[*kept, "purposes", *StrengthLine.__dataclass_fields__])
    return table.rename(columns={name: f"{prefix}{name}" for name in VALUES})
