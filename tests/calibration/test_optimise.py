"""Gauss-Newton and the optimum, on the published surrogates and on planted problems."""

import json
from types import SimpleNamespace

import numpy as np
import pytest

from virtual_soil.calibration import paper
from virtual_soil.calibration.errors import CalibrationError
from virtual_soil.calibration.gauss_newton import gauss_newton
from virtual_soil.calibration.optimise import (
    calibrate,
    calibrate_case,
    cases_about,
    combined_scale,
    distinct,
    objectives,
    present,
    relative_scale,
    search,
    targets_of,
    weights_of,
    within_reach,
)
from virtual_soil.calibration.paper import optima as paper_optima
from virtual_soil.calibration.paper import published
from virtual_soil.calibration.paper.optima import soil_table
from virtual_soil.calibration.space import Space
from virtual_soil.calibration.uncertainty import likelihood_of
from virtual_soil.campaign.experiments.registry import responses_of

#: Those that the paper has.
RESPONSES = {name: response for name, response in responses_of(("repose", "shear")).items() if name != "bulk_density"}
VARIABLES = ["radius_m", "static_friction", "rolling_friction"]
EQUAL = np.full(4, 0.25)
OPTIONS = {"tolerance": 1e-3, "max_iterations": 200, "n_starts": 8, "unreachable": "as_given"}
CASE = {"case": "sand", "soil": "silica_barco_sand", "weights": dict.fromkeys(RESPONSES, 1.0)}
SAND = {"cohesion": 24.0, "friction_angle": 26.6, "angle_of_repose": 30.0}
#: Hardly any preference for large grains.
SLIGHT = {"angle_of_repose": 0.25, "cohesion": 0.25, "friction_angle": 0.25, "large_grains": 1e-9}


def relative(targets):
    return {name: relative_scale(RESPONSES[name], {"value": target}, None) for name, target in targets.items()}


def relative_errors(surrogates, targets, variables=VARIABLES):
    return objectives(present(SLIGHT, variables), surrogates, relative(targets), variables, targets)


def test_gauss_newton_solves_a_linear_problem_in_one_step():
    A = np.array([[1.0, 2.0], [3.0, 1.0], [0.5, -1.0]])
    b = np.array([3.0, 4.0, -0.5])
    descent = gauss_newton(lambda x: (x.T @ A.T - b).T, np.zeros(2), np.ones(3), 1e-6, 10)
    assert descent.converged
    assert descent.x == pytest.approx([1.0, 1.0])
    assert descent.iterations == 2  # the second step finds that nothing is left to do


def test_gauss_newton_minimises_the_weighted_cost():
    descent = gauss_newton(lambda x: np.array([x[0] - 1.0, x[0] - 3.0]), np.zeros(1), np.array([3.0, 1.0]), 1e-9, 10)
    assert descent.x == pytest.approx([1.5])
    assert descent.cost == pytest.approx(0.5 * (3 * 0.25 + 2.25))


@pytest.mark.parametrize("start", [(70.85, 0.609, 0.0811), (70.0, 0.6, 0.08), (100.0, 1.0, 0.1)])
def test_the_papers_sand_optimum_comes_back_from_its_own_surrogates(start):
    descent = gauss_newton(relative_errors(published(), SAND), np.array(start), EQUAL, 1e-3, 500)
    assert descent.converged
    assert descent.x == pytest.approx([70.69, 0.6128, 0.0816], rel=1e-3)


def test_a_run_that_goes_astray_says_so():
    descent = gauss_newton(lambda x: np.array([np.exp(-x[0])]), np.zeros(1), np.ones(1), 1e-6, 20)
    assert not descent.converged
    assert "not converged after 20 iterations" in descent.reason


