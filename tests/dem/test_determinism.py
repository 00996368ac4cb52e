"""The same bytes in every process, whoever compiled the kernels."""

import hashlib
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from dem import compiled, jit

PROGRAM = """
import hashlib, dem
touch = dem.Interaction(restitution=0.5, static_friction=0.4, rolling_friction=0.1)
simulation = dem.Simulation(
    materials={"soil": dem.Material(density_kg_m3=2500.0, poisson_ratio=0.2, shear_modulus_pa=1e7)},
    interactions={("soil", "soil"): touch},
    walls=[
        dem.Box(name="floor", material="soil", low_m=(-1, -1, 0), high_m=(1, 1, 0)),
        dem.Tube(name="tube", material="soil", radius_m=6e-3, bottom_m=0.0, top_m=1.0),
    ],
    smallest_radius_m=1e-3,
)
region = dem.TubeRegion(radius_m=6e-3, bottom_m=0.0)
simulation.add_factory(dem.Factory(n_grains=200, region=region, sizes=dem.Sizes(mean_m=1e-3), material="soil", seed=1))
simulation.advance(6000)
grains = simulation.grains
print(hashlib.sha256(grains.positions_m.tobytes() + grains.angular_velocities_rad_s.tobytes()).hexdigest())
"""


def digest(**environment):
    """What a fresh process simulates."""
    done = subprocess.run([sys.executable, "-c", PROGRAM], env=os.environ | environment, capture_output=True, text=True, check=True)
    return done.stdout.strip()


def copied(folder):
    """The package at another place, with other times."""
    copy = Path(shutil.copytree(jit.PACKAGE, folder / "dem", ignore=shutil.ignore_patterns("__pycache__")))
    os.utime(copy / "step" / "loop.py", (1e9, 1e9))
    return copy


def test_a_changed_file_needs_its_own_compilation_and_a_copy_does_not(monkeypatch, tmp_path):
    markers, copy = [], copied(tmp_path)
    for place, change in (("step/loop.py", ""), ("experiments/bed.py", "# another\n"), ("step/loop.py", "# another\n")):
        with open(copy / place, "a", encoding="utf-8") as file:
            file.write(change)
        monkeypatch.setattr(jit, "SOURCE", jit.source_hash(jit.ABOVE_KERNELS))
        markers.append(compiled.marker(compiled.Variant()))
        monkeypatch.setattr(jit, "PACKAGE", copy)
    assert markers[0] == markers[1] != markers[2]
    assert len({compiled.marker(compiled.Variant(precision)) for precision in ("float32", "float64")}) == 2


@pytest.mark.slow
def test_the_first_process_after_an_installation_gives_the_bytes_of_all_others(tmp_path):
    """And a second checkout of the same source uses the kernels of the first."""
    empty = {"NUMBA_CACHE_DIR": str(tmp_path / "cache")}
    first = digest(**empty)
    kernels = compiled.kernels(tmp_path / "cache")
    second = digest(PYTHONPATH=str(copied(tmp_path).parent), **empty)
    assert len(first) == 2 * hashlib.sha256().digest_size
    assert first == second == digest()
    assert kernels == compiled.kernels(tmp_path / "cache")
