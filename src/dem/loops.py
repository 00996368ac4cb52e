"""Loops over independent work, on one thread or on several.

A parallel loop of numba takes arrays and numbers from around it, but no tuple of mixed types, as the state of a simulation is. So
the tuple lies on the stack of the function that waits for the loop, and the loop takes its address.
"""

from typing import Any, cast

from dem.jit import INLINE_FLAGS, JIT_FLAGS, PART, cgutils, intrinsic, overload, prange, types


def spread(work):
    """Return loop(threads, n, arguments), which calls work(k, arguments) for every k below n; work : a kernel.

    threads : None for one thread, else all that `set_num_threads` allows; its type selects the code when a kernel is compiled.
    arguments : a tuple. Calls for two k must not write to the same places.
    """

    def loop(threads, n, arguments):
        for k in range(n):
            work(k, arguments)

    def in_turn(threads, n, arguments):
        return loop if isinstance(threads, types.NoneType) else None

    def side_by_side(threads, n, arguments):
        if isinstance(threads, types.NoneType):
            return None
        read = reader(arguments)

        def parallel(threads, n, arguments):
            address = address_of(arguments)
            for k in prange(n):
                work(k, read(address))

        return parallel

    # what a loop calls is known only here, so numba's cache cannot tell two loops apart
    overload(loop, jit_options=cast(Any, PART | INLINE_FLAGS | {"cache": False}), strict=False)(in_turn)
    overload(loop, jit_options=cast(Any, JIT_FLAGS | {"parallel": True}), strict=False)(side_by_side)
    return loop


@intrinsic
def address_of(typing, value):
    """Address of a copy of a value on the stack, which is there until the caller returns."""

    def generate(context, builder, signature, args):
        return builder.ptrtoint(cgutils.alloca_once_value(builder, args[0]), context.get_value_type(types.intp))

    return types.intp(value), generate


def reader(kind):
    """Return read(address): the value of a type of numba's that lies at an address."""

    @intrinsic
    def read(typing, address):
        def generate(context, builder, signature, args):
            value = builder.load(builder.inttoptr(args[0], context.get_value_type(kind).as_pointer()))
            if context.enable_nrt:  # the caller will count what a call returns down again
                context.nrt.incref(builder, kind, value)
            return value

        return kind(address), generate

    return read
