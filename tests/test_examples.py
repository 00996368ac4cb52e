"""What the documentation shows runs as shown."""

import doctest
import re
import subprocess
import sys
from pathlib import Path

import nbformat
import numpy as np
from PIL import Image

import dem

ROOT = Path(__file__).parents[1]
BIN = Path(sys.executable).parent


def test_the_packages_first_example_is_true():
    results = doctest.testmod(dem)
    assert results.attempted > 5
    assert results.failed == 0


def test_the_heap_example_pours_a_heap():
    result = subprocess.run([sys.executable, "docs/examples/heap.py"], cwd=ROOT, capture_output=True, text=True, check=True)
    angle = float(re.search(r"angle of repose ([\d.]+) deg", result.stdout).group(1))
    assert 20 < angle < 45


def test_dimers_stand_where_spheres_without_rolling_friction_lie_flat():
    result = subprocess.run([sys.executable, "docs/examples/clumps.py"], cwd=ROOT, capture_output=True, text=True, check=True)
    spheres, dimers = map(float, re.findall(r"angle of repose ([\d.]+) deg", result.stdout))
    tilt, order = map(float, re.search(r"long axes: ([\d.]+) deg .* order ([\d.]+)", result.stdout).groups())
    assert spheres < 5.0
    assert dimers > spheres + 10.0
    assert tilt > 60.0  # they lie, beyond the 57.3 deg of random directions
    assert 0.0 < order < 0.5


def test_a_paddle_from_a_file_stirs_grains_and_is_filmed(tmp_path):
    film = tmp_path / "paddle.gif"
    command = [sys.executable, "docs/examples/paddle.py", str(film)]
    result = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True)
    torque = float(re.search(r"paddle: (-?[\d.]+) uN m", result.stdout).group(1))
    assert torque < -1.0  # it turns about +y and the grains hold it back
    with Image.open(film) as drawn:
        assert drawn.n_frames == 30


def test_calibration_by_hand_finds_the_heap_and_draws_it(tmp_path):
    picture = tmp_path / "heap.png"
    command = [sys.executable, "docs/examples/calibrate_by_hand.py", str(picture)]
    result = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True)
    angles = {float(r): float(angle) for r, angle in re.findall(r"friction ([\d.]+): angle of repose ([\d.]+)", result.stdout)}
    assert len(angles) == 5
    assert angles[0.1] < angles[0.3]
    best = float(re.search(r"nearest to 30 deg: rolling friction ([\d.]+)", result.stdout).group(1))
    assert abs(angles[best] - 30.0) < 5.0
    with Image.open(picture) as drawn:
        side, above = np.array_split(np.asarray(drawn.convert("RGB")), 2, axis=1)
    for view in (side, above):  # grains in the shades of their depth, not an empty figure
        assert len(np.unique(view.reshape(-1, 3), axis=0)) > 500


def test_frictionless_grains_pack_as_spheres_do_and_rough_ones_more_loosely():
    command = [sys.executable, "docs/examples/loose_density.py"]
    result = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True)
    smooth, medium, rough = map(float, re.findall(r"solid fraction ([\d.]+)", result.stdout))
    assert abs(smooth - 0.6366) < 0.015  # Scott & Kilgour 1969; the core holds some 500 grains
    assert 0.45 < rough < medium - 0.03 < smooth - 0.06


def test_the_notebook_shows_a_heap_its_picture_and_tables(tmp_path):
    command = [sys.executable, "docs/examples/execute.py", str(tmp_path)]
    subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True)
    kept, anew = (nbformat.read(folder / "heap.ipynb", as_version=4) for folder in (ROOT / "docs/examples", tmp_path))
    assert [cell.source for cell in anew.cells] == [cell.source for cell in kept.cells]
    for notebook in (kept, anew):
        outputs = [output for cell in notebook.cells for output in cell.get("outputs", ())]
        assert not any(output.output_type == "error" for output in outputs)
        shown = [output.data for output in outputs if "data" in output]
        assert sum("image/png" in data for data in shown) == 2
        (shape,) = [data["text/html"] for data in shown if "<caption>HeapShape" in data.get("text/html", "")]
        angle = float(re.search(r"angle_profile_deg</th><td>([\d.]+)", shape).group(1))
        assert 15 < angle < 30  # Table 2: 27.5 deg with twice as many grains; its own surrogate: 23.3


def test_the_packages_pages_are_written_without_a_warning(tmp_path):
    dry = ["make", "--no-print-directory", "-n", "docs", f"BIN={BIN}"]
    recipe = subprocess.run(dry, cwd=ROOT, capture_output=True, text=True, check=True).stdout
    command = recipe.splitlines()[-1].replace("build/api", str(tmp_path)).split()
    result = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert (result.returncode, result.stderr) == (0, "")
    for page in (
        "dem.html",
        "dem/experiments/angle_of_repose.html",
        "virtual_soil/calibration/optimise.html",
        "virtual_soil/exports.html",
    ):
        assert (tmp_path / page).is_file()


def test_make_help_names_every_target_the_readme_uses():
    help_text = subprocess.run(["make", "help"], cwd=ROOT, capture_output=True, text=True, check=True).stdout
    targets = {line.split()[0] for line in help_text.splitlines()}
    assert {"campaign", "setup", "test", "lint", "smoke", "paper"} <= targets
