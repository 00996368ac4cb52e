"""What the workflow makes of a configuration before anything runs."""

import pytest
import yaml

from virtual_soil.campaign.code import ROOT
from virtual_soil.campaign.experiments.repose.declared import softening
from virtual_soil.campaign.study import StudyError, design_rows


@pytest.mark.parametrize(("reduction", "grown", "expected"), [(100.0, 1.0, 100.0), (100.0, 10.0, 10.0), (5.0, 10.0, 1.0)])
def test_heaps_of_larger_grains_are_softened_in_proportion_less(reduction, grown, expected):
    assert softening(reduction, grown) == expected


def test_the_papers_own_stiffness_is_kept_for_every_radius():
    assert {softening(1.0, grown) for grown in (0.5, 1.0, 2.0, 10.0)} == {1.0}


@pytest.mark.parametrize("gone", ["static_friction", "rolling_friction", "radius_m"])
def test_tables_and_figures_need_frictions_and_radius(gone):
    config = yaml.safe_load((ROOT / "config/config.yaml").read_text())
    design = config["design"]
    part = design["sweep"] if gone == "radius_m" else design["grid"]
    part["density_kg_m3"] = [2000.0, 2500.0, 3000.0]
    design["variables"] = [*design["variables"], "density_kg_m3"]
    design["sweep_couples"] = [
        {**couple, "density_kg_m3": 2500.0} if part is design["grid"] else couple for couple in design["sweep_couples"]
    ]
    config["fidelity"]["check"]["couples"] = []
    design_rows(config)
    del part[gone]
    design["variables"].remove(gone)
    with pytest.raises(StudyError, match="design.variables is .*; allowed: any keys of material beside static_friction"):
        design_rows(config)
