"""The first answer: a soil calibrated on the reference tables, without any simulation."""

import json
import re
import subprocess
import sys
from pathlib import Path

import pandas as pd
import pytest
from campaign import ENVIRONMENT, ROOT, counted

from virtual_soil.calibration.errors import CalibrationError
from virtual_soil.calibration.first_answer import cases_of
from virtual_soil.campaign.experiments.registry import responses_of
from virtual_soil.campaign.tables import read_provenance, read_table

REFERENCE = ROOT / "docs" / "reference"
MEASURED = json.loads((REFERENCE / "surrogates.json").read_text(encoding="utf-8"))
RESPONSES = {name: response for name, response in responses_of(("repose", "plane_shear")).items() if name in MEASURED}
VARIABLES = ["radius_m", "static_friction", "rolling_friction"]


def snakemake(folder: Path, *arguments: str) -> str:
    """Output of snakemake with this Snakefile, its results in another folder."""
    for name in ("config", "docs"):
        if not (folder / name).exists():
            (folder / name).symlink_to(ROOT / name)
    command = [sys.executable, "-m", "snakemake", "--snakefile", str(ROOT / "Snakefile"), "--directory", str(folder), *arguments]
    result = subprocess.run(command, cwd=ROOT, env=ENVIRONMENT, capture_output=True, text=True, check=False)
    return result.stdout + result.stderr


@pytest.fixture(scope="module")
def answered(tmp_path_factory):
    """Folder and printed text of the first answers for all soils, with the settings of the reference campaign."""
    folder = tmp_path_factory.mktemp("first_answer")
    return folder, snakemake(folder, "-c2", "first_answer", "--configfile", "config/reference.yaml")


@pytest.mark.slow
@pytest.mark.parametrize(("soil", "n_cases"), [("silica_barco_sand", 1), ("lunar_regolith", 1)])
def test_it_is_the_reference_campaigns_own_answer(answered, soil, n_cases):
    folder, _ = answered
    table = read_table(str(folder / f"results/first_answer/{soil}.parquet"), "first_answer").set_index("case")
    reference = pd.read_parquet(REFERENCE / "calibration.parquet").query("surrogate == 'ours'").set_index("case").loc[table.index]
    assert len(table) == n_cases
    weights = [f"weight_{name}" for name in (*RESPONSES, "large_grains")]
    assert table[weights].to_numpy() == pytest.approx(reference[weights].to_numpy())
    for name in VARIABLES:
        assert table[name].to_numpy() == pytest.approx(reference[name].to_numpy(), rel=1e-3)
        for end in ("low", "high"):
            column = f"{name}_{end}_95"
            assert table[column].to_numpy() == pytest.approx(reference[column].to_numpy(), rel=0.05), column
        assert (table[f"{name}_low_95"] < table[f"{name}_high_95"]).all()


@pytest.mark.slow
def test_it_says_what_it_rests_on_and_what_is_out_of_reach(answered):
    folder, text = answered
    assert text.count("No simulation was run for it. A campaign at your own settings has to confirm it.") == 2
    assert re.search("steady_cohesion +NO, nearest", text)
    path = str(folder / "results/first_answer/lunar_regolith.parquet")
    table = read_table(path, "first_answer")
    reach = pd.read_parquet(REFERENCE / "reachability.parquet").query("soil == 'lunar_regolith' and not reachable")
    assert "steady_cohesion" in set(reach["response"])  # grains without adhesion
    assert set(table["out_of_reach"]) == {",".join(reach["response"])}
    assert set(table["prediction"]) == set(table["match"]) == {"not simulated"}
    assert table["basis"].str.contains("reference tables").all()
    assert read_provenance(path)["design"]["variables"] == VARIABLES


def test_it_simulates_nothing_and_takes_a_soil_by_name_or_by_file(tmp_path):
    for soil in ("lunar_regolith", "config/soils/example/example.yaml"):
        plan = snakemake(tmp_path, "-n", "first_answer", "--config", f"soil={soil}")
        assert counted(plan) == {"estimate_from_reference": 1, "first_answer": 1}, plan


@pytest.mark.slow
def test_a_strength_that_the_reference_did_not_measure_is_said_to_be_another(tmp_path):
    angle = "{value: 30.0, strength: peak, source: made up}"
    (tmp_path / "clay.yaml").write_text(
        f"steady_friction_angle_deg: {angle}\nangle_of_repose_deg: {{value: 31.0, source: made up}}\n"
    )
    output = snakemake(tmp_path, "-c1", "first_answer", "--config", "soil=clay.yaml")
    text = (tmp_path / "results/first_answer/clay.txt").read_text()
    assert "steady_friction_angle: a peak strength of the soil, beside the steady strength of the reference" in text, output


@pytest.mark.parametrize(
    ("soil", "message"),
    [
        (
            "green_cheese",
            "there is no config/soils/green_cheese.yaml; existing soils: apollo_12_surface, cmu_sand, glass_beads_50um, ",
        ),
        ("no/such.yaml", "soil: there is no file no/such.yaml; allowed: a soil file (.yaml), or a name in config/soils"),
        ("3", "soil: 3 is not of type 'string'"),
    ],
)
def test_an_unknown_soil_is_refused(tmp_path, soil, message):
    assert message in snakemake(tmp_path, "-n", "first_answer", "--config", f"soil={soil}")


