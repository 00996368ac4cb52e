"""Which points count with which noise, both surrogates, the choice between them, and their text."""

import numpy as np
import pandas as pd
import pytest

from virtual_soil.calibration.errors import CalibrationError
from virtual_soil.calibration.models import choose, fit_both, from_json, known_points, to_json
from virtual_soil.calibration.noise import student
from virtual_soil.campaign.experiments.registry import responses_of

RESPONSES = responses_of(("repose", "shear"))
DESIGN = {
    "variables": ["radius_m", "static_friction", "rolling_friction"],
    "grid": {"static_friction": [0.0, 0.3, 0.9, 1.7], "rolling_friction": [0.0, 0.1, 0.3]},
    "sweep": {"radius_m": [25e-6, 50e-6, 100e-6, 200e-6]},
    "sweep_couples": [{"static_friction": 0.3, "rolling_friction": 0.1}, {"static_friction": 0.9, "rolling_friction": 0.3}],
}
MATERIAL = {"radius_m": 50e-6, "static_friction": 0.3, "rolling_friction": 0.1, "density_kg_m3": 3000.0}
FORM = {"f": "quadratic", "g": "log", "model": "best"}


def planted(response):
    points = [(50e-6, s, r) for s in DESIGN["grid"]["static_friction"] for r in DESIGN["grid"]["rolling_friction"]]
    points += [(x, *c.values()) for c in DESIGN["sweep_couples"] for x in DESIGN["sweep"]["radius_m"] if x != 50e-6]
    table = pd.DataFrame(points, columns=DESIGN["variables"])
    table["friction_angle_deg"] = response(table["static_friction"], table["rolling_friction"], table["radius_m"] / 50e-6)
    table["friction_angle_deg"] += 0.2 * np.random.default_rng(1).standard_normal(len(table))
    return table.assign(noise=0.2, point_id=[f"p{k}" for k in range(len(table))])


def polynomial(s, r, x):
    return (10 + 20 * s + 60 * r - 5 * s**2 - 30 * r**2 + 8 * s * r) * (1 - 0.1 * np.log(x))


def saturating(s, r, x):
    return 40 * np.tanh(4 * s) * (1 + r) + 0 * x


def test_each_surrogate_wins_where_it_is_right():
    for response, winner in ((polynomial, "quadratic"), (saturating, "gaussian_process")):
        models, _ = fit_both(RESPONSES["friction_angle"], planted(response), DESIGN, MATERIAL, FORM)
        chosen = choose({"friction_angle": models}, {"friction_angle": FORM})
        assert chosen["friction_angle"].model == winner
        other = choose({"friction_angle": models}, {"friction_angle": {**FORM, "model": "quadratic"}})
        assert other["friction_angle"].model == "quadratic"


def test_residuals_left_out_are_those_of_refits_without_the_point():
    points = planted(polynomial)
    models, table = fit_both(RESPONSES["friction_angle"], points, DESIGN, MATERIAL, FORM)
    mine = table[table["model"] == "quadratic"].reset_index(drop=True)
    assert set(mine["set"]) == {"f", "g"}
    k = int(np.flatnonzero((points["static_friction"] == 1.7) & (points["rolling_friction"] == 0.1))[0])
    without, _ = fit_both(RESPONSES["friction_angle"], points.drop(index=k), DESIGN, MATERIAL, FORM)
    row = points.iloc[k]
    expected = row["friction_angle_deg"] - float(without["quadratic"].predict(row[DESIGN["variables"]].to_dict()))
    assert mine.loc[k, "left_out_residual"] == pytest.approx(expected)
    known = mine["left_out_residual"].dropna()
    assert models["quadratic"].cv_rmse == pytest.approx(np.sqrt((known**2).mean()))
    assert models["quadratic"].cv_rmse > models["quadratic"].rmse


def test_text_and_back_predicts_the_same():
    models, _ = fit_both(RESPONSES["friction_angle"], planted(saturating), DESIGN, MATERIAL, FORM)
    text = to_json({"friction_angle": models}, {"friction_angle": FORM})
    at = {"radius_m": np.array([60e-6, 90e-6]), "static_friction": np.array([0.2, 1.0]), "rolling_friction": np.array([0.05, 0.2])}
    assert from_json(text)["friction_angle"].model == "gaussian_process"
    for kind, model in models.items():
        again = from_json(text, kind)["friction_angle"]
        assert again.predict_with_error(at)[0].tolist() == model.predict_with_error(at)[0].tolist()
        assert again.predict_with_error(at)[1].tolist() == model.predict_with_error(at)[1].tolist()


def heaps(**columns):
    rows = {"fidelity": "campaign", "purposes": "grid", "density_kg_m3": 3000.0, "radius_m": 50e-6, "static_friction": 0.3,
            "rolling_friction": 0.1, **columns}  # fmt: skip
    return pd.DataFrame(rows)


def test_all_heaps_of_the_base_material_count_with_the_scatter_over_their_seeds():
    repose = pd.concat(
        [
            heaps(point_id="a", angle_of_repose_deg=[20.0, 22.0, 24.0]),
            heaps(point_id="b", static_friction=0.9, angle_of_repose_deg=[30.0]),
            heaps(point_id="dense", density_kg_m3=4000.0, angle_of_repose_deg=[1.0]),
            heaps(point_id="a", fidelity="reference", angle_of_repose_deg=[1.0]),
            heaps(point_id="hidden", purposes="twin", angle_of_repose_deg=[1.0]),
            heaps(point_id="failed", angle_of_repose_deg=[np.nan]),
        ]
    )
    points = known_points(RESPONSES["angle_of_repose"], {"repose": repose}, DESIGN, MATERIAL).set_index("point_id")
    assert points["angle_of_repose_deg"].to_dict() == {"a": 22.0, "b": 30.0}
    assert points["noise"].to_dict() == pytest.approx({"a": 2.0 / np.sqrt(3), "b": 2.0})


def test_a_line_that_is_straight_by_luck_borrows_the_scatter_of_all_lines():
    scatter = np.array([0.001, 0.1, 0.2])
    strength = heaps(
        point_id=["a", "b", "c"], cohesion_pa=1.0, cohesion_se_pa=50.0 * scatter, relative_scatter=scatter, n_runs=[4, 8, 8]
    )
    points = known_points(RESPONSES["cohesion"], {"strength": strength}, DESIGN, MATERIAL)
    pooled = (2 * 0.001**2 + 6 * 0.1**2 + 6 * 0.2**2) / 14
    moderated = [np.sqrt((6 * pooled + n * s**2) / (6 + n)) for n, s in zip((2, 6, 6), scatter, strict=True)]
    factors = [student(6 + n) / student(n) for n in (2, 6, 6)]  # the stated errors have that of the line alone
    assert points["noise"].tolist() == pytest.approx([50.0 * s * f for s, f in zip(moderated, factors, strict=True)])


def test_without_any_result_one_sentence_says_so():
    with pytest.raises(CalibrationError, match="cohesion: points with a result is 0"):
        known_points(RESPONSES["cohesion"], {"strength": heaps(point_id=["a"], cohesion_pa=[np.nan])}, DESIGN, MATERIAL)


def test_heaps_without_any_repeat_have_no_scatter_and_are_refused():
    tables = {"repose": heaps(point_id=["a", "b"], angle_of_repose_deg=[1.0, 2.0])}
    with pytest.raises(CalibrationError, match="angle_of_repose: points with several seeds is 0"):
        known_points(RESPONSES["angle_of_repose"], tables, DESIGN, MATERIAL)
