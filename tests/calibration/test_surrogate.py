"""Surrogates f x g: recovery of planted functions, the paper's published ones, refusals."""

import numpy as np
import pandas as pd
import pytest

from virtual_soil.calibration import paper
from virtual_soil.calibration.errors import CalibrationError
from virtual_soil.calibration.paper import published
from virtual_soil.calibration.surrogate import fit_surrogate
from virtual_soil.campaign.experiments.registry import responses_of

RESPONSES = responses_of(("repose", "shear"))

DESIGN = {
    "variables": ["radius_m", "static_friction", "rolling_friction"],
    "grid": {"static_friction": [0.0, 0.3, 0.9, 1.7], "rolling_friction": [0.0, 0.1, 0.3]},
    "sweep": {"radius_m": [25e-6, 50e-6, 100e-6, 200e-6]},
    "sweep_couples": [{"static_friction": 0.3, "rolling_friction": 0.1}, {"static_friction": 0.9, "rolling_friction": 0.3}],
}
ANGLE = RESPONSES["angle_of_repose"]
MATERIAL = {"radius_m": 50e-6, "static_friction": 0.3, "rolling_friction": 0.1}


def planted(g, noise=0.0):
    """Points of the design with a response that is exactly f x g, plus noise."""
    rng = np.random.default_rng(5)
    points = [(50e-6, s, r) for s in DESIGN["grid"]["static_friction"] for r in DESIGN["grid"]["rolling_friction"]]
    points += [(x, *c.values()) for c in DESIGN["sweep_couples"] for x in DESIGN["sweep"]["radius_m"] if x != 50e-6]
    table = pd.DataFrame(points, columns=["radius_m", "static_friction", "rolling_friction"])
    s, r = table["static_friction"], table["rolling_friction"]
    table["angle_of_repose_deg"] = (10 + 20 * s + 60 * r - 5 * s**2 - 30 * r**2 + 8 * s * r) * g(table["radius_m"] / 50e-6)
    table["angle_of_repose_deg"] += noise * rng.standard_normal(len(table))
    table["point_id"] = [f"p{k}" for k in range(len(table))]
    return table


@pytest.mark.parametrize(
    ("form", "g", "coefficients"),
    [
        ("quadratic", lambda x: 0.7 + 0.45 * x - 0.15 * x**2, (0.7, 0.45, -0.15)),
        ("log", lambda x: 1 - 0.115 * np.log(x), (0.115,)),
    ],
)
def test_a_planted_product_is_recovered(form, g, coefficients):
    surrogate = fit_surrogate(ANGLE, planted(g), DESIGN, MATERIAL, {"f": "quadratic", "g": form})
    assert surrogate.g["radius_m"].coefficients == pytest.approx(coefficients)
    assert dict(zip(surrogate.powers, surrogate.coefficients, strict=True))[0, 1] == pytest.approx(60.0)
    assert surrogate.r_squared == pytest.approx(1.0)
    points = planted(g)
    predicted = surrogate.predict({name: points[name].to_numpy() for name in DESIGN["variables"]})
    assert predicted == pytest.approx(points["angle_of_repose_deg"].to_numpy())


@pytest.mark.parametrize("case", list(paper.OPTIMA))
def test_the_published_surrogates_give_the_printed_properties_at_the_printed_optima(case):
    """Within the rounding of the printed coefficients: 0.15 deg; some 4 Pa for sand and 20 Pa for regolith."""
    optimum, surrogates = paper.OPTIMA[case], published()
    for response, tolerance in (("friction_angle", 0.15), ("angle_of_repose", 0.15), ("cohesion", 5 if case == "sand" else 25)):
        printed = optimum["cohesion_pa" if response == "cohesion" else f"{response}_deg"]
        assert float(surrogates[response].predict(optimum)) == pytest.approx(printed, abs=tolerance)


def test_too_few_points_are_refused_with_the_number_that_is_left():
    points = planted(lambda x: 1 + 0 * x).query("static_friction < 0.5")
    with pytest.raises(CalibrationError, match="number of points to fit is 6; allowed: more than the 6"):
        fit_surrogate(ANGLE, points, DESIGN, MATERIAL, {"f": "quadratic", "g": "log"})


def test_a_design_that_does_not_determine_the_coefficients_is_refused():
    points = planted(lambda x: 1 + 0 * x).query("rolling_friction == 0.1")
    points = pd.concat([points.assign(point_id=points["point_id"] + str(k)) for k in range(3)])
    with pytest.raises(CalibrationError, match="rank of the design"):
        fit_surrogate(ANGLE, points, DESIGN, MATERIAL, {"f": "quadratic", "g": "log"})


def test_a_notebook_sees_what_a_surrogate_is_and_how_far_it_reaches():
    shown = published()["angle_of_repose"]._repr_html_()
    for words in ("angle_of_repose", "quadratic", "deg", "2.5e-05 to 0.0005", "0 to 1.7"):
        assert words in shown
    assert "left-out" not in shown  # the paper prints no points
    fitted = fit_surrogate(ANGLE, planted(lambda x: 1 - 0.1 * np.log(x), 0.5), DESIGN, MATERIAL, {"f": "quadratic", "g": "log"})
    assert f"<td>{fitted.n_points}</td>" in fitted._repr_html_()
    assert f"<td>{fitted.cv_rmse:.4g}</td>" in fitted._repr_html_()
