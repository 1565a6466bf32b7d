"""All tensions that balance a wrench: one solution and the null space, by reflections."""

from __future__ import annotations

import numpy as np
from numba import njit

from cdpr_drake.arrays import Array

RANK_TOLERANCE = 1e-10
"""A wrench matrix whose QR factor has a smaller pivot than this, relative to the largest, is
singular."""


@njit(cache=True)
def null_space(W: Array, w: Array, A: Array, t: Array, N: Array) -> bool:
    """Splits the solutions of W t + w = 0 into t + N eta with W N = 0, N' N = 1, N' t = 0.

    So t is the pseudo-inverse solution -W^+ w.

    Args:
        W: Wrench matrix, shape (n, m) with n <= m, any scaling.
        w: Wrench, shape (n,).
        A: Work space, shape (m + 2, n).
        t: Gets the least-norm solution, shape (m,) [N].
        N: Gets the orthonormal basis of the null space, shape (m, m - n).

    Returns:
        Whether W has full rank; if not, t and N are worthless.

    Source: Golub and Van Loan, Matrix Computations, 5.2; servoing thesis (1.27), sign corrected.
    """
    n, m = W.shape
    for i in range(n):
        for j in range(m):
            A[j, i] = W[i, j]
    # W' = Q R, column by column; row m of A keeps R's diagonal, row m + 1 the reflectors' scale.
    largest, smallest = 0.0, np.inf
    for k in range(n):
        square = 0.0
        for i in range(k, m):
            square += A[i, k] * A[i, k]
        pivot = np.sqrt(square)
        largest = max(largest, pivot)
        smallest = min(smallest, pivot)
        if pivot <= RANK_TOLERANCE * largest:
            return False
        if A[k, k] > 0.0:
            pivot = -pivot
        A[m, k] = pivot
        A[k, k] -= pivot
        A[m + 1, k] = -1.0 / (pivot * A[k, k])
        for j in range(k + 1, n):
            dot = 0.0
            for i in range(k, m):
                dot += A[i, k] * A[i, j]
            dot *= A[m + 1, k]
            for i in range(k, m):
                A[i, j] -= dot * A[i, k]
    if smallest <= RANK_TOLERANCE * largest:
        return False
    # R' y = -w, then t = Q (y, 0).
    for i in range(n):
        value = -w[i]
        for k in range(i):
            value -= A[k, i] * t[k]
        t[i] = value / A[m, i]
    for i in range(n, m):
        t[i] = 0.0
    for k in range(n - 1, -1, -1):
        dot = 0.0
        for i in range(k, m):
            dot += A[i, k] * t[i]
        dot *= A[m + 1, k]
        for i in range(k, m):
            t[i] -= dot * A[i, k]
    for j in range(m - n):
        for i in range(m):
            N[i, j] = 0.0
        N[n + j, j] = 1.0
        for k in range(n - 1, -1, -1):
            dot = 0.0
            for i in range(k, m):
                dot += A[i, k] * N[i, j]
            dot *= A[m + 1, k]
            for i in range(k, m):
                N[i, j] -= dot * A[i, k]
    return True
