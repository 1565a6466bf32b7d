"""Numba kernels: from coordinates of a program to a point of a motion, and its derivative.

A point is the row of `pose_path.POINT_SIZE` numbers: unit quaternion and place of P in W, V_WP and
A_WP. Its changes are counted by `SEEDS` numbers, all spatial vectors (rotation, translation) in W:
a small turn and move of P, the change of V_WP, the change of A_WP. Constraints are written for
these once; the derivative of the seeds by the coordinates, shape (`SEEDS`, k), takes them to
whatever coordinates a program has.

With r the quaternion, of any length, r' and r'' its derivatives by time, h = r' / r and k = r'' / r
as quaternions, e = dr / r the change, and `vec` and `re` the parts of a quaternion,

    turn = 2 vec(e),    w = 2 vec(h),        alpha = 2 vec(k) - 2 re(h) w,
    dw = 2 vec(dr' / r - h e),    dalpha = 2 vec(dr'' / r - k e) - 2 re(dr' / r - h e) w
                                            - 2 re(h) dw.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit

from cdpr_drake.arrays import Array

SEEDS = 18
"""Numbers of a change of a point: turn and move (6), of V_WP (6), of A_WP (6)."""


@njit(cache=True, inline="always")
def _over(a: Any, q: Any) -> Any:
    """a times the inverse of q, quaternions (w, x, y, z)."""
    per = 1.0 / (q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3])
    return (
        per * (a[0] * q[0] + a[1] * q[1] + a[2] * q[2] + a[3] * q[3]),
        per * (-a[0] * q[1] + a[1] * q[0] - a[2] * q[3] + a[3] * q[2]),
        per * (-a[0] * q[2] + a[1] * q[3] + a[2] * q[0] - a[3] * q[1]),
        per * (-a[0] * q[3] - a[1] * q[2] + a[2] * q[1] + a[3] * q[0]),
    )


@njit(cache=True, inline="always")
def _times(a: Any, b: Any) -> Any:
    """Product of quaternions (w, x, y, z)."""
    return (
        a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
        a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
        a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
        a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0],
    )


@njit(cache=True)
def point_of_numbers(numbers: Array, changes: Array, point: Array, seeds: Array) -> None:
    """Writes a point and its seeds by k coordinates.

    Args:
        numbers: Quaternion, of any length, and place [m], and their first and second derivatives
            by time, shape (3, 7).
        changes: Their derivatives by the coordinates, shape (3, 7, k).
        point: Gets the point, shape (19,).
        seeds: Gets their derivatives, shape (`SEEDS`, k).
    """
    q = (numbers[0, 0], numbers[0, 1], numbers[0, 2], numbers[0, 3])
    scale = 1.0 / np.sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3])
    h = _over((numbers[1, 0], numbers[1, 1], numbers[1, 2], numbers[1, 3]), q)
    f = _over((numbers[2, 0], numbers[2, 1], numbers[2, 2], numbers[2, 3]), q)
    for i in range(4):
        point[i] = scale * q[i]
    for i in range(3):
        point[4 + i], point[10 + i], point[16 + i] = (
            numbers[0, 4 + i], numbers[1, 4 + i], numbers[2, 4 + i],
        )  # fmt: skip
        point[7 + i] = 2.0 * h[1 + i]
        point[13 + i] = 2.0 * f[1 + i] - 2.0 * h[0] * point[7 + i]
    for j in range(changes.shape[2]):
        a, b, c = changes[0], changes[1], changes[2]
        e = _over((a[0, j], a[1, j], a[2, j], a[3, j]), q)
        dh = _over((b[0, j], b[1, j], b[2, j], b[3, j]), q)
        df = _over((c[0, j], c[1, j], c[2, j], c[3, j]), q)
        he, fe = _times(h, e), _times(f, e)
        growth = dh[0] - he[0]
        for i in range(3):
            turning = 2.0 * (dh[1 + i] - he[1 + i])
            seeds[i, j] = 2.0 * e[1 + i]
            seeds[3 + i, j] = a[4 + i, j]
            seeds[6 + i, j] = turning
            seeds[9 + i, j] = b[4 + i, j]
            seeds[12 + i, j] = (
                2.0 * (df[1 + i] - fe[1 + i]) - 2.0 * growth * point[7 + i] - 2.0 * h[0] * turning
            )
            seeds[15 + i, j] = c[4 + i, j]


@njit(cache=True)
def relative_points(x: Array, origin: Array, basis: Array, points: Array, seeds: Array) -> None:
    """Points of coordinates in which quaternion and place are linear.

    Args:
        x: Coordinates and, where there are any, their first and second derivatives by time, shape
            (N, n), (N, 2 n) or (N, 3 n).
        origin: Quaternion and place where all are 0, shape (7,).
        basis: What each coordinate adds to them, shape (7, n).
        points: Gets the points, shape (N, 19).
        seeds: Gets their derivatives, shape (N, `SEEDS`, columns of x).
    """
    n = basis.shape[1]
    orders = x.shape[1] // n
    numbers, changes = np.empty((3, 7)), np.zeros((3, 7, x.shape[1]))
    for order in range(orders):
        for i in range(7):
            for j in range(n):
                changes[order, i, order * n + j] = basis[i, j]
    for row in range(x.shape[0]):
        for order in range(3):
            for i in range(7):
                numbers[order, i] = origin[i] if order == 0 else 0.0
                if order < orders:
                    for j in range(n):
                        numbers[order, i] += basis[i, j] * x[row, order * n + j]
        point_of_numbers(numbers, changes, points[row], seeds[row])


@njit(cache=True)
def body_points(x: Array, points: Array, seeds: Array) -> None:
    """Points of a floating body's state as MultibodyPlant has it.

    Args:
        x: Quaternion wxyz, of any length, and place [m], then V_WP and A_WP, as far as there are
            any, shape (N, 7), (N, 13) or (N, 19).
        points: Gets the points, shape (N, 19).
        seeds: Gets their derivatives, shape (N, `SEEDS`, columns of x).
    """
    numbers, changes = np.zeros((3, 7)), np.zeros((3, 7, x.shape[1]))
    for i in range(7):
        changes[0, i, i] = 1.0
    for row in range(x.shape[0]):
        for i in range(7):
            numbers[0, i] = x[row, i]
        point_of_numbers(numbers, changes, points[row], seeds[row])
        for i in range(7, x.shape[1]):
            points[row, i] = x[row, i]
            seeds[row, i - 1, i] = 1.0


@njit(cache=True, inline="always")
def _turned(half: float, order: int) -> Any:
    """cos and sin of half an angle, or their derivatives by the angle of some order."""
    c, s = np.cos(half), np.sin(half)
    for _ in range(order):
        c, s = -0.5 * s, 0.5 * c
    return c, s


@njit(cache=True)
def _of_angles(half: Array, orders: np.ndarray, out: Array) -> None:
    """Writes qx qy qz of three half angles, or a partial derivative of it, shape (4,)."""
    a, x = _turned(half[0], orders[0])
    b, y = _turned(half[1], orders[1])
    c, z = _turned(half[2], orders[2])
    first = _times((a, x, 0.0, 0.0), (b, 0.0, y, 0.0))
    q = _times(first, (c, 0.0, 0.0, z))
    out[0], out[1], out[2], out[3] = q[0], q[1], q[2], q[3]


@njit(cache=True)
def angle_points(x: Array, points: Array, seeds: Array) -> None:
    """Points of coordinates (x, y, z, phi, theta, psi) [m, rad], R = Rx(phi) Ry(theta) Rz(psi).

    Args:
        x: Coordinates and, where there are any, their first and second derivatives by time, shape
            (N, 6), (N, 12) or (N, 18).
        points: Gets the points, shape (N, 19).
        seeds: Gets their derivatives, shape (N, `SEEDS`, columns of x).
    """
    k = x.shape[1]
    orders = k // 6
    numbers, changes = np.zeros((3, 7)), np.zeros((3, 7, k))
    half, count = np.empty(3), np.zeros(3, np.int64)
    first, second, third = np.empty((3, 4)), np.empty((3, 3, 4)), np.empty(4)
    for order in range(orders):
        for i in range(3):
            changes[order, 4 + i, 6 * order + i] = 1.0
    for row in range(x.shape[0]):
        numbers[:] = 0.0
        changes[:, :4] = 0.0
        for order in range(orders):
            for i in range(3):
                numbers[order, 4 + i] = x[row, 6 * order + i]
        for i in range(3):
            half[i] = 0.5 * x[row, 3 + i]
        count[:] = 0
        _of_angles(half, count, numbers[0])
        for i in range(3):
            count[i] += 1
            _of_angles(half, count, first[i])
            for j in range(3):
                count[j] += 1
                _of_angles(half, count, second[i, j])
                count[j] -= 1
            count[i] -= 1
        for i in range(3):
            for w in range(4):
                changes[0, w, 3 + i] = first[i, w]
        if orders > 1:
            v = x[row, 9:12]
            for i in range(3):
                for w in range(4):
                    numbers[1, w] += first[i, w] * v[i]
                    changes[1, w, 9 + i] = first[i, w]
                    for j in range(3):
                        changes[1, w, 3 + i] += second[i, j, w] * v[j]
        if orders > 2:
            v, a = x[row, 9:12], x[row, 15:18]
            for i in range(3):
                for w in range(4):
                    numbers[2, w] += first[i, w] * a[i]
                    changes[2, w, 15 + i] = first[i, w]
                    for j in range(3):
                        numbers[2, w] += second[i, j, w] * v[i] * v[j]
                        changes[2, w, 3 + i] += second[i, j, w] * a[j]
                        changes[2, w, 9 + i] += 2.0 * second[i, j, w] * v[j]
                for j in range(3):
                    for m in range(3):
                        count[:] = 0
                        count[i] += 1
                        count[j] += 1
                        count[m] += 1
                        _of_angles(half, count, third)
                        for w in range(4):
                            changes[2, w, 3 + i] += third[w] * v[j] * v[m]
        point_of_numbers(numbers, changes, points[row], seeds[row])
