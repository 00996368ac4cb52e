"""Refinement, verification, twins, sensitivity and reachability."""

import numpy as np
import pandas as pd
import pytest

from virtual_soil.calibration.checks import reachability_table
from virtual_soil.calibration.errors import CalibrationError
from virtual_soil.calibration.gaussian_process import fit_process
from virtual_soil.calibration.noise import student
from virtual_soil.calibration.points import point_at, point_id
from virtual_soil.calibration.refine import propose, settled
from virtual_soil.calibration.sensitivity import sobol_table
from virtual_soil.calibration.space import Space
from virtual_soil.calibration.twin import coverage_table, twin_soil, twin_table
from virtual_soil.calibration.uncertainty import Likelihood
from virtual_soil.calibration.verify import answer, comparison_table, undecided, verdict
from virtual_soil.campaign.experiments.registry import responses_of
from virtual_soil.campaign.measure import responses_by_seed

#: Those that the paper has.
RESPONSES = {name: response for name, response in responses_of(("repose", "shear")).items() if name != "bulk_density"}
VARIABLES = ("radius_m", "static_friction", "rolling_friction")
RANGES = {"radius_m": (25e-6, 500e-6), "static_friction": (0.0, 1.7), "rolling_friction": (0.0, 0.3)}
SPACE = Space(VARIABLES, RANGES, {"radius_m": 0.0})
MATERIAL = {"radius_m": 50e-6, "static_friction": 0.3, "rolling_friction": 0.1, "density_kg_m3": 3000.0}
NAMES = ("cohesion", "friction_angle", "angle_of_repose")


def process(response, values_of, unit, noise):
    observed = values_of(unit) + noise * np.random.default_rng(len(response)).standard_normal(len(unit))
    points = np.column_stack(list(SPACE.values(unit).values()))
    return fit_process(response, "deg", SPACE, points, observed, np.full(len(unit), noise))


def campaign(unit, noise=0.5):
    return {
        "cohesion": process("cohesion", lambda u: 0 * u[:, 0], unit, 3 * noise),
        "friction_angle": process("friction_angle", lambda u: 15 + 20 * u[:, 1] + 5 * u[:, 2], unit, noise),
        "angle_of_repose": process("angle_of_repose", lambda u: 10 + 30 * u[:, 2] + 8 * u[:, 0], unit, noise),
    }


def likelihood(models, **targets):
    targets = {"cohesion": 0.0, "friction_angle": 27.0, "angle_of_repose": 30.0, **targets}
    return Likelihood(RESPONSES, models, SPACE, targets, dict.fromkeys(NAMES, 1.0), dict.fromkeys(NAMES, 1.0))


def test_refinement_goes_to_the_optimum_and_then_where_the_soil_is_probable_but_unknown():
    left = SPACE.crowd(128)
    models = campaign(left[left[:, 0] < 0.4])  # coarse grains were never simulated
    wanted = likelihood(models)
    optimum = {name: float(v[0]) for name, v in SPACE.values(np.array([[0.3, 0.5, 0.5]])).items()}
    points = propose([optimum], wanted, 3)
    assert points[0] == optimum
    unit = SPACE.unit({name: [point[name] for point in points] for name in VARIABLES})
    assert unit[1, 0] > 0.4
    crowd = wanted(SPACE.crowd(1024))
    assert wanted(unit[1:]).min() > np.quantile(crowd, 0.7)
    assert np.linalg.norm(unit[1] - unit[2]) > 0.05
    rivals = [optimum, {**optimum, "static_friction": 1.2}, {**optimum, "static_friction": 1.6}]
    assert propose(rivals, wanted, 2) == rivals[:2]


def comparison(simulated, target_se=0.1, predicted=30.0, match="matches"):
    numbers = {"target": 30.0, "target_se": target_se, "predicted": predicted, "simulated": simulated, "simulated_se": 3.0}
    return pd.DataFrame({"case": ["sand"] * 3, "match": match, **numbers})


def test_a_case_is_settled_within_the_tolerance_or_the_targets_uncertainty_whatever_the_noise():
    assert settled(comparison([30.0, 31.0, 29.0]), 0.05) == {"sand"}
    assert settled(comparison([30.0, 32.0, 29.0]), 0.05) == set()
    assert settled(comparison([30.0, 32.0, 29.0], target_se=2.1), 0.05) == {"sand"}
    assert settled(comparison([30.0, np.nan, 29.0]), 0.05) == set()
    assert settled(comparison([30.0, 40.0, 29.0], match=["matches", "not asked", "matches"]), 0.05) == {"sand"}


POINT = point_id(point_at(MATERIAL, {"radius_m": 1e-4, "static_friction": 0.4, "rolling_friction": 0.2}))


