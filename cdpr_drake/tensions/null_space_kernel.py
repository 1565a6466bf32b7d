"""All tensions that balance a wrench: one solution and the null space, by reflections."""

from __future__ import annotations

import numpy as np
from numba import njit

from cdpr_drake.arrays import Array

RANK_TOLERANCE = 1e-10
"""A wrench matrix whose QR factor has a smaller pivot than this, relative to the largest, is
singular."""


REASSOCIATE = {"reassoc", "contract", "nsz"}
"""Lets the compiler sum in another order, which keeps NaN and infinity as they are."""


@njit(cache=True, fastmath=REASSOCIATE)
def factor(W: Array, A: Array) -> bool:
    """Factors a wrench matrix, W = L Q' with Q a product of Householder reflections.

    Args:
        W: Wrench matrix, shape (n, m) with n <= m, any scaling.
        A: Gets the factors, shape (n, m + 2): in row k, L up to column k - 1 and reflection k from
            there; in column m L's diagonal, in column m + 1 the reflections' scale. All loops run
            along rows, for speed.

    Returns:
        Whether W has full rank; if not, A is worthless.

    Source: Golub and Van Loan, Matrix Computations, 5.2.
    """
    n, m = W.shape
    for i in range(n):
        for j in range(m):
            A[i, j] = W[i, j]
    largest, smallest = 0.0, np.inf
    for k in range(n):
        row = A[k]
        square = 0.0
        for j in range(k, m):
            square += row[j] * row[j]
        pivot = np.sqrt(square)
        largest = max(largest, pivot)
        smallest = min(smallest, pivot)
        if pivot <= RANK_TOLERANCE * largest:
            return False
        if row[k] > 0.0:
            pivot = -pivot
        row[m] = pivot
        row[k] -= pivot
        scale = -1.0 / (pivot * row[k])
        row[m + 1] = scale
        for i in range(k + 1, n):
            other = A[i]
            dot = 0.0
            for j in range(k, m):
                dot += row[j] * other[j]
            dot *= scale
            for j in range(k, m):
                other[j] -= dot * row[j]
    return smallest > RANK_TOLERANCE * largest


@njit(cache=True, fastmath=REASSOCIATE)
def balance(A: Array, w: Array, wanted: Array, W: Array, t: Array) -> None:
    """Writes the tensions nearest to wanted ones that balance w, bounds aside.

    t = t_w - W^+ (w + W t_w); with t_w = 0 the pseudo-inverse solution.

    Args:
        A: Factors of W from `factor`.
        w: Wrench, shape (n,).
        wanted: t_w, shape (m,) [N].
        W: Wrench matrix, shape (n, m).
        t: Gets the tensions, shape (m,) [N].
    """
    n, m = W.shape
    for i in range(n):
        row, lever = A[i], W[i]
        value = -w[i]
        for j in range(m):
            value -= lever[j] * wanted[j]
        for k in range(i):
            value -= row[k] * t[k]
        t[i] = value / row[m]
    for j in range(n, m):
        t[j] = 0.0
    for k in range(n - 1, -1, -1):
        _reflect(A[k], k, m, t)
    for j in range(m):
        t[j] += wanted[j]


@njit(cache=True, fastmath=REASSOCIATE)
def null_basis(A: Array, m: int, N: Array) -> None:
    """Writes an orthonormal basis of the null space of W, row by row.

    Args:
        A: Factors of W from `factor`, shape (n, m + 2).
        m: Number of cables.
        N: Gets the basis, shape (m - n, m) or with columns to spare.
    """
    n = A.shape[0]
    for i in range(m - n):
        for j in range(m):
            N[i, j] = 0.0
        N[i, n + i] = 1.0
        for k in range(n - 1, -1, -1):
            _reflect(A[k], k, m, N[i])


@njit(cache=True, fastmath=REASSOCIATE, inline="always")
def _reflect(row: Array, k: int, m: int, x: Array) -> None:
    dot = 0.0
    for j in range(k, m):
        dot += row[j] * x[j]
    dot *= row[m + 1]
    for j in range(k, m):
        x[j] -= dot * row[j]


@njit(cache=True)
def null_space(W: Array, w: Array, t: Array, N: Array) -> bool:
    """Splits the solutions of W t + w = 0 into t + N' eta with W N' = 0, N N' = 1, N t = 0.

    Args:
        W: Wrench matrix, shape (n, m).
        w: Wrench, shape (n,).
        t: Gets the least-norm solution -W^+ w, shape (m,) [N].
        N: Gets an orthonormal basis of the null space, row by row, shape (m - n, m).

    Returns:
        Whether W has full rank; if not, t and N are worthless.

    Source: servoing thesis (1.27), sign corrected.
    """
    n, m = W.shape
    A = np.empty((n, m + 2))
    if not factor(W, A):
        return False
    balance(A, w, np.zeros(m), W, t)
    null_basis(A, m, N)
    return True
