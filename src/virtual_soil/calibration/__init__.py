"""Inference: from simulated responses to the grain parameters of a real soil. Knows nothing of grains, kernels or Snakemake."""

from virtual_soil.calibration.checks import FidelityCheck, acceleration_table, reachability_table
from virtual_soil.calibration.design import expand, further
from virtual_soil.calibration.errors import CalibrationError
from virtual_soil.calibration.first_answer import cases_of, first_answer, first_answer_text
from virtual_soil.calibration.gauss_newton import gauss_newton
from virtual_soil.calibration.gaussian_process import GaussianProcess
from virtual_soil.calibration.models import fit_all, from_json, space_of, to_json
from virtual_soil.calibration.mohr_coulomb import fit_line, strength_table
from virtual_soil.calibration.optimise import calibrate, cases_about, weights_of
from virtual_soil.calibration.paper import published
from virtual_soil.calibration.refine import propose, settled
from virtual_soil.calibration.response import Response, Responses
from virtual_soil.calibration.screening import screening_table
from virtual_soil.calibration.sensitivity import sobol_table
from virtual_soil.calibration.soil import laboratory_files, measure_soil
from virtual_soil.calibration.space import Space
from virtual_soil.calibration.surrogate import Surrogate
from virtual_soil.calibration.twin import coverage_table, twin_soil, twin_table
from virtual_soil.calibration.uncertainty import equivalents, identifiability, likelihood_of, posterior_table, sample
from virtual_soil.calibration.verify import comparison_table, conclusion

__all__ = [
    "CalibrationError",
    "FidelityCheck",
    "GaussianProcess",
    "Response",
    "Responses",
    "Space",
    "Surrogate",
    "acceleration_table",
    "calibrate",
    "cases_about",
    "cases_of",
    "comparison_table",
    "conclusion",
    "coverage_table",
    "equivalents",
    "expand",
    "fit_all",
    "first_answer",
    "first_answer_text",
    "fit_line",
    "from_json",
    "further",
    "gauss_newton",
    "identifiability",
    "laboratory_files",
    "likelihood_of",
    "measure_soil",
    "posterior_table",
    "propose",
    "published",
    "reachability_table",
    "sample",
    "screening_table",
    "settled",
    "sobol_table",
    "space_of",
    "strength_table",
    "to_json",
    "twin_soil",
    "twin_table",
    "weights_of",
]