def verification_tables(angles=(27.0, 29.0, 31.0), seeds=(1, 2, 3), slope=0.5):
    point = POINT
    repose = pd.DataFrame({"point_id": point, "angle_of_repose_deg": angles})
    tests = [(seed, p, (10.0 * seed + slope * p) * (1 + 1e-3 * (p == 500.0))) for seed in seeds for p in (250.0, 500.0, 1000.0)]
    shear = pd.DataFrame(tests, columns=["seed", "normal_stress_pa", "plateau_shear_stress_pa"]).assign(
        point_id=point, fidelity="campaign", purposes="verification", status="done"
    )
    shear["plane_normal_stress_pa"] = shear["normal_stress_pa"]
    strength = pd.DataFrame([{"point_id": point, "cohesion_se_pa": 4.0, "friction_angle_se_deg": 0.7, **LINE}])
    return {"repose": repose, "shear": shear, "strength": strength}


OPTIMA = pd.DataFrame(
    [{"case": "sand", "soil": "sand", "radius_m": 1.00003e-4, "static_friction": 0.4, "rolling_friction": 0.2,
      "target_cohesion_pa": 24.0, "target_friction_angle_deg": 26.6, "target_angle_of_repose_deg": 30.0,
      "weight_cohesion": 1.0, "weight_friction_angle": 1.0, "weight_angle_of_repose": 1.0}]
)  # fmt: skip
LINE = {"relative_scatter": 0.1, "n_runs": 8}
#: A line's error where the campaign knows its scatter, over its own.
MODERATED = student(12) / student(6)
SCATTER = {
    name: lambda _, sd=sd: np.array([sd]) for name, sd in {"angle_of_repose": 3.0, "cohesion": 0.1, "friction_angle": 0.1}.items()
}


TARGET_ERRORS = {("sand", "cohesion"): 5.0, ("sand", "friction_angle"): 0.5, ("sand", "angle_of_repose"): 1.0}
LIMITS = {
    "difference_of_consequence": {"cohesion_pa": 40.0, "friction_angle_deg": 4.0, "angle_of_repose_deg": 4.0},
    "standard_error": {"cohesion_pa": 20.0, "friction_angle_deg": 1.0, "angle_of_repose_deg": 3.0},
}


def compared(tables, limits=LIMITS, spoiled=None, **changed):
    by_seed = responses_by_seed(RESPONSES, tables, {"shear": {"strength": "plateau", "normal_stress": "plane"}})
    models = campaign(SPACE.crowd(64))
    optima = OPTIMA.assign(**changed)
    return comparison_table(
        RESPONSES, optima, models, tables, by_seed, SCATTER, TARGET_ERRORS, limits, spoiled or {}, {POINT: 0.03}, MATERIAL
    )


def test_verification_compares_prediction_and_simulation_at_the_optimum():
    table = compared(verification_tables()).set_index("response")
    heap = table.loc["angle_of_repose"]
    assert (heap["simulated"], heap["simulated_sd"], heap["n_seeds"], heap["target"]) == (29.0, 2.0, 3, 30.0)
    se = 2.0 / np.sqrt(3) * student(2)
    assert heap["simulated_se"] == pytest.approx(se)
    assert heap["gap"] == pytest.approx(29.0 - heap["predicted"])
    assert table.loc["friction_angle", "simulated"] == pytest.approx(np.degrees(np.arctan(0.5)), abs=0.2)
    assert table.loc["cohesion", "simulated"] == pytest.approx(20.0, abs=1.0)
    assert table.loc["cohesion", "simulated_sd"] == pytest.approx(10.0, rel=0.05)
    assert set(table["max_overlap_ratio"]) == {0.03}
    assert table.loc["cohesion", "prediction"] == "confirmed"  # predicted 0, simulated 20 +- 13: three seeds tell no more
    assert heap["difference"] == -1.0
    assert heap["difference_se"] == pytest.approx(np.hypot(1.0, se))
    # wanted 24 +- 5 Pa, 26.6 +- 0.5 deg and 30 +- 1 deg
    assert table["match"].to_dict() == {"cohesion": "matches", "friction_angle": "matches", "angle_of_repose": "matches"}
    table = table.reset_index()
    assert verdict(table, "prediction") == "contradicted: friction_angle; not decided: angle_of_repose"
    assert verdict(table.assign(prediction="confirmed"), "prediction") == "confirmed"
    assert verdict(table, "match") == "matches"
    table.loc[table["response"] == "angle_of_repose", "prediction"] = "not simulated"
    assert verdict(table, "prediction") == "contradicted: friction_angle; not simulated: angle_of_repose"


