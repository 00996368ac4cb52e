"""The family of soils under the wheel, and the page that says whether it matters which of them is taken."""

import numpy as np
import pandas as pd
import pytest
from made_up_runs import pressed, rows, travelled

from virtual_soil.calibration.errors import CalibrationError
from virtual_soil.calibration.space import space_of
from virtual_soil.wheel.soil import chosen_ranks, member_name, soil_of_case, values_of
from virtual_soil.wheel.spread_page import Family, answer_table, further_table, verdict, write_page
from virtual_soil.wheel.spread_runs import beds_of, done_runs, spread_table

DESIGN = {
    "variables": ["radius_m", "static_friction", "rolling_friction"],
    "ranges": {"radius_m": [1e-4, 1e-3], "static_friction": [0.1, 1.0], "rolling_friction": [0.0, 0.2]},
}
SETTINGS = {"soils": 4, "optimum_seeds": [1, 2, 3], "soil_seeds": [1, 2]}


@pytest.fixture
def study(tmp_path):
    """Tables of a calibration whose equivalent sets lie on a valley, one of them extrapolated; returns the calibration's path."""
    grid = np.linspace(0.2, 0.9, 8)
    table = rows("equivalents", rank=list(range(1, 9)), case=["sand"] * 8, static_friction=grid, rolling_friction=0.15 - 0.1 * grid)
    table["extrapolated"] = table["rank"] == 8
    table.assign(radius_m=5e-4).to_parquet(tmp_path / "equivalents.parquet")
    values = {"static_friction": [0.5], "rolling_friction": [0.1], "radius_m": [4e-4]}
    answer = rows("calibration", case=["sand"], surrogate=["ours"], status=["converged"], **values)
    answer.to_parquet(tmp_path / "calibration.parquet")
    return tmp_path / "calibration.parquet"


def family(slope=0.0, n=9):
    """Runs of n soils, two beds each, whose pull changes by `slope` with the static friction, and what is known of the soils."""
    generator = np.random.default_rng(2)
    frictions = np.linspace(0.15, 0.95, n)
    names = ["sand", *(member_name("sand", k) for k in range(1, n))]
    soils = pd.DataFrame({"case": names, "static_friction": frictions, "rolling_friction": generator.uniform(0.0, 0.2, n)})
    soils = soils.assign(radius_m=5e-4)
    frame = soils.loc[soils.index.repeat(2)].reset_index(drop=True)
    pull = 3.0 + slope * frame["static_friction"] + 0.1 * generator.normal(size=len(frame))
    columns = {"drawbar_pull_n": pull, "drawbar_ratio": pull / 20.0, "torque_n_m": 0.5 + 0.01 * generator.normal(size=len(frame))}
    columns |= {"sinkage_m": 0.02 + 1e-4 * generator.normal(size=len(frame)), "plate_pressure_pa": 1e4 + 1e3 * pull}
    runs = rows("wheel_spread", case=list(frame["case"]), seed=[1, 2] * n, **columns)
    posterior = pd.DataFrame({"static_friction": generator.uniform(0.2, 0.9, 400), "radius_m": 5e-4})
    posterior = posterior.assign(rolling_friction=generator.uniform(0.02, 0.18, 400))
    posterior["angle_of_repose_deg"] = 20.0 + 10.0 * posterior["static_friction"]
    acting = ["static_friction", "rolling_friction"]
    return runs, Family(
        "sand", ["confirmed", "matches"], soils, posterior, space_of(DESIGN), acting, {"angle_of_repose_deg": ("deg", 0.01)}
    )


def test_soils_that_differ_matter_and_what_tells_them_apart_is_named(tmp_path):
    runs, known = family(slope=4.0)
    answers, further = answer_table(runs, known), further_table(runs, known, 0.005)
    pull = answers[answers["quantity"] == "drawbar_pull_n"].iloc[0]
    assert pull["beds_sd"] == pytest.approx(0.1, rel=0.5)
    assert pull["soils_sd"] == pytest.approx(4.0 * np.linspace(0.15, 0.95, 9).std(ddof=1), rel=0.2)
    assert pull["posterior_sd"] == pytest.approx(4.0 * 0.7 / np.sqrt(12.0), rel=0.15)  # uniform over 0.7
    assert further["measurement"].iloc[0] == "angle_of_repose_deg"
    assert further["left_over_ratio"].iloc[0] < 0.3
    halving = further.set_index("measurement")["halving_error"]
    assert halving["angle_of_repose_deg"] == pytest.approx(10.0 * 0.7 / np.sqrt(12.0) / np.sqrt(3.0), rel=0.2)
    assert np.isnan(halving["bed_bulk_density_kg_m3"])
    text = verdict(pull, further)
    assert "It matters" in text
    assert "Measuring angle of repose to ± 0.1" in text
    page, picture = tmp_path / "spread.md", tmp_path / "wheel" / "spread.png"
    write_page(runs, known, answers, further, page, picture)
    written = page.read_text(encoding="utf-8")
    assert written.startswith("The answer of case sand is confirmed")
    assert text in written
    assert picture.stat().st_size > 10_000


