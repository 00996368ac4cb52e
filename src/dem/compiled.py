"""Kernels are compiled in a separate process and always loaded from the cache, never used by the process that compiled them.

A process that compiles holds a kernel twice, by itself and inlined in its caller, optimised separately; a process that loads the
caller from the cache has the second only. The two round differently in the last bit, so the first run after an installation would
not be reproducible. Compiling elsewhere makes all runs identical, and lets the processes of a campaign share one compilation.

For the same reason a cache that has lost a file is compiled again as a whole, before anything is loaded from it.
"""

import contextlib
import fcntl
import hashlib
import itertools
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any, NamedTuple

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
    tangential_model: str = "edem"

    @property
    def name(self) -> str:
        """Name as part of a file's name."""
        threads, code = "threads" if self.parallel else "thread", "vector" if self.vector_code else "plain"
        domain, books = "periodic" if self.periodic else "open", "-ledger" if self.energy_ledger else ""
        shape = ("-clumps" if self.clumps else "") + ("-turning" if self.turning else "")
        shape += f"-{self.tangential_model}" if self.tangential_model != "edem" else ""
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
    kinds = (choices.pop("periodic"),) if "periodic" in choices else (False, True)
    variants = [Variant(precision, parallel, energy_ledger, **choices, periodic=periodic) for periodic in kinds]
    if unknown := [variant for variant in variants if marker(variant) not in _found]:
        with ThreadPoolExecutor(len(unknown)) as threads:
            list(threads.map(ensure_one, unknown))


def ensure_one(variant: Variant) -> None:
    """Have one variant compiled; others may be compiled at the same time."""
    file = marker(variant)
    if file in _found:
        return
    if not is_true(file):
        with alone(file.with_suffix(".lock")):
            if not is_true(file):  # no other process has compiled it while this one waited
                compile_anew(file, [json.dumps(variant)])
    _found.add(file)


def is_true(file: Path) -> bool:
    """True if all files of the cache that a marker lists are as they were when it was written, or are indices with more entries.

    These take half a second to read where many variants were compiled, so they are listed anew for the next process.
    """
    listed = content_of(file)
    found = {name: digest_of(file.parent / name) for name in listed}
    changed = [name for name in listed if found[name] != listed[name]]
    true = bool(listed) and all(knows(file.parent / name, listed) for name in changed)
    if true and changed:
        with contextlib.suppress(OSError):  # the cache may be another user's
            replace(file, json.dumps(found).encode())
    return true


def knows(index: Path, listed: dict[str, str]) -> bool:
    """True if a file is an index of numba's that lists the kernels of a marker, as it does after another variant was compiled."""
    data = f"{index.parent.name}/{index.stem}."
    own = {Path(name).name for name in listed if name.endswith(".nbc") and name.startswith(data)}
    return index.suffix == ".nbi" and own <= set(entries_of(index).values())


def entries_of(index: Path) -> dict[Any, str]:
    """Signature -> name of the kernel's file, in an index of numba's; empty if that is of another source, damaged or not there."""
    try:
        entries = jit.index(index)._load_index()
    except Exception:  # noqa: BLE001  # damaged bytes may raise anything
        return {}
    return {key: name for key, name in entries.items() if (index.parent / name).is_file()}


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
def alone(path: Path):
    """While inside, no other process or thread is inside with this file."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with open(path, "w", encoding="utf-8") as file:
        with contextlib.suppress(OSError):  # some network file systems have no locks
            fcntl.flock(file, fcntl.LOCK_EX)
        yield


def in_a_child(variant: list[str], folder: Path) -> subprocess.CompletedProcess[str]:
    """Compile in a process of its own, into a folder."""
    path = os.pathsep.join([str(jit.PACKAGE.parent), os.environ.get("PYTHONPATH", "")])
    environment = {**os.environ, "PYTHONPATH": path, "NUMBA_CACHE_DIR": str(folder)}
    command = [sys.executable, "-m", "dem.compiled", *variant]
    return subprocess.run(command, env=environment, capture_output=True, text=True, check=False)


def compile_anew(file: Path, variant: list[str]) -> None:
    """Compile one variant in a copy of the cache, take over what is new, and write its marker.

    Two processes that compile into one folder lose entries of numba's indices. If what was copied has changed in the meantime, all
    begins again.
    """
    folder = file.parent
    with tempfile.TemporaryDirectory(prefix="virtual-soil-kernels-") as name:
        own = Path(name)
        with alone(folder / "lock"):
            if is_damaged(folder, content_of(file)):
                empty(folder)
            before = {name: digest for name, digest in kernels(folder).items() if not is_foreign(folder / name)}
            merge(folder, own)
        done = in_a_child(variant, own)
        if done.returncode and before:
            with alone(folder / "lock"):
                empty(folder)
            return compile_anew(file, variant)
        if done.returncode:
            lines = done.stderr.strip().splitlines() or [f"exit status {done.returncode}"]
            output = "\n".join(lines)[-2000:]
            raise RuntimeError(f"the kernels could not be compiled into {folder} ({lines[-1]}). The whole output:\n{output}")
        with alone(folder / "lock"):
            if kept := not is_damaged(folder, before):
                merge(own, folder)
                replace(file, json.dumps(kernels(folder)).encode())
    return None if kept else compile_anew(file, variant)


def is_damaged(folder: Path, listed: Mapping[str, str | None]) -> bool:
    """True if a kernel or an index that was listed is lost, a kernel has changed or an index cannot be read.

    An index that has changed otherwise is written anew.
    """
    found = kernels(folder)
    return any(
        name not in found or (is_foreign(folder / name) if name.endswith(".nbi") else found[name] != digest)
        for name, digest in listed.items()
    )


def is_foreign(file: Path) -> bool:
    """True for an index that lists nothing that is there, as one of another source or a damaged one."""
    return file.suffix == ".nbi" and not entries_of(file)


def merge(source: Path, target: Path) -> None:
    """Add to a cache the kernels of another that it lacks."""
    for file in sorted(source.glob("*/*.nbi")):
        place = target / file.relative_to(source)
        place.parent.mkdir(exist_ok=True)
        theirs, known = entries_of(file), entries_of(place)
        missing = [key for key in theirs if key not in known]
        free = (name for k in itertools.count(1) if (name := f"{file.stem}.{k}.nbc") not in set(known.values()))
        for key in missing:
            name = next(free)
            replace(place.with_name(name), file.with_name(theirs[key]).read_bytes())
            known[key] = name
        if missing:
            jit.index(place)._save_index(known)


def replace(file: Path, content: bytes) -> None:
    """Write a file, whole or not at all."""
    part = file.with_name(f"{file.name}.{os.getpid()}.part")
    part.write_bytes(content)
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
        tangential_model=variant.tangential_model,
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
