"""Kernels that only kernels call, as tests can call them."""

import functools

import numba


@functools.cache
def callable_from_python(kernel):
    """A kernel that calls another one."""
    return numba.njit(lambda *arguments: kernel(*arguments))
