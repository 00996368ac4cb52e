"""Compilation of every kernel.

Kernels are cached on disk so that only the first process compiles. By itself, numba looks a kernel up by the path of its file and
by that file alone. Here it looks up the place within the package and a hash of the source of all kernels: functions that a kernel
calls from other files count, and all checkouts of the same source share their kernels, wherever they lie and whenever they were
made. Virtual tests and measurements, which hold no kernels, may change without a new compilation. numba keys the cache by
processor type, so machines with different processors can share a cache.
"""

import functools
import hashlib
import os
import sys
from pathlib import Path
from typing import Any, cast

from dem.cache import kernel_folder

PACKAGE = Path(__file__).parent

#: No Python exceptions on division, and arithmetic may be reordered: LLVM can then vectorise the kernels. No kernel is
#: called from C, so none is compiled a second time with C's convention.
JIT_FLAGS: dict[str, Any] = {"fastmath": True, "error_model": "numpy", "_nrt": True, "no_cfunc_wrapper": True}

#: For the hottest kernels, which allocate no arrays: no reference counting.
LEAN_FLAGS = {**JIT_FLAGS, "_nrt": False}

#: For kernels with a single caller or few instructions: inlined, because passing an array takes about 10 ns per call.
INLINE_FLAGS: dict[str, Any] = {**LEAN_FLAGS, "forceinline": True}

#: For the hottest loops: functions of their own, whose registers hold nothing else. A flag that is not set is inherited from the
#: caller, so what an inlined function calls is inlined too, unless it says otherwise.
APART_FLAGS: dict[str, Any] = {**LEAN_FLAGS, "forceinline": False}

#: For hot kernels whose rounding errors count: no reordered arithmetic.
EXACT_FLAGS: dict[str, Any] = {**APART_FLAGS, "fastmath": False}

#: For code that must see NaN and infinity as they are (guards, list building).
STRICT_FLAGS: dict[str, Any] = {**JIT_FLAGS, "fastmath": False}


#: Folders that hold no kernels, and from which no kernel takes a number.
ABOVE_KERNELS = ("experiments", "measure")


def source_hash(but: tuple[str, ...] = ()) -> str:
    """Hash of all Python files of the package, in path order (16 hex digits); but : folders to leave out."""
    digest = hashlib.sha256()
    for path in sorted(PACKAGE.rglob("*.py")):
        place = path.relative_to(PACKAGE)
        if place.parts[0] not in but:
            digest.update(place.as_posix().encode())
            digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


#: Hash of the source of the kernels that this process runs.
SOURCE = source_hash(ABOVE_KERNELS)

os.environ["NUMBA_CACHE_DIR"] = str(kernel_folder(SOURCE))
os.environ.setdefault("NUMBA_SLP_VECTORIZE", "1")  # 15-20 % faster kernels; read once, when numba is imported
# OpenMP's threads spin between two loops; those of the other layers sleep, and waking them takes longer than a step.
os.environ.setdefault("NUMBA_THREADING_LAYER_PRIORITY", "omp tbb workqueue")

# numba reads its environment at import, so the rest of the package imports numba's names from here.
from llvmlite.binding import get_host_cpu_features, get_host_cpu_name  # noqa: E402
from numba import __version__, config, njit, prange, set_num_threads, types  # noqa: E402
from numba.core import cgutils  # noqa: E402
from numba.core.caching import CacheImpl, IndexDataCacheFile, UserProvidedCacheLocator  # noqa: E402
from numba.extending import intrinsic, overload  # noqa: E402

from dem.parts import PART, Kernel, twin  # noqa: E402

__all__ = [
    "ABOVE_KERNELS",
    "DISABLED",
    "INLINE_FLAGS",
    "JIT_FLAGS",
    "MAX_THREADS",
    "PART",
    "apart_jit",
    "by_type",
    "cgutils",
    "exact_jit",
    "index",
    "inline_jit",
    "intrinsic",
    "jit",
    "lean_jit",
    "overload",
    "prange",
    "set_num_threads",
    "source_hash",
    "strict_inline_jit",
    "strict_jit",
    "target",
    "types",
]

