"""The targets `wheel`, `plate`, `cone`: what they plan, what they refuse, and a toy wheel from a calibration to its tables."""

import math
import shutil
import subprocess
import sys
from pathlib import Path

import pandas as pd
import pytest
import yaml

from dem.measure.rim import RimStress, integrated
from virtual_soil.campaign import new_study
from virtual_soil.campaign.tables import load_schema, read_table, write_table

ROOT = Path(__file__).parents[2]
TOY = {
    "study": "toy",
    "material": {"radius_sd_ratio": 0.05, "density_kg_m3": 2500.0},
    "wheel": {
        "cases": ["sand"],
        "shape": {"radius_m": 0.010, "width_m": 0.008},
        "load_n": 0.1,
        "slips": [0.5],
        "speed_m_s": 0.05,
        "travel_ratio": 1.2,
        "grains_per_radius": 5.0,
        "bed": {"length_ratio": 4.7, "width_ratio": 2.5, "depth_ratio": 1.5, "seeds": [1]},
        "shear_modulus_pa": 1e6,
    },
    "plate": {"diameters_m": [0.008], "depth_m": 0.004, "speed_m_s": 0.1},
    "cone": {"base_area_m2": 30e-6, "angle_deg": 120.0, "depth_m": 0.003, "speed_m_s": 0.1},
}


def calibration(path: Path, cases=("sand",), **changes):
    """A made-up table of a finished calibration."""
    values = {"case": list(cases), "soil": "silica_barco_sand", "surrogate": "ours", "radius_m": 5e-5, "static_friction": 0.6}
    values |= {"rolling_friction": 0.12, "status": "converged", "missed": "", "extrapolated": "", "iterations": 3}
    values |= {"prediction": "confirmed", "match": "matches"} | changes
    columns = {name: rule for name, rule in load_schema("calibration").items() if not rule.get("optional")}
    table = pd.DataFrame({name: values.get(name, 0.5 if rule["type"] == "number" else "") for name, rule in columns.items()})
    path.parent.mkdir(parents=True, exist_ok=True)
    write_table(table, str(path), "calibration", {})


def snakemake(folder: Path, *arguments: str, **changes) -> subprocess.CompletedProcess:
    """Run a target on the toy study; changes : section=dict of keys."""
    config = {name: {**value, **changes.get(name, {})} if isinstance(value, dict) else value for name, value in TOY.items()}
    (folder / "toy.yaml").write_text(yaml.safe_dump(config))
    files = ("--snakefile", str(ROOT / "Snakefile"), "--configfile", str(ROOT / "config/smoke.yaml"), "toy.yaml")
    command = [sys.executable, "-m", "snakemake", *arguments, *files]
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)


def planned(text: str) -> dict[str, int]:
    """Rule -> number of jobs in what a dry run prints."""
    lines = [line.split() for line in text.split("Job stats:")[1].split("total")[0].splitlines()]
    return {line[0]: int(line[1]) for line in lines if len(line) == 2 and line[1].isdigit()}


def test_the_target_plans_a_bed_for_every_case_and_seed_and_a_run_for_every_slip(tmp_path):
    calibration(tmp_path / "results/toy/calibration.parquet", ("sand", "regolith"))
    bed = TOY["wheel"]["bed"] | {"seeds": [1, 2, 3]}
    result = snakemake(tmp_path, "-n", "wheel", wheel={"cases": ["sand", "regolith"], "slips": [0.5, -0.2], "bed": bed})
    assert result.returncode == 0, result.stderr
    jobs = planned(result.stdout + result.stderr)
    expected = {
        "compile_wheel_kernels": 1,
        "prepare_bed": 6,
        "lower_wheel": 6,
        "drive_wheel": 12,
        "press_plate": 6,
        "push_cone": 6,
        "wheel_report": 1,
    }
    assert {name: jobs.get(name) for name in expected} == expected
    assert not {"simulate", "conclude", "calibrate"} & set(jobs)