def test_a_response_without_a_weight_is_not_asked_to_match():
    table = compared(verification_tables(), weight_cohesion=0.0, target_cohesion_pa=np.nan).set_index("response")
    assert table["match"].to_dict() == {"cohesion": "not asked", "friction_angle": "matches", "angle_of_repose": "matches"}
    assert table.loc["cohesion", "prediction"] == "confirmed"  # predictions are compared for all
    table = table.assign(prediction=["not decided", "confirmed", "confirmed"]).reset_index()
    assert verdict(table, "match") == "matches"
    assert verdict(table, "prediction") == "confirmed"  # what nobody asked for decides nothing


def test_a_test_too_blunt_to_decide_matches_nothing_and_confirms_nothing():
    blunt = {name: {column: 0.1 * value for column, value in columns.items()} for name, columns in LIMITS.items()}
    table = compared(verification_tables(), blunt).set_index("response")
    assert table["match"].to_dict() == {"cohesion": "not decided", "friction_angle": "matches", "angle_of_repose": "not decided"}
    assert verdict(table.reset_index(), "match") == "not decided: cohesion, angle_of_repose"  # every seed has the same slope
    assert "confirmed" not in set(table["prediction"])


def test_simulations_that_were_spoiled_are_counted_at_their_optimum():
    point = point_id(point_at(MATERIAL, {"radius_m": 1e-4, "static_friction": 0.4, "rolling_friction": 0.2}))
    assert set(compared(verification_tables(), spoiled={point: 2, "another": 5})["n_spoiled"]) == {2}
    assert set(compared(verification_tables(), spoiled={"another": 5})["n_spoiled"]) == {0}


@pytest.mark.parametrize(
    ("difference", "error", "decisive", "expected"),
    [(1.9, 1.0, True, "matches"), (1.9, 1.0, False, "not decided"), (-2.1, 1.0, True, "misses"), (2.1, 1.0, False, "misses"),
     (np.nan, np.nan, False, "not simulated")],
)  # fmt: skip
def test_a_question_has_four_answers(difference, error, decisive, expected):
    assert answer("match", difference, error, decisive) == expected


def test_two_seeds_have_the_scatter_that_the_campaign_knows():
    table = compared(verification_tables((27.0, 29.0), (1, 2)))
    errors = table.set_index("response")["simulated_se"]
    assert errors.to_dict() == pytest.approx(
        {"angle_of_repose": 3.0 / np.sqrt(2), "cohesion": 4.0 * MODERATED, "friction_angle": 0.7 * MODERATED}
    )


def test_an_optimum_whose_simulations_all_failed_is_not_verified():
    tables = verification_tables()
    empty = {name: table.iloc[:0] for name, table in tables.items()}
    table = compared(empty)
    assert table["simulated"].isna().all()
    for question in ("prediction", "match"):
        assert set(table[question]) == {"not simulated"}
        assert verdict(table, question) == "not simulated"


def test_every_simulated_soil_is_found_again_about_as_often_as_the_region_says():
    processes = campaign(SPACE.crowd(64)[:40])
    truths = SPACE.values(np.array([[0.3, 0.6, 0.4], [0.7, 0.4, 0.6]]))
    twins = {f"twin{k}": {name: float(value[k]) for name, value in truths.items()} for k in range(2)}
    known = [
        {"soil": twin, "property": name, "value": float(processes[name].predict(at)), "standard_uncertainty": 0.5}
        for twin, at in twins.items()
        for name in RESPONSES
    ]
    every = coverage_table(RESPONSES, processes, processes, SPACE, twins, pd.DataFrame(known))
    assert every["kind"].value_counts().to_dict() == {"made up": 500, "left out": 40, "simulated": 2}
    made_up = every.loc[every["kind"] == "made up", "credible_level"]
    for mass in (0.5, 0.9, 0.95):
        assert (made_up <= mass).mean() == pytest.approx(mass, abs=0.05)
    simulated = every[every["kind"] == "simulated"]
    assert simulated["inside_95"].all()  # its targets are the predictions there
    assert simulated["static_friction"].tolist() == [twin["static_friction"] for twin in twins.values()]
    table = every[every["kind"] == "left out"]
    assert table["inside_95"].mean() > 0.85
    assert table["credible_level"].mean() < 0.7  # and the regions are not all of the design


def test_coverage_sees_errors_that_are_stated_too_small():
    unit = SPACE.crowd(64)[:40]
    honest, liars = campaign(unit, 2.0), {}
    for name, model in honest.items():
        small = tuple(0.05 * e for e in model.noise)
        liars[name] = type(model)(**{**vars_of(model), "noise": small})
    table = coverage_table(RESPONSES, liars, liars, SPACE, {}, pd.DataFrame())
    assert table.loc[table["kind"] == "left out", "inside_95"].mean() < 0.8


def vars_of(model):
    return {name: getattr(model, name) for name in type(model).__dataclass_fields__}


TWIN = {"radius_m": 80e-6, "static_friction": 0.6, "rolling_friction": 0.14, "repose_seeds": [1, 2], "shear_seeds": [1]}


