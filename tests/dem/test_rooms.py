"""A contact law or a shape is added with one new module and one changed file, and takes effect."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from dem import jit

LAW = '''
"""A brake proportional to the radius instead of the normal force."""

from typing import NamedTuple


class RollingD(NamedTuple):
    torque: float


PARAMETERS = RollingD
PROPERTIES = ("rolling_friction",)
COLUMNS = ("mu_r", "torque")
CONSTANTS = ("torque",)
HISTORY = ("nothing",)
SEPARATE_SPINS = False
WORDS = {"words": "A dummy.", "equation": "none"}


def column_values(a, b, interaction):
    return interaction.rolling_friction, 1e3 * interaction.rolling_friction


def reach(columns, R_star):
    return 0.0


def read(law, c, o):
    return RollingD(c[o])


def write(law, raw, p, c, o, pair):
    c[o] = raw[p + 256] * pair.R_star


def resistance(law, pressing):
    return law.torque * pressing
'''

SHAPE = '''
"""A sphere. Geometry record: centre, centre, radius."""

import math
from dataclasses import dataclass, replace

import numpy as np

from dem.jit import lean_jit
from dem.layout import BLOCK as B
from dem.shapes.wall import SIZE, Wall, store


@dataclass(frozen=True, kw_only=True)
class Ball(Wall):
    centre_m: tuple[float, float, float]
    radius_m: float


SHAPE = Ball


def record(ball):
    return (*ball.centre_m, *ball.centre_m, ball.radius_m)


def placed(ball, values):
    return replace(ball, centre_m=tuple(values[:3]))


def distance(ball, positions):
    return np.linalg.norm(positions - ball.centre_m, axis=1) - ball.radius_m


@lean_jit
def separation(x, y, z, g):
    x, y, z = x - g[0], y - g[1], z - g[2]
    share = 1.0 - g[SIZE] / math.sqrt(x * x + y * y + z * z)
    return share * x, share * y, share * z


@lean_jit
def separate(g, places, n, b):
    for q in range(n):
        x, y, z = separation(places[q], places[B + q], places[2 * B + q], g)
        store(x, y, z, places[3 * B + q], q, b)
'''

SEPARATION = """        return box.separation(x, y, z, g)
    if kind == BALL:
        return ball.separation(x, y, z, g)
"""
SEPARATE = """        box.separate(g, places, n, b)
    elif kind == BALL:
        ball.separate(g, places, n, b)
"""

SCENE = """
import sys, dem
from dem import shapes
rolling, ball = sys.argv[1], len(sys.argv) > 2
touch = dem.Interaction(restitution=0.5, static_friction=0.5, rolling_friction=0.3)
floor = dem.Box(name="floor", material="soil", low_m=(-1, -1, 0), high_m=(1, 1, 0))
if ball:
    from dem.shapes.ball import Ball
    floor = Ball(name="floor", material="soil", centre_m=(0.0, 0.0, -0.1), radius_m=0.1, velocity_m_s=(0.0, 0.0, 0.01))
simulation = dem.Simulation(
    materials={"soil": dem.Material(density_kg_m3=2500.0, poisson_ratio=0.2, shear_modulus_pa=1e6)},
    interactions={("soil", "soil"): touch}, walls=[floor], smallest_radius_m=1e-3, vector_code=False, rolling_model=rolling,
)
simulation.add_grains([(0, 1e-4, 1.0e-3), (0, 1.2e-4, 3.0e-3)], 1e-3, "soil", (0, 0, -0.05), (30.0, 0, 10.0))
simulation.advance(400)
dem.save(simulation, "state.npz")
grains = dem.load("state.npz").grains
print(simulation.mean_wall_forces_n["floor"].tolist(), grains.positions_m[:, 2].tolist(), grains.angular_velocities_rad_s.tolist())
"""


@pytest.fixture
def copy(tmp_path):
    """A copy of the package; a function that runs the scene with it, and one that names the files that differ from the original."""
    package = Path(shutil.copytree(jit.PACKAGE, tmp_path / "dem", ignore=shutil.ignore_patterns("__pycache__")))

    def run(*arguments):
        environment = os.environ | {"PYTHONPATH": str(tmp_path), "NUMBA_DISABLE_JIT": "1"}
        done = subprocess.run(
            [sys.executable, "-c", SCENE, *arguments], cwd=tmp_path, env=environment, capture_output=True, text=True, check=False
        )
        assert not done.returncode, done.stderr
        return done.stdout

    def changed():
        originals = {path.relative_to(jit.PACKAGE): path.read_text() for path in jit.PACKAGE.rglob("*.py")}
        return sorted(name.as_posix() for name, text in originals.items() if (package / name).read_text() != text)

    return package, run, changed


def edit(file, *replacements):
    text = file.read_text()
    for old, new in replacements:
        assert text.count(old) == 1, old
        text = text.replace(old, new)
    file.write_text(text)


def test_a_rolling_law_is_one_module_and_its_entry_in_the_list(copy):
    package, run, changed = copy
    (package / "contact" / "laws" / "rolling_d.py").write_text(LAW)
    edit(
        package / "contact" / "model.py",
        ("pull_off, rolling_a, rolling_c\n", "pull_off, rolling_a, rolling_c, rolling_d\n"),
        ('"type_c": rolling_c}', '"type_c": rolling_c, "type_d": rolling_d}'),
    )
    assert changed() == ["contact/model.py"]
    assert len({run("type_a"), run("type_c"), run("type_d")}) == 3
    assert run("type_d") == run("type_d")


def test_a_shape_is_one_module_and_its_entry_in_the_list(copy):
    package, run, changed = copy
    (package / "shapes" / "ball.py").write_text(SHAPE)
    edit(
        package / "shapes" / "__init__.py",
        ("from dem.shapes import box, mesh, tube", "from dem.shapes import ball, box, mesh, tube"),
        ("SHAPES = (box, tube, mesh)", "SHAPES = (box, tube, mesh, ball)"),
        ("KINDS = BOX, TUBE, MESH =", "KINDS = BOX, TUBE, MESH, BALL ="),
        ("        return box.separation(x, y, z, g)\n", SEPARATION),
        ("        box.separate(g, places, n, b)\n", SEPARATE),
    )
    assert changed() == ["shapes/__init__.py"]
    flat, round_ = run("type_a"), run("type_a", "ball")
    assert flat != round_
    assert "-" in round_.split("]")[0]  # the grains press the ball down
