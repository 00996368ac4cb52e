"""Kernels are compiled in a process of their own and always loaded from the cache, never used by the process that compiled them.

A process that compiles keeps a kernel twice, on its own and inlined in its caller, optimised apart; one that loads the caller from
the cache has the second only. The two round differently in the last bit, so that the first run after an installation would
not repeat. Compiling elsewhere makes all runs alike, and makes the many processes of a campaign share one compilation.

For the same reason a cache that lost a file since is compiled anew as a whole, before anything is loaded from it.
"""

import contextlib
import fcntl
import hashlib
import json
import os
import subprocess
import sys
from pathlib import Path

from dem import jit

#: Set in the process that compiles.
compiles_here = False

#: Markers that this process has found true: what is loaded already, no damage on the disk changes.
_found: set[Path] = set()


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
    if jit.DISABLED or compiles_here:
        return
    file = marker(precision, parallel, energy_ledger)
    if file in _found:
        return
    if not is_true(file):
        with alone(file.parent):
            if not is_true(file):  # nobody else has compiled while this process waited
                compile_anew(file, [precision, str(int(parallel)), str(int(energy_ledger))])
    _found.add(file)


def is_true(file: Path) -> bool:
    """Whether all files of the cache that a marker lists are as they were when it was written."""
    listed = content_of(file)
    try:
        found = kernels(file.parent)
    except FileNotFoundError:  # another process empties the cache at this moment
        return False
    return bool(listed) and listed == {name: digest for name, digest in found.items() if name in listed}


def content_of(file: Path) -> dict[str, str]:
    """What a marker lists, as `kernels` does; empty where there is no sound marker."""
    try:
        listed = json.loads(file.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
    return listed if isinstance(listed, dict) else {}


def kernels(folder: Path) -> dict[str, str]:
    """Path in the cache -> hash of its content, of numba's indices (.nbi) and of the compiled kernels (.nbc)."""
    paths = sorted(path for path in folder.glob("*/*") if path.suffix in (".nbi", ".nbc"))
    return {path.relative_to(folder).as_posix(): hashlib.blake2b(path.read_bytes(), digest_size=8).hexdigest() for path in paths}


@contextlib.contextmanager
def alone(folder: Path):
    """While inside, no other process compiles: numba's indices lose entries when two write them at the same time."""
    folder.mkdir(parents=True, exist_ok=True)
    with open(folder / "lock", "w", encoding="utf-8") as file:
        with contextlib.suppress(OSError):  # some network file systems have no locks
            fcntl.flock(file, fcntl.LOCK_EX)
        yield


def in_a_child(variant: list[str]) -> subprocess.CompletedProcess[str]:
    """Compile in a process of its own."""
    path = os.pathsep.join([str(jit.PACKAGE.parent), os.environ.get("PYTHONPATH", "")])
    environment = {**os.environ, "PYTHONPATH": path}
    command = [sys.executable, "-m", "dem.compiled", *variant]
    return subprocess.run(command, env=environment, capture_output=True, text=True, check=False)


def compile_anew(file: Path, variant: list[str]) -> None:
    """Compile one variant and write its marker.

    An index alone may have changed, as it does when another variant is compiled. Anything else that a marker lists and that is not
    there any more, or an index that cannot be read, makes the whole cache void.
    """
    folder, listed = file.parent, content_of(file)
    found = kernels(folder)
    if any(name not in found or (name.endswith(".nbc") and found[name] != digest) for name, digest in listed.items()):
        empty(folder)
    done = in_a_child(variant)
    if done.returncode and kernels(folder):
        empty(folder)
        done = in_a_child(variant)
    if done.returncode:
        lines = done.stderr.strip().splitlines() or [f"exit status {done.returncode}"]
        output = "\n".join(lines)[-2000:]
        raise RuntimeError(f"the kernels could not be compiled into {folder} ({lines[-1]}). The whole output:\n{output}")
    part = file.with_name(f"{file.name}.{os.getpid()}.part")
    part.write_text(json.dumps(kernels(folder)), encoding="utf-8")
    os.replace(part, file)


def empty(folder: Path) -> None:
    """Remove all kernels of a cache and the markers that list them."""
    for path in [*folder.glob("*/*.nb[ic]"), *folder.glob("*.compiled")]:
        path.unlink(missing_ok=True)


def main(precision: str, parallel: str, energy_ledger: str) -> None:
    """Compile one variant by running two grains for a moment."""
    from dem import Box, Interaction, Material, Simulation, compiled
    from dem.step import loop

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
    simulation.largest_overlap_ratio()
    for reason in (loop.PAIRS_FULL, loop.WALL_PAIRS_FULL):
        simulation._lengthen(reason)
    simulation._sort_in_space()


if __name__ == "__main__":
    main(*sys.argv[1:])
