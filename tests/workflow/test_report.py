"""What the report says about its own numbers."""

import pandas as pd

from virtual_soil.report.calibrated import answer_remarks, coverage_sentence, reach_remarks

RANGES = {"cohesion": (-20.0, 80.0), "friction_angle": (8.0, 58.0), "angle_of_repose": (0.0, 53.0)}


def tables(determined=True, **changes):
    row = {
        "case": "sand", "surrogate": "ours", "at_bound": "", "n_distinct": 1, "deviation_sd": 0.5, "missed": "", "extrapolated": "",
        "verified": "agrees",
        "cohesion_pa": 24.0, "friction_angle_deg": 30.0, "angle_of_repose_deg": 30.0, **changes,
    }  # fmt: skip
    reach = [{"response": name, "lowest_simulated": low, "highest_simulated": high} for name, (low, high) in RANGES.items()]
    direction = {"case": "sand", "determined": determined, "component_radius_m": 0.05, "component_static_friction": 0.9,
                 "component_rolling_friction": -0.4}  # fmt: skip
    return {
        "calibration": pd.DataFrame([row]),
        "reachability": pd.DataFrame(reach),
        "identifiability": pd.DataFrame([direction]),
    }


def remark(**changes):
    (text,) = answer_remarks(tables(**changes))
    return text


def test_a_prediction_beyond_everything_simulated_is_called_so():
    expected = "The predicted cohesion, 282.0 Pa, lies beyond all that the campaign simulated (-20.0 to 80.0)"
    assert expected in remark(cohesion_pa=282.0)


def test_an_optimum_in_order_needs_no_remark():
    assert remark() == "sand: nothing to add."


def test_every_reason_for_doubt_is_named():
    assert "misses cohesion, friction angle, by up to 11 standard deviations" in remark(
        deviation_sd=10.8, missed="cohesion,friction_angle"
    )
    assert "extrapolated: cohesion, angle of repose" in remark(extrapolated="cohesion,angle_of_repose")
    assert "edge of the design (r, µs)" in remark(at_bound="radius_m,static_friction")
    assert "does not confirm what was predicted (differs: cohesion)" in remark(verified="differs: cohesion")
    assert "3 distinct minima" in remark(n_distinct=3)
    assert "do not determine +0.90 µs -0.40 µr there" in remark(determined=False)


def test_a_target_out_of_reach_is_told_with_the_way_on():
    row = {"soil": "moon", "response": "angle_of_repose", "target": 65.0, "reachable": False, "lowest_predicted": 0.0,
           "highest_predicted": 53.21, "nearest_reachable": 53.21, "grows_with": "+rolling_friction, -radius_m"}  # fmt: skip
    (text,) = reach_remarks(pd.DataFrame([row, {**row, "reachable": True}]))
    assert "without adhesion" in reach_remarks(pd.DataFrame([{**row, "response": "cohesion"}]))[-1]
    assert "The angle of repose of moon, 65, is out of reach: the design gives 0.0 to 53.2." in text
    assert "would go on with +µr, -r." in text


def test_the_coverage_is_counted():
    assert "3 of 4 (75%)" in coverage_sentence(pd.DataFrame({"inside_95": [True, True, False, True]}))
