"""Kernels of `test_shared_kernels`, in a module as kernels that are kept on disk must be."""

import numpy as np
from numba import njit, types

from cdpr_drake.numerics.shared_kernels import MATRIX, VECTOR, shared

TRIPLE = types.Tuple((types.float64, VECTOR, types.boolean))


@shared(TRIPLE(types.UniTuple(types.float64, 3), VECTOR, types.int64))
@njit(cache=True)
def stretched(X, a, factor):
    """A tuple, an array of its own and a truth, from a tuple, an array and a whole number."""
    a[0] = X[1]
    return X[0] * factor, factor * a, X[2] > 0.0


@shared(types.void(MATRIX))
@njit(cache=True)
def fill(A):
    """Writes, and returns nothing."""
    for i in range(A.shape[0]):
        for j in range(A.shape[1]):
            A[i, j] = 3.0


@shared(types.float64(types.float64))
@njit(cache=True)
def refuse(x):
    """Raises what its caller's caller shall see."""
    if x > 1.0:
        raise ValueError("more than 1")
    return x


@njit(cache=True, nogil=True)
def caller(A, full, x):
    """Calls all of them, one only if `full`."""
    first, row, positive = stretched((1.0, 2.0, 3.0), A[0], 2)
    if full:
        fill(A)
    return first + row[0] + refuse(x), positive


@njit
def wrongly(x):
    """Gives an array where a number is expected."""
    return refuse(np.zeros((x, x)))
