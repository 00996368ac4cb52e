"""Surrogates of the reference campaign for other grains, gravities and lift speeds."""

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from virtual_soil.calibration.errors import CalibrationError
from virtual_soil.calibration.first_answer import cases_of, conditions, first_answer
from virtual_soil.calibration.models import from_json
from virtual_soil.calibration.optimise import combined_scale
from virtual_soil.calibration.scaling import lift_number, scaling_of
from virtual_soil.calibration.space import space_of
from virtual_soil.campaign import asked
from virtual_soil.campaign.experiments.apparatus import GRAVITIES_M_S2
from virtual_soil.campaign.experiments.registry import responses_of
from virtual_soil.campaign.tables import read_provenance, read_table

ROOT = Path(__file__).parents[2]
REFERENCE = ROOT / "docs" / "reference"
DESIGN = read_provenance(str(REFERENCE / "calibration.parquet"))["design"]
RADII_M = DESIGN["sweep"]["radius_m"]
SIMULATED = asked.of_reference(str(ROOT / "config" / "reference.yaml"))
SURROGATES = (REFERENCE / "surrogates.json").read_text(encoding="utf-8")
RESPONSES = {name: response for name, response in responses_of(("repose", "plane_shear")).items() if name in json.loads(SURROGATES)}
FRICTIONS = {"static_friction": np.array([0.2, 0.5, 1.2]), "rolling_friction": np.array([0.05, 0.1, 0.25])}
#: A test that is the reference's heap of 0.1 mm in all but its units: 40 times as large, lunar gravity, the same lift number.
LIKE_M = 1e-4
MOON = {"radius_m": 4e-3, "gravity_m_s2": 1.62, "lift_speed_m_s": 5e-3 * (1.62 / 9.81 * 40.0) ** 0.5, "density_kg_m3": 1700.0}
DENSITY = {"density_kg_m3": 1700.0}


def scaling(test):
    return scaling_of(test, SIMULATED, DESIGN)


@pytest.fixture(scope="module")
def models():
    return from_json(SURROGATES)


def test_the_reference_was_tested_as_its_configuration_says():
    assert SIMULATED == {"density_kg_m3": 3000.0, "gravity_m_s2": 9.81, "lift_speed_m_s": 5e-3}


def test_both_radii_have_one_lift_number():
    for test in ({"gravity_m_s2": 1.62}, {"lift_speed_m_s": 0.02}, {**MOON, "lift_speed_m_s": 0.012}):
        found = scaling(test)
        own = lift_number(found.test["lift_speed_m_s"], found.test["gravity_m_s2"], 1e-3)
        assert lift_number(5e-3, 9.81, 1e-3 * found.ratio) == pytest.approx(own)
    assert scaling(MOON).ratio * MOON["radius_m"] == pytest.approx(LIKE_M)


def test_a_soil_responds_as_the_reference_at_its_lift_number(models):
    there = {**FRICTIONS, "radius_m": np.full(3, LIKE_M)}
    fixed = scaling(MOON).surrogates(models, RESPONSES)
    free = scaling({name: MOON[name] for name in MOON if name != "radius_m"}).surrogates(models, RESPONSES)
    for name, model in models.items():
        mean, error = model.predict_with_error(there)
        for found, values in ((fixed, FRICTIONS), (free, {**FRICTIONS, "radius_m": np.full(3, MOON["radius_m"])})):
            scaled_mean, scaled_error = found[name].predict_with_error(values)
            assert scaled_mean == pytest.approx(mean)
            assert found[name].predict(values) == pytest.approx(mean)
            assert scaled_error == pytest.approx(np.hypot(error, RESPONSES[name].scaling_error))
            assert found[name].cv_rmse == pytest.approx(np.hypot(model.cv_rmse, RESPONSES[name].scaling_error))


def test_the_simulated_points_surround_the_same_grains():
    processes = from_json(SURROGATES, "gaussian_process")
    found = scaling({"gravity_m_s2": 1.62}).surrogates(processes, RESPONSES)["angle_of_repose"]
    weak = {"static_friction": 0.3, "rolling_friction": 0.1}
    low, high = found.ranges["radius_m"]
    assert found.surrounds({**weak, "radius_m": 0.9 * high})
    assert found.surrounds({**weak, "radius_m": 1.1 * low})
    assert not found.surrounds({**weak, "radius_m": 1.1 * high})


