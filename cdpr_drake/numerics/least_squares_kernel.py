"""Least squares of limited rank, and what it leaves free, as a numba kernel."""

from __future__ import annotations

import numpy as np
from numba import njit

from cdpr_drake.arrays import Array


@njit(cache=True)
def least_squares(L: Array, rate: Array, rank: int) -> tuple[Array, Array]:
    """v of least norm that brings L @ v nearest to a rate, and the projector on L's null space.

    Args:
        L: Interaction matrix, shape (n, k).
        rate: Wanted rate of the features, shape (n,).
        rank: Singular values beyond this many, or below 1e-9 of the largest, count as zero: where
            features leave a motion free, image noise must not move it.

    Returns:
        v, shape (k,), and 1 - L^+ L, shape (k, k).
    """
    U, S, Vt = np.linalg.svd(L, full_matrices=False)
    n, k = L.shape
    v = np.zeros(k)
    free = np.eye(k)
    for i in range(min(rank, S.shape[0])):
        if S[i] <= 1e-9 * S[0]:
            break
        share = 0.0
        for j in range(n):
            share += U[j, i] * rate[j]
        share /= S[i]
        for a in range(k):
            v[a] += Vt[i, a] * share
            for b in range(k):
                free[a, b] -= Vt[i, a] * Vt[i, b]
    return v, free