def test_a_study_that_names_its_cases_is_told_once_what_the_wheel_takes(tmp_path):
    """Before the soil is calibrated, too; the other targets with their own jobs."""
    refused = snakemake(tmp_path, "-n", "wheel", wheel={"bed": TOY["wheel"]["bed"] | {"seeds": [1, 2]}})
    runs = "2 lowerings of the wheel, 2 runs of the wheel, 2 plates, 2 cones"
    line = f"wheel (not part of `all`): 2 beds of 1 900 grains, {runs}: about 1 core-min in all."
    assert (refused.stdout + refused.stderr).count(line) == 1
    calibration(tmp_path / "results/toy/calibration.parquet")
    silent = snakemake(tmp_path, "-n", "plate", wheel={"cases": []})
    text = silent.stdout + silent.stderr
    assert "wheel (not part of `all`)" not in text
    assert "plate (not part of `all`): 5 beds of 1 900 grains, 5 plates: about 1 core-min in all." in text  # of all cases


def test_a_new_study_with_a_wheel_and_a_plate_plans_them(tmp_path):
    shutil.copytree(ROOT / "config", tmp_path / "config")
    tools = {"wheel": ["radius_m=0.1", "slips=0,0.5", "gravity_m_s2=moon"], "plate": ["diameters_m=0.1"]}
    (path,) = new_study.start(tmp_path, "rover", "lunar_regolith", tools)
    calibration(tmp_path / "results/rover/calibration.parquet", ("rover",))
    command = [sys.executable, "-m", "snakemake", "-n", "wheel", "--snakefile", str(ROOT / "Snakefile"), "--configfile", str(path)]
    result = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert result.returncode == 0, result.stderr
    jobs = planned(result.stdout + result.stderr)
    assert {rule: jobs.get(rule) for rule in ("prepare_bed", "drive_wheel", "press_plate", "push_cone")} == {
        "prepare_bed": 2,
        "drive_wheel": 4,
        "press_plate": 2,
        "push_cone": None,
    }
    assert "4 runs of the wheel, 2 plates: about" in result.stdout + result.stderr


#: A scheduler that notes what is asked for, and refuses.
SUBMIT = "echo {rule} {resources.runtime} {resources.mem_mb} >> asked.txt; exit 1"


def test_every_job_on_a_bed_asks_for_time_and_memory(tmp_path):
    calibration(tmp_path / "results/toy/calibration.parquet")
    bed = tmp_path / "results/toy/wheel/sand/1"
    bed.mkdir(parents=True)
    second = bed.with_name("2")
    second.mkdir()
    files = [bed.parent.parent / "kernels.txt", *(one / name for one in (bed, second) for name in ("bed.npz", "bed.parquet"))]
    for path in (*files, bed / "lowered.npz"):  # as if the first jobs had made them
        path.touch()
    cluster = ("--executor", "cluster-generic", "--cluster-generic-submit-cmd", SUBMIT, "--jobs", "9", "--keep-going")
    changes = {"wheel": {"grains_per_radius": 60.0, "bed": TOY["wheel"]["bed"] | {"seeds": [1, 2, 3]}}}
    snakemake(tmp_path, *cluster, "wheel", "wheel_film", "--default-resources", "runtime=1", "mem_mb=1", **changes)
    asked = [line.split() for line in (tmp_path / "asked.txt").read_text().splitlines()]
    assert {rule for rule, *_ in asked} == {"prepare_bed", "lower_wheel", "drive_wheel", "film_wheel", "press_plate", "push_cone"}
    memory = {rule: int(mem_mb) for rule, _, mem_mb in asked}
    minutes = {rule: int(runtime) for rule, runtime, _ in asked}
    assert all(value > 4 for value in minutes.values())  # more than a start
    assert all(value > 1000 for value in memory.values())
    assert memory["film_wheel"] > memory["drive_wheel"] == memory["prepare_bed"]


