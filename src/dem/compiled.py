"""Kernels are compiled in a separate process and always loaded from the cache, never used by the process that compiled them.

A process that compiles holds a kernel twice, by itself and inlined in its caller, optimised separately; a process that loads the
caller from the cache has the second only. The two round differently in the last bit, so the first run after an installation would
not be reproducible. Compiling elsewhere makes all runs identical, and lets the processes of a campaign share one compilation.

For the same reason a cache that has lost a file is compiled again as a whole, before anything is loaded from it.
"""

import contextlib
import fcntl
import hashlib
import json
import os
import pickle
import subprocess
import sys
from pathlib import Path
from typing import NamedTuple

from dem import jit

#: Set in the process that compiles.
compiles_here = False

#: Markers that this process has found valid: damage on the disk does not affect what is loaded.
_found: set[Path] = set()


class Variant(NamedTuple):
    """Settings that choose the code of the time loop; each variant is compiled by itself."""

    precision: str = "float32"
    parallel: bool = False
    energy_ledger: bool = False
    rolling_model: str = "type_a"
    adhesion: str = "none"
    vector_code: bool = True
    periodic: bool = False
    clumps: bool = False
    turning: bool = False

    @property
    def name(self) -> str:
        """Name as part of a file's name."""
        threads, code = "threads" if self.parallel else "thread", "vector" if self.vector_code else "plain"
        domain, books = "periodic" if self.periodic else "open", "-ledger" if self.energy_ledger else ""
        shape = ("-clumps" if self.clumps else "") + ("-turning" if self.turning else "")
        return f"{self.precision}-{threads}-{self.rolling_model}-{self.adhesion}-{code}-{domain}{books}{shape}"


def marker(variant: Variant) -> Path:
    """File in the kernel cache that marks one variant of the time loop as compiled.

    For this processor and this source: numba looks both up.
    """
    lookup = f"{jit.target()} {jit.SOURCE}"
    name = f"{hashlib.sha256(lookup.encode()).hexdigest()[:16]}-{variant.name}"
    return Path(os.environ["NUMBA_CACHE_DIR"]) / f"{name}.compiled"


def ensure(precision: str = "float32", parallel: bool = False, energy_ledger: bool = False, **choices) -> None:
    """Have a variant of the time loop compiled into the cache, unless it is there; that takes one to two minutes.

    choices : the other fields of `Variant`; without `periodic`, both kinds of domain are compiled.

    Raises
    ------
    RuntimeError : the compilation failed; the message ends with its output.
    """
    if jit.DISABLED or compiles_here:
        return
    for periodic in (choices.pop("periodic"),) if "periodic" in choices else (False, True):
        ensure_one(Variant(precision, parallel, energy_ledger, **choices, periodic=periodic))


def ensure_one(variant: Variant) -> None:
    """Have one variant compiled."""
    file = marker(variant)
    if file in _found:
        return
    if not is_true(file):
        with alone(file.parent):
            if not is_true(file):  # no other process has compiled it while this one waited
                compile_anew(file, [json.dumps(variant)])
    _found.add(file)


def is_true(file: Path) -> bool:
    """True if all files of the cache that a marker lists are as they were when it was written, or are indices with more entries."""
    listed = content_of(file)
    changed = [name for name, digest in listed.items() if digest_of(file.parent / name) != digest]
    return bool(listed) and all(knows(file.parent / name, listed) for name in changed)


def knows(index: Path, listed: dict[str, str]) -> bool:
    """True if a file is an index of numba's that lists the kernels of a marker, as it does after another variant was compiled."""
    data = f"{index.parent.name}/{index.stem}."
    own = {Path(name).name for name in listed if name.endswith(".nbc") and name.startswith(data)}
    try:
        with open(index, "rb") as file:
            pickle.load(file)  # noqa: S301  # numba's version; numba itself loads these files next
            _, entries = pickle.loads(file.read())  # noqa: S301
        return index.suffix == ".nbi" and own <= set(entries.values())
    except Exception:  # noqa: BLE001  # damaged bytes may raise anything
        return False


def content_of(file: Path) -> dict[str, str]:
    """Files that a marker lists, as `kernels` does; empty if there is no valid marker."""
    try:
        listed = json.loads(file.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
    return listed if isinstance(listed, dict) else {}


def kernels(folder: Path) -> dict[str, str | None]:
    """Path in the cache -> hash of its content, of numba's indices (.nbi) and of the compiled kernels (.nbc)."""
    paths = sorted(path for path in folder.glob("*/*") if path.suffix in (".nbi", ".nbc"))
    return {path.relative_to(folder).as_posix(): digest_of(path) for path in paths}


def digest_of(path: Path) -> str | None:
    """Hash of a file's content; None if it is not there, as when another process empties the cache at this moment."""
    try:
        return hashlib.blake2b(path.read_bytes(), digest_size=8).hexdigest()
    except FileNotFoundError:
        return None


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

    An index alone may have been lost or changed: it is written anew. Anything else that a marker lists and that is not there any
    more, or an index that cannot be read, makes the whole cache void.
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


def main(values: str) -> None:
    """Compile one variant by running two grains for a moment; values : JSON list of the fields of `Variant`."""
    from dem import Box, Clump, Interaction, Material, Simulation, compiled, solids
    from dem.step import loop

    compiled.compiles_here = True
    variant = Variant(*json.loads(values))
    touch = Interaction(restitution=0.5, static_friction=0.3, rolling_friction=0.1)
    simulation = Simulation(
        materials={"a": Material(density_kg_m3=2500.0, poisson_ratio=0.2, shear_modulus_pa=1e6)},
        interactions={("a", "a"): touch},
        walls=[Box(name="floor", material="a", low_m=(-1.0, -1.0, 0.0), high_m=(1.0, 1.0, 0.0))],
        smallest_radius_m=1e-3,
        period_m=(0.0, 1.0, 0.0) if variant.periodic else (0.0, 0.0, 0.0),
        precision=variant.precision,
        threads=2 if variant.parallel else 1,
        energy_ledger=variant.energy_ledger,
        rolling_model=variant.rolling_model,
        adhesion=variant.adhesion,
        vector_code=variant.vector_code,
    )
    simulation.add_grains([(0.0, 0.0, 1.1e-3), (0.0, 0.0, 3.2e-3)], 1e-3, "a")
    if variant.turning:
        simulation.add_wall(solids.box((0.1, 0.1, 0.01), name="plate", material="a", position_m=(0.5, 0.5, 0.5)))
    if variant.clumps:
        simulation.add_clumps(Clump.preset("dimer"), [(0.0, 0.0, 1e-2)], 2e-3, "a")
    simulation.advance(2)
    simulation.is_static()
    simulation.largest_overlap_ratio()
    for reason in (loop.PAIRS_FULL, loop.SURFACE_PAIRS_FULL):
        simulation._state.lengthen(reason)
    simulation._runner.sort_in_space()


if __name__ == "__main__":
    main(*sys.argv[1:])
