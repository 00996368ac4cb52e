"""A simulation that cannot work is recorded with its reason, and excluded visibly."""

import numpy as np
import pandas as pd
import pytest

from virtual_soil.campaign.experiments.repose import simulate as heaps
from virtual_soil.campaign.experiments.repose.measure import measured
from virtual_soil.campaign.experiments.shear.measure import reduce
from virtual_soil.campaign.sections import Study
from virtual_soil.campaign.settings import defaults
from virtual_soil.campaign.simulate import run_batch
from virtual_soil.campaign.study import experiment_settings

ROW = {
    "simulation_id": "0123456789", "point_id": "01234567", "fidelity": "campaign",
    "radius_m": 1e-3, "radius_sd_ratio": 0.0, "density_kg_m3": 2500.0,
    "poisson_ratio": 0.2, "shear_modulus_pa": 1e7, "static_friction": 0.3, "rolling_friction": 0.1, "restitution": 0.5, "seed": 1,
}  # fmt: skip
IMPOSSIBLE = ROW | {"poisson_ratio": 0.6}


@pytest.fixture
def config():
    fidelity = {
        "repose_stiffness_number": None, "shear_stiffness_number": 5000.0, "repose_time_step_rayleigh_ratio": 0.4,
        "shear_time_step_rayleigh_ratio": 0.3,
        "shear_inertial_number": 0.01, "lift_speed_m_s": 0.05,
    }  # fmt: skip
    return {
        "material": {"radius_m": 1e-3},
        "design": {"geometry": "scaled"},
        "fidelity": {"campaign": fidelity},
        **{name: defaults(Study)[name] for name in ("repose_test", "shear_test", "grading")},
        "engine": {
            "rolling_model": "type_a", "damping_model": "edem", "precision": "float32", "energy_ledger": False,
            "gravity_m_s2": 9.81,
        },
        "repose": {
            "n_particles": 60, "tube_diameter_ratio": 5.0, "plate_half_width_ratio": 30.0, "wall_static_friction": None,
            "wall_rolling_friction": None, "max_time_s": 0.05, "estimator": "profile",
        },
        "shear": {
            "length_ratio": 16.0, "height_ratio": 10.0, "width_ratio": 5.0, "displacement_ratio": 0.5, "frame_static_friction": 0.0,
            "preparation_friction_ratio": 0.3, "normal_stresses_pa": [500.0], "strength": "plateau", "normal_stress": "plane",
        },
    }  # fmt: skip


def simulate(row, config, folder):
    output = {name: str(folder / name) for name in ("history", "before", "after", "run", "timing")}
    run_batch([(row, experiment_settings(config, row))], "engine", output, str(folder / "checkpoints"), 300)
    return pd.read_parquet(output["run"]).iloc[0], output


def test_an_impossible_heap_is_recorded_with_its_reason(config, tmp_path):
    run, output = simulate(IMPOSSIBLE | {"experiment": "repose"}, config, tmp_path)
    assert run["status"] == "failed"
    assert run["reason"] == "poisson_ratio is 0.6; allowed: between -1 and 0.5, both excluded."
    assert len(pd.read_parquet(output["after"])) == 0
    assert measured(run.to_dict(), None, config["repose"])["angle_profile_deg"] is None


def test_an_impossible_shear_test_is_recorded_and_left_out_of_the_strength(config, tmp_path):
    row = IMPOSSIBLE | {"experiment": "shear", "normal_stress_pa": 1000.0}
    run, _ = simulate(row, config, tmp_path)
    assert run["status"] == "failed"
    stresses = np.array([100.0, 200.0, 400.0, 800.0])
    shear = pd.DataFrame(
        {
            "point_id": "p", "fidelity": "campaign", "purposes": "grid", "status": ["done", "done", "done", run["status"]],
            "normal_stress_pa": stresses, "plane_normal_stress_pa": stresses,
            "plateau_shear_stress_pa": [60.0, 120.0, 240.0, np.nan],
        }
    )  # fmt: skip
    settings = {"strength": "plateau", "normal_stress": "plane"}
    assert reduce("strength", shear, settings)["n_runs"].tolist() == [3]


def test_a_heap_that_does_not_come_to_rest_in_time_says_so_and_has_no_angle_of_repose(config, tmp_path):
    config["fidelity"]["campaign"]["lift_speed_m_s"] = 1.0
    config["repose"]["max_time_s"] = 0.03  # no heap of any seed rests so soon
    run, output = simulate(ROW | {"experiment": "repose"}, config, tmp_path)
    assert run["status"] == "time_limit"
    grains = pd.read_parquet(output["after"])
    assert len(grains) == 60
    row = measured(run.to_dict(), grains, config["repose"])
    assert np.isfinite(row["angle_profile_deg"])
    assert row["angle_of_repose_deg"] is None


def test_a_heap_that_is_still_in_its_tube_at_the_time_limit_has_failed(config, tmp_path):
    run, _ = simulate(ROW | {"experiment": "repose"}, config, tmp_path)
    assert run["status"] == "failed"
    assert run["reason"].startswith("the tube is not clear of the grains at the time limit of 0.05 s: its rim is 2.5 mm high, the")


def test_a_fault_of_the_program_is_not_mistaken_for_a_failed_simulation(config, tmp_path, monkeypatch):
    def broken(*_, **__):
        raise KeyError("a bug")

    monkeypatch.setattr(heaps.angle_of_repose, "run", broken)
    with pytest.raises(RuntimeError, match="1 of 1 simulations broke off: 0123456789"):
        simulate(ROW | {"experiment": "repose"}, config, tmp_path)


def test_a_flat_heap_has_a_bound_and_its_middle_as_value(config):
    run = {"status": "flat", "n_particles": 3000}
    row = measured(run, pd.DataFrame({"x_m": []}), config["repose"])
    assert row["angle_bound_deg"] == pytest.approx(5.78, abs=0.02)
    assert row["angle_of_repose_deg"] == 0.5 * row["angle_bound_deg"]
    assert row["angle_profile_deg"] == 0.0
