"""Numba kernel for the pose of a plane with points on it, from one image.

A homography gives the two poses of a plane that its image allows to first order (IPPE); from each
of them Newton's method leads to a minimum of the squares of the reprojection, in pixels, and the
lower one is the pose. Rotations are matrices all the way, so that half turns are nothing special.
Seen nearly head on, an image with noise leaves residuals that bend the sum of squares as much as
its first derivatives do: there the second ones save tens of steps.

Source: Collins and Bartoli, Infinitesimal plane-based pose estimation, IJCV 109, 2014; Marquardt,
J. SIAM 11, 1963, for the damping; Nocedal and Wright, Numerical Optimization, 3.3 and 10.2, for
the second derivatives.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from cdpr_drake.arrays import Array
from cdpr_drake.numerics.lanes import COUNT, lane_of, load_lanes, no_lanes, store_lanes
from cdpr_drake.numerics.linear_algebra_kernel import eliminate, substitute

STEPS = 300
"""Largest number of steps; about five are needed, more where both minima are nearly one."""

# Only what each step does most is put into it as it is written: numba takes longer for the rest.

SETTLED = 1e-13
"""Where less than this is left, as an angle [rad] or a share of the distance, a step is the last;
rounding of pixels leaves about as much."""

CLOSE = 1e-7
"""Below this size of a step sums of squares tell no more by their digits which pose is better."""

STALLED = 0.9
"""A close step of a larger share of the one before is rounding, and the last."""

TRUSTED = 0.1
"""Largest step whose fall of the sum of squares tells what is to come."""

LARGEST_FALL = 10.0
"""The sum of squares may still fall by this many times what the next step makes of it: steps that
shrink by a tenth only, each a tenth of what is left, add up to so much."""


@njit(error_model="numpy")
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


@njit(error_model="numpy")
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


@njit(error_model="numpy")
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


@njit(error_model="numpy")
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
def _normal_equations(
    xy: Array, uv: Array, camera: Array, R: Array, p: Array, N: Array, C: Array
) -> float:
    """J'J and, as column 6, -J'e of the reprojection, shape (6, 8), the last column zero.

    For a rotation vector and a displacement in C. J'J and C, shape (6, 8), its last columns zero,
    add up to all second derivatives of e'e / 2. The sum of squares e'e is returned [px^2].
    """
    row, total = np.zeros(COUNT), 0.0
    for i in range(6):
        store_lanes(N[i], 0, no_lanes())
        store_lanes(C[i], 0, no_lanes())
    for k in range(xy.shape[0]):
        x, y = xy[k, 0], xy[k, 1]
        rx, ry, rz = (
            R[0, 0] * x + R[0, 1] * y,
            R[1, 0] * x + R[1, 1] * y,
            R[2, 0] * x + R[2, 1] * y,
        )
        near = 1.0 / (rz + p[2])
        gx, gy, gz = 0.0, 0.0, 0.0
        for axis in range(2):
            along = (rx + p[0] if axis == 0 else ry + p[1]) * near
            scale = camera[axis] * near
            e = camera[axis] * along + camera[2 + axis] - uv[k, axis]
            row[3], row[4], row[5] = 0.0, 0.0, -scale * along
            row[3 + axis] = scale
            # The point moves by w x r + d.
            row[0] = ry * row[5] - rz * row[4]
            row[1] = rz * row[3] - rx * row[5]
            row[2] = rx * row[4] - ry * row[3]
            row[6] = -e
            total += e * e
            gx, gy, gz = gx + e * row[3], gy + e * row[4], gz + e * row[5]
            for i in range(6):
                store_lanes(N[i], 0, load_lanes(N[i], 0) + row[i] * load_lanes(row, 0))
        # g is the derivative of e'e / 2 by the point; of what is left of its second derivatives by
        # it, beside J'J, these are (x, z), (y, z) and (z, z), and the others zero.
        hx, hy, hz = -near * gx, -near * gy, -2.0 * near * gz
        C[3, 5] += hx
        C[4, 5] += hy
        C[5, 5] += hz
        a, b, c = hz * ry - hy * rz, hx * rz - hz * rx, hx * ry - hy * rx
        C[0, 3] += hx * ry
        C[0, 4] += hy * ry
        C[0, 5] += a
        C[1, 3] -= hx * rx
        C[1, 4] -= hy * rx
        C[1, 5] += b
        C[2, 5] -= c
        # To second order the point moves by w x (w x r) / 2 more.
        gr = gx * rx + gy * ry + gz * rz
        C[0, 0] += ry * (a - hy * rz) + gx * rx - gr
        C[0, 1] += rz * hx * ry - rx * a + 0.5 * (gx * ry + gy * rx)
        C[0, 2] += 0.5 * (gx * rz + gz * rx) - ry * c
        C[1, 1] += gy * ry - gr - rx * (b + hx * rz)
        C[1, 2] += rx * c + 0.5 * (gy * rz + gz * ry)
        C[2, 2] += gz * rz - gr
    for i in range(6):
        for j in range(i):
            C[i, j] = C[j, i]
    return total


@njit(error_model="numpy")
def _solve(N: Array, C: Array, damping: float, S: Array, x: Array) -> bool:
    """x with (N + C + damping diag N) x = column 6 of N, shape (6, 8), by Gauss; without C, and
    False, where that matrix is not positive definite."""
    for weight in (1.0, 0.0):
        for i in range(6):
            store_lanes(S[i], 0, load_lanes(N[i], 0) + weight * load_lanes(C[i], 0))
            S[i, i] += damping * N[i, i]
        definite = True
        for k in range(6):  # a positive definite matrix needs no other order of pivots
            top = load_lanes(S[k], 0)
            pivot = lane_of(top, k)
            definite = definite and pivot > 0.0
            share = 1.0 / pivot
            for i in range(k + 1, 6):
                store_lanes(S[i], 0, load_lanes(S[i], 0) - S[i, k] * share * top)
        if definite:
            break
    for i in range(5, -1, -1):
        x[i] = S[i, 6]
        for j in range(i + 1, 6):
            x[i] -= S[i, j] * x[j]
        x[i] /= S[i, i]
    return weight > 0.0


@njit(error_model="numpy")
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
def _least_reprojection(
    xy: Array, uv: Array, camera: Array, R: Array, p: Array, bound: float
) -> float:
    """Moves a pose to the minimum that it belongs to; the sum of squares there [px^2].

    Infinite, and the pose anywhere, where the minimum lies above a bound [px^2].
    """
    N, C, S = np.empty((6, COUNT)), np.empty((6, COUNT)), np.empty((6, COUNT))
    x = np.zeros(6)
    R_next, p_next = np.empty((3, 3)), np.empty(3)
    error, damping, before, close = np.inf, 1e-6, np.inf, False
    for _ in range(STEPS):
        _turned(R, x, R_next)
        for i in range(3):
            p_next[i] = p[i] + x[3 + i]
        new = _normal_equations(xy, uv, camera, R_next, p_next, N, C)
        if close or new <= error:
            error = new
            damping *= 0.1
            for i in range(3):
                p[i] = p_next[i]
                for j in range(3):
                    R[i, j] = R_next[i, j]
        else:  # also where it is not a number: back, to find the same sum and go on from it
            damping = max(damping, 1e-12) * 100.0
            before = np.inf
            for i in range(6):
                x[i] = 0.0
            if damping > 1e12 or not error < np.inf:
                break
            continue
        is_newton = _solve(N, C, damping, S, x)
        turn = np.sqrt(x[0] * x[0] + x[1] * x[1] + x[2] * x[2])
        move = np.sqrt(x[3] * x[3] + x[4] * x[4] + x[5] * x[5])
        size, fall = max(turn, move / abs(p[2])), 0.0
        for i in range(6):
            fall += x[i] * N[i, 6]
        if size < TRUSTED and error - LARGEST_FALL * fall > bound:
            return np.inf
        close = size < CLOSE
        # What is left after a step is about as much smaller than it as it is than the one before,
        # and after one of Newton's as the square of that.
        share = min(size / before, 1.0)
        if is_newton:
            share *= share
        if close and (size * share < SETTLED or size > STALLED * before):
            _turned(R, x, R_next)
            for i in range(3):
                p[i] += x[3 + i]
                for j in range(3):
                    R[i, j] = R_next[i, j]
            break
        before = size
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
    H, R = np.empty((3, 3)), np.empty((2, 3, 3))
    _homography(xy, image, H)
    _two_rotations(H, R)
    # The better start goes first, to spare the other most of its way.
    places, starts = np.empty((2, 3)), np.empty(2)
    for k in range(2):
        _position(xy, image, R[k], places[k])
        starts[k] = _squares(xy, uv, camera, R[k], places[k])
    best, found, first = np.inf, False, 1 if starts[1] < starts[0] else 0
    for turn in range(2):
        k = first if turn == 0 else 1 - first
        p = places[k]
        error = _least_reprojection(xy, uv, camera, R[k], p, best)
        if error < best and p[2] > 0.0:
            best, found = error, True
            for i in range(3):
                p_CO[i] = size * p[i] - R[k, i, 0] * mx - R[k, i, 1] * my
                for j in range(3):
                    R_CO[i, j] = R[k, i, j]
    return found and p_CO[2] > 0.0
