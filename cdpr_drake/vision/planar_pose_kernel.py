"""Numba kernel for the pose of a plane with points on it, from one image.

A homography gives the two poses of a plane that its image allows to first order (IPPE); from each
of them least squares over the reprojection, in pixels, leads to a minimum, and the lower one is the
pose. Rotations are matrices all the way, so that half turns are nothing special.

Source: Collins and Bartoli, Infinitesimal plane-based pose estimation, IJCV 109, 2014; Marquardt,
J. SIAM 11, 1963, for the least squares.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from cdpr_drake.arrays import Array
from cdpr_drake.numerics.lanes import COUNT, lane_of, load_lanes, no_lanes, store_lanes
from cdpr_drake.numerics.linear_algebra_kernel import eliminate, substitute

STEPS = 300
"""Largest number of steps of the least squares; about five are needed, more where both minima are
nearly one."""

# Its parts are put into it as they are written: a kernel of kernels compiles all of them anew.

SETTLED = 1e-13
"""A step that turns [rad] and moves, as a share of the distance, by less is the last."""


@njit(error_model="numpy", inline="always")
def _homography(xy: Array, image: Array, H: Array) -> None:
    """H with (u, v, 1)' ~ H (x, y, 1)' at unit focal length, its last number 1.

    Args:
        xy: Points in the plane about their mean, of a size near 1, shape (n, 2) [-].
        image: Their images, shape (n, 2) [-].
        H: Gets the matrix, shape (3, 3).
    """
    A, b, row, pivots = np.zeros((8, 8)), np.zeros(8), np.empty(8), np.empty(8)
    for k in range(xy.shape[0]):
        for axis in range(2):
            for i in range(8):
                row[i] = 0.0
            x, y, seen = xy[k, 0], xy[k, 1], image[k, axis]
            row[3 * axis], row[3 * axis + 1], row[3 * axis + 2] = x, y, 1.0
            row[6], row[7] = -seen * x, -seen * y
            for i in range(8):
                b[i] += row[i] * seen
                for j in range(8):
                    A[i, j] += row[i] * row[j]
    n = A.shape[0]  # written out, 8 would have these kernels compiled once more
    eliminate(A, n, pivots)
    substitute(A, n, pivots, b)
    for i in range(8):
        H[i // 3, i % 3] = b[i]
    H[2, 2] = 1.0


@njit(error_model="numpy", inline="always")
def _two_rotations(H: Array, R: Array) -> None:
    """The rotations that a homography allows at the plane's origin, shape (2, 3, 3)."""
    p, q = H[0, 2], H[1, 2]
    s = np.sqrt(1.0 + p * p + q * q)
    f = 1.0 / (s * (s + 1.0))
    # Turns z of C to the line of sight.
    V = np.empty((3, 3))
    V[0, 0], V[0, 1], V[0, 2] = 1.0 - f * p * p, -f * p * q, p / s
    V[1, 0], V[1, 1], V[1, 2] = -f * p * q, 1.0 - f * q * q, q / s
    V[2, 0], V[2, 1], V[2, 2] = -p / s, -q / s, 1.0 / s
    b00, b01 = V[0, 0] - p * V[2, 0], V[0, 1] - p * V[2, 1]
    b10, b11 = V[1, 0] - q * V[2, 0], V[1, 1] - q * V[2, 1]
    det = b00 * b11 - b01 * b10
    j00, j01 = H[0, 0] - H[2, 0] * p, H[0, 1] - H[2, 1] * p
    j10, j11 = H[1, 0] - H[2, 0] * q, H[1, 1] - H[2, 1] * q
    a00, a01 = (b11 * j00 - b01 * j10) / det, (b11 * j01 - b01 * j11) / det
    a10, a11 = (b00 * j10 - b10 * j00) / det, (b00 * j11 - b10 * j01) / det
    m00, m01, m11 = a00 * a00 + a01 * a01, a00 * a10 + a01 * a11, a10 * a10 + a11 * a11
    largest = np.sqrt(0.5 * (m00 + m11 + np.sqrt((m00 - m11) ** 2 + 4.0 * m01 * m01)))
    a00, a01, a10, a11 = a00 / largest, a01 / largest, a10 / largest, a11 / largest
    c0 = np.sqrt(max(1.0 - a00 * a00 - a10 * a10, 0.0))
    c1 = np.sqrt(max(1.0 - a01 * a01 - a11 * a11, 0.0))
    if a00 * a01 + a10 * a11 > 0.0:
        c1 = -c1
    T = np.empty((3, 3))
    for k in range(2):
        sign = 1.0 - 2.0 * k
        d0, d1 = sign * c0, sign * c1
        T[0, 0], T[0, 1], T[0, 2] = a00, a01, a10 * d1 - d0 * a11
        T[1, 0], T[1, 1], T[1, 2] = a10, a11, d0 * a01 - a00 * d1
        T[2, 0], T[2, 1], T[2, 2] = d0, d1, a00 * a11 - a01 * a10
        for i in range(3):
            for j in range(3):
                R[k, i, j] = V[i, 0] * T[0, j] + V[i, 1] * T[1, j] + V[i, 2] * T[2, j]


