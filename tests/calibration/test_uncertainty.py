"""Posterior, regions, equivalent sets and identifiability, against problems with known answers."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from virtual_soil.calibration.errors import CalibrationError
from virtual_soil.calibration.models import from_json
from virtual_soil.calibration.space import Space
from virtual_soil.calibration.twin import made_up_twins
from virtual_soil.calibration.uncertainty import (
    Likelihood,
    credible_level,
    equivalents,
    identifiability,
    intervals,
    likelihood_of,
    posterior_table,
    probabilities,
    sample,
)
from virtual_soil.campaign.experiments.registry import responses_of

#: Those that the paper has.
RESPONSES = {name: response for name, response in responses_of(("repose", "shear")).items() if name != "bulk_density"}

VARIABLES = ("radius_m", "static_friction", "rolling_friction")
SPACE = Space(VARIABLES, dict.fromkeys(VARIABLES, (0.0, 1.0)))
EQUAL = {"cohesion": 1.0, "friction_angle": 1.0, "angle_of_repose": 1.0}


class Linear:
    """A response that is linear in the variables, with the same error everywhere."""

    def __init__(self, slopes, error=0.0):
        self.slopes, self.error = slopes, error

    def predict(self, values):
        return sum(slope * np.asarray(values[name], float) for slope, name in zip(self.slopes, VARIABLES, strict=True))

    def predict_with_error(self, values):
        mean = self.predict(values)
        return mean, np.full(np.shape(mean), self.error)


def problem(slopes=((1, 0, 0), (0, 1, 0), (0, 0, 1)), truth=(0.4, 0.5, 0.6), sigma=(0.02, 0.04, 0.03), error=0.0, weights=EQUAL):
    models = {name: Linear(row, error) for name, row in zip(EQUAL, slopes, strict=True)}
    targets = {name: float(np.dot(row, truth)) for name, row in zip(EQUAL, slopes, strict=True)}
    return Likelihood(RESPONSES, models, SPACE, targets, dict(zip(EQUAL, sigma, strict=True)), weights)


WEIGHTS = {"angle_of_repose": 0.25, "cohesion": 0.25, "friction_angle": 0.25, "large_grains": 0.25}
CASE = {"case": "moon", "soil": "moon", "weights": WEIGHTS}


def test_the_posterior_of_a_linear_problem_is_the_normal_distribution():
    unit, _ = sample(problem(), 4000)
    assert (unit.mean(axis=0) - [0.4, 0.5, 0.6]) / [0.02, 0.04, 0.03] == pytest.approx(np.zeros(3), abs=0.15)
    assert unit.std(axis=0) == pytest.approx([0.02, 0.04, 0.03], rel=0.1)


def test_errors_of_the_surrogate_add_to_those_of_the_target():
    unit, _ = sample(problem(error=0.03), 4000)
    assert unit.std(axis=0) == pytest.approx(np.hypot([0.02, 0.04, 0.03], 0.03), rel=0.1)


def test_a_tenth_of_the_weight_is_sqrt_ten_times_the_uncertainty():
    unit, _ = sample(problem(weights={**EQUAL, "cohesion": 0.1}), 4000)
    assert unit[:, 0].std() == pytest.approx(0.02 * np.sqrt(10), rel=0.1)


def test_the_same_samples_in_every_run():
    assert (sample(problem(), 200)[0] == sample(problem(), 200)[0]).all()


def test_both_of_two_modes_are_sampled():
    class Square(Linear):
        def predict(self, values):
            return (np.asarray(values["radius_m"], float) - 0.5) ** 2

    models = {"cohesion": Square(None), "friction_angle": Linear((0, 1, 0)), "angle_of_repose": Linear((0, 0, 1))}
    targets = {"cohesion": 0.09, "friction_angle": 0.5, "angle_of_repose": 0.5}
    unit, _ = sample(Likelihood(RESPONSES, models, SPACE, targets, dict.fromkeys(EQUAL, 0.01), EQUAL), 2000)
    assert 0.25 < (unit[:, 0] < 0.5).mean() < 0.75
    assert np.abs(np.abs(unit[:, 0] - 0.5) - 0.3).mean() < 0.02


def test_the_95_percent_region_holds_the_truth_in_95_percent_of_all_soils():
    random, sigma, inside = np.random.default_rng(7), np.array([0.05, 0.08, 0.06]), []
    crowd = SPACE.crowd(2**13)
    for _ in range(300):
        truth = random.uniform(0.3, 0.7, 3)
        likelihood = problem(truth=truth + sigma * random.standard_normal(3), sigma=sigma)
        logs = likelihood(crowd)
        inside.append(credible_level(logs, probabilities(logs), float(likelihood(truth)[0])) <= 0.95)
    assert 0.91 < np.mean(inside) < 0.99


def test_outside_the_design_nothing_is_probable():
    assert problem()(np.array([[0.5, 0.5, 1.01], [-0.01, 0.5, 0.5]])).tolist() == [-np.inf, -np.inf]


def test_intervals_hold_95_percent_of_the_samples():
    likelihood = problem()
    table = posterior_table(CASE, likelihood, *sample(likelihood, 4000))
    bounds = intervals(table, ["static_friction"])
    assert bounds["static_friction_low_95"] == pytest.approx(0.5 - 1.96 * 0.04, abs=0.012)
    assert bounds["static_friction_high_95"] == pytest.approx(0.5 + 1.96 * 0.04, abs=0.012)


def test_a_combination_that_no_test_sees_is_named():
    slopes = np.array([[1.0, 1.0, 0.0], [2.0, 2.0, 0.0], [0.0, 0.0, 1.0]])
    table = identifiability(CASE, problem(slopes, sigma=(0.1, 0.1, 0.1)), dict.fromkeys(VARIABLES, 0.5))
    assert table["determined"].tolist() == [True, True, False]
    assert table["singular_value"].tolist() == pytest.approx([np.sqrt(10) * 10, 10.0, 0.0], abs=1e-6)
    free = table.iloc[2][[f"component_{name}" for name in VARIABLES]].to_numpy(float)
    assert np.abs(free) == pytest.approx([np.sqrt(0.5), np.sqrt(0.5), 0.0], abs=1e-6)
    assert free[0] * free[1] < 0


def test_equivalent_sets_lie_in_the_region_and_far_apart():
    slopes = np.array([[1.0, 1.0, 0.0], [2.0, 2.0, 0.0], [0.0, 0.0, 1.0]])
    likelihood = problem(slopes, truth=(0.5, 0.5, 0.5), sigma=(0.02, 0.02, 0.02))
    posterior = posterior_table(CASE, likelihood, *sample(likelihood, 2000))

    class LeftHalf:
        def surrounds(self, values):
            return values["radius_m"] < 0.5

    table = equivalents(posterior, likelihood, 10, {"cohesion": LeftHalf()})
    assert not table["extrapolated"].iloc[1:].any()
    assert (table["radius_m"].iloc[1:] < 0.5).all()
    table = equivalents(posterior, likelihood, 10, {})
    assert table["rank"].tolist() == list(range(1, 11))
    for name, response in RESPONSES.items():
        distance = (table[response.column] - likelihood.targets[name]).abs()
        assert (distance <= max(0.02 * 1.001, distance.iloc[0])).all()
    assert table["log_likelihood"].iloc[0] == posterior["log_likelihood"].max()
    assert table["log_likelihood"].min() >= posterior["log_likelihood"].quantile(0.05)
    assert (table["radius_m"] + table["static_friction"]).to_numpy() == pytest.approx(1.0, abs=0.08)
    assert table["radius_m"].max() - table["radius_m"].min() > 0.8  # along the whole line that the tests do not see


def test_a_target_out_of_reach_does_not_drown_those_within():
    rows = [("moon", "cohesion", 9.0, 0.01), ("moon", "friction_angle", 0.5, 0.04), ("moon", "angle_of_repose", 0.6, 0.03)]
    soils = pd.DataFrame(rows, columns=["soil", "property", "value", "standard_uncertainty"])
    # cohesion hardly depends on anything: by itself it would prefer large frictions, by a hair's breadth
    models = {
        "cohesion": Linear((0.0, 0.01, 0.01), 0.001),
        "friction_angle": Linear((0, 1, 0)),
        "angle_of_repose": Linear((0, 0, 1)),
    }
    likelihood = likelihood_of(CASE, RESPONSES, models, soils, SPACE, 0.05)
    assert likelihood.discrepancies["cohesion"] == pytest.approx(9.0 - 0.02)
    assert likelihood.discrepancies["friction_angle"] == 0.0
    unit, _ = sample(likelihood, 2000)
    assert unit[:, 1:].mean(axis=0) == pytest.approx([0.5, 0.6], abs=0.01)
    deviations = likelihood.deviations(dict.fromkeys(VARIABLES, 0.5))
    assert deviations["cohesion"] == pytest.approx((9.0 - 0.01) / np.hypot(0.01, 0.001))
    assert deviations["friction_angle"] == 0.0


def test_an_unstated_uncertainty_is_a_share_of_the_value_and_a_stated_one_counts():
    rows = [("moon", "cohesion", 0.0, np.nan), ("moon", "friction_angle", 40.0, np.nan), ("moon", "angle_of_repose", 30.0, 2.0)]
    soils = pd.DataFrame(rows, columns=["soil", "property", "value", "standard_uncertainty"])
    weights = {"large_grains": 5, "friction_angle": 10, "angle_of_repose": 1, "cohesion": 10}
    found = likelihood_of({**CASE, "weights": weights}, RESPONSES, {}, soils, SPACE, 0.05)
    assert found.uncertainties == {"cohesion": 1.0, "friction_angle": 2.0, "angle_of_repose": 2.0}
    assert found.weights == pytest.approx({"angle_of_repose": 1 / 7, "cohesion": 10 / 7, "friction_angle": 10 / 7})
    with pytest.raises(CalibrationError, match="soil of a case is mars"):
        likelihood_of({**CASE, "soil": "mars"}, RESPONSES, {}, soils, SPACE, 0.05)


def test_a_set_whose_prediction_is_uncertain_is_no_equivalent():
    """Where the surrogate knows nothing, any target is consistent with it: the 95 % region holds such sets, the list must not."""

    class Vague(Linear):
        def predict_with_error(self, values):
            mean, _ = super().predict_with_error(values)
            return mean, np.where(np.asarray(values["static_friction"]) > 0.6, 0.5, 0.01)

    likelihood = problem(truth=(0.5, 0.5, 0.5), sigma=(0.05, 0.05, 0.05))
    vague = replace(likelihood, surrogates={name: Vague(model.slopes, 0.01) for name, model in likelihood.surrogates.items()})
    posterior = posterior_table(CASE, vague, *sample(vague, 2000))
    region = posterior[posterior["log_likelihood"] >= posterior["log_likelihood"].quantile(0.05)]
    off = (region["static_friction"] - 0.5).abs()
    assert off.max() > 0.2
    table = equivalents(posterior, vague, 30, {})
    assert len(table) > 10
    assert (table["static_friction"] - 0.5).abs().max() < 0.06


def test_regions_hold_as_many_made_up_soils_as_they_say():
    """500 soils on the reference's surrogates, measured as well as a good laboratory does."""
    reference = Path(__file__).parents[2] / "docs" / "reference" / "surrogates.json"
    processes = from_json(reference.read_text(encoding="utf-8"), "gaussian_process")
    noise = {"steady_cohesion": 10.0, "steady_friction_angle": 1.0, "angle_of_repose": 1.0}
    responses = {name: response for name, response in responses_of(("repose", "plane_shear")).items() if name in noise}
    levels = made_up_twins(responses, processes, processes["steady_cohesion"].space, noise, 500, 1)["credible_level"]
    for mass, low, high in ((0.5, 0.45, 0.55), (0.9, 0.87, 0.93), (0.95, 0.93, 0.97)):
        assert low <= np.mean(levels <= mass) <= high, mass
