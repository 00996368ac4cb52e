"""LIGGGHTS, controlled through its standard input: input text, meshes, one running program, its printed output and dumps."""

import os
import re
import shutil
import subprocess
from pathlib import Path
from typing import IO, cast

import numpy as np

NAME = "LIGGGHTS"
HOW_TO_INSTALL = "apt-get install liggghts"
MODEL = "model hertz tangential history rolling_friction epsd2"
STICKY_MODEL = "model hertz tangential history cohesion sjkr rolling_friction epsd2"
LOOP_TIME = re.compile(r"Loop time of ([\d.e+-]+) on .*? for (\d+) steps with (\d+) atoms")

#: Minimum Young's modulus in SI units that LIGGGHTS accepts.
LEAST_YOUNG_MODULUS_PA = 5e6


class PeerError(RuntimeError):
    """Error: the program is missing, has stopped, or printed unreadable output."""


def installed() -> bool:
    """True if the program is on the path."""
    return shutil.which("liggghts") is not None


def require_installed() -> None:
    """Raise PeerError with instructions for its installation if the program is missing."""
    if not installed():
        raise PeerError(f"{NAME} is not installed; on Debian and Ubuntu: {HOW_TO_INSTALL}.")


def version() -> str:
    """Version of the Debian package."""
    query = subprocess.run(["dpkg-query", "-W", "-f", "${Version}", "liggghts"], capture_output=True, text=True)
    return query.stdout or "unknown"


def young_modulus(shear_modulus_pa: float, poisson_ratio: float) -> float:
    """Young's modulus E = 2 G (1 + nu) in Pa."""
    return 2.0 * shear_modulus_pa * (1.0 + poisson_ratio)


def material_lines(
    shear_modulus_pa, poisson_ratio, restitution, static_friction, rolling_friction, cohesion_j_m3=None
) -> list[str]:
    """Return the lines that define the contacts of n types of one elastic material.

    Parameters
    ----------
    shear_modulus_pa, poisson_ratio, restitution : numbers, the same for all types.
    static_friction, rolling_friction : (n, n), between each pair of types.
    cohesion_j_m3 : (n, n) cohesion energy density of `sjkr`, or None without cohesion.

    Raises
    ------
    PeerError : the grains are softer than LIGGGHTS allows.
    """
    E = young_modulus(shear_modulus_pa, poisson_ratio)
    if E < LEAST_YOUNG_MODULUS_PA:
        raise PeerError(f"Young's modulus is {E:.3g} Pa; {NAME} allows no less than {LEAST_YOUNG_MODULUS_PA:.3g} Pa.")
    n = len(static_friction)

    def fix(number, name, kind, values):
        return f"fix m{number} all property/global {name} {kind} " + " ".join(f"{value:.9g}" for value in values)

    sticky = [] if cohesion_j_m3 is None else [fix(6, "cohesionEnergyDensity", f"peratomtypepair {n}", np.ravel(cohesion_j_m3))]
    return [
        fix(1, "youngsModulus", "peratomtype", [E] * n),
        fix(2, "poissonsRatio", "peratomtype", [poisson_ratio] * n),
        fix(3, "coefficientRestitution", f"peratomtypepair {n}", [restitution] * n * n),
        fix(4, "coefficientFriction", f"peratomtypepair {n}", np.ravel(static_friction)),
        fix(5, "coefficientRollingFriction", f"peratomtypepair {n}", np.ravel(rolling_friction)),
        *sticky,
        f"pair_style gran {MODEL if cohesion_j_m3 is None else STICKY_MODEL}",
        "pair_coeff * *",
    ]


def header_lines(boundary: str, data: Path, skin_m: float) -> list[str]:
    """Return the lines before the materials: units, box and grains."""
    return [
        "atom_style granular", "atom_modify map array", f"boundary {boundary}", "newton off", "communicate single vel yes",
        "units si", f"read_data {data}", f"neighbor {skin_m:.9g} bin", "neigh_modify delay 0",
    ]  # fmt: skip


def data_text(title, box_m, n_types, positions_m, radii_m, densities_kg_m3, spins_rad_s=None, velocities_m_s=None, note="") -> str:
    """Return a LIGGGHTS data file of n grains of type 1; LAMMPS needs the note "  # sphere".

    Parameters
    ----------
    box_m : (3, 2) low and high ends of the simulated box. positions_m : (n, 3). radii_m : (n,). densities_kg_m3 : (n,) or a number.
    spins_rad_s, velocities_m_s : (n, 3), or None for grains at rest.
    """
    n = len(radii_m)
    lines = [title, "", f"{n} atoms", f"{n_types} atom types", ""]
    lines += [f"{low:.9g} {high:.9g} {a}lo {a}hi" for a, (low, high) in zip("xyz", box_m, strict=True)]
    lines += ["", f"Atoms{note}", ""]
    densities = np.broadcast_to(densities_kg_m3, n)
    for k, ((x, y, z), r, rho) in enumerate(zip(positions_m, radii_m, densities, strict=True), 1):
        lines.append(f"{k} 1 {2 * r:.17g} {rho:.9g} {x:.17g} {y:.17g} {z:.17g}")
    moving = np.zeros((n, 6))
    moving[:, :3] = 0.0 if velocities_m_s is None else velocities_m_s
    moving[:, 3:] = 0.0 if spins_rad_s is None else spins_rad_s
    lines += ["", "Velocities", ""]
    lines += [" ".join([str(k), *(f"{value:.17g}" for value in row)]) for k, row in enumerate(moving, 1)]
    return "\n".join(lines) + "\n"