def test_a_twin_is_a_soil_with_what_its_simulations_measure():
    point = point_id(point_at(MATERIAL, {name: TWIN[name] for name in VARIABLES}))
    common = {"point_id": point, "fidelity": "campaign", "seed": [1, 2, 9]}
    repose = pd.DataFrame({**common, "angle_of_repose_deg": [30.0, 32.0, 90.0]})
    line = {"cohesion_pa": -4.0, "cohesion_se_pa": 5.0, "friction_angle_deg": 33.0, "friction_angle_se_deg": 0.5, **LINE}
    strength = pd.DataFrame([{"point_id": point, "fidelity": "campaign", **line}])
    design = {
        "variables": list(VARIABLES),
        "grid": {"static_friction": [0.0, 0.1, 1.7], "rolling_friction": [0.0, 0.05, 0.3]},
        "sweep": {"radius_m": [25e-6, 500e-6]},
    }
    at = {name: TWIN[name] for name in VARIABLES}
    tables = {"repose": repose.assign(**at), "strength": strength.assign(**at)}
    rows = twin_soil("hidden", TWIN, RESPONSES, tables, design, MATERIAL).set_index("property")
    assert rows["value"].to_dict() == {"cohesion": -4.0, "friction_angle": 33.0, "angle_of_repose": 31.0}
    assert rows["standard_uncertainty"].to_dict()["cohesion"] == pytest.approx(5.0 * MODERATED)
    with pytest.raises(CalibrationError, match="simulations of twin hidden with a result for angle_of_repose is 0"):
        twin_soil("hidden", {**TWIN, "repose_seeds": [7]}, RESPONSES, tables, design, MATERIAL)


def test_the_truth_is_inside_where_it_is_probable_and_outside_where_it_is_not():
    models = campaign(SPACE.crowd(64))
    wanted = likelihood(models)
    optimum = pd.DataFrame([{"case": "hidden", **dict.fromkeys(VARIABLES, 0.1)}])
    from virtual_soil.calibration.uncertainty import posterior_table, sample

    case = {"case": "hidden", "soil": "hidden"}
    posterior = posterior_table(case, wanted, *sample(wanted, 500))
    for unit, inside in (([0.5, 0.5, 0.5], True), ([0.5, 0.9, 0.1], False)):
        truth = {name: float(v[0]) for name, v in SPACE.values(np.array([unit])).items()}
        table = twin_table({"hidden": truth}, [case], optimum, posterior, {"hidden": wanted}, SPACE)
        assert len(table) == 3
        assert set(table["inside_95"]) == {inside}


def test_sobol_indices_of_a_linear_response_are_the_shares_of_its_variance():
    table = sobol_table({"friction_angle": campaign(SPACE.crowd(64), 0.05)["friction_angle"]}, SPACE).set_index("variable")
    shares = {"radius_m": 0.0, "static_friction": 400 / 425, "rolling_friction": 25 / 425}
    assert table["first_order"].to_dict() == pytest.approx(shares, abs=0.03)
    assert table["total"].to_dict() == pytest.approx(shares, abs=0.03)


def test_an_unreachable_target_is_named_with_the_nearest_value_and_the_way_on():
    models = campaign(SPACE.crowd(64), 0.1)
    runs = pd.DataFrame({"fidelity": "campaign", "cohesion_pa": [0.0], "friction_angle_deg": 20.0, "angle_of_repose_deg": 20.0})
    rows = [
        ("moon", "angle_of_repose", 65.0, np.nan),
        ("moon", "friction_angle", 35.0, np.nan),
        ("moon", "cohesion", 300.0, np.nan),
    ]
    soils = pd.DataFrame(rows, columns=["soil", "property", "value", "standard_uncertainty"])
    table = reachability_table(RESPONSES, models, SPACE, {"repose": runs, "strength": runs}, soils, 0.05).set_index("response")
    assert table["reachable"].to_dict() == {"angle_of_repose": False, "friction_angle": True, "cohesion": False}
    assert table.loc["angle_of_repose", "nearest_reachable"] == pytest.approx(48.0, abs=0.5)
    assert table.loc["angle_of_repose", "grows_with"] == "+rolling_friction, +radius_m"
    assert table.loc["friction_angle", "grows_with"] == ""


def test_what_is_too_blunt_to_tell_is_undecided_whatever_the_prediction():
    table = pd.DataFrame(
        {
            "case": ["a", "a", "b", "c", "c"],
            "response": ["cohesion", "friction_angle", "cohesion", "cohesion", "friction_angle"],
            "match": ["not decided", "matches", "misses", "not decided", "not decided"],
            "prediction": ["confirmed", "not decided", "not decided", "contradicted", "confirmed"],
        }
    )
    assert undecided(table) == {"a": ["cohesion"], "c": ["cohesion", "friction_angle"]}
