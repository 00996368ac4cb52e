"""Screening and acceleration tables from small made-up campaigns."""

import numpy as np
import pandas as pd
import pytest

from virtual_soil.calibration.checks import FidelityCheck, acceleration_table
from virtual_soil.calibration.errors import CalibrationError
from virtual_soil.calibration.noise import known_scatter, line_errors
from virtual_soil.calibration.response import Response
from virtual_soil.calibration.screening import screening_table
from virtual_soil.campaign.experiments.registry import responses_of

RESPONSES = responses_of(("repose", "shear"))

ANGLE = RESPONSES["angle_of_repose"]
MATERIAL = {"static_friction": 0.3, "density_kg_m3": 3000.0}
SCREENING = {"base_seeds": [1, 2, 3], "changed_seeds": [1, 2], "factors": {"static_friction": 1.6667, "density_kg_m3": 1.3333}}


def heaps(**columns):
    rows = {
        "fidelity": "campaign", "status": "static", "point_id": "base", "rolling_friction": 0.1, "wall_time_s": 2.0,
        "static_friction": 0.3, "density_kg_m3": 3000.0, **columns,
    }  # fmt: skip
    return pd.DataFrame(rows)


def campaign():
    return pd.concat(
        [
            heaps(seed=[1, 2, 3, 4], angle_of_repose_deg=[27.0, 28.0, 26.0, 90.0]),
            heaps(seed=[1, 2], static_friction=0.5, angle_of_repose_deg=[31.0, 32.0]),
            heaps(seed=[1, 2], density_kg_m3=4000.0, angle_of_repose_deg=[27.0, np.nan]),
        ]
    )


def test_screening_compares_one_change_at_a_time_with_the_base_set():
    table = screening_table(ANGLE, campaign(), MATERIAL, SCREENING, True).set_index("parameter")
    assert table.loc["base", ["angle_of_repose_deg", "sd_deg", "n_runs"]].tolist() == [27.0, 1.0, 3]
    assert table.loc["base", ["difference_deg", "difference_se_deg", "exceeds_noise"]].tolist() == [0.0, 0.0, False]
    friction = table.loc["static_friction"]
    assert friction["difference_deg"] == pytest.approx(4.5)
    assert friction["sensitivity_percent"] == pytest.approx(100 * (4.5 / 27) / (0.2 / 0.3))
    pooled = np.sqrt((2.0 + 0.5) / (2 + 1))
    assert friction["difference_se_deg"] == pytest.approx(pooled * np.sqrt(1 / 3 + 1 / 2))
    assert friction["exceeds_noise"]
    assert friction["paper_sensitivity_percent"] == 21.9


def test_a_change_inside_the_noise_is_called_so_and_failed_runs_do_not_count():
    density = screening_table(ANGLE, campaign(), MATERIAL, SCREENING, True).set_index("parameter").loc["density_kg_m3"]
    assert density["n_runs"] == 1
    assert not density["exceeds_noise"]


def test_screening_without_a_base_run_is_refused():
    with pytest.raises(CalibrationError, match="base runs of the screening"):
        screening_table(ANGLE, heaps(seed=[9], angle_of_repose_deg=[27.0]), MATERIAL, SCREENING, True)


def test_a_response_that_is_a_regression_is_screened_by_its_value_and_the_error_of_the_line():
    """The scatter that lines are known to have makes the error of one that is straight by chance as large as the other's."""
    lines = heaps(static_friction=[0.3, 0.5], peak_cohesion_pa=[20.0, 32.0], density_kg_m3=[3000.0, 3000.0])
    lines = lines.assign(**{"peak_cohesion_se_pa": [4.0, 1.0], "relative_scatter": [0.1, 0.025], "n_runs": [8, 8]})
    response = Response(
        name="peak_cohesion", column="peak_cohesion_pa", unit="Pa", symbol="c", table="peak", error_column="peak_cohesion_se_pa"
    )
    table = screening_table(response, lines, MATERIAL, SCREENING, True).set_index("parameter")
    assert table["n_runs"].tolist() == [8, 8, 0]
    friction = table.loc["static_friction"]
    assert friction["difference_pa"] == 12.0
    assert friction["sensitivity_percent"] == pytest.approx(100 * (12.0 / 20.0) / (0.2 / 0.3))
    base, changed = line_errors(lines, "peak_cohesion_se_pa", known_scatter(response, lines))
    assert changed > 1.0  # the error in the table
    assert friction["difference_se_pa"] == pytest.approx(np.hypot(base, changed))
    assert friction["exceeds_noise"] == (12.0 > 2.0 * np.hypot(base, changed))
    assert np.isnan(table.loc["density_kg_m3", "peak_cohesion_pa"])
    assert not table.loc["density_kg_m3", "exceeds_noise"]


def test_acceleration_reports_bias_beside_the_seeds_scatter():
    repose = pd.concat(
        [
            heaps(seed=[1, 2], angle_of_repose_deg=[27.0, 28.0]),
            heaps(seed=[1, 2], fidelity="reference", angle_of_repose_deg=[25.0, 26.0], wall_time_s=50.0),
            heaps(seed=[1], point_id="other", angle_of_repose_deg=[40.0]),
        ]
    )
    shear = heaps(seed=[1], normal_stress_pa=1.0, ratio=0.5)
    table = acceleration_table([FidelityCheck("repose", repose, "angle_of_repose_deg"), FidelityCheck("shear", shear, "ratio")])
    assert len(table) == 1
    row = table.iloc[0]
    assert row["bias"] == pytest.approx(2.0)
    assert row["bias_se"] == pytest.approx(np.sqrt(0.5))
    assert row["exceeds_noise"]
    assert (row["campaign_wall_time_s"], row["reference_wall_time_s"]) == (2.0, 50.0)


def test_a_study_without_check_points_has_an_empty_acceleration_table():
    table = acceleration_table([FidelityCheck("repose", heaps(seed=[1], angle_of_repose_deg=[40.0]), "angle_of_repose_deg")])
    assert table.empty
    assert "bias" in table


def test_loads_that_the_reference_does_not_have_do_not_count():
    shear = pd.concat(
        [
            heaps(seed=[1, 2, 1, 2], normal_stress_pa=[1.0, 1.0, 9.0, 9.0], ratio=[0.5, 0.6, 7.0, 8.0]),
            heaps(seed=[1, 2], fidelity="reference", normal_stress_pa=1.0, ratio=[0.4, 0.5]),
        ]
    )
    rows = [acceleration_table([FidelityCheck("shear", shear, "ratio", load)]).iloc[0] for load in ("normal_stress_pa", None)]
    assert [row["campaign_n"] for row in rows] == [2, 4]
    assert rows[0]["bias"] == pytest.approx(0.1)


def test_any_response_can_be_screened_and_the_paper_is_beside_its_own_only():
    wear = Response(name="wear", column="wear_mm", unit="mm", symbol="w", table="wear")
    runs = campaign().rename(columns={"angle_of_repose_deg": "wear_mm"})
    table = screening_table(wear, runs, MATERIAL, SCREENING, True)
    known = screening_table(ANGLE, campaign(), MATERIAL, SCREENING, True)
    for mine, its in (("wear_mm", "angle_of_repose_deg"), ("sd_mm", "sd_deg"), ("difference_se_mm", "difference_se_deg")):
        assert table[mine].tolist() == pytest.approx(known[its].tolist(), nan_ok=True)
    assert table["paper_angle_deg"].isna().all()
    assert known["paper_angle_deg"].iloc[0] == 27.47
