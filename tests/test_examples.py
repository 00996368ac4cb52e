"""What the documentation shows runs as shown."""

import doctest
import re
import subprocess
import sys
from pathlib import Path

import dem

ROOT = Path(__file__).parents[1]


def test_the_packages_first_example_is_true():
    results = doctest.testmod(dem)
    assert results.attempted > 5
    assert results.failed == 0


def test_the_heap_example_pours_a_heap():
    result = subprocess.run([sys.executable, "docs/examples/heap.py"], cwd=ROOT, capture_output=True, text=True, check=True)
    angle = float(re.search(r"angle of repose ([\d.]+) deg", result.stdout).group(1))
    assert 20 < angle < 45


def test_make_help_names_every_target_the_readme_uses():
    help_text = subprocess.run(["make", "help"], cwd=ROOT, capture_output=True, text=True, check=True).stdout
    targets = {line.split()[0] for line in help_text.splitlines()}
    assert {"campaign", "setup", "test", "lint", "smoke", "paper"} <= targets
