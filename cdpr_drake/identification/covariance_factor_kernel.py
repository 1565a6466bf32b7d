"""Factors of covariances of some hundred correlated equations, and what they make of equations.

LAPACK hands matrices of this size to threads that wait for each other longer than they work.

Source: Golub and Van Loan, Matrix Computations, 4.2 and 3.1.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from cdpr_drake.arrays import Array


@njit(cache=True, error_model="numpy")
def factor(K: Array, U: Array) -> bool:
    """Writes the upper triangular U with K = U' U, row by row.

    Args:
        K: Symmetric, shape (n, n); its upper triangle is read.
        U: Shape (n, n), zeros.

    Returns:
        Whether K is positive definite; otherwise U is of no use.
    """
    n = K.shape[0]
    row = np.empty(n)
    for i in range(n):
        for j in range(i, n):
            row[j] = K[i, j]
        for k in range(0, i - 3, 4):  # four at once halve the time
            a, b, c, d = U[k, i], U[k + 1, i], U[k + 2, i], U[k + 3, i]
            A, B, C, D = U[k], U[k + 1], U[k + 2], U[k + 3]
            for j in range(i, n):
                row[j] -= a * A[j] + b * B[j] + c * C[j] + d * D[j]
        for k in range(i - i % 4, i):
            share, above = U[k, i], U[k]
            for j in range(i, n):
                row[j] -= share * above[j]
        if not row[i] > 0.0:
            return False
        scale = 1.0 / np.sqrt(row[i])
        for j in range(i, n):
            U[i, j] = scale * row[j]
    return True


@njit(cache=True, error_model="numpy")
def whiten(U: Array, x: Array) -> None:
    """Overwrites right hand sides, shape (n, k), by U'^-1 x."""
    n, k = x.shape
    row = np.empty(k)
    for i in range(n):
        for j in range(k):
            row[j] = x[i, j]
        for h in range(i):
            share, above = U[h, i], x[h]
            for j in range(k):
                row[j] -= share * above[j]
        for j in range(k):
            x[i, j] = row[j] / U[i, i]


@njit(cache=True, error_model="numpy")
def unwhiten(U: Array, x: Array) -> None:
    """Overwrites right hand sides, shape (n, k), by U^-1 x: with `whiten` before it K^-1 x."""
    n, k = x.shape
    row = np.empty(k)
    for i in range(n - 1, -1, -1):
        for j in range(k):
            row[j] = x[i, j]
        for h in range(i + 1, n):
            share, below = U[i, h], x[h]
            for j in range(k):
                row[j] -= share * below[j]
        for j in range(k):
            x[i, j] = row[j] / U[i, i]