def test_objectives_are_relative_errors_and_prefer_large_grains():
    phi = relative_errors(published(), SAND)
    x = np.array([70.0, 0.6, 0.08])
    values = dict(zip(VARIABLES, (70e-6, 0.6, 0.08), strict=True))
    assert phi(x)[0] == pytest.approx(published()["angle_of_repose"].predict(values) / 30.0 - 1)
    assert phi(x)[1] == pytest.approx(published()["cohesion"].predict(values) / 24.0 - 1)
    assert phi(x)[3] == pytest.approx(10 * (np.pi / 2 - np.arctan(65.0)))


def test_every_case_has_a_minimum_at_least_as_cheap_as_the_one_the_paper_prints():
    weights = {case["case"]: np.array(list(case["weights"].values())) for case in paper_optima.CASES}
    options = {**OPTIONS, "cases": paper_optima.CASES}
    table, history, minima = calibrate(RESPONSES, published(), soil_table(), options, VARIABLES, "published")
    for _, row in table.iterrows():
        printed = paper.OPTIMA[row["case"]]
        x = np.array([printed["radius_m"] * 1e6, printed["static_friction"], printed["rolling_friction"]])
        phi = relative_errors(published(), targets_of(RESPONSES, soil_table(), CASE | {"soil": row["soil"]}))(x)
        assert row["cost"] < 0.5 * weights[row["case"]] @ phi**2
        assert row["inside_design"]
        assert 25e-6 <= row["radius_m"] <= 500e-6
    assert set(history["case"]) == set(weights)


def test_a_reachable_soil_is_found_exactly():
    truth = {"radius_m": 400e-6, "static_friction": 0.5, "rolling_friction": 0.15}
    targets = {name: float(s.predict(truth)) for name, s in published().items()}
    row, _, _ = calibrate_case(published(), targets, relative(targets), SLIGHT, OPTIONS, VARIABLES)
    for name, surrogate in published().items():
        assert float(surrogate.predict(row)) == pytest.approx(targets[name], rel=1e-3)


def test_a_target_out_of_reach_is_aimed_at_from_its_nearest_value():
    truth = {"radius_m": 60e-6, "static_friction": 0.5, "rolling_friction": 0.15}
    targets = {name: float(s.predict(truth)) for name, s in published().items()} | {"cohesion": 1e6}
    low, high = np.array([25e-6, 0.0, 0.0]), np.array([500e-6, 1.7, 0.3])
    aims = within_reach(published(), targets, low, high, VARIABLES)
    assert aims["friction_angle"] == targets["friction_angle"]
    corners = [dict(zip(VARIABLES, (r, s, q), strict=True)) for r in (25e-6, 500e-6) for s in (0.0, 1.7) for q in (0.0, 0.3)]
    assert max(float(published()["cohesion"].predict(corner)) for corner in corners) <= aims["cohesion"] < 1e6
    scales = relative(targets)
    row, _, _ = calibrate_case(published(), targets, scales, SLIGHT, {**OPTIONS, "unreachable": "nearest"}, VARIABLES)
    given, _, _ = calibrate_case(published(), targets, scales, SLIGHT, OPTIONS, VARIABLES)
    error = {
        k: abs(float(published()["friction_angle"].predict(v)) - targets["friction_angle"]) for k, v in enumerate((row, given))
    }
    assert error[0] < 0.1 < error[1]


def test_without_a_radius_among_the_variables_there_is_no_fourth_objective():
    assert len(relative_errors(published(), SAND)(np.ones(3))) == 4
    surrogates = published()
    flat = {name: type(s)(**{**vars(s), "g": {}}) for name, s in surrogates.items()}
    assert len(relative_errors(flat, SAND, VARIABLES[1:])(np.ones(2))) == 3


@pytest.mark.parametrize(
    "weights",
    [
        [0.25] * 4,
        {"large_grains": 1.0},
        {"angle_of_repose": 0.0, "large_grains": 1.0},
        {"angle_of_repose": 1.0, "cohesion": 1.0, "friction_angle": 1.0, "radius": 1.0},
        {**SLIGHT, "cohesion": -1.0},
        {**SLIGHT, "cohesion": float("nan")},
    ],
)
def test_weights_are_numbers_by_name_of_objectives_and_one_response_has_one(weights):
    with pytest.raises(CalibrationError) as refused:
        weights_of({"case": "sand", "weights": weights}, RESPONSES)
    assert f"optimise.cases: weights of sand is {weights}; allowed: some of " in str(refused.value)
    assert "{angle_of_repose: 0.25, cohesion: 0.25, friction_angle: 0.25, large_grains: 0.25}" in str(refused.value)


