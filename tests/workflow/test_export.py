"""What a study hands over: one folder for each case, here of the reference campaign."""

import json
from pathlib import Path
from types import SimpleNamespace

import pandas as pd
import pytest
import yaml

import export
from virtual_soil.campaign.experiments.registry import responses_of
from virtual_soil.exports import PROGRAMS, check_card

ROOT = Path(__file__).parents[2]
REFERENCE = ROOT / "docs" / "reference"


@pytest.mark.parametrize("case", ["sand", "regolith"])
def test_a_case_gets_its_card_and_input_for_every_program(tmp_path, case):
    files = SimpleNamespace(
        calibration=str(REFERENCE / "calibration.parquet"), verification=str(REFERENCE / "verification.parquet")
    )
    provenance = {"engine": "a", "inference": "b", "export": "c", "versions": {}}
    config = yaml.safe_load((ROOT / "config/config.yaml").read_text())
    export.main(case, files, SimpleNamespace(config=config, provenance=provenance), tmp_path / case)
    assert {path.name for path in (tmp_path / case).iterdir()} == {"material.json", *(name for name, _ in PROGRAMS.values())}
    card = check_card(json.loads((tmp_path / case / "material.json").read_text()))
    # our optimum, not that of the polynomials or of the paper, which are in the same table
    optimum = pd.read_parquet(REFERENCE / "calibration.parquet").query("surrogate == 'ours'").set_index("case").loc[case]
    for name in config["design"]["variables"]:
        assert card["parameters"][name]["value"] == optimum[name]
        assert card["parameters"][name]["low_95"] == optimum[f"{name}_low_95"]
    assert [card["verification"][name] for name in ("prediction", "match")] == [optimum["prediction"], optimum["match"]]
    known = responses_of(config["experiments"])  # the reference was made before bulk densities were measured
    expected = [name for name in known if "bulk_density" not in name]
    assert [row["response"] for row in card["verification"]["simulations"]] == expected