@njit(error_model="numpy", inline="always")
def _position(xy: Array, image: Array, R: Array, p: Array) -> None:
    """Position for a rotation, linear least squares at unit focal length."""
    A, pivots = np.zeros((3, 3)), np.empty(3)
    p[0], p[1], p[2] = 0.0, 0.0, 0.0
    for k in range(xy.shape[0]):
        x, y = xy[k, 0], xy[k, 1]
        depth = R[2, 0] * x + R[2, 1] * y
        for axis in range(2):
            seen = image[k, axis]
            right = seen * depth - (R[axis, 0] * x + R[axis, 1] * y)
            A[axis, axis] += 1.0
            A[axis, 2] -= seen
            A[2, axis] -= seen
            A[2, 2] += seen * seen
            p[axis] += right
            p[2] -= seen * right
    eliminate(A, A.shape[0], pivots)
    substitute(A, A.shape[0], pivots, p)


@njit(error_model="numpy", inline="always")
def _squares(xy: Array, uv: Array, camera: Array, R: Array, p: Array) -> float:
    """Sum of squares e'e of the reprojection [px^2]."""
    total = 0.0
    for k in range(xy.shape[0]):
        x, y = xy[k, 0], xy[k, 1]
        Z = R[2, 0] * x + R[2, 1] * y + p[2]
        for axis in range(2):
            along = R[axis, 0] * x + R[axis, 1] * y + p[axis]
            e = camera[axis] * along / Z + camera[2 + axis] - uv[k, axis]
            total += e * e
    return total


@njit(error_model="numpy", inline="always")
def _normal_equations(xy: Array, uv: Array, camera: Array, R: Array, p: Array, N: Array) -> None:
    """J'J and, as column 6, -J'e of the reprojection, shape (6, 8), the last column zero.

    For a rotation vector and a displacement in C.
    """
    row = np.zeros(COUNT)
    for i in range(6):
        store_lanes(N[i], 0, no_lanes())
    for k in range(xy.shape[0]):
        x, y = xy[k, 0], xy[k, 1]
        rx, ry, rz = (
            R[0, 0] * x + R[0, 1] * y,
            R[1, 0] * x + R[1, 1] * y,
            R[2, 0] * x + R[2, 1] * y,
        )
        Z = rz + p[2]
        for axis in range(2):
            f = camera[axis]
            along = rx + p[0] if axis == 0 else ry + p[1]
            e = f * along / Z + camera[2 + axis] - uv[k, axis]
            row[3], row[4], row[5] = 0.0, 0.0, -f * along / (Z * Z)
            row[3 + axis] = f / Z
            # The point moves by w x r + d.
            row[0] = ry * row[5] - rz * row[4]
            row[1] = rz * row[3] - rx * row[5]
            row[2] = rx * row[4] - ry * row[3]
            row[6] = -e
            for i in range(6):
                store_lanes(N[i], 0, load_lanes(N[i], 0) + row[i] * load_lanes(row, 0))


@njit(error_model="numpy", inline="always")
def _solve(N: Array, damping: float, S: Array, x: Array) -> None:
    """x with (N + damping diag N) x = column 6 of N, shape (6, 8), by Gauss with row pivots."""
    for i in range(6):
        store_lanes(S[i], 0, load_lanes(N[i], 0))
        S[i, i] *= 1.0 + damping
    for k in range(6):
        best = k
        for i in range(k + 1, 6):
            if abs(S[i, k]) > abs(S[best, k]):
                best = i
        top = load_lanes(S[best], 0)
        if best != k:
            store_lanes(S[best], 0, load_lanes(S[k], 0))
            store_lanes(S[k], 0, top)
        pivot = lane_of(top, k)
        for i in range(k + 1, 6):
            store_lanes(S[i], 0, load_lanes(S[i], 0) - S[i, k] / pivot * top)
    for i in range(5, -1, -1):
        x[i] = S[i, 6]
        for j in range(i + 1, 6):
            x[i] -= S[i, j] * x[j]
        x[i] /= S[i, i]


