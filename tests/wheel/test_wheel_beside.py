"""Runs beside measurements: means over beds, criteria, verdicts; and the handbook's line of a plate's law."""

import math

import numpy as np
import pandas as pd
import pytest
from made_up_runs import BEDS, pressed, rows, travelled

from virtual_soil.campaign.settings import defaults
from virtual_soil.campaign.tables import check_table, write_table
from virtual_soil.campaign.terrain import Handbook
from virtual_soil.wheel import beside
from virtual_soil.wheel.measured import plate_table, wheel_table
from virtual_soil.wheel.measurements import sd_name

#: Two beds at a slip of 0.5 whose wheels pull 3 N and -1 N of 10 N and sink 20 mm.
RUNS = rows("wheel_run", seed=[1, 2], radius_m=[0.1, 0.1], width_m=[0.05, 0.05], asked_slip=[0.5, 0.5], applied_load_n=[10.0, 10.0])


def driven(*pulls):
    """The wheel's table of runs with these pulls, on the beds one by one."""
    return wheel_table(RUNS[: len(pulls)], [travelled(pull) for pull in pulls], BEDS)


def laboratory(slip=0.5, **values):
    """A measured point; what is not given is not known."""
    names = ("load_n", "drawbar_pull_n", "torque_n_m", "sinkage_m", "drawbar_ratio", "traction_coefficient")
    known = {"slip": slip, "n_tests": 1} | {key: math.nan for name in names for key in (name, sd_name(name))}
    return pd.DataFrame([known | values])


def verdicts(table, measured):
    return {row["quantity"]: row["verdict"] for row in beside.wheel_points(table, measured)}


def test_the_predicted_value_is_the_mean_of_the_beds_with_their_scatter():
    (row,) = beside.wheel_points(driven(3.0, -1.0), laboratory(sinkage_m=0.025, sinkage_sd_m=1e-3))
    assert (row["predicted"], row["n_beds"], row["measured_sd"]) == (pytest.approx(0.02), 2, 1e-3)
    ratio, sign = beside.wheel_points(driven(3.0, -1.0), laboratory(drawbar_ratio=0.1, drawbar_ratio_sd=0.01))
    assert ratio["predicted"] == pytest.approx(0.1, abs=1e-9)
    assert ratio["predicted_error"] == pytest.approx(0.2, rel=1e-6)  # of 0.3 and -0.1
    assert ratio["difference"] == pytest.approx(0.0, abs=1e-9)
    (single, _) = beside.wheel_points(driven(3.0), laboratory(drawbar_ratio=0.1))
    assert single["predicted_error"] == driven(3.0)["drawbar_ratio_error"].iloc[0]


@pytest.mark.parametrize(("sinkage_m", "verdict"), [(0.0155, "agrees"), (0.0285, "agrees"), (0.0153, "misses"), (0.0287, "misses")])
def test_a_sinkage_agrees_within_thirty_percent_of_the_measured_one(sinkage_m, verdict):
    assert verdicts(driven(1.0), laboratory(sinkage_m=sinkage_m)) == {"sinkage_m": verdict}


@pytest.mark.parametrize(("ratio", "verdict"), [(0.051, "agrees"), (0.149, "agrees"), (0.049, "misses"), (0.151, "misses")])
def test_a_drawbar_ratio_agrees_within_a_twentieth_of_the_load(ratio, verdict):
    assert verdicts(driven(1.0), laboratory(drawbar_ratio=ratio))["drawbar_ratio"] == verdict


@pytest.mark.parametrize(
    ("measured", "deviation", "verdict"),
    [
        (0.03, 0.01, "agrees"),
        (-0.03, 0.01, "misses"),
        (-0.03, 0.02, "not decided"),
        (0.03, 0.02, "not decided"),
        (-0.03, math.nan, "misses"),
    ],
)
def test_a_sign_is_decided_only_where_it_is_known(measured, deviation, verdict):
    found = verdicts(driven(1.0), laboratory(drawbar_ratio=measured, drawbar_ratio_sd=deviation))
    assert found["drawbar_sign"] == verdict


def test_a_sign_of_which_the_beds_are_not_sure_is_not_decided():
    assert verdicts(driven(3.0, -1.0), laboratory(drawbar_ratio=-0.3, drawbar_ratio_sd=0.01))["drawbar_sign"] == "not decided"


def test_a_torque_stands_beside_without_a_criterion():
    assert verdicts(driven(1.0), laboratory(traction_coefficient=0.5)) == {"traction_coefficient": "no criterion"}


def test_a_slip_that_was_not_run_is_said_to_be_so():
    assert verdicts(driven(1.0), laboratory(slip=0.4, sinkage_m=0.02)) == {"sinkage_m": "not run"}
    broken = driven(1.0).assign(sinkage_m=math.nan)
    assert verdicts(broken, laboratory(sinkage_m=0.02)) == {"sinkage_m": "not run"}


def plates_of(*histories, diameters=(0.06, 0.10)):
    n = len(histories)
    runs = rows("press_run", seed=[1] * n, diameter_m=list(diameters)[:n], depth_m=[0.025] * n)
    return runs, list(histories)


def measured_plates(*points):
    names = ("diameter_m", "sinkage_m", "pressure_pa", "pressure_sd_pa")
    return pd.DataFrame([dict(zip(names, point, strict=True)) for point in points])


