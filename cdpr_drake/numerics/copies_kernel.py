"""Copies between arrays inside kernels, as loops.

An assignment of one array to a slice of another compiles much more: messages about shapes that do
not fit, and strings to write them with, in every kernel that is linked above it.
"""

from __future__ import annotations

from numba import njit

from cdpr_drake.arrays import Array


@njit(cache=True)
def copy_vector(a: Array, out: Array) -> None:
    """out <- a, both of shape (n,)."""
    for i in range(a.shape[0]):
        out[i] = a[i]


@njit(cache=True)
def copy_matrix(a: Array, out: Array) -> None:
    """out <- a, both of shape (n, k)."""
    for i in range(a.shape[0]):
        for j in range(a.shape[1]):
            out[i, j] = a[i, j]
