"""A kernel cache that was harmed after it was compiled is never used as it is."""

import json
import os
import pickle
import shutil
import subprocess
import sys
import threading
from pathlib import Path
from types import SimpleNamespace

import numba
import numpy as np
import pytest
from callers import callable_from_python
from numba.core.serialize import dumps

from dem import compiled, jit
from dem.lists import slabs

INDEX = "step_0/loop.advance-1.py3.nbi"


def index_of(*names):
    """An index as numba writes it: its version, then the source's hash and the file of every compiled variant."""
    return pickle.dumps(numba.__version__, -1) + dumps((jit.SOURCE, {k: name for k, name in enumerate(names)}))


KERNELS = {
    INDEX: index_of("loop.advance-1.py3.1.nbc"),
    "step_0/loop.advance-1.py3.1.nbc": b"code",
    "dem_0/walls.store-2.py3.nbi": index_of("walls.store-2.py3.1.nbc"),
    "dem_0/walls.store-2.py3.1.nbc": b"more",
}


@pytest.fixture
def cache(tmp_path, monkeypatch):
    """An empty cache, and a compiler that notes its calls and writes the KERNELS that it misses; a cut one stops it."""
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    monkeypatch.setattr(compiled, "_found", set())
    calls = []

    def run(command, env, **_):
        calls.append(command[3:])
        folder = Path(env["NUMBA_CACHE_DIR"])
        if any(not path.read_bytes() for path in folder.glob("*/*.nbc")):
            return SimpleNamespace(returncode=1, stderr="Traceback\nEOFError: Ran out of input")
        for name, content in KERNELS.items():
            (folder / name).parent.mkdir(exist_ok=True)
            if not (folder / name).exists():
                (folder / name).write_bytes(content)
        return SimpleNamespace(returncode=0, stderr="")

    monkeypatch.setattr(subprocess, "run", run)
    return SimpleNamespace(folder=tmp_path, calls=calls)


def ensured(cache, ledger=False):
    """Ask for the kernels as a new process would; how many times the compiler was called."""
    compiled._found.clear()
    cache.calls.clear()
    compiled.ensure("float32", False, ledger, periodic=False)
    assert all((cache.folder / name).read_bytes() == content for name, content in KERNELS.items() if name != INDEX)
    return len(cache.calls)


pytestmark = pytest.mark.skipif(jit.DISABLED, reason="nothing is compiled")


def test_kernels_are_compiled_once_for_each_variant(cache):
    assert [ensured(cache), ensured(cache), ensured(cache, ledger=True), ensured(cache)] == [1, 0, 1, 0]


@pytest.mark.parametrize(
    ("name", "content"),
    [(name, content) for name in KERNELS for content in (None, b"", b"other") if (name, content) != (INDEX, b"other")],
)
def test_a_cache_that_lost_something_is_compiled_as_a_whole(cache, name, content):
    ensured(cache)
    before = {name: (cache.folder / name).stat().st_mtime_ns for name in KERNELS}
    (cache.folder / name).unlink() if content is None else (cache.folder / name).write_bytes(content)
    assert ensured(cache) >= 1
    assert all((cache.folder / name).read_bytes() == KERNELS[name] for name in KERNELS)
    assert all((cache.folder / name).stat().st_mtime_ns > before[name] for name in KERNELS)
    assert ensured(cache) == 0


def test_an_index_of_another_source_is_replaced(cache):
    (cache.folder / INDEX).parent.mkdir()
    (cache.folder / INDEX).write_bytes(pickle.dumps(numba.__version__, -1) + dumps(("older", {0: "loop.advance-1.py3.1.nbc"})))
    (cache.folder / "step_0/loop.advance-1.py3.1.nbc").write_bytes(b"older")
    assert [ensured(cache), ensured(cache)] == [1, 0]


def test_a_cut_kernel_that_no_marker_lists_yet_is_compiled_anew(cache):
    ensured(cache)
    (cache.folder / "dem_0/walls.store-2.py3.1.nbc").write_bytes(b"")
    assert ensured(cache, ledger=True) == 2
    assert ensured(cache) == 1  # its marker went with the cache


def test_a_cache_that_is_emptied_while_one_compiles_is_filled_as_a_whole(cache, monkeypatch):
    ensured(cache)
    run, emptied = subprocess.run, []

    def run_and_empty(command, **named):
        if not emptied:
            emptied.append(compiled.empty(cache.folder))
        return run(command, **named)

    monkeypatch.setattr(subprocess, "run", run_and_empty)
    assert ensured(cache, ledger=True) == 2