def test_pressures_have_a_verdict_only_between_the_stated_sinkages():
    """p = 1e6 z."""
    measured = measured_plates(
        (0.06, 0.005, 1.0, math.nan), (0.06, 0.01, 14e3, 1e3), (0.06, 0.02, 30e3, 1e3), (0.08, 0.01, 1e4, 0.0)
    )
    found = beside.plate_points(*plates_of(pressed(1e6, 1.0)), measured, (0.010, 0.020))
    assert [row["verdict"] for row in found[:4]] == ["no criterion", "agrees", "misses", "not run"]
    assert found[1]["predicted"] == pytest.approx(1e4, rel=1e-6)
    assert found[1]["allowed"] == pytest.approx(0.3 * 14e3)


@pytest.mark.parametrize(("larger", "verdict"), [(1.5e6, "agrees"), (0.9e6, "misses")])
def test_the_pressure_must_grow_with_the_plate_as_the_measured_one_does(larger, verdict):
    measured = measured_plates((0.06, 0.005, 3e3, 0.0), (0.06, 0.01, 8e3, 800.0), (0.10, 0.005, 8e3, 0.0), (0.10, 0.01, 16e3, 0.0))
    found = beside.plate_points(*plates_of(pressed(1e6, 1.0), pressed(larger, 1.0)), measured, (0.010, 0.020))
    (growth,) = [row for row in found if row["quantity"] == "pressure_growth"]
    assert (growth["diameter_m"], growth["at_m"], growth["verdict"]) == (0.10, 0.01, verdict)
    assert growth["predicted"] == pytest.approx(larger / 1e6, rel=1e-6)
    assert (growth["measured"], growth["measured_sd"]) == (pytest.approx(2.0), pytest.approx(0.2))


def test_a_plate_of_a_size_that_was_not_pressed_has_no_growth():
    measured = measured_plates((0.06, 0.01, 8e3, 0.0), (0.10, 0.01, 16e3, 0.0))
    found = beside.plate_points(*plates_of(pressed(1e6, 1.0)), measured, (0.010, 0.020))
    assert [row["verdict"] for row in found if row["quantity"] == "pressure_growth"] == ["not run"]


def test_the_table_has_the_points_of_both_files(tmp_path):
    runs, (history,) = plates_of(pressed(1e6, 1.0))
    files = [str(tmp_path / name) for name in ("run.parquet", "history.parquet")]
    write_table(runs, files[0], "press_run", {})
    write_table(history, files[1], "press_history", {})
    (tmp_path / "wheel.csv").write_text("slip,load_n,sinkage_m\n0.5,10,0.02\n")
    (tmp_path / "plates.csv").write_text("diameter_m,sinkage_m,pressure_pa\n0.06,0.01,10e3\n")
    wheel, plate = ({"file": str(tmp_path / name)} for name in ("wheel.csv", "plates.csv"))
    both = {"wheel": wheel, "plate": plate | {"compared_m": [0.01, 0.02]}}
    table = check_table(beside.compared(driven(1.0), files[:1], files[1:], both, 9.81), "wheel_measured", "table")
    assert table[["tool", "verdict"]].values.tolist() == [["wheel", "agrees"], ["plate", "agrees"]]
    none = both | {"wheel": {"file": None}}
    assert check_table(beside.compared(driven(1.0), [], [], none, 9.81), "wheel_measured", "none").empty


def line_of(plates, tmp_path=None, **changes):
    runs, histories = plates_of(pressed(2e6, 1.2), pressed(9e6, 1.4))
    tables = {"wheel": driven(1.0), "plate": plate_table(runs, histories, BEDS)}
    handbook = defaults(Handbook) | {"internal_friction_angle_deg": 30.0, "plates": plates} | changes
    file = None if tmp_path is None else str(tmp_path / "plates.csv")
    return check_table(beside.handbook_table(tables, handbook, file, 0.025, 9.81), "wheel_handbook", "line")


def test_the_handbooks_line_takes_the_simulated_plate_nearest_to_the_wheels_width():
    line = line_of("simulated", shear_displacement_m=0.02)
    row = line.iloc[0]
    assert (row["case"], row["diameter_m"], row["shear_displacement_m"]) == ("sand", 0.06, 0.02)
    assert (row["k_pa_m_n"], row["n"]) == (pytest.approx(2e6, rel=1e-3), pytest.approx(1.2, rel=1e-4))
    assert line["slip"].between(-0.95, 0.95).all()


def test_the_handbooks_line_takes_the_measured_plate_over_the_depth_of_the_simulated(tmp_path):
    z = np.array([0.005, 0.01, 0.015, 0.02, 0.025, 0.05])
    pressures = np.where(z < 0.03, 3e6 * z**1.3, 1e3)  # deeper than the tests, so not of the law
    points = "".join(f"0.06,{depth},{pressure}\n" for depth, pressure in zip(z, pressures, strict=True))
    (tmp_path / "plates.csv").write_text("diameter_m,sinkage_m,pressure_pa\n" + points)
    row = line_of("measured", tmp_path).iloc[0]
    assert (row["case"], row["k_pa_m_n"], row["n"]) == ("", pytest.approx(3e6, rel=1e-3), pytest.approx(1.3, rel=1e-4))


def test_no_law_is_no_line(tmp_path):
    (tmp_path / "plates.csv").write_text("diameter_m,sinkage_m,pressure_pa\n0.06,0.01,1e4\n")
    assert line_of("measured", tmp_path).empty
