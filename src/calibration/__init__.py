"""Inference: from simulated responses to the grain parameters of a real soil. Knows nothing of grains, kernels or Snakemake."""

from calibration.checks import acceleration_table, reachability_table
from calibration.design import expand
from calibration.errors import CalibrationError
from calibration.gauss_newton import gauss_newton
from calibration.mohr_coulomb import fit_line, strength_table
from calibration.optimise import calibrate
from calibration.screening import screening_table
from calibration.soil import measure_soil
from calibration.surrogate import Surrogate, fit_all, from_json, published, to_json

__all__ = [
    "CalibrationError",
    "Surrogate",
    "acceleration_table",
    "calibrate",
    "expand",
    "fit_all",
    "fit_line",
    "from_json",
    "gauss_newton",
    "measure_soil",
    "published",
    "reachability_table",
    "screening_table",
    "strength_table",
    "to_json",
]
