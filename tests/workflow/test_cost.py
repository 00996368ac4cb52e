"""What a simulation is expected to take, beside the engine's own count and beside simulations that were made."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import yaml
from snakemake.utils import update_config

from dem.experiments import angle_of_repose, direct_shear
from virtual_soil.campaign import cost
from virtual_soil.campaign.cost import expected_s, memory_mb, runtime_min
from virtual_soil.campaign.experiments.common import engine_of, soil_of, time_step_s
from virtual_soil.campaign.experiments.registry import BY_NAME
from virtual_soil.campaign.experiments.shear import declared
from virtual_soil.campaign.study import design_rows, experiment_settings, plain_rows

ROOT = Path(__file__).parents[2]
REFERENCE = ROOT / "docs" / "reference"


def study(name):
    """A study's configuration."""
    config = yaml.safe_load((ROOT / "config" / "config.yaml").read_text())
    update_config(config, yaml.safe_load((ROOT / "config" / f"{name}.yaml").read_text()))
    return config


def recorded(experiment):
    """Design rows with what their simulations took, of the reference campaign, and their settings."""
    rows = plain_rows(pd.read_parquet(REFERENCE / f"{experiment}.parquet"))
    # slopes that creep until the time limit take more, and are finished in their next attempt
    rows = [row for row in rows if row["status"] not in ("failed", "time_limit")]
    config = study("reference")
    return rows, [experiment_settings(config, row) for row in rows]


def grains_and_steps(row, settings):
    return BY_NAME[row["experiment"]].cost(row, settings)


def first(experiment):
    rows, settings = recorded(experiment)
    return rows[0], settings[0]


@pytest.mark.parametrize("sd_ratio", [0.0, 0.2])
def test_grains_of_a_heap_are_the_engines(sd_ratio):
    row, settings = first("repose")
    row |= {"radius_sd_ratio": sd_ratio}
    setup = angle_of_repose.Setup(**settings["setup"])
    built = angle_of_repose.build(soil_of(row, settings), setup, engine_of(settings), 1)
    assert time_step_s(soil_of(row, settings), engine_of(settings)) == built.time_step_s
    assert grains_and_steps(row, settings)[0] == built.n_grains


@pytest.mark.parametrize("number", [None, 5000.0])
def test_grains_and_sheared_steps_are_the_engines_in_a_box(number, monkeypatch):
    config = study("paper")
    row = next(row for row in design_rows(config) if row["experiment"] == "shear") | {"radius_sd_ratio": 0.2}
    config["fidelity"]["campaign"]["shear_stiffness_number"] = number
    settings = experiment_settings(config, row)
    soil, setup = soil_of(row, settings), direct_shear.Setup(**settings["setup"])
    built = direct_shear.build(soil, setup, engine_of(settings), 1)
    monkeypatch.setattr(declared, "CONSOLIDATION_STEPS", 0)
    monkeypatch.setattr(declared, "CONSOLIDATION_TIMES", 0.0)
    grains, steps = grains_and_steps(row, settings)
    assert grains == built.n_grains
    # the engine rounds every one of the 120 intervals between two samples up
    sheared = direct_shear.N_SAMPLES * direct_shear.sample_steps(soil, setup, built)
    assert 0 <= sheared - steps <= direct_shear.N_SAMPLES


@pytest.mark.parametrize("experiment", ["repose", "plane_shear"])
def test_what_simulations_took_was_expected_within_the_headroom(experiment):
    rows, settings = recorded(experiment)
    expected = np.array([grains_and_steps(*pair)[1] for pair in zip(rows, settings, strict=True)])
    ratio = expected / np.array([row["n_steps"] for row in rows])
    assert 0.6 < np.median(ratio) < 1.7
    assert ratio.min() > 1.0 / cost.HEADROOM


@pytest.mark.parametrize("experiment", ["repose", "plane_shear"])
def test_an_attempt_gets_more_than_the_one_before(experiment):
    row, settings = first(experiment)
    minutes = [runtime_min([(row, settings)], attempt) for attempt in (1, 2, 3)]
    megabytes = [memory_mb([(row, settings)], attempt) for attempt in (1, 2, 3)]
    for values in (minutes, megabytes):
        assert all(isinstance(value, int) and value >= 1 for value in values)
        assert values[0] < values[1] < values[2]


def test_more_grains_and_stiffer_grains_get_more_time():
    row, settings = first("repose")
    many = settings | {"setup": settings["setup"] | {"n_particles": 300_000}}
    stiff = row | {"shear_modulus_pa": 100.0 * row["shear_modulus_pa"]}
    assert grains_and_steps(stiff, settings)[1] == pytest.approx(10.0 * grains_and_steps(row, settings)[1])
    assert runtime_min([(row, many)], 1) > 100 * runtime_min([(row, settings)], 1)
    assert memory_mb([(row, many)], 1) > memory_mb([(row, settings)], 1) + 500


def test_a_batch_gets_the_time_of_all_its_simulations_and_the_memory_of_the_largest():
    row, settings = first("repose")
    large = settings | {"setup": settings["setup"] | {"n_particles": 300_000}}
    batch = [(row, settings), (row, large), (row, settings)]
    minutes = cost.START_MIN + cost.HEADROOM * (2.0 * expected_s(row, settings) + expected_s(row, large)) / 60.0
    assert runtime_min(batch, 1) - 1 < minutes <= runtime_min(batch, 1)
    assert memory_mb(batch, 1) == memory_mb([(row, large)], 1)
