"""The guide "your apparatus", command by command, with larger grains, a faster lift and few points: two files to an answer."""

import re

import pandas as pd
import pytest
import yaml
from campaign import ROOT, copy_project, snakemake
from test_guides import blocks

GUIDE = ROOT / "docs" / "guides" / "your-apparatus.md"
#: On top of the guide's study: what makes it small.
SMALL = {
    "material": {"radius_m": 3e-3},
    "design": {"n_points": 10, "repose_seeds": [1]},
    "screening": {"base_seeds": [1, 2], "changed_seeds": [1]},
    "plane_shear": {"length_ratio": 16.0, "height_ratio": 20.0, "width_ratio": 10.0, "max_shear_strain": 8.0},
    "fidelity": {"check": {"couples": []}},
    "optimise": {"n_starts": 4},
    "uncertainty": {"n_samples": 100, "n_equivalents": 5},
    "refine": {"rounds": 0},
    "verify": {"repose_seeds": [101, 102], "plane_shear_seeds": [101], "more_seeds": 0, "equivalents": 0},
}


@pytest.fixture(scope="module")
def project(tmp_path_factory):
    """A project with the guide's two files, and the small study's results."""
    project = copy_project(tmp_path_factory.mktemp("own"))
    (soil,) = [block for block in blocks(GUIDE) if block.startswith("angle_of_repose_deg:")]
    (study,) = [block for block in blocks(GUIDE) if block.startswith("study:")]
    (project / "config/soils/our_sand.yaml").write_text(soil.replace("lift_speed_m_s: 0.01", "lift_speed_m_s: 0.1"))
    (project / "config/our_sand.yaml").write_text(study)
    (project / "config/small.yaml").write_text(yaml.safe_dump(SMALL))
    done = snakemake(project, "-c1", "all", "--configfile", "config/our_sand.yaml", "config/small.yaml")
    assert done.returncode == 0, done.stderr[-3000:]
    return project


def table(project, name):
    return pd.read_parquet(project / f"results/our_sand/{name}.parquet")


def test_the_guide_ends_with_an_answer_for_its_own_grains(project):
    answer = table(project, "calibration").iloc[0]
    assert answer["radius_m"] == 3e-3
    for name, (low, high) in {"static_friction": (0.1, 1.0), "rolling_friction": (0.0, 0.3)}.items():
        assert low <= answer[name] <= high
    asked = table(project, "verification").query("match != 'not asked'")
    assert set(asked["response"]) == {"angle_of_repose", "steady_friction_angle", "bulk_density"}
    assert asked["simulated"].notna().all()


def test_tube_and_stresses_are_the_laboratorys(project):
    heaps, beds = table(project, "repose"), table(project, "plane_shear")
    of_guide = heaps[heaps["radius_m"] == 3e-3]
    assert set(of_guide["n_particles"]) == {round(0.57 * 0.025**2 * 0.15 / (4.0 / 3.0 * 3e-3**3))}
    assert set(beds["normal_stress_pa"]) == {5e4, 1e5, 2e5}
    assert of_guide["poured_solid_fraction"].between(0.5, 0.68).all()
    assert (of_guide["bulk_density_kg_m3"] / of_guide["density_kg_m3"]).dropna().between(0.5, 0.68).all()


def test_rougher_grains_are_poured_looser(project):
    heaps = table(project, "repose").query("purposes.str.contains('points')")
    assert heaps["poured_solid_fraction"].corr(heaps["static_friction"] + heaps["rolling_friction"], method="spearman") < -0.5


def test_the_report_draws_the_tube_to_scale(project):
    svg = (project / "results/our_sand/figures/heap.svg").read_text()
    texts = re.sub(r"<[^>]*>", "", " ".join(re.findall(r"<!-- (.*?) -->", svg)))
    assert "tube 50 mm, filled to 1" in texts
    assert "grains of 3 mm radius" in texts
    assert (project / "results/our_sand/export/our_sand/material.json").is_file()
