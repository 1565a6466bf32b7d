"""Numba kernels that do with poses what Drake's RigidTransform does, to the last bit.

A compiled loop cannot ask Drake, and has to give the numbers of a loop that does. So each kernel
adds in the order in which Drake and Eigen add, and rounds where they round. Processors without
fused multiplication and addition round elsewhere in Drake; `agrees` tells whether the kernels are
Drake's here.

A pose is its matrix (3, 4) column by column, shape (12,) [-, m], as `servoing.columns` makes it.

Source: Drake, math/fast_pose_composition_functions.cc, math/rotation_matrix.h; Eigen,
SVD/JacobiSVD.h, Jacobi/Jacobi.h.
"""

from __future__ import annotations

import math
from functools import cache
from typing import Any

import numpy as np
from numba import njit, types
from numba.extending import intrinsic
from pydrake.common.eigen_geometry import Quaternion
from pydrake.math import RigidTransform, RotationMatrix

from cdpr_drake.arrays import Array
from cdpr_drake.geometry.poses import euclidean_length

_TINY, _PRECISION = float(np.finfo(float).tiny), 2.0 * float(np.finfo(float).eps)
_TRIALS = 64
"""Poses by which `agrees` compares: where the rounding differs, it does in every second."""


@intrinsic
def fused(typing: Any, a: Any, b: Any, c: Any) -> Any:
    """a b + c, rounded once."""

    def generate(context: Any, builder: Any, _: Any, arguments: Any) -> Any:
        return builder.fma(*arguments)

    return types.float64(types.float64, types.float64, types.float64), generate


@njit(cache=True)
def square_sum(values: Array, first: int, past: int) -> float:
    """Sum of squares, added as `poses.euclidean_length` does."""
    total = 0.0
    for k in range(first, past):
        total += values[k] * values[k]
    return total


@njit(cache=True)
def compose(A: Array, B: Array, out: Array) -> None:
    """out <- A @ B; out is another array."""
    for i in range(3):
        for j in range(3):
            out[3 * j + i] = fused(
                A[6 + i], B[3 * j + 2], fused(A[3 + i], B[3 * j + 1], A[i] * B[3 * j])
            )
        out[9 + i] = fused(A[6 + i], B[11], fused(A[3 + i], B[10], fused(A[i], B[9], A[9 + i])))


@njit(cache=True)
def invert(A: Array, out: Array) -> None:
    """out <- A.inverse(); out is another array."""
    x, y, z = -A[9], -A[10], -A[11]
    for i in range(3):
        for j in range(3):
            out[3 * j + i] = A[3 * i + j]
    out[9] = (A[0] * x + A[1] * y) + A[2] * z
    out[10] = (A[3] * x + A[4] * y) + A[5] * z
    out[11] = A[6] * x + (A[7] * y + A[8] * z)  # the one that is left of packets of two


@njit(cache=True)
def pose_of_floating(state: Array, out: Array) -> None:
    """out <- pose of a floating platform whose state begins with quaternion and position."""
    norm = math.sqrt(square_sum(state, 0, 4))
    w, x, y, z = state[0] / norm, state[1] / norm, state[2] / norm, state[3] / norm
    s = 2.0 / ((x * x + z * z) + (y * y + w * w))
    sx, sy, sz = s * x, s * y, s * z
    wx, wy, wz = sx * w, sy * w, sz * w
    xx, xy, xz = sx * x, sy * x, sz * x
    yy, yz, zz = sy * y, sz * y, sz * z
    out[0], out[3], out[6] = 1.0 - yy - zz, xy - wz, xz + wy
    out[1], out[4], out[7] = xy + wz, 1.0 - xx - zz, yz - wx
    out[2], out[5], out[8] = xz - wy, yz + wx, 1.0 - xx - yy
    for i in range(3):
        out[9 + i] = state[4 + i]


@njit(cache=True)
def _turn(A: Array, p: int, q: int, step: int, along: int, c: float, s: float) -> None:
    """Rows, or columns, p and q of a matrix to their sums by cosine and sine."""
    if c == 1.0 and s == 0.0:
        return
    for k in range(3):
        at, other = step * p + along * k, step * q + along * k
        x, y = A[at], A[other]
        A[at], A[other] = c * x + s * y, -s * x + c * y


@njit(cache=True)
def _swap(A: Array, p: int, q: int) -> None:
    for k in range(3):
        A[3 * p + k], A[3 * q + k] = A[3 * q + k], A[3 * p + k]