def test_soils_that_do_not_differ_do_not_matter():
    runs, known = family()
    answers = answer_table(runs, known)
    pull = answers[answers["quantity"] == "drawbar_pull_n"].iloc[0]
    assert pull["soils_low"] == 0.0
    text = verdict(pull, further_table(runs, known, 0.05))
    assert "cannot be told from the beds' noise" in text
    assert "It matters" not in text


def test_an_emulator_that_knows_nothing_says_nothing_of_the_posterior(tmp_path):
    runs, known = family()
    answers, further = answer_table(runs, known), further_table(runs, known, 0.05)
    pull = answers[answers["quantity"] == "drawbar_pull_n"].iloc[0]
    assert pull["emulator_degree"] == 0
    assert np.isnan(pull["posterior_sd"])
    assert further["left_over_ratio"].isna().all()
    assert "is not known from these soils" in verdict(pull, further)
    write_page(runs, known, answers, further, tmp_path / "spread.md", tmp_path / "wheel" / "spread.png")
    text = (tmp_path / "spread.md").read_text(encoding="utf-8")
    assert "| – | – |" in text
    assert "nan" not in text


def test_a_blunt_measurement_tells_nothing():
    runs, known = family(slope=4.0)
    further = further_table(runs, known, 1.0).set_index("measurement")
    assert further.loc["angle_of_repose_deg", "left_over_ratio"] > 0.98
    assert set(further.index) == {"angle_of_repose_deg", "plate_pressure_pa", "bed_bulk_density_kg_m3"}


def test_members_are_spread_over_what_acts_under_the_wheel(study):
    assert chosen_ranks(study.with_name("equivalents.parquet"), "sand", DESIGN, 3) == [1, 7, 3]  # in the coordinates, logarithms
    assert beds_of(study, "sand", DESIGN, SETTINGS)[:4] == [("sand", 1), ("sand", 2), ("sand", 3), ("sand-equivalent-1", 1)]
    assert len(beds_of(study, "sand", DESIGN, SETTINGS)) == 3 + 4 * 2
    assert values_of(study, "sand-equivalent-3")["static_friction"] == pytest.approx(0.4)
    config = {"material": {"static_friction": 0.0}, "design": DESIGN, "grading": None, "shape": None}
    assert soil_of_case(config, study, "sand-equivalent-3")["row"]["static_friction"] == pytest.approx(0.4)


def test_what_is_not_there_is_refused(study, tmp_path):
    with pytest.raises(CalibrationError, match="wheel_spread.soils is 8; allowed: at most the 7"):
        beds_of(study, "sand", DESIGN, SETTINGS | {"soils": 8})
    with pytest.raises(CalibrationError, match="run the target `all`"):
        beds_of(tmp_path / "none" / "calibration.parquet", "sand", DESIGN, SETTINGS)
    with pytest.raises(CalibrationError, match="case sand, set is 9; allowed"):
        values_of(study, "sand-equivalent-9")


def test_runs_have_the_pressure_of_their_beds_plate():
    runs = rows("wheel_run", case=["sand"] * 2, seed=[1, 2], status=["done", "failed"], radius_m=[0.1, 0.1])
    beds = rows("wheel_bed", case=["sand"] * 2, seed=[1, 2])
    table = spread_table(runs, [travelled(2.0), travelled(2.0)[:0]], beds, [pressed(1e6, 1.0), pressed(2e6, 1.0)], 0.01)
    assert table["plate_pressure_pa"].to_numpy() == pytest.approx([1e4, 2e4], rel=0.02)
    assert spread_table(runs, [travelled(2.0)] * 2, beds, [], 0.01)["plate_pressure_pa"].isna().all()
    assert list(done_runs(table)["seed"]) == [1]
    with pytest.raises(CalibrationError, match="wheel that are done"):
        done_runs(table[table["status"] == "failed"])