def rectangle(corner_m, side_a_m, side_b_m) -> np.ndarray:
    """Two triangles (2, 3, 3) of a rectangle given by a corner and two sides, (3,) each."""
    a = np.asarray(corner_m, float)
    b, d = a + side_a_m, a + side_b_m
    c = b + side_b_m
    return np.array([[a, b, c], [a, c, d]])


def tube(radius_m: float, bottom_m: float, height_m: float, n_facets: int = 60) -> np.ndarray:
    """Triangles (2 n_facets, 3, 3) of an open upright tube, all outside the inscribed round tube."""
    angle = np.linspace(0, 2 * np.pi, n_facets + 1)
    outer = radius_m / np.cos(np.pi / n_facets)
    ring = np.column_stack([outer * np.cos(angle), outer * np.sin(angle), np.full_like(angle, bottom_m)])
    up = np.array([0.0, 0.0, height_m])
    return np.concatenate([rectangle(a, b - a, up) for a, b in zip(ring[:-1], ring[1:], strict=True)])


def mesh_text(triangles_m: np.ndarray) -> str:
    """Format triangles (n, 3, 3) as ASCII STL."""
    lines = ["solid mesh"]
    for triangle in triangles_m:
        lines += ["facet normal 0 0 0", "outer loop"]
        lines += ["vertex " + " ".join(f"{c:.9e}" for c in corner) for corner in triangle]
        lines += ["endloop", "endfacet"]
    return "\n".join([*lines, "endsolid mesh"]) + "\n"


def last_thermo(lines: list[str]) -> dict[str, float]:
    """Names and values of the last row of the last thermo table in the output."""
    header = max((k for k, line in enumerate(lines) if line.split()[:1] == ["Step"]), default=None)
    if header is None or header + 1 == len(lines):
        raise PeerError(f"{NAME} printed no thermo table:\n{''.join(lines[-20:])}")
    values = [line for line in lines[header + 1 :] if re.match(r"\s*\d", line)][-1]
    return dict(zip(lines[header].split(), map(float, values.split()), strict=True))


def read_dump(text: str) -> np.ndarray:
    """Read the columns of the last frame of a custom dump (n, columns), sorted by the first column, the grains' id."""
    rows = text.split("ITEM: ATOMS")[-1].splitlines()[1:]
    table = np.array([row.split() for row in rows], float).reshape(len(rows), -1)
    return table[np.argsort(table[:, 0])] if len(rows) else table


class Liggghts:
    """Running program in its own folder that reads commands line by line; use it in a `with` statement."""

    def __init__(self, folder: Path, lines: list[str]):
        require_installed()
        self.folder = folder
        self.process = subprocess.Popen(
            ["stdbuf", "-oL", "liggghts", "-log", "none"],
            cwd=folder,
            env={**os.environ, "OMP_NUM_THREADS": "1"},
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )
        self.input, self.output = cast(IO[str], self.process.stdin), cast(IO[str], self.process.stdout)
        self.send(lines)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.kill()
        self.process.communicate()

    def send(self, lines: list[str]) -> None:
        """Send commands to the program."""
        try:
            self.input.write("\n".join(lines) + "\n")
            self.input.flush()
        except BrokenPipeError:
            raise PeerError(f"{NAME} stopped:\n{self.output.read()[-2000:]}") from None

    def run(self, n_steps: int) -> dict[str, float]:
        """Run a number of steps; returns the last row of the thermo table."""
        self.send([f"run {n_steps}"])
        seen = []
        for line in self.output:
            seen.append(line)
            if LOOP_TIME.match(line):
                return last_thermo(seen)
        raise PeerError(f"{NAME} stopped:\n{''.join(seen[-20:])}")

    def dump(self, columns: str) -> np.ndarray:
        """Return the current grains: id and the named columns, one row per grain."""
        count = len(columns.split())
        self.send([f"dump now all custom 1 now.txt id {columns}", f'dump_modify now format "%d{" %.17g" * count}"'])
        self.run(0)
        self.send(["undump now"])
        return read_dump((self.folder / "now.txt").read_text())
