"""An experiment is added as the guide prints it: new files, and one line in one list; then it runs from target to report."""

import re
import shutil
import subprocess
import sys

import pandas as pd
import pytest
import yaml
from campaign import ENVIRONMENT, ROOT, copy_project
from test_guides import printed

from virtual_soil.campaign.manifest import hashes

CAMPAIGN, REPORT = "src/virtual_soil/campaign/experiments", "src/virtual_soil/report/experiments"
#: New file -> how the block of the guide begins that it is printed in.
PRINTED = {
    f"{CAMPAIGN}/density/declared.py": '"""Loose bulk density in a campaign',
    f"{CAMPAIGN}/density/simulate.py": '"""The loose-density test as a job',
    f"{CAMPAIGN}/density/measure.py": '"""Loose densities of stored packings',
    f"{CAMPAIGN}/density/schemas/density_run.yaml": "columns:\n  simulation_id",
    f"{REPORT}/density.py": '"""Loose density: what the report',
}
WRITTEN = {
    f"{CAMPAIGN}/density/__init__.py": '"""The loose-density test in a campaign."""\n',
    f"{CAMPAIGN}/density/schemas/density.yaml": (
        "includes: [design, density_run]\ncolumns:\n  wall_time_s: {type: number, meaning: wall time}\n"
    ),
    "src/virtual_soil/report/captions/loose_density.rst": "Loose density over static friction.\n",
    f"{CAMPAIGN}/density/schemas/density_history.yaml": "columns:\n  simulation: {type: string, meaning: simulation_id}\n",
}
GENERATED = {"config/config.yaml", "config/schema.yaml", "docs/configuration.md"}
TESTS = ("repose", "shear", "density")
WEIGHTS = {"angle_of_repose": 0.2, "cohesion": 0.2, "friction_angle": 0.2, "large_grains": 0.2, "loose_density": 0.2}
#: As few and as short simulations as make all surrogates.
STUDY = {
    "study": "small",
    "experiments": list(TESTS),
    "soils": ["own"],
    "design": {
        "grid": {"static_friction": [0.2, 0.5, 0.9], "rolling_friction": [0.05, 0.1, 0.2]},
        "variables": ["static_friction", "rolling_friction"],  # the radius is fixed
        "sweep_couples": [{"static_friction": 0.5, "rolling_friction": 0.1}],
        **{f"{name}_seeds": [1, 2] if name == "density" else [1] for name in TESTS},
    },
    "screening": {"base_seeds": [1, 2], "changed_seeds": [1], "factors": {"density_kg_m3": 1.3333}},
    "fidelity": {"campaign": {"lift_speed_m_s": 1e-2}, "check": {"couples": []}},
    "repose": {"n_particles": 700, "tube_diameter_ratio": 8.0, "plate_half_width_ratio": 40.0},
    "shear": {"length_ratio": 20.0, "height_ratio": 12.0, "displacement_ratio": 2.0, "normal_stresses_pa": [250.0, 500.0, 1000.0]},
    "density": {"n_particles": 500, "tube_radius_ratio": 8.0},
    "optimise": {"cases": [{"case": "own", "soil": "own", "weights": WEIGHTS}], "n_starts": 4},
    "uncertainty": {"n_samples": 100, "n_equivalents": 5},
    "refine": {"rounds": 0},
    "verify": {**{f"{name}_seeds": [101] for name in TESTS}, "more_seeds": 0},
}
SOIL = """
angle_of_repose_deg: {value: 25.0, source: made up}
cohesion_pa: {value: 20.0, source: made up}
friction_angle_deg: {value: 30.0, source: made up}
loose_density_kg_m3: {value: 1600.0, source: made up}
"""


def run(project, *command):
    environment = ENVIRONMENT | {"PYTHONPATH": str(project / "src")}
    return subprocess.run(
        [sys.executable, "-m", *command], cwd=project, env=environment, capture_output=True, text=True, check=False
    )


@pytest.fixture(scope="module")
def project(tmp_path_factory):
    """A copy of the project with the printed experiment in it, and the files that were changed for it."""
    project = copy_project(tmp_path_factory.mktemp("addition"))
    (project / "src").unlink()
    shutil.copytree(ROOT / "src", project / "src", ignore=shutil.ignore_patterns("__pycache__"))
    (project / "docs").mkdir()
    shutil.copy(ROOT / "docs/configuration.md", project / "docs")
    before = hashes(project)
    for name, text in {**{name: printed("add-an-experiment.md", text) for name, text in PRINTED.items()}, **WRITTEN}.items():
        (project / name).parent.mkdir(parents=True, exist_ok=True)
        (project / name).write_text(text)
    example = (ROOT / "docs/examples/loose_density.py").read_text().split('if __name__ == "__main__":')[0]
    (project / "src/dem/experiments/loose_density.py").write_text(example)
    registry = project / CAMPAIGN / "registry.py"
    line = printed("add-an-experiment.md", "from virtual_soil.campaign.experiments.density import")
    first = "from virtual_soil.campaign.experiments.repose"
    text = registry.read_text().replace(first, f"{line}{first}", 1)
    registry.write_text(re.sub(r"= \((shear, plane_shear, slope, draw_down, rotating_drum, repose)\)", r"= (\1, density)", text))
    result = run(project, "virtual_soil.campaign.generate")
    assert result.returncode == 0, result.stderr
    after = hashes(project)
    changed = {name for name in before if after.get(name) != before[name] and "__pycache__" not in name}
    return project, changed


def test_one_list_changes_by_hand_and_the_generated_files(project):
    assert project[1] == {f"{CAMPAIGN}/registry.py", *GENERATED}


def test_the_printed_experiment_runs_from_a_target_to_the_report(project):
    folder, _ = project
    (folder / "config/small.yaml").write_text(yaml.safe_dump(STUDY))
    (folder / "config/soils/own.yaml").write_text(SOIL)
    result = run(folder, "snakemake", "-c2", "all", "--configfile", "config/small.yaml")
    assert result.returncode == 0, result.stdout[-4000:] + result.stderr[-4000:]
    results = folder / "results/small"
    assert set(pd.read_parquet(results / "density.parquet")["status"]) == {"done"}
    assert "loose_density" in set(pd.read_parquet(results / "soil.parquet")["property"])
    optimum = pd.read_parquet(results / "calibration.parquet").query("surrogate == 'ours'").iloc[0]
    assert optimum["target_loose_density_kg_m3"] == 1600.0
    assert 1200.0 < optimum["loose_density_kg_m3"] < 2000.0
    verified = pd.read_parquet(results / "verification.parquet").set_index("response").loc["loose_density"]
    assert verified["simulated"] == pytest.approx(verified["predicted"], rel=0.2)
    page = (results / "report.html").read_text()
    assert "loose density" in page
    assert "Packings are poured with full friction." in page
