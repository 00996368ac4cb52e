"""What the report says about its own numbers."""

import pandas as pd

from _report import answer_remarks

RANGES = {"cohesion": (-20.0, 80.0), "friction_angle": (8.0, 58.0), "angle_of_repose": (0.0, 53.0)}


def tables(**predicted):
    row = {"case": "sand", "surrogate": "ours", "at_bound": "", "status": "converged", "reason": "", "n_distinct": 1}
    row |= {"cohesion_pa": 24.0, "friction_angle_deg": 30.0, "angle_of_repose_deg": 30.0, **predicted}
    reach = [{"response": name, "lowest_simulated": low, "highest_simulated": high} for name, (low, high) in RANGES.items()]
    return {"calibration": pd.DataFrame([row]), "reachability": pd.DataFrame(reach)}


def test_a_prediction_beyond_everything_simulated_is_called_so():
    remarks = " ".join(answer_remarks(tables(cohesion_pa=282.0)))
    assert "sand: the predicted cohesion, 282.0 Pa, lies beyond all that was simulated (-20.0 to 80.0)" in remarks


def test_a_prediction_within_the_simulated_range_needs_no_remark():
    assert "beyond" not in " ".join(answer_remarks(tables()))