@pytest.mark.parametrize(
    ("asked", "message"),
    [
        (["soil=lunar_regolith", "radius_m=2e-5"], "lift speed / sqrt(gravity x radius) is 0.357; allowed: up to 0.3193"),
        (["soil=lunar_regolith", "gravity_m_s2=pluto"], "It means: gravitational acceleration: a number, or earth, moon, mars"),
        (["soil=lunar_regolith", "radius_m=2"], "radius_m: 2 is unusual; usual: 1e-06 to 0.1"),
        (["soil=lunar_regolith", "density_kg_m3=0"], "density_kg_m3: 0 is less than or equal to the minimum of 0"),
        (
            ["radius_m=2e-3"],
            "radius_m is given without a soil; allowed: beside soil=..., for its first answer; in a study, material",
        ),
    ],
)
def test_a_test_that_cannot_be_is_refused_before_anything_runs(tmp_path, asked, message):
    output = snakemake(tmp_path, "-n", "first_answer", "--config", *asked)
    assert message in output
    assert "Traceback" not in output
    assert "Job stats" not in output


@pytest.mark.slow
def test_it_answers_for_other_grains_under_another_gravity(tmp_path):
    asked = ["soil=lunar_regolith", "radius_m=4e-3", "gravity_m_s2=moon", "lift_speed_m_s=0.01285", "density_kg_m3=1700"]
    output = snakemake(tmp_path, "-c1", "first_answer", "--config", *asked)
    path = str(tmp_path / "results/first_answer/lunar_regolith.parquet")
    row = read_table(path, "first_answer").iloc[0]
    assert row["radius_m"] == row["radius_m_low_95"] == row["radius_m_high_95"] == 4e-3
    reference = pd.read_parquet(REFERENCE / "calibration.parquet").query("surrogate == 'ours' and soil == 'lunar_regolith'").iloc[0]
    for name in ("static_friction", "rolling_friction"):
        assert row[f"{name}_low_95"] < reference[f"{name}_high_95"]
        assert row[f"{name}_high_95"] > reference[f"{name}_low_95"]
    assert "a tube lifted at 0.01285 m/s under 1.62 m/s2" in output
    assert re.search("but for what was asked for: density_kg_m3 = 1700, .*, radius_m = 0.004, ", output)
    assert read_provenance(path)["material"]["density_kg_m3"] == 1700.0
    assert read_provenance(path)["asked"]["gravity_m_s2"] == 1.62


def test_a_soil_file_with_a_gap_is_refused_before_anything_runs(tmp_path):
    (tmp_path / "clay.yaml").write_text("cohesion_pa: {value: , source: unknown}\n")
    output = snakemake(tmp_path, "first_answer", "-c1", "--config", "soil=clay.yaml")
    assert "clay.yaml: cohesion_pa.value is None; allowed: a number." in output
    assert "Traceback" not in output
    assert "Job stats" not in output


def test_make_shows_why_it_cannot_answer():
    command = [
        "make",
        "-o",
        "setup",
        "-o",
        ".venv/ready",
        "first-answer",
        f"BIN={Path(sys.executable).parent}",
        "SOIL=green_cheese",
    ]
    result = subprocess.run(command, cwd=ROOT, env=ENVIRONMENT, capture_output=True, text=True, check=False)
    assert result.returncode != 0
    assert "there is no config/soils/green_cheese.yaml; existing soils: " in result.stdout + result.stderr


def test_make_passes_the_test_on():
    given = ["RADIUS=2e-3", "DENSITY=1700", "GRAVITY=moon", "LIFT=0.01"]
    command = ["make", "-n", "-o", "setup", "-o", ".venv/ready", "first-answer", "SOIL=clay", *given]
    result = subprocess.run(command, cwd=ROOT, env=ENVIRONMENT, capture_output=True, text=True, check=True)
    asked = "soil=clay radius_m=2e-3 density_kg_m3=1700 gravity_m_s2=moon lift_speed_m_s=0.01"
    assert f"--config {asked}\n" in result.stdout


def test_a_soil_without_a_case_has_equal_weights():
    weights = {"angle_of_repose": 1, "steady_cohesion": 2, "peak_cohesion": 0, "steady_friction_angle": 0, "peak_friction_angle": 0,
               "large_grains": 0}  # fmt: skip
    cases = [{"case": "a", "soil": "sand", "weights": weights}]
    sand = pd.DataFrame({"soil": "sand", "property": list(RESPONSES)})
    assert cases_of(sand, cases, RESPONSES) == cases
    clay = sand.assign(soil="clay")
    weights = dict.fromkeys(RESPONSES, 1.0)
    assert cases_of(clay, cases, RESPONSES) == [{"case": "clay", "soil": "clay", "weights": weights}]
    one = cases_of(clay[clay["property"] == "steady_cohesion"], cases, RESPONSES)
    assert one == [{"case": "clay", "soil": "clay", "weights": {"steady_cohesion": 1.0}}]
    with pytest.raises(CalibrationError, match="targets of clay is .* allowed: at least one of steady_cohesion"):
        cases_of(clay.assign(property="colour"), cases, RESPONSES)