def test_the_density_changes_no_response_and_adds_its_error(models):
    found, values = scaling(DENSITY).surrogates(models, RESPONSES), {**FRICTIONS, "radius_m": np.full(3, LIKE_M)}
    for name, model in models.items():
        assert (found[name].predict(values) == model.predict(values)).all()
    assert found["angle_of_repose"].cv_rmse > models["angle_of_repose"].cv_rmse
    assert found["peak_cohesion"].cv_rmse == models["peak_cohesion"].cv_rmse


@pytest.mark.parametrize("test", [{}, SIMULATED, {"gravity_m_s2": GRAVITIES_M_S2["earth"]}])
def test_the_references_own_test_changes_nothing(models, test):
    found = scaling(test)
    assert found.surrogates(models, RESPONSES) == models
    assert found.design(DESIGN) == DESIGN
    assert conditions(found, RESPONSES) == []


def test_a_radius_of_the_references_own_adds_no_error(models):
    found = scaling({"radius_m": LIKE_M})
    for name, model in found.surrogates(models, RESPONSES).items():
        for ours, its in zip(
            model.predict_with_error(FRICTIONS),
            models[name].predict_with_error({**FRICTIONS, "radius_m": np.full(3, LIKE_M)}),
            strict=True,
        ):
            assert (ours == its).all()
    space = space_of(found.design(DESIGN))
    assert space.variables == ("static_friction", "rolling_friction")
    assert space.fixed == {"radius_m": LIKE_M}


def test_without_a_fixed_radius_the_radii_are_those_of_the_same_lift_numbers(models):
    found = scaling({"gravity_m_s2": 1.62, "lift_speed_m_s": 0.01})
    ends = space_of(found.design(DESIGN)).ranges["radius_m"]
    assert found.surrogates(models, RESPONSES)["angle_of_repose"].ranges["radius_m"] == pytest.approx(ends)
    for own, its in zip(ends, (min(RADII_M), max(RADII_M)), strict=True):
        assert lift_number(0.01, 1.62, own) == pytest.approx(lift_number(5e-3, 9.81, its))


@pytest.mark.parametrize("radius_m", [2e-3, 4e-3])
def test_a_lift_faster_than_simulated_is_refused_with_the_speed_that_was(radius_m):
    with pytest.raises(CalibrationError) as refused:
        scaling({"radius_m": radius_m, "lift_speed_m_s": 0.09})
    message = str(refused.value)
    assert f"is {lift_number(0.09, 9.81, radius_m):.4g}; allowed: up to 0.3193" in message
    (speed,) = re.search(r"a lift_speed_m_s up to (\S+)\.$", message).groups()
    assert float(speed) == pytest.approx(0.3193 * (9.81 * radius_m) ** 0.5, rel=1e-3)
    assert scaling({"radius_m": radius_m, "lift_speed_m_s": float(speed)}).radius_m == radius_m  # four digits, some rounded up


def test_a_lift_slower_than_simulated_is_answered_by_the_slowest_and_extrapolates():
    processes = from_json(SURROGATES, "gaussian_process")
    slow = scaling({"radius_m": 2e-3, "lift_speed_m_s": 5e-3})
    found = slow.surrogates(processes, RESPONSES)
    weak, slowest = {"static_friction": 0.3, "rolling_friction": 0.1}, max(RADII_M)
    for name, process in processes.items():
        mean, error = process.predict_with_error({**weak, "radius_m": slowest})
        added = np.hypot(RESPONSES[name].scaling_error, RESPONSES[name].slow_error)
        assert np.array(found[name].predict_with_error(weak)) == pytest.approx([float(mean), np.hypot(error, added)])
        assert found[name].surrounds(weak) == (name != "angle_of_repose")
    assert "extrapolated" in " ".join(conditions(slow, RESPONSES))
    least = scaling({"radius_m": 2e-3, "lift_speed_m_s": 0.01})  # to four digits that of the slowest
    assert not least.slow
    assert least.surrogates(processes, RESPONSES)["angle_of_repose"].surrounds(weak)
    assert "extrapolated" not in " ".join(conditions(least, RESPONSES))
    slower = scaling({"radius_m": slowest, "lift_speed_m_s": 2.5e-3})  # the slowest's own grains
    assert slower.error(RESPONSES["angle_of_repose"]) == slow.error(RESPONSES["angle_of_repose"])


