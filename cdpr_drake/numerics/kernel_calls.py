"""How kernels are called: by address, with a table of arrays, in threads, on other scalars.

`kernel_address` and `call_at_address` let one kernel call another that is chosen at run time.
`array_addresses` hands many arrays over as one argument. `over_rows` shares rows among threads.
`any_scalar` runs the source of a kernel on other scalars, such as AutoDiffXd.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from types import FunctionType
from typing import Any

import numpy as np
from numba import carray, get_num_threads, njit, types
from numba.extending import intrinsic

from cdpr_drake.arrays import Array

SHARES = 8
"""Shares of the rows per thread, so that a thread whose rows are quick takes over others."""


@njit(cache=True, inline="always")
def as_number(k: int) -> int:
    """k, for a kernel that is to be compiled once for all whole numbers.

    numba compiles a kernel anew for each number that is written out where it is called.
    """
    return k + 0


@cache
def kernel_address(kernel: Any, signature: Any) -> int:
    """Where the machine code of a kernel, compiled by numba for a signature, begins.

    What calls a kernel by its address is compiled, and cached on disk, once for all of them. As an
    argument a kernel would make its caller another function in every process; its position in a
    chain of comparisons would make all of them wait for all others.
    """
    kernel.compile(signature.args)  # as for a call from Python, which would be compiled once more
    compiled = kernel.get_compile_result(signature)
    return int(compiled.library.get_pointer_to_function(compiled.fndesc.llvm_func_name))


def call_at_address(signature: Any) -> Callable[..., Any]:
    """The code of a `numba.extending.intrinsic` whose first argument is such an address.

    Its other arguments are those of the signature; errors of the kernel go on to the caller.
    """

    def generate(context: Any, builder: Any, _: Any, arguments: Any) -> Any:
        convention, given = context.call_conv, (signature.return_type, signature.args)
        kind = convention.get_function_type(*given).as_pointer()
        kernel = builder.inttoptr(arguments[0], kind)
        status, result = convention.call_function(builder, kernel, *given, arguments[1:])
        with builder.if_then(status.is_error, likely=False):
            convention.return_status_propagate(builder, status)
        return result

    return generate


def array_addresses(arrays: Sequence[Array]) -> np.ndarray:
    """Address and lengths of up to three axes of each array, shape (k, 4), whole numbers.

    To hand fifteen arrays from Python to a compiled function costs as much as the forces of eight
    cables. Arrays that stay where they are are handed over once, as this table, and read by
    `vector_at` and its like. Whoever keeps the table must keep the arrays, too.

    Args:
        arrays: Of 64 bit numbers, without gaps.

    Raises:
        ValueError: An array has gaps, or numbers of another size.
    """
    table = np.zeros((len(arrays), 4), dtype=np.int64)
    for row, array in zip(table, arrays, strict=True):
        if not array.flags.c_contiguous or array.itemsize != 8 or array.ndim > 3:
            raise ValueError(f"array of {array.dtype}, shape {array.shape}: cannot be addressed")
        row[0] = array.ctypes.data
        row[1 : 1 + array.ndim] = array.shape
    return table


@njit(cache=True, inline="always")
def integers_at(table: np.ndarray, k: int) -> np.ndarray:
    """Array k of a table as whole numbers, one axis."""
    return _whole_numbers(table, as_number(k))


@njit(cache=True, inline="always")
def vector_at(table: np.ndarray, k: int) -> Array:
    """Array k of a table, one axis."""
    return _vector(table, as_number(k))


@njit(cache=True, inline="always")
def matrix_at(table: np.ndarray, k: int) -> Array:
    """Array k of a table, two axes."""
    return _matrix(table, as_number(k))


@njit(cache=True, inline="always")
def cube_at(table: np.ndarray, k: int) -> Array:
    """Array k of a table, three axes."""
    return _cube(table, as_number(k))


def _pointer_to(kind: Any) -> Any:
    pointer = types.CPointer(kind)

    @intrinsic
    def pointer_at(typing: Any, address: Any) -> Any:
        def generate(context: Any, builder: Any, _: Any, arguments: Any) -> Any:
            return builder.inttoptr(arguments[0], context.get_value_type(pointer))

        return pointer(types.int64), generate

    return pointer_at


_floats_at, _integers_at = _pointer_to(types.float64), _pointer_to(types.int64)


@njit(cache=True)
def _whole_numbers(table: np.ndarray, k: int) -> np.ndarray:
    return carray(_integers_at(table[k, 0]), (table[k, 1],))


@njit(cache=True)
def _vector(table: np.ndarray, k: int) -> Array:
    return carray(_floats_at(table[k, 0]), (table[k, 1],))


@njit(cache=True)
def _matrix(table: np.ndarray, k: int) -> Array:
    return carray(_floats_at(table[k, 0]), (table[k, 1], table[k, 2]))


@njit(cache=True)
def _cube(table: np.ndarray, k: int) -> Array:
    return carray(_floats_at(table[k, 0]), (table[k, 1], table[k, 2], table[k, 3]))


def over_rows(
    kernel: Callable[..., Any], count: int, threads: int | None, *arguments: object
) -> None:
    """Calls `kernel(first, past, *arguments)` until all rows of range(count) are done.

    Threads of Python do what numba's own `prange` does, without its second compilation of
    everything below the loop, and may be used from several threads at once.

    Args:
        kernel: Compiled with `nogil=True`; takes the first row and the one past the last before
            its other arguments; what it writes for a row no other row may touch.
        count: Number of rows.
        threads: Number of threads; None: as many as `numba.set_num_threads` allows, by itself all
            cores.
        arguments: Further arguments of the kernel.
    """
    threads = min(get_num_threads() if threads is None else max(threads, 1), count)
    if threads <= 1:
        kernel(0, count, *arguments)
        return
    step = -(-count // (SHARES * threads))
    kernel(0, 0, *arguments)  # compiles in one thread
    with ThreadPoolExecutor(threads) as pool:
        shares = [
            pool.submit(kernel, first, min(first + step, count), *arguments)
            for first in range(0, count, step)
        ]
        try:
            for share in shares:
                share.result()
        finally:
            for share in shares:
                share.cancel()


def any_scalar(kernel: Any, replace: dict[str, Callable[..., Any]] | None = None) -> Any:
    """The Python function of a kernel, bound to the Python functions of the kernels it calls.

    So one source serves the fast path and the differentiable one. The kernel may use what NumPy
    offers object arrays: arithmetic, comparison, sqrt, log, sin, cos, arctan2.

    Args:
        kernel: A function compiled by numba.njit.
        replace: Functions to call instead of kernels of that name, wherever they are called.
    """
    replace = replace or {}
    function = kernel.py_func
    names = dict(function.__globals__)
    for name in function.__code__.co_names:
        if name in replace:
            names[name] = replace[name]
        elif hasattr(names.get(name), "py_func"):
            names[name] = any_scalar(names[name], replace)
    return FunctionType(function.__code__, names, function.__name__, function.__defaults__)
