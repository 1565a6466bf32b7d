"""Many arrays as one argument of a kernel: their addresses.

To hand fifteen arrays from Python to a compiled function costs as much as the forces of eight
cables. Arrays that stay where they are are handed over once, as a table of where they begin.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numba import carray, njit, types
from numba.extending import intrinsic

from cdpr_drake.arrays import Array
from cdpr_drake.numerics.kernel_calls import as_number


def array_addresses(arrays: Sequence[Array]) -> np.ndarray:
    """Address and lengths of up to three axes of each array, shape (k, 4), whole numbers.

    Whoever keeps the table must keep the arrays, too.

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
