"""How every kernel is compiled.

Kernels are cached on disk so that only the first process compiles. numba notices a change in a kernel's own file but not in
a function that it calls from another file; so the cache folder's name carries a hash of the whole package's source.
numba itself keys the cache by processor type, so a cache shared by unlike machines is not reused wrongly.
"""

import hashlib
import os
from pathlib import Path
from typing import Any

PACKAGE = Path(__file__).parent

#: Kernels are free of traps (no Python exceptions on division) and may reorder arithmetic, which lets LLVM vectorise them.
JIT_FLAGS: dict[str, Any] = {"fastmath": True, "error_model": "numpy", "cache": True}

#: For the hottest kernels, which make no arrays: no reference counts for the arrays that they are given or slice.
LEAN_FLAGS = {**JIT_FLAGS, "_nrt": False}

#: For what runs once per block of contacts: into its caller, as handing over arrays takes some 10 ns each time.
INLINE_FLAGS: dict[str, Any] = {**LEAN_FLAGS, "forceinline": True}

#: For hot kernels whose rounding errors count: no reference counts either, and no arithmetic reordered. Not to say anything of
#: fastmath would be to take over the caller's.
EXACT_FLAGS: dict[str, Any] = {**LEAN_FLAGS, "fastmath": False}

#: For code that must see NaN and infinity as they are (guards, list building).
STRICT_FLAGS: dict[str, Any] = {**JIT_FLAGS, "fastmath": False}


def source_hash() -> str:
    """Hash of all Python files of the package, in path order (16 hex digits)."""
    digest = hashlib.sha256()
    for path in sorted(PACKAGE.rglob("*.py")):
        digest.update(path.relative_to(PACKAGE).as_posix().encode())
        digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


def _cache_folder() -> Path:
    base = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return Path(base) / "virtual-soil" / "kernels" / source_hash()


os.environ.setdefault("NUMBA_CACHE_DIR", str(_cache_folder()))
os.environ.setdefault("NUMBA_SLP_VECTORIZE", "1")  # 15-20 % faster kernels; read once, when numba is imported
# OpenMP's threads wait awake between two loops; the others sleep, and waking them takes longer than a step.
os.environ.setdefault("NUMBA_THREADING_LAYER_PRIORITY", "omp tbb workqueue")

# numba reads its environment at import, so the rest of the package imports from here what it needs of numba.
from llvmlite.binding import get_host_cpu_features, get_host_cpu_name  # noqa: E402
from numba import config, njit, prange, set_num_threads, types  # noqa: E402
from numba.core import cgutils  # noqa: E402
from numba.extending import intrinsic  # noqa: E402

__all__ = [
    "DISABLED",
    "MAX_THREADS",
    "cgutils",
    "exact_jit",
    "inline_jit",
    "intrinsic",
    "jit",
    "lean_jit",
    "parallel_jit",
    "prange",
    "processor",
    "set_num_threads",
    "source_hash",
    "strict_jit",
    "types",
]

MAX_THREADS: int = config.NUMBA_NUM_THREADS  # type: ignore[attr-defined]  # numba sets it at run time
#: Whether kernels run as plain Python (NUMBA_DISABLE_JIT=1).
DISABLED = bool(config.DISABLE_JIT)  # type: ignore[attr-defined]  # the same


def processor() -> str:
    """Name and features of the machine's processor, as numba sees it: compiled code is for this alone."""
    return f"{get_host_cpu_name()} {get_host_cpu_features().flatten()}"


def jit(function):
    """Compile a numerical kernel."""
    return njit(**JIT_FLAGS)(function)


def lean_jit(function):
    """Compile a numerical kernel that makes no arrays."""
    return njit(**LEAN_FLAGS)(function)


def inline_jit(function):
    """Compile a numerical kernel that makes no arrays into each of its callers."""
    return njit(**INLINE_FLAGS)(function)


def exact_jit(function):
    """Compile a numerical kernel that makes no arrays and keeps the order of its sums."""
    return njit(**EXACT_FLAGS)(function)


def parallel_jit(function):
    """Compile a numerical kernel whose `prange` loops run on numba's threads."""
    return njit(parallel=True, **JIT_FLAGS)(function)


def strict_jit(function):
    """Compile a kernel that keeps IEEE rules for NaN and infinity."""
    return njit(**STRICT_FLAGS)(function)
