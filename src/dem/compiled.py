"""Kernels are compiled in a process of their own and always loaded from the cache, never used by the process that compiled them.

A process that compiles keeps a kernel twice, on its own and inlined in its caller, optimised apart; one that loads the caller from
the cache has the second only. The two round differently in the last bit, so that the first run after an installation would
not repeat. Compiling elsewhere makes all runs alike, and makes the many processes of a campaign share one compilation.
"""

import hashlib
import os
import subprocess
import sys
from pathlib import Path

from dem import jit

#: Set in the process that compiles.
compiles_here = False


def marker(precision: str, parallel: bool, energy_ledger: bool) -> Path:
    """File in the kernel cache that says that one variant of the time loop is compiled.

    For this processor, and for source files in this place with these times: numba looks all of them up.
    """
    stamps = [(path.stat().st_mtime_ns, path.stat().st_size) for path in sorted(jit.PACKAGE.rglob("*.py"))]
    lookup = f"{jit.processor()} {jit.PACKAGE} {stamps}"
    name = f"{hashlib.sha256(lookup.encode()).hexdigest()[:16]}-{precision}-{'threads' if parallel else 'thread'}"
    return Path(os.environ["NUMBA_CACHE_DIR"]) / f"{name}{'-ledger' if energy_ledger else ''}.compiled"


def ensure(precision: str = "float32", parallel: bool = False, energy_ledger: bool = False) -> None:
    """Have one variant of the time loop compiled into the cache, unless it is there; takes a minute then.

    Raises
    ------
    RuntimeError : the compilation failed; the message ends with its output.
    """
    file = marker(precision, parallel, energy_ledger)
    if jit.DISABLED or compiles_here or file.exists():
        return
    command = [sys.executable, "-m", "dem.compiled", precision, str(int(parallel)), str(int(energy_ledger))]
    path = os.pathsep.join([str(jit.PACKAGE.parent), os.environ.get("PYTHONPATH", "")])
    done = subprocess.run(command, env={**os.environ, "PYTHONPATH": path}, capture_output=True, text=True, check=False)
    if done.returncode:
        raise RuntimeError(f"the kernels could not be compiled into {file.parent}: {done.stderr.strip()[-2000:]}")
    file.touch()


def main(precision: str, parallel: str, energy_ledger: str) -> None:
    """Compile one variant by running two grains for a moment."""
    from dem import Box, Interaction, Material, Simulation, compiled, loop

    compiled.compiles_here = True
    touch = Interaction(restitution=0.5, static_friction=0.3, rolling_friction=0.1)
    simulation = Simulation(
        materials={"a": Material(density_kg_m3=2500.0, poisson_ratio=0.2, shear_modulus_pa=1e6)},
        interactions={("a", "a"): touch},
        walls=[Box(name="floor", material="a", low_m=(-1.0, -1.0, 0.0), high_m=(1.0, 1.0, 0.0))],
        smallest_radius_m=1e-3,
        precision=precision,
        threads=2 if int(parallel) else 1,
        energy_ledger=bool(int(energy_ledger)),
    )
    simulation.add_grains([(0.0, 0.0, 1.1e-3), (0.0, 0.0, 3.2e-3)], 1e-3, "a")
    simulation.advance(2)
    simulation.is_static()
    for reason in (loop.PAIRS_FULL, loop.WALL_PAIRS_FULL):
        simulation._lengthen(reason)
    simulation._sort_in_space()


if __name__ == "__main__":
    main(*sys.argv[1:])