@njit(cache=True)
def _diagonalize(W: Array, U: Array, V: Array) -> None:
    """Two-sided Jacobi sweeps over W, shape (9,) column by column, as Eigen's JacobiSVD."""
    largest = max(abs(W[0]), abs(W[4]), abs(W[8]))
    finished = False
    while not finished:
        finished = True
        for p in range(1, 3):
            for q in range(p):
                bound = max(_TINY, _PRECISION * largest)
                if not (abs(W[3 * q + p]) > bound or abs(W[3 * p + q]) > bound):
                    continue
                finished = False
                a, b, c, d = W[4 * p], W[3 * q + p], W[3 * p + q], W[4 * q]
                # a b over c d: made symmetric by a turn, then diagonal by another.
                first_c, first_s = 1.0, 0.0
                if not abs(c - b) < _TINY:
                    ratio = (a + d) / (c - b)
                    length = math.sqrt(1.0 + ratio * ratio)
                    first_s, first_c = 1.0 / length, ratio / length
                    b, d = first_c * b + first_s * d, -first_s * b + first_c * d
                    a = first_c * a + first_s * c
                right_c, right_s = 1.0, 0.0
                if not 2.0 * abs(b) < _TINY:
                    tau = (a - d) / (2.0 * abs(b))
                    w = math.sqrt(tau * tau + 1.0)
                    t = 1.0 / (tau + w) if tau > 0.0 else 1.0 / (tau - w)
                    right_c = 1.0 / math.sqrt(t * t + 1.0)
                    sign = 1.0 if t > 0.0 else -1.0
                    right_s = -sign * (b / abs(b)) * abs(t) * right_c
                left_c = first_c * right_c - first_s * -right_s
                left_s = first_c * -right_s + first_s * right_c
                _turn(W, p, q, 1, 3, left_c, left_s)
                _turn(U, p, q, 3, 1, left_c, left_s)
                _turn(W, p, q, 3, 1, right_c, -right_s)
                _turn(V, p, q, 3, 1, right_c, -right_s)
                largest = max(largest, max(abs(W[4 * p]), abs(W[4 * q])))


@njit(cache=True)
def project(M: Array, first: int, row_by_row: bool, out: Array) -> None:
    """out[:9] <- RotationMatrix.ProjectToRotationMatrix of the matrix M[first : first + 9].

    It is the nearest rotation. What is not finite stays so.
    """
    W, U, V, sizes = np.empty(9), np.zeros(9), np.zeros(9), np.empty(3)
    scale = 0.0
    for k in range(9):
        scale = max(scale, abs(M[first + k]))
    for i in range(3):
        U[4 * i] = V[4 * i] = 1.0
        for j in range(3):
            at = 3 * i + j if row_by_row else 3 * j + i
            W[3 * j + i] = M[first + at] / scale
    _diagonalize(W, U, V)
    for i in range(3):
        sizes[i] = abs(W[4 * i]) * scale
        if W[4 * i] < 0.0:
            for k in range(3):
                U[3 * i + k] = -U[3 * i + k]
    for i in range(2):
        most = i
        for k in range(i + 1, 3):
            if sizes[k] > sizes[most]:
                most = k
        if most != i:
            sizes[i], sizes[most] = sizes[most], sizes[i]
            _swap(U, i, most)
            _swap(V, i, most)
    for j in range(3):
        for i in range(3):
            a, b, c = U[i] * V[j], U[3 + i] * V[3 + j], U[6 + i] * V[6 + j]
            out[3 * j + i] = a + (b + c) if i == 2 else (a + b) + c


@njit(cache=True)
def pack_rows(X: Array, out: Array, first: int) -> None:
    """out[first : first + 12] <- rotation row by row, position, as states keep a pose."""
    for i in range(3):
        for j in range(3):
            out[first + 3 * i + j] = X[3 * j + i]
        out[first + 9 + i] = X[9 + i]


@njit(cache=True)
def unpack_rows(packed: Array, first: int, out: Array) -> None:
    """Inverse of `pack_rows`; rounding that has grown in the rotation is removed."""
    project(packed, first, True, out)
    for i in range(3):
        out[9 + i] = packed[first + 9 + i]


@njit(cache=True)
def _results(state: Array, other: Array, rough: Array) -> Array:
    """What the kernels give, in the order of `_drake_results`."""
    out, X, Y, Z = np.empty((4, 12)), np.empty(12), np.empty(12), np.zeros(12)
    pose_of_floating(state, X)
    pose_of_floating(other, Y)
    out[0] = X
    compose(X, Y, Z)
    out[1] = Z
    invert(X, Z)
    out[2] = Z
    project(rough, 0, True, Z)
    out[3] = Z
    return out


def _drake_results(state: Array, other: Array, rough: Array) -> Array:
    X, Y = (
        RigidTransform(Quaternion(each[:4] / euclidean_length(each[:4])), each[4:])
        for each in (state, other)
    )
    R = RotationMatrix.ProjectToRotationMatrix(rough.reshape(3, 3))
    inverse = X.inverse()
    poses = [X, X @ Y, inverse, RigidTransform(R, inverse.translation())]
    rows = [np.asarray(each.GetAsMatrix34().ravel("F")) for each in poses]
    return np.array(rows)


@cache
def agrees() -> bool:
    """Whether these kernels give Drake's numbers on this processor, to the last bit."""
    random = np.random.default_rng(0)
    for _ in range(_TRIALS):
        state, other = random.standard_normal((2, 7))
        turned = _drake_results(state, other, np.eye(3).ravel())[0, :9]
        rough = turned + 1e-16 * random.standard_normal(9)
        if not np.array_equal(_results(state, other, rough), _drake_results(state, other, rough)):
            return False
    return True
