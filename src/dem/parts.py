"""Kernels that kernels call are compiled as parts of their callers.

numba compiles each function to its end: it optimises it with all that it calls, makes machine code of it, and wraps that for calls
from Python. Of a kernel that runs inside of another one only the first is used. So a kernel is two functions, one that Python calls
and one that kernels call, and the second stays in LLVM's intermediate code. That takes 40 % off the time of compilation.
"""

import types as pytypes
from typing import Any

import llvmlite.binding as llvm
from numba import types
from numba.core.codegen import JITCodeLibrary, JITCPUCodegen
from numba.core.compiler import Compiler
from numba.core.registry import CPUDispatcher

#: How numba's cache names the form in which a part is stored.
KIND = "part"


class Part(JITCodeLibrary):
    """Code of a function with all that it calls, for its callers: linked and optimised, but not made executable."""

    def _finalize_final_module(self):
        self._finalize_dynamic_globals()
        self._verify_declare_only_symbols()
        self._finalized = True

    def get_pointer_to_function(self, name):
        """Return 0: there is no machine code."""
        return 0

    @property
    def codegen(self):
        """What numba asks to set the environment of a function, which code that is not executable has not."""
        return self

    def set_env(self, env_name, env):
        """Do nothing."""

    def serialize_using_object_code(self):
        """Return what `read` makes a part of."""
        return self.name, KIND, self._get_module_for_linking().as_bitcode()

    @classmethod
    def read(cls, codegen, name, bitcode):
        """Return a part that was stored."""
        part = cls(codegen, name)
        part._shared_module = part._final_module = llvm.parse_bitcode(bitcode)
        part._finalized = True
        return part


class PartCompiler(Compiler):
    """numba's compiler, making parts."""

    def define_pipelines(self):
        """Return numba's own steps."""
        self.state.library = Part(self.state.targetctx.codegen(), self.state.func_id.func_qualname)
        self.state.library.enable_object_caching()
        return super().define_pipelines()


def restored(codegen, serialized):
    """Return a library from numba's cache; as numba does it, but for parts."""
    name, kind, data = serialized
    return Part.read(codegen, name, data) if kind == KIND else codegen._library_class._unserialize(codegen, serialized)


JITCPUCodegen.unserialize_library = restored  # type: ignore[method-assign]


#: Options of numba's decorator for a part.
PART: dict[str, Any] = {"cache": True, "no_cpython_wrapper": True, "pipeline_class": PartCompiler}


class Kernel(CPUDispatcher):
    """A function that Python calls. part : what kernels call in its place."""

    def __init__(self, function, part, options):
        super().__init__(function, targetoptions=options)
        self.part = part

    @property
    def _numba_type_(self):
        return types.Dispatcher(self.part)


def twin(function):
    """Copy of a function under another name, by which numba's cache and LLVM tell the two."""
    copy = pytypes.FunctionType(
        function.__code__, function.__globals__, function.__name__, function.__defaults__, function.__closure__
    )
    copy.__qualname__ = f"{function.__qualname__}.{KIND}"
    copy.__module__, copy.__doc__ = function.__module__, function.__doc__
    return copy