def test_weights_belong_to_their_names_in_any_order():
    given = {"large_grains": 4.0, "friction_angle": 3.0, "angle_of_repose": 1.0, "cohesion": 2.0}
    case = {"case": "sand", "soil": "silica_barco_sand", "weights": given}
    assert list(weights_of(case, RESPONSES).items()) == [
        ("angle_of_repose", 1.0), ("cohesion", 2.0), ("friction_angle", 3.0), ("large_grains", 4.0),
    ]  # fmt: skip
    fewer = {"angle_of_repose": RESPONSES["angle_of_repose"]}
    assert cases_about(fewer, [case]) == [{**case, "weights": {"angle_of_repose": 1.0, "large_grains": 4.0}}]
    assert cases_about(fewer, [{**case, "weights": {"cohesion": 1.0, "large_grains": 1.0}}]) == []


@pytest.mark.parametrize("weights", [{"angle_of_repose": 1.0, "cohesion": 0.0}, {"angle_of_repose": 1.0}])
def test_a_response_without_a_weight_is_left_out_of_cost_and_likelihood(weights):
    soils = soil_table().assign(standard_uncertainty=np.nan)
    options = {**OPTIONS, "cases": [{"case": "sand", "soil": "silica_barco_sand", "weights": weights}]}
    row = calibrate(RESPONSES, published(), soils, options, VARIABLES, "published")[0].iloc[0]
    assert row["cost"] < 1e-9  # one target can always be met
    assert row["weight_cohesion"] == 0
    space = Space(tuple(VARIABLES), published()["cohesion"].ranges, {"radius_m": 0.0})
    errors = {name: type(s)(**{**vars(s), "cv_rmse": 1.0}) for name, s in published().items()}
    likelihood = likelihood_of(options["cases"][0], RESPONSES, errors, soils, space, 0.05)
    assert likelihood.weights == {"angle_of_repose": 1.0}
    fewer = likelihood_of(options["cases"][0], RESPONSES, errors, soils.query("property == 'angle_of_repose'"), space, 0.05)
    at = space.crowd(8)
    assert likelihood(at).tolist() == fewer(at).tolist()
    assert set(likelihood.deviations(space.values(at[0])).keys()) == {"angle_of_repose"}


def test_a_weight_without_a_target_is_refused_and_a_response_without_both_is_predicted():
    soils = soil_table().query("property != 'cohesion'")
    with pytest.raises(CalibrationError, match="targets of silica_barco_sand is"):
        targets_of(RESPONSES, soils, CASE)
    case = {**CASE, "weights": {"angle_of_repose": 1.0, "friction_angle": 1.0}}
    assert set(targets_of(RESPONSES, soils, case)) == {"angle_of_repose", "friction_angle"}
    row = calibrate(RESPONSES, published(), soils, {**OPTIONS, "cases": [case]}, VARIABLES, "published")[0].iloc[0]
    assert np.isnan(row["target_cohesion_pa"])
    assert np.isfinite(row["cohesion_pa"])


def test_errors_are_in_units_of_target_and_surrogate_together_and_a_floor_keeps_them_finite():
    surrogate = SimpleNamespace(cv_rmse=0.3)
    scale = combined_scale(0.05, {"cohesion": 10.0})
    known = {"value": 30.0, "standard_uncertainty": 0.4}
    assert scale(RESPONSES["angle_of_repose"], known, surrogate) == pytest.approx(0.5)
    unknown = {"value": 80.0, "standard_uncertainty": float("nan")}
    assert scale(RESPONSES["angle_of_repose"], unknown, surrogate) == pytest.approx(np.hypot(4.0, 0.3))
    assert scale(RESPONSES["cohesion"], {"value": 0.0, "standard_uncertainty": float("nan")}, surrogate) == 10.0