def test_the_film_is_of_the_middle_slip_on_the_first_bed(tmp_path):
    calibration(tmp_path / "results/toy/calibration.parquet")
    result = snakemake(
        tmp_path, "-n", "wheel_film", wheel={"slips": [-0.2, 0.5, 0.7], "bed": TOY["wheel"]["bed"] | {"seeds": [3, 1]}}
    )
    assert result.returncode == 0, result.stderr
    jobs = planned(result.stdout + result.stderr)
    assert {name: jobs.get(name) for name in ("prepare_bed", "film_wheel", "drive_wheel")} == {
        "prepare_bed": 1,
        "film_wheel": 1,
        "drive_wheel": None,
    }
    assert "results/toy/wheel/sand/3/slip_0.5/film.gif" in result.stdout + result.stderr


def test_a_study_without_a_calibration_is_told_what_to_run(tmp_path):
    result = snakemake(tmp_path, "-n", "wheel")
    assert result.returncode != 0
    assert "calibration of case sand is missing (results/toy/calibration.parquet)" in result.stdout + result.stderr


#: What the toy's beds, runs and plate stand beside.
MEASURED = {
    "wheel.csv": "slip,load_n,drawbar_pull_n,sinkage_m\n0.5,0.1,0.01,0.004\n0.75,0.1,0.01,0.005\n",
    "plates.csv": "diameter_m,sinkage_m,pressure_pa\n" + "".join(f"0.008,{z},{3e6 * z}\n" for z in (1e-3, 2e-3, 3e-3, 4e-3)),
}


def beside(folder: Path) -> dict:
    """Sections wheel and plate of the toy with measurements, a handbook's line, and beds of a stated density."""
    for name, text in MEASURED.items():
        (folder / name).write_text(text)
    wheel = {"measured": {"file": "wheel.csv", "source": "J. Doe 2001"}, "handbook": {"internal_friction_angle_deg": 30.0}}
    wheel["bed"] = TOY["wheel"]["bed"] | {"bulk_density_kg_m3": 1320.0}
    measured = {"file": "plates.csv", "source": "J. Doe 2001", "compared_m": [0.001, 0.003]}
    return {"wheel": wheel, "plate": {"measured": measured}}


def test_measurements_that_cannot_be_meant_are_refused_before_a_bed_is_prepared(tmp_path):
    calibration(tmp_path / "results/toy/calibration.parquet")
    changes = beside(tmp_path)
    (tmp_path / "wheel.csv").write_text("slip,load_n,sinkage_m\n0.5,0.1,4\n")
    result = snakemake(tmp_path, "-n", "wheel", **changes)
    assert result.returncode != 0
    assert "wheel.csv, line 2: sinkage_m is 4; allowed: 0 to the wheel's radius, 0.01 m" in result.stdout + result.stderr
    changes["wheel"]["measured"]["file"] = "none.csv"
    missing = snakemake(tmp_path, "-n", "wheel", **changes)
    assert "none.csv: cannot be read" in missing.stdout + missing.stderr


def test_the_density_is_sought_once_for_all_beds_of_a_case(tmp_path):
    calibration(tmp_path / "results/toy/calibration.parquet")
    changes = beside(tmp_path)
    changes["wheel"]["bed"] |= {"seeds": [1, 2, 3]}
    result = snakemake(tmp_path, "-n", "wheel", **changes)
    jobs = planned(result.stdout + result.stderr)
    assert {name: jobs.get(name) for name in ("steer_density", "prepare_bed")} == {"steer_density": 1, "prepare_bed": 3}
    changes["wheel"]["bed"] |= {"preparation_friction_ratio": 0.5}
    refused = snakemake(tmp_path, "-n", "wheel", **changes)
    assert "wheel.bed.preparation_friction_ratio is 0.5; allowed: 1 with wheel.bed.bulk" in refused.stdout + refused.stderr