MAX_THREADS: int = config.NUMBA_NUM_THREADS  # type: ignore[attr-defined]  # numba sets it at run time
#: True if kernels run as plain Python (NUMBA_DISABLE_JIT=1).
DISABLED = bool(config.DISABLE_JIT)  # type: ignore[attr-defined]


class PackageLocator(UserProvidedCacheLocator):
    """Where numba keeps the package's kernels, and the stamp by which it knows them; other files are kept as numba does."""

    def get_source_stamp(self):
        """Return the hash of the source of all kernels."""
        return SOURCE

    @classmethod
    def get_suitable_cache_subpath(cls, py_file):
        """Return the place of a file's folder within the package."""
        return "-".join(("dem", *Path(py_file).parent.relative_to(PACKAGE).parts))

    @classmethod
    def from_function(cls, py_func, py_file):
        """Return None for files of others."""
        return super().from_function(py_func, py_file) if PACKAGE in Path(py_file).parents else None


CacheImpl._locator_classes = [PackageLocator, *CacheImpl._locator_classes]


def index(file: Path) -> IndexDataCacheFile:
    """Numba's index (.nbi) of one kernel's compiled signatures."""
    return IndexDataCacheFile(str(file.parent), file.stem, SOURCE)


def target() -> str:
    """Processor with its features, Python and numba: compiled code is valid for these only."""
    return f"{get_host_cpu_name()} {get_host_cpu_features().flatten()} {sys.version_info[:2]} {__version__}"


def kernel(function, flags):
    """Compile a function for calls from Python, and by itself for calls from kernels."""
    if DISABLED:
        return function
    whole = Kernel(function, part(twin(function), flags), {"nopython": True} | flags)
    whole.enable_caching()
    return whole


def part(function, flags):
    """Compile a function for calls from kernels alone; calls from Python would jump to address zero and are refused."""
    if DISABLED:
        return function
    made = njit(**PART | flags)(function)

    def add(compiled):
        made.overloads[tuple(compiled.signature.args)] = compiled

    def refuse(*_arguments, **_named):
        raise TypeError(f"{made.py_func.__name__} is a part of other kernels; allowed: a call from a kernel.")

    made.add_overload, made._compile_for_args = add, refuse
    return made


def jit(function):
    """Compile a numerical kernel."""
    return kernel(function, JIT_FLAGS)


def lean_jit(function):
    """Compile a numerical kernel that allocates no arrays."""
    return kernel(function, LEAN_FLAGS)


def inline_jit(function):
    """Compile a numerical kernel that allocates no arrays, inlined into each of its callers; Python cannot call it."""
    return part(function, INLINE_FLAGS)


def apart_jit(function):
    """As `lean_jit`, but a function of its own even where its caller is inlined."""
    return kernel(function, APART_FLAGS)


def exact_jit(function):
    """As `apart_jit`, keeping the order of sums."""
    return kernel(function, EXACT_FLAGS)


def strict_jit(function):
    """Compile a kernel that keeps IEEE rules for NaN and infinity."""
    return kernel(function, STRICT_FLAGS)


def strict_inline_jit(function):
    """As `strict_jit`, inlined into each of its callers; Python cannot call it."""
    return part(function, STRICT_FLAGS | {"forceinline": True})


def by_type(functions):
    """Return one function for many: the type of the first argument, a NamedTuple class, selects which of `functions` runs.

    functions : class -> function. A kernel selects when it is compiled, so a call costs nothing; it is then read from
    the disk cache as any other kernel. A closure over compiled functions would be compiled again in every process.
    """
    functions = {kind: getattr(function, "py_func", function) for kind, function in functions.items()}

    @functools.singledispatch
    def generic(selector, *arguments):
        raise TypeError(f"no function for {type(selector).__name__}; known: {[kind.__name__ for kind in functions]}")

    for kind, function in functions.items():
        generic.register(kind)(function)

    def select(selector, *arguments):
        return functions.get(getattr(selector, "instance_class", None))

    overload(generic, jit_options=cast(Any, PART | LEAN_FLAGS), strict=False)(select)
    return generic
