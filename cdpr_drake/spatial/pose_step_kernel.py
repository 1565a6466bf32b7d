"""Numba kernels for steps in search of a pose: turning a platform, solving for a step."""

from __future__ import annotations

import numpy as np
from numba import njit

from cdpr_drake.arrays import Array


@njit(cache=True)
def turn_pose(state: Array, wx: float, wy: float, wz: float) -> None:
    """Turns a platform by a rotation vector in W [rad].

    Args:
        state: Begins with the unit quaternion wxyz, and is changed.
        wx: Rotation vector, first of three.
        wy: Second.
        wz: Third.
    """
    square = wx * wx + wy * wy + wz * wz
    angle = np.sqrt(square)
    half_sinc = np.sin(0.5 * angle) / angle if angle > 1e-4 else 0.5 - square / 48.0
    a, b, c, d = np.cos(0.5 * angle), half_sinc * wx, half_sinc * wy, half_sinc * wz
    w, x, y, z = state[0], state[1], state[2], state[3]
    qw = a * w - b * x - c * y - d * z
    qx = a * x + b * w + c * z - d * y
    qy = a * y - b * z + c * w + d * x
    qz = a * z + b * y - c * x + d * w
    per_norm = 1.0 / np.sqrt(qw * qw + qx * qx + qy * qy + qz * qz)
    state[0] = qw * per_norm
    state[1] = qx * per_norm
    state[2] = qy * per_norm
    state[3] = qz * per_norm


@njit(cache=True, error_model="numpy")
def solve_damped(A: Array, g: Array, damping: float, C: Array, x: Array) -> float:
    """Solves (A + damping diag A) x = -g by A = C D C'; C holds D on its diagonal.

    Returns the least pivot relative to A's diagonal, not above 0 where there is no solution.
    """
    least = np.inf
    for j in range(6):
        pivot = A[j, j] * (1.0 + damping)
        for k in range(j):
            total = A[j, k]
            for q in range(k):
                total -= C[j, q] * C[k, q] * C[q, q]
            C[j, k] = total / C[k, k]
            pivot -= C[j, k] * total
        relative = pivot / A[j, j]
        if not relative > 1e-15 or A[j, j] <= 0.0:
            return -1.0
        least = min(least, relative)
        C[j, j] = pivot
    for j in range(6):
        total = -g[j]
        for k in range(j):
            total -= C[j, k] * x[k]
        x[j] = total
    for j in range(5, -1, -1):
        total = x[j] / C[j, j]
        for k in range(j + 1, 6):
            total -= C[k, j] * x[k]
        x[j] = total
    return least
