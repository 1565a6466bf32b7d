"""Numba kernels for rotations: vectors, quaternions and matrices, and steps in search of a pose.

A search turns its platform by `turn_pose` and finds its step by `solve_damped`.
`motion_kernel.floating_motion` has its own matrix of a quaternion, since cable kernels take one as
a tuple of numbers in registers.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from cdpr_drake.arrays import Array


@njit(cache=True)
def turning_into(v: Array, a: float, b: float, R: Array) -> None:
    """R[:3, :3] <- I + a [v]x + b [v]x^2, the form of all that turns about v."""
    x, y, z = v[0], v[1], v[2]
    R[0, 0] = 1.0 - b * (y * y + z * z)
    R[1, 1] = 1.0 - b * (x * x + z * z)
    R[2, 2] = 1.0 - b * (x * x + y * y)
    R[0, 1], R[1, 0] = b * x * y - a * z, b * x * y + a * z
    R[0, 2], R[2, 0] = b * x * z + a * y, b * x * z - a * y
    R[1, 2], R[2, 1] = b * y * z - a * x, b * y * z + a * x


@njit(cache=True)
def rotation_into(vector: Array, R: Array) -> None:
    """R[:3, :3] <- exp([vector]x), of a rotation vector, shape (3,) [rad]. Source: Rodrigues."""
    x, y, z = vector[0], vector[1], vector[2]
    square = x * x + y * y + z * z
    theta = np.sqrt(square)
    if theta > 1e-8:
        a, b = np.sin(theta) / theta, 2.0 * (np.sin(0.5 * theta) / theta) ** 2
    else:
        a, b = 1.0 - square / 6.0, 0.5 - square / 24.0
    turning_into(vector, a, b, R)


@njit(cache=True)
def quaternion_into(w: float, x: float, y: float, z: float, s: float, R: Array) -> None:
    """R[:3, :3] <- rotation matrix of the quaternion (w, x, y, z), s being 2 by its square."""
    R[0, 0] = 1.0 - s * (y * y + z * z)
    R[1, 1] = 1.0 - s * (x * x + z * z)
    R[2, 2] = 1.0 - s * (x * x + y * y)
    R[0, 1], R[1, 0] = s * (x * y - w * z), s * (x * y + w * z)
    R[0, 2], R[2, 0] = s * (x * z + w * y), s * (x * z - w * y)
    R[1, 2], R[2, 1] = s * (y * z - w * x), s * (y * z + w * x)


@njit(cache=True)
def rotations_of_quaternions(q: Array) -> Array:
    """Rotation matrices, shape (n, 3, 3), of unit quaternions (w, x, y, z), shape (n, 4)."""
    R = np.empty((q.shape[0], 3, 3))
    for n in range(q.shape[0]):
        quaternion_into(q[n, 0], q[n, 1], q[n, 2], q[n, 3], 2.0, R[n])
    return R


@njit(cache=True)
def quaternion_of_matrix(R: Array, q: Array) -> None:
    """q[:4] <- unit quaternion (w, x, y, z), w not negative, of a rotation matrix R[:3, :3].

    By the largest component, as Drake's `RotationMatrix.ToQuaternion`.
    """
    trace = R[0, 0] + R[1, 1] + R[2, 2]
    wx, wy, wz = R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]
    xy, xz, yz = R[0, 1] + R[1, 0], R[0, 2] + R[2, 0], R[1, 2] + R[2, 1]
    if trace >= R[0, 0] and trace >= R[1, 1] and trace >= R[2, 2]:
        w, x, y, z = 1.0 + trace, wx, wy, wz
    elif R[0, 0] >= R[1, 1] and R[0, 0] >= R[2, 2]:
        w, x, y, z = wx, 1.0 - (trace - 2.0 * R[0, 0]), xy, xz
    elif R[1, 1] >= R[2, 2]:
        w, x, y, z = wy, xy, 1.0 - (trace - 2.0 * R[1, 1]), yz
    else:
        w, x, y, z = wz, xz, yz, 1.0 - (trace - 2.0 * R[2, 2])
    norm = np.sqrt(w * w + x * x + y * y + z * z)
    if w < 0.0:
        norm = -norm
    q[0], q[1], q[2], q[3] = w / norm, x / norm, y / norm, z / norm


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
