"""LIGGGHTS on the benchmarks: lines that all cases share, and a run that samples variables."""

import os
import platform
import time
from pathlib import Path
from typing import NamedTuple

import numpy as np

from virtual_soil.bulk.materials import GRAVITY_M_S2, POISSON_RATIO, SOLIDS, pair, young_modulus
from virtual_soil.bulk.packings import Packing
from virtual_soil.bulk.run import Run, grain_steps, steps_per_sample
from virtual_soil.verification.peers import liggghts

MODEL = "model hertz tangential history"
#: Neighbour skin in radii of the smallest grain. Of 0.2 to 1.8 the impact is fastest at 1.2, the drum hardly depends on it.
SKIN_RATIO = 1.0


def processor() -> str:
    """Name of the processor."""
    info = Path("/proc/cpuinfo")
    lines = info.read_text(encoding="utf-8").splitlines() if info.is_file() else []
    named = [line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")]
    return named[0] if named else platform.processor() or "unknown"


def processor_time(pid: int) -> float:
    """Processor time in s that a process has used (proc(5): fields 14 and 15 of stat)."""
    fields = Path(f"/proc/{pid}/stat").read_text(encoding="utf-8").rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def grains_lines(folder: Path, packing: Packing, box_m, names: tuple[str, ...], velocities_m_s=None) -> list[str]:
    """Lines up to the grains, whose groups are called as their materials.

    Parameters
    ----------
    folder : of the run; grains.data is written into it. box_m : (3, 2), beyond which grains are lost. names : the materials, in the
        order of their types. velocities_m_s : (n, 3).
    """
    densities = np.array([SOLIDS[name].density_kg_m3 for name in packing.materials])
    text = liggghts.data_text(
        "grains", box_m, len(names), packing.positions_m, packing.radii_m, densities, velocities_m_s=velocities_m_s
    )
    groups = []
    for name in packing.names:
        first, last = np.flatnonzero(packing.materials == name)[[0, -1]] + 1
        groups += [f"group {name} id <> {first} {last}", f"set group {name} type {names.index(name) + 1}"]
    (folder / "grains.data").write_text(text, encoding="utf-8")
    skin_m = SKIN_RATIO * float(packing.radii_m.min())
    return [*liggghts.header_lines("f f f", Path("grains.data"), skin_m), *groups]


def material_lines(names: tuple[str, ...], softening: float) -> list[str]:
    """Lines that define the contacts of all pairs of materials; a material's type is its position, from 1."""
    n = len(names)
    pairs = [pair(a, b) for a in names for b in names]
    values = {
        "youngsModulus peratomtype": [young_modulus(name, softening) for name in names],
        "poissonsRatio peratomtype": [POISSON_RATIO] * n,
        f"coefficientRestitution peratomtypepair {n}": [restitution for restitution, _ in pairs],
        f"coefficientFriction peratomtypepair {n}": [friction for _, friction in pairs],
    }
    return [
        # its bounds of Young's modulus only warn of step and cost
        "hard_particles yes", "soft_particles yes",
        *(
            f"fix m{k} all property/global {name} " + " ".join(f"{x:.9g}" for x in row)
            for k, (name, row) in enumerate(values.items(), 1)
        ),
        f"pair_style gran {MODEL}", "pair_coeff * *",
    ]  # fmt: skip


def motion_lines(time_step_s: float, down: str = "0.0 0.0 -1.0") -> list[str]:
    """Lines after the walls: step, gravity, motion, and grains that leave the box. down : direction of gravity."""
    return [
        f"timestep {time_step_s:.9g}", f"fix gravity all gravity {GRAVITY_M_S2} vector {down}", "fix motion all nve/sphere",
        "thermo_style custom step atoms ke", "thermo 1000000", "thermo_modify lost ignore norm no",
    ]  # fmt: skip


def mesh_line(folder: Path, name: str, triangles_m: np.ndarray, steel_type: int, more: str = "") -> str:
    """Line of a wall of triangles (n, 3, 3), whose STL file is written into the folder. more : further keywords."""
    (folder / f"{name}.stl").write_text(liggghts.mesh_text(triangles_m), encoding="utf-8")
    return f"fix {name} all mesh/surface file {name}.stl type {steel_type} {more}".rstrip()


def mesh_walls(names: list[str]) -> str:
    """Line that has the grains touch meshes."""
    return f"fix walls all wall/gran {MODEL} mesh n_meshes {len(names)} meshes {' '.join(names)}"


class Clock(NamedTuple):
    """Duration, interval of the samples and time step of a run, in s."""

    duration_s: float
    sample_s: float
    time_step_s: float


def sampled(folder: Path, lines: list[str], values: dict[str, str], n_grains: int, clock: Clock) -> Run:
    """Run LIGGGHTS in a folder and sample variables.

    Parameters
    ----------
    lines : input up to the first step. values : quantity -> its equal-style variable, "grains" among them.

    Raises
    ------
    PeerError : the program is missing or stopped.
    """
    steps = steps_per_sample(clock.sample_s, clock.time_step_s)
    n_steps = steps * round(clock.duration_s / clock.sample_s)
    variables = [f"variable {name} equal {formula}" for name, formula in values.items()]
    named = " ".join(f"v_{name}" for name in values)
    lines = [*lines, *variables, f"fix samples all ave/time {steps} 1 {steps} {named} file samples.txt"]
    with liggghts.Liggghts(folder, lines) as program:
        program.run(0)  # not timed: it sorts the grains and sets up the meshes
        begin, begin_processor = time.perf_counter(), processor_time(program.process.pid)
        program.run(n_steps)
        wall_s, processor_s = time.perf_counter() - begin, processor_time(program.process.pid) - begin_processor
        text = (folder / "samples.txt").read_text(encoding="utf-8")
    made, columns = read_samples(text, list(values), n_steps)
    return Run(
        times_s=made * clock.time_step_s,
        values=columns,
        n_grains=n_grains,
        grain_steps=grain_steps(columns["grains"], steps),
        n_steps=n_steps,
        time_step_s=clock.time_step_s,
        wall_s=wall_s,
        processor_s=processor_s,
    )


def read_samples(text: str, names: list[str], n_steps: int) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """Steps (k,) and named columns (k,) each of the output of `ave/time`.

    Raises
    ------
    PeerError : they end before n_steps: a terminated LIGGGHTS ends its run early, as if it were complete.
    """
    table = np.array([line.split() for line in text.splitlines() if not line.startswith("#")], float).reshape(-1, 1 + len(names))
    if not len(table) or table[-1, 0] != n_steps:
        last = f"{table[-1, 0]:.0f}" if len(table) else "none"
        raise liggghts.PeerError(f"{liggghts.NAME} was stopped: its last sample is of step {last}, not of {n_steps}.")
    return table[:, 0], dict(zip(names, table[:, 1:].T, strict=True))