def test_a_toy_wheel_runs_from_the_calibration_to_its_tables(tmp_path):
    calibration(tmp_path / "results/toy/calibration.parquet")
    changes = beside(tmp_path)
    result = snakemake(tmp_path, "-c1", "wheel", **changes)
    logs = "\n".join(path.read_text() for path in tmp_path.glob("logs/toy/wheel/**/*.log"))
    assert result.returncode == 0, result.stderr[-3000:] + logs
    tables = {name: read_table(str(tmp_path / f"results/toy/{name}.parquet"), name) for name in ("wheel", "plate", "cone")}
    run = tables["wheel"].iloc[0]
    assert (run["case"], run["seed"], run["status"], run["asked_slip"]) == ("sand", 1, "done", 0.5)
    assert run["grain_radius_m"] == pytest.approx(1e-3)
    assert run["momentum_residual_ratio"] < 1e-5
    assert run["load_n"] == pytest.approx(0.1, rel=0.05)
    assert run["slip"] == pytest.approx(0.5, abs=1e-6)
    assert run["power_balance_w"] > 0.0
    assert 1e-3 < run["sinkage_m"] < 8e-3
    assert "results depend on the grain size" in run["warnings"]
    plate, cone = tables["plate"], tables["cone"].iloc[0]
    assert plate["sinkage_m"].tolist() == pytest.approx([0.8e-3, 1.6e-3, 2.4e-3, 3.2e-3])
    assert (plate["pressure_pa"].iloc[1:] > 0.0).all()
    assert math.isnan(plate["bekker_n"].iloc[0])  # of one plate
    assert cone["resistance_pa"] > 0.0
    assert not list(tmp_path.glob("results/toy/checkpoints/wheel/*"))
    page = (tmp_path / "results/toy/wheel.md").read_text(encoding="utf-8")
    assert page.startswith("The soil's answer is confirmed")
    assert "| `static_friction` |" in page
    whole = (tmp_path / "results/toy/wheel.html").read_text(encoding="utf-8")
    assert whole.count('<img src="data:image/png;base64,') == page.count("](wheel/figures/")
    (found,) = read_table(str(tmp_path / "results/toy/wheel/sand/preparation.parquet"), "wheel_preparation").to_dict("records")
    assert found["bulk_density_kg_m3"] == pytest.approx(1320.0, abs=0.0031 * 2500.0)
    assert run["preparation_friction_ratio"] == found["preparation_friction_ratio"] != 1.0
    points = read_table(str(tmp_path / "results/toy/wheel_measured.parquet"), "wheel_measured")
    sinkage = points[points["quantity"] == "sinkage_m"].set_index("slip")
    assert sinkage["predicted"].loc[0.5] == run["sinkage_m"]
    assert sinkage["verdict"].loc[0.75] == "not run"
    pressures = points[points["quantity"] == "pressure_pa"]
    assert (pressures["verdict"].iloc[:3].isin(["agrees", "misses"])).all()
    assert pressures["verdict"].iloc[3] == "no criterion"
    line = read_table(str(tmp_path / "results/toy/wheel_handbook.parquet"), "wheel_handbook")
    assert (line["n"].iloc[0], round(line["slip"].max(), 6)) == (pytest.approx(1.0, abs=1e-6), 0.55)
    assert "- J. Doe 2001" in page
    assert "asked for 1320 kg/m³" in page
    for figure in ("wheel", "rim", "rut", "field"):
        assert (tmp_path / f"results/toy/wheel/figures/{figure}.png").stat().st_size > 5000
    folder = tmp_path / "results/toy/wheel/sand/1/slip_0.5"
    rim, rut, field = (read_table(str(folder / f"{name}.parquet"), f"wheel_{name}") for name in ("rim", "rut", "field"))
    stress = RimStress(*(rim[name].to_numpy() for name in rim))
    assert integrated(stress, 0.010, 0.008)["load_n"] == pytest.approx(run["load_n"], abs=4.0 * run["load_error_n"])
    assert (rut["height_after_m"] - rut["height_before_m"]).min() < -1e-3
    assert (field["displacement_z_m"] < -0.5e-3).any()
    again = snakemake(tmp_path, "-n", "wheel", "plate", "cone", **changes)
    assert "Nothing to be done" in again.stdout + again.stderr