def test_variants_that_are_compiled_at_the_same_time_lose_nothing(cache, monkeypatch):
    """Each compiler sees an empty cache and writes its own signature, as the file of the same name."""
    meet = threading.Barrier(2, timeout=20.0)

    def run(command, env, **_):
        file, periodic = Path(env["NUMBA_CACHE_DIR"]) / INDEX, json.loads(command[3])[6]
        meet.wait()
        file.parent.mkdir()
        file.write_bytes(pickle.dumps(numba.__version__, -1) + dumps((jit.SOURCE, {periodic: "loop.advance-1.py3.1.nbc"})))
        file.with_name("loop.advance-1.py3.1.nbc").write_bytes(str(periodic).encode())
        return SimpleNamespace(returncode=0, stderr="")

    monkeypatch.setattr(subprocess, "run", run)
    compiled.ensure()
    entries = compiled.entries_of(cache.folder / INDEX)
    assert {key: (cache.folder / "step_0" / name).read_text() for key, name in entries.items()} == {False: "False", True: "True"}
    compiled._found.clear()
    monkeypatch.setattr(subprocess, "run", None)
    compiled.ensure()


def test_an_index_that_another_variant_made_longer_keeps_the_kernels_and_is_read_once(cache, monkeypatch):
    ensured(cache)
    (cache.folder / INDEX).write_bytes(index_of("loop.advance-1.py3.1.nbc", "loop.advance-1.py3.2.nbc"))
    read = []
    monkeypatch.setattr(compiled, "entries_of", lambda index, found=compiled.entries_of: read.append(index) or found(index))
    assert [ensured(cache), ensured(cache)] == [0, 0]
    assert read == [cache.folder / INDEX]


def test_an_index_that_lost_a_kernel_but_lists_another_is_compiled_for_and_the_others_stay(cache):
    ensured(cache)
    (cache.folder / "step_0/loop.advance-1.py3.2.nbc").write_bytes(b"another variant's")
    (cache.folder / INDEX).write_bytes(index_of("loop.advance-1.py3.2.nbc"))
    before = (cache.folder / "dem_0/walls.store-2.py3.1.nbc").stat().st_mtime_ns
    assert [ensured(cache), ensured(cache)] == [1, 0]
    assert (cache.folder / "dem_0/walls.store-2.py3.1.nbc").stat().st_mtime_ns == before


@pytest.mark.parametrize("content", [b"", b"[]", b"{", b"\xff", json.dumps({"dem_0/gone.nbc": "0"}).encode()])
def test_a_marker_that_says_nothing_is_not_believed(cache, content):
    ensured(cache)
    compiled.marker(compiled.Variant()).write_bytes(content)
    assert [ensured(cache), ensured(cache)] == [1, 0]


def test_a_compiler_that_fails_is_named_with_its_folder(cache, monkeypatch):
    failed = SimpleNamespace(returncode=1, stderr="Traceback\nOSError: [Errno 28] No space left on device")
    monkeypatch.setattr(subprocess, "run", lambda *_, **__: failed)
    with pytest.raises(RuntimeError, match=r"could not be compiled into .*\(OSError: \[Errno 28\] No space left on device\)"):
        compiled.ensure()
    assert not list(cache.folder.glob("*.compiled"))


@pytest.mark.slow
def test_a_truncated_kernel_gives_the_same_simulation(tmp_path):
    """A copy of the real cache, with one kernel cut: it is compiled anew, and the result has the bytes of the sound one."""
    compiled.ensure(periodic=False)
    folder = Path(os.environ["NUMBA_CACHE_DIR"])
    copy = Path(shutil.copytree(folder, tmp_path / "copy"))

    def result(cache):
        program = (
            "import hashlib, dem; from dem.experiments import angle_of_repose as a; from dem.experiments.soil import Engine, Soil; "
            "soil = Soil(radius_m=1e-3, radius_sd_ratio=0.1, density_kg_m3=2500.0, poisson_ratio=0.2, shear_modulus_pa=1e7, "
            "static_friction=0.6, rolling_friction=0.2, restitution=0.5); "
            "heap = a.run(soil, a.Setup(n_particles=60, tube_diameter_ratio=5.0, plate_half_width_ratio=30.0, "
            "lift_speed_m_s=0.05, max_time_s=0.2, scale_radius_m=1e-3), Engine(), 1); "
            "print(hashlib.sha256(heap.grains.positions_m.tobytes()).hexdigest())"
        )
        environment = os.environ | {"NUMBA_CACHE_DIR": str(cache), "PYTHONPATH": str(jit.PACKAGE.parent)}
        return subprocess.run([sys.executable, "-c", program], env=environment, capture_output=True, text=True, check=True).stdout

    sound = result(folder)
    (kernel, *_) = sorted(copy.glob("*/loop.*.nbc"))
    kernel.write_bytes(kernel.read_bytes()[:1000])
    assert result(copy) == sound


def test_what_kernels_call_of_a_kernel_is_not_made_executable():
    begin = np.minimum(4 * np.arange(slabs.SLABS + 1), 8)
    assert callable_from_python(slabs.used_slabs)(begin) == slabs.used_slabs(begin) == 2
    (within,), (whole,) = slabs.used_slabs.part.overloads.values(), slabs.used_slabs.overloads.values()
    names = within.fndesc.llvm_func_name, whole.fndesc.llvm_func_name
    assert names[0] != names[1]
    assert within.library.get_pointer_to_function(names[0]) == 0
    assert whole.library.get_pointer_to_function(names[1]) != 0
