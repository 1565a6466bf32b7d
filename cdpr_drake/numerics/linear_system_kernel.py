"""Small linear systems by Gauss' elimination with row pivots, as kernels without allocation.

Source: Golub and Van Loan, Matrix Computations, 3.4.
"""

from __future__ import annotations

from numba import njit

from cdpr_drake.arrays import Array


@njit(cache=True, error_model="numpy")
def eliminate(A: Array, n: int, pivots: Array) -> None:
    """Overwrites `A[:n, :n]` by its triangular factors, for `substitute`.

    Args:
        A: Matrix, shape (n, n) or larger; a singular one leaves infinite or NaN numbers.
        n: Its size.
        pivots: Where the rows' exchanges are written, shape (n,), whole numbers as floats.
    """
    for k in range(n):
        best = k
        for i in range(k + 1, n):
            if abs(A[i, k]) > abs(A[best, k]):
                best = i
        pivots[k] = best
        if best != k:
            for j in range(n):
                A[k, j], A[best, j] = A[best, j], A[k, j]
        for i in range(k + 1, n):
            A[i, k] /= A[k, k]
            for j in range(k + 1, n):
                A[i, j] -= A[i, k] * A[k, j]


@njit(cache=True, error_model="numpy")
def substitute(A: Array, n: int, pivots: Array, x: Array) -> None:
    """Overwrites a right hand side, `x[:n]`, by the solution; other arguments from `eliminate`."""
    for k in range(n):
        best = int(pivots[k])
        x[k], x[best] = x[best], x[k]
    for i in range(n):
        for j in range(i):
            x[i] -= A[i, j] * x[j]
    for i in range(n - 1, -1, -1):
        for j in range(i + 1, n):
            x[i] -= A[i, j] * x[j]
        x[i] /= A[i, i]