def test_a_response_that_is_not_known_to_scale_is_left_out(models):
    unknown = {**RESPONSES, "angle_of_repose": replace(RESPONSES["angle_of_repose"], scaling_error=None)}
    assert set(RESPONSES) - set(scaling(MOON).answered(unknown)) == {"angle_of_repose"}
    assert scaling({}).answered(unknown) == scaling({"radius_m": LIKE_M}).answered(unknown) == unknown
    assert "angle_of_repose" not in scaling(MOON).surrogates(models, scaling(MOON).answered(unknown))


def test_a_design_of_ranges_is_scaled_too():
    ranges = {"radius_m": [25e-6, 500e-6], "static_friction": [0.1, 1.0], "rolling_friction": [0.0, 0.3]}
    design = {"variables": list(ranges), "ranges": ranges, "fixed": {"wall_static_friction": 0.3}}
    free = scaling_of({"gravity_m_s2": 1.62}, SIMULATED, design)
    assert space_of(free.design(design)).ranges["radius_m"] == pytest.approx([end / free.ratio for end in ranges["radius_m"]])
    fixed = space_of(scaling_of(MOON, SIMULATED, design).design(design))
    assert fixed.variables == ("static_friction", "rolling_friction")
    assert fixed.fixed == {"wall_static_friction": 0.3, "radius_m": MOON["radius_m"]}


def test_a_campaign_of_one_radius_answers_for_its_own_test_only():
    design = {**DESIGN, "variables": ["static_friction", "rolling_friction"]}
    assert scaling_of({}, SIMULATED, design).its_own
    with pytest.raises(CalibrationError, match="variables of the reference is .* allowed: radius_m among them"):
        scaling_of(MOON, SIMULATED, design)


def test_the_errors_are_those_of_the_page():
    page = (ROOT / "docs" / "scaling.md").read_text(encoding="utf-8")
    for name in ("angle_of_repose", "steady_friction_angle", "peak_friction_angle"):
        measured = float(re.search(rf"\| {name.replace('_', ' ')} \|.*\| (\S+) \|", page)[1])
        assert measured <= RESPONSES[name].scaling_error < measured + 0.1, name
    slow = float(re.search(r"\| angle of repose, lifted more slowly \|.*\| (\S+) \|", page)[1])
    assert slow <= RESPONSES["angle_of_repose"].slow_error < slow + 0.1


def answer(found):
    """First answer for the lunar regolith by the paper's polynomials, which are fast, as a table of one row; no errors added."""
    exact = {name: replace(response, scaling_error=0.0) for name, response in RESPONSES.items()}
    models, processes = (found.surrogates(from_json(SURROGATES, kind), exact) for kind in ("quadratic", "gaussian_process"))
    tables = {name: read_table(str(REFERENCE / f"{name}.parquet"), name) for name in ("repose", "steady_strength", "peak_strength")}
    soils = pd.read_parquet(REFERENCE / "soil.parquet").query("soil == 'lunar_regolith'")
    settings = {
        "design": found.design(DESIGN),
        "cases": cases_of(soils, [], exact),
        "optimise": {"tolerance": 1e-3, "max_iterations": 10, "n_starts": 2, "unreachable": "nearest"},
        "uncertainty": {"target_uncertainty_ratio": 0.05, "n_samples": 200},
        "scale": combined_scale(0.05, {}),
    }
    return first_answer(exact, models, processes, tables, soils, settings)[0].iloc[0]


def test_a_matched_test_gives_the_frictions_of_the_reference():
    ours, its = answer(scaling(MOON)), answer(scaling({"radius_m": LIKE_M}))
    assert ours["radius_m"] == MOON["radius_m"]
    for name in ("static_friction", "rolling_friction"):
        assert ours[name] == pytest.approx(its[name], rel=1e-3)
        assert ours[f"{name}_low_95"] == pytest.approx(its[f"{name}_low_95"], rel=0.05)
    assert ours["angle_of_repose_deg"] == pytest.approx(its["angle_of_repose_deg"], rel=1e-3)
    other = answer(scaling({"radius_m": 4 * LIKE_M}))
    assert abs(other["angle_of_repose_deg"] - its["angle_of_repose_deg"]) > 0.1  # the radius does matter
