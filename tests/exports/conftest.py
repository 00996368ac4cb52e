"""A material card to export."""

from pathlib import Path

import pytest
import yaml

from virtual_soil.exports import material_card

ROOT = Path(__file__).parents[2]
OPTIMUM = {
    "case": "sand", "soil": "barco", "surrogate": "ours", "radius_m": 1e-4, "static_friction": 0.4, "rolling_friction": 0.1,
    "radius_m_low_95": 5e-5, "radius_m_high_95": 2e-4, "static_friction_low_95": 0.3, "static_friction_high_95": 0.5,
    "rolling_friction_low_95": 0.05, "rolling_friction_high_95": 0.15, "cohesion_pa": 1.0, "friction_angle_deg": 27.0,
    "angle_of_repose_deg": 29.0, "target_cohesion_pa": 24.0, "target_friction_angle_deg": 26.6, "target_angle_of_repose_deg": 30.0,
    "cohesion_pa_low_95": -5.0, "cohesion_pa_high_95": 6.0, "friction_angle_deg_low_95": 25.0, "friction_angle_deg_high_95": 28.0,
    "angle_of_repose_deg_low_95": 27.0, "angle_of_repose_deg_high_95": 31.0, "missed": "cohesion", "extrapolated": "",
    "prediction": "contradicted: angle_of_repose", "match": "misses: angle_of_repose",
}  # fmt: skip
SIMULATED = [
    {"response": "angle_of_repose", "unit": "deg", "target": 30.0, "predicted": 29.0, "predicted_se": 1.0,
     "simulated": float("nan"), "simulated_se": float("nan"), "n_seeds": 0, "prediction": "not simulated",
     "match": "not simulated"},
]  # fmt: skip
RESPONSES = {"cohesion_pa": "Pa", "friction_angle_deg": "deg", "angle_of_repose_deg": "deg"}
PROVENANCE = {"engine": "abc", "inference": "def", "export": "012", "versions": {"numpy": "2"}}


@pytest.fixture
def config():
    return yaml.safe_load((ROOT / "config/config.yaml").read_text())


@pytest.fixture
def make_card(config):
    """A card of the optimum with changes to it, and to the configuration: make_card(engine={...}, repose={...}).

    clump : shape of the grains.
    """

    def make(optimum=None, clump=None, **changes):
        changed = config | {k: config[k] | v for k, v in changes.items()}
        return material_card(OPTIMUM | (optimum or {}), SIMULATED, changed, PROVENANCE, RESPONSES, clump)

    return make
