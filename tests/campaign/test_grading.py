"""The grading of a study: a sieve curve becomes classes by mass, and reaches the simulated grains."""

import numpy as np
import pytest

from dem import Sizes
from dem.experiments import angle_of_repose
from virtual_soil.calibration.errors import CalibrationError
from virtual_soil.campaign.experiments.common import engine_of, soil_of
from virtual_soil.campaign.experiments.repose import declared as repose
from virtual_soil.campaign.sections import Study
from virtual_soil.campaign.settings import defaults

CURVE = {"sieve_diameters_m": [63e-6, 125e-6, 250e-6, 500e-6], "sieve_passing": [0.0, 0.2, 0.7, 1.0]}


def study(**grading):
    config = defaults(Study)
    config["grading"] |= grading
    return config


def row(config, **changes):
    return {**config["material"], "experiment": "repose", "fidelity": "campaign", **changes}


def test_a_sieve_curve_reaches_the_grains_of_a_heap():
    config = study(**CURVE)
    settings = repose.setup(config, row(config))
    soil = soil_of(row(config), settings)
    simulation = angle_of_repose.build(soil, angle_of_repose.Setup(**settings["setup"]), engine_of(settings), seed=1)
    radii = simulation.grains.radii_m
    assert radii.mean() == pytest.approx(config["material"]["radius_m"], rel=2e-3)
    values = np.unique(radii)
    middles = np.sqrt(np.array(CURVE["sieve_diameters_m"])[:-1] * np.array(CURVE["sieve_diameters_m"])[1:])
    assert values / values[0] == pytest.approx(middles / middles[0])
    masses = np.array([(radii[radii == value] ** 3).sum() for value in values]) / (radii**3).sum()
    assert masses == pytest.approx([0.2, 0.5, 0.3], abs=0.05)


def test_a_log_normal_spread_reaches_the_grains_and_the_default_needs_no_words():
    config = study(distribution="log_normal")
    config["material"]["radius_sd_ratio"] = 0.2
    settings = repose.setup(config, row(config))
    assert soil_of(row(config), settings).sizes == Sizes(mean_m=50e-6, sd_ratio=0.2, distribution="log_normal")
    assert "grading" not in repose.setup(study(), row(study()))


@pytest.mark.parametrize(
    ("grading", "message"),
    [
        (
            {**CURVE, "sieve_passing": [0.0, 0.5, 1.0]},
            "grading.sieve_passing is .*; allowed: a share for each of",
        ),
        ({**CURVE, "sieve_passing": None}, "grading.sieve_passing is None; allowed: a share for each"),
        ({**CURVE, "sieve_passing": [0.1, 0.2, 0.7, 1.0]}, "grading.sieve_passing is .*; allowed: shares that rise from 0 to 1"),
        ({**CURVE, "sieve_passing": [0.0, 0.7, 0.2, 1.0]}, "grading.sieve_passing is .*; allowed: shares that rise from 0 to 1"),
        ({**CURVE, "sieve_diameters_m": [63e-6, 250e-6, 125e-6, 5e-4]}, "grading.sieve_diameters_m is .*; allowed: ascending"),
        ({**CURVE, "sieve_diameters_m": [63e-6, 125e-6, 250e-6, 5e-3]}, "grading: largest over smallest radius is 12.6; allowed"),
    ],
)
def test_a_curve_without_sense_is_refused(grading, message):
    config = study(**grading)
    with pytest.raises(CalibrationError, match=message):
        repose.setup(config, row(config))
