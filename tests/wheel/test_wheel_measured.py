"""Tables of made-up runs: what is measured, what is left out, and which bed stands beside it."""

import math

import pytest
from made_up_runs import BEDS, pressed, rows, travelled

from virtual_soil.campaign.tables import check_table
from virtual_soil.errors import InputError
from virtual_soil.wheel.measured import cone_table, plate_table, stacked, wheel_table


def test_the_wheels_table_has_the_means_of_the_last_stretch_beside_its_bed():
    runs = rows("wheel_run", seed=[2, 1], radius_m=[0.1, 0.1], asked_slip=[0.5, 0.5])
    table = check_table(wheel_table(runs, [travelled(3.0), travelled(-1.0)], BEDS), "wheel", "table")
    assert table["drawbar_pull_n"].tolist() == pytest.approx([3.0, -1.0], abs=1e-9)
    assert table["drawbar_ratio"].tolist() == pytest.approx([0.3, -0.1], abs=1e-9)
    assert table["traction_coefficient"].tolist() == pytest.approx([0.5, 0.5])
    assert table["slip"].tolist() == pytest.approx([0.5, 0.5])
    assert table["efficiency"].iloc[0] == pytest.approx(3.0 * 0.1 / (0.5 * 2.0))
    assert table["solid_fraction"].tolist() == [0.60, 0.55]
    assert (table["n_samples"] == 80).all()


@pytest.mark.parametrize("status", ["failed", "bottomed", "not_lowered"])
def test_a_run_that_is_not_done_has_no_means(status):
    runs = rows("wheel_run", seed=[1], status=[status], radius_m=[0.1])
    table = check_table(wheel_table(runs, [travelled(3.0)], BEDS), "wheel", "table")
    assert math.isnan(table["drawbar_pull_n"].iloc[0])
    assert (table["status"].iloc[0], table["n_samples"].iloc[0]) == (status, 0)


def test_plates_have_pressures_laws_and_the_moduli_of_their_own_bed():
    """k = k_c / b + k_phi with k_c = 2e4, k_phi = 1e6 on the first bed, and one plate on the second."""
    diameters = [0.04, 0.08, 0.04]
    runs = rows("press_run", seed=[1, 1, 2], diameter_m=diameters, depth_m=[0.025] * 3)
    moduli = [2e4 / 0.02 + 1e6, 2e4 / 0.04 + 1e6, 5e5]
    table = plate_table(runs, [pressed(k, 1.2) for k in moduli], BEDS)
    check_table(table, "plate", "table")
    assert len(table) == 3 * 4
    first = table[(table["seed"] == 1) & (table["diameter_m"] == 0.04)]
    assert first["sinkage_m"].tolist() == pytest.approx([0.005, 0.010, 0.015, 0.020])
    assert first["pressure_pa"].to_numpy() == pytest.approx(2e6 * first["sinkage_m"] ** 1.2, rel=2e-3)
    assert (first["n"].iloc[0], first["k_pa_m_n"].iloc[0]) == (pytest.approx(1.2, rel=1e-4), pytest.approx(2e6, rel=1e-3))
    both = table[table["seed"] == 1]
    assert both["bekker_k_c"].to_numpy() == pytest.approx(2e4, rel=1e-2)
    assert both["bekker_k_phi"].to_numpy() == pytest.approx(1e6, rel=1e-2)
    assert table[table["seed"] == 2]["bekker_n"].isna().all()


def test_the_law_of_a_plate_is_fitted_up_to_the_end_of_the_test():
    history = pressed(1e6, 1.0)
    history.loc[history["depth_m"] > 0.0125, "pressure_pa"] = 12.5e3  # p = k z, then constant
    found = plate_table(rows("press_run", seed=[1], depth_m=[0.025]), [history], BEDS).iloc[0]
    assert 0.2 < found["n"] < 0.8
    assert found["law_residual_ratio"] > 0.02


def test_a_test_that_broke_off_has_no_pressure():
    runs = rows("press_run", seed=[1], status=["failed"], depth_m=[0.025])
    empty = pressed(1e6, 1.0)[:0]
    assert check_table(plate_table(runs, [empty], BEDS), "plate", "table")["pressure_pa"].isna().all()
    assert check_table(cone_table(runs, [empty], BEDS), "cone", "table")["gradient_pa_m"].isna().all()


def test_the_cones_gradient_is_that_of_its_resistance():
    runs = rows("press_run", seed=[2], depth_m=[0.05])
    row = check_table(cone_table(runs, [pressed(3e6, 1.0, 0.05)], BEDS), "cone", "table").iloc[0]
    assert row["gradient_pa_m"] == pytest.approx(3e6, rel=1e-3)
    assert row["resistance_depth_m"] == pytest.approx(0.04)
    assert row["resistance_pa"] == pytest.approx(3e6 * 0.04, rel=1e-3)
    assert row["solid_fraction"] == 0.60


def test_a_target_without_runs_is_told_so():
    with pytest.raises(InputError, match=r"number of runs is 0; allowed: at least one: a plate in plate\.diameters_m"):
        stacked([], "press_run")