def test_a_soil_without_cohesion_is_calibrated_with_combined_errors():
    soils = soil_table().assign(standard_uncertainty=1.0)
    soils.loc[soils["property"] == "cohesion", "value"] = 0.0
    errors = {name: type(s)(**{**vars(s), "cv_rmse": 1.0}) for name, s in published().items()}
    options, scale = {**OPTIONS, "cases": [CASE]}, combined_scale(0.05, {"cohesion": 10.0})
    row = calibrate(RESPONSES, errors, soils, options, VARIABLES, "published", scale)[0].iloc[0]
    assert row["target_cohesion_pa"] == 0.0
    assert abs(row["cohesion_pa"]) < 20.0


def test_a_zero_angle_is_refused_because_errors_are_relative_but_dry_sand_may_have_no_cohesion():
    soils = soil_table()
    soils.loc[0, "value"] = 0.0
    assert targets_of(RESPONSES, soils, CASE)["cohesion"] == 0.0
    phi = relative_errors(published(), {**SAND, "cohesion": 0.0})(np.array([70.0, 0.6, 0.08]))
    values = dict(zip(VARIABLES, (70e-6, 0.6, 0.08), strict=True))
    assert phi[1] == pytest.approx(published()["cohesion"].predict(values) / RESPONSES["cohesion"].smallest_scale)
    soils.loc[1, "value"] = 0.0
    with pytest.raises(CalibrationError, match="target friction_angle of silica_barco_sand is 0.0"):
        targets_of(RESPONSES, soils, CASE)


def test_ends_along_one_valley_are_one_minimum_and_a_barrier_makes_two():
    def cost(x):
        return (x[0] ** 2 - 1.0) ** 2 + 1e-4 * (x[0] - 1.0) ** 2 + 0.0 * x[1]

    ends = [(cost(np.array(x)), np.array(x), (name,)) for name, x in (("a", (1.0, 0.1)), ("b", (1.0, 0.9)), ("c", (-1.0, 0.5)))]
    found = distinct(ends, np.array([4.0, 1.0]), cost)
    assert [(x.tolist(), finders) for _, x, finders in found] == [([1.0, 0.1], ("a", "b")), ([-1.0, 0.5], ("c",))]


def test_the_search_keeps_every_minimum_and_who_found_it():
    def phi(x):
        return np.array([x[0] ** 2 - 1.0, 0.1 * (x[0] - 1.0), x[1] - 0.5])

    found = search(phi, np.ones(3), np.array([[-2.0, 0.0], [2.0, 0.4]]), ["a", "b"], OPTIONS)
    assert [m.x[0] for m in found.minima] == pytest.approx([1.0, -0.995], abs=2e-3)
    assert found.minima[0].cost == pytest.approx(0.5 * 0.01)
    assert found.global_cost == pytest.approx(found.minima[0].cost)
    assert "screened_start" in found.minima[0].found_by
    assert found.minima[0].at_bound == ("b",)


def test_the_condition_number_is_that_of_the_scaled_jacobian():
    bounds = np.array([[0.0, 0.0], [10.0, 1.0]])
    found = search(lambda x: np.array([x[0] - 5.0, x[1] - 0.5]), np.ones(2), bounds, ["a", "b"], OPTIONS)
    assert found.minima[0].condition_number == pytest.approx(10.0)


def test_the_papers_cases_have_cheaper_minima_than_it_prints(capsys):
    paper_optima.main()
    result = json.loads(capsys.readouterr().out.splitlines()[-1])
    assert set(result) == set(paper.OPTIMA)
    for case in paper_optima.CASES:
        assert result[case["case"]][0]["cost"] < paper_optima.printed_cost(case)
        assert set(result[case["case"]][0]) == {"radius_um", "static_friction", "rolling_friction", "cost"}