@njit(error_model="numpy", inline="always")
def _turned(R: Array, w: Array, out: Array) -> None:
    """exp([w]x) R, shape (3, 3)."""
    angle = np.sqrt(w[0] * w[0] + w[1] * w[1] + w[2] * w[2])
    a, b = 1.0, 0.5
    if angle > 1e-8:
        a, b = np.sin(angle) / angle, (1.0 - np.cos(angle)) / (angle * angle)
    x, y, z = w[0], w[1], w[2]
    E = np.empty((3, 3))
    E[0, 0], E[0, 1], E[0, 2] = 1.0 - b * (y * y + z * z), b * x * y - a * z, b * x * z + a * y
    E[1, 0], E[1, 1], E[1, 2] = b * x * y + a * z, 1.0 - b * (x * x + z * z), b * y * z - a * x
    E[2, 0], E[2, 1], E[2, 2] = b * x * z - a * y, b * y * z + a * x, 1.0 - b * (x * x + y * y)
    for i in range(3):
        for j in range(3):
            out[i, j] = E[i, 0] * R[0, j] + E[i, 1] * R[1, j] + E[i, 2] * R[2, j]


@njit(error_model="numpy", inline="always")
def _least_reprojection(xy: Array, uv: Array, camera: Array, R: Array, p: Array) -> float:
    """Moves a pose to the minimum that it belongs to; the sum of squares there [px^2]."""
    N, S, x = np.empty((6, COUNT)), np.empty((6, COUNT)), np.zeros(6)
    R_next, p_next = np.empty((3, 3)), np.empty(3)
    error, damping = np.inf, 1e-6
    for step in range(STEPS):
        if step > 0:
            _solve(N, damping, S, x)
        _turned(R, x, R_next)
        for i in range(3):
            p_next[i] = p[i] + x[3 + i]
        # At the minimum most steps end above it by rounding: they need no derivatives.
        new = _squares(xy, uv, camera, R_next, p_next)
        turn = np.sqrt(x[0] * x[0] + x[1] * x[1] + x[2] * x[2])
        move = np.sqrt(x[3] * x[3] + x[4] * x[4] + x[5] * x[5])
        last = step > 0 and turn < SETTLED and move < SETTLED * abs(p[2])
        if new <= error:
            error = new
            damping *= 0.1
            for i in range(3):
                p[i] = p_next[i]
                for j in range(3):
                    R[i, j] = R_next[i, j]
            _normal_equations(xy, uv, camera, R, p, N)
        else:  # also where it is not a number
            damping = max(damping, 1e-12) * 10.0
        if last or damping > 1e12 or not error < np.inf:
            break
    return error


@njit(cache=True, error_model="numpy")
def planar_pose(p_OK: Array, uv: Array, camera: Array, R_CO: Array, p_CO: Array) -> bool:
    """The pose of an object from the images of points in its plane z = 0.

    Args:
        p_OK: At least four points in O that are not on a line, shape (n, 3) [m]; z is not read.
        uv: Their images, shape (n, 2) [px].
        camera: fx, fy, cx, cy of the pinhole [px].
        R_CO: Gets the rotation, shape (3, 3).
        p_CO: Gets the position, shape (3,) [m].

    Returns:
        Whether there is one in front of the camera.
    """
    n = p_OK.shape[0]
    mx, my, size = 0.0, 0.0, 0.0
    for k in range(n):
        mx += p_OK[k, 0] / n
        my += p_OK[k, 1] / n
    for k in range(n):
        size += ((p_OK[k, 0] - mx) ** 2 + (p_OK[k, 1] - my) ** 2) / n
    size = np.sqrt(size)
    xy, image = np.empty((n, 2)), np.empty((n, 2))
    for k in range(n):
        xy[k, 0], xy[k, 1] = (p_OK[k, 0] - mx) / size, (p_OK[k, 1] - my) / size
        image[k, 0] = (uv[k, 0] - camera[2]) / camera[0]
        image[k, 1] = (uv[k, 1] - camera[3]) / camera[1]
    H, R, p = np.empty((3, 3)), np.empty((2, 3, 3)), np.empty(3)
    _homography(xy, image, H)
    _two_rotations(H, R)
    best, found = np.inf, False
    for k in range(2):
        _position(xy, image, R[k], p)
        error = _least_reprojection(xy, uv, camera, R[k], p)
        if error < best and p[2] > 0.0:
            best, found = error, True
            for i in range(3):
                p_CO[i] = size * p[i] - R[k, i, 0] * mx - R[k, i, 1] * my
                for j in range(3):
                    R_CO[i, j] = R[k, i, j]
    return found and p_CO[2] > 0.0
