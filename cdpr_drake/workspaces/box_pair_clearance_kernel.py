"""Proofs that two cables stay clear, or do not, at every pose of a box: numba kernels.

Notation and proof stand in `box_verdicts_kernel`, under **Interference**.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from cdpr_drake.arrays import Array
from cdpr_drake.workspaces.box_expansion_kernel import INSIDE, OPEN, OUTSIDE, ROUNDING
from cdpr_drake.workspaces.cable_distance_kernel import segments_shares

PARALLEL = 1e-6
"""Normals are not turned where two directions have a smaller sine or cosine than this."""

FREE_AXIS = 1e-9
"""A normal with a smaller component along an axis of a box leaves an edge or a face of it."""


@njit(cache=True, error_model="numpy")
def dot(x: Array, y: Array) -> float:
    """x.y of shape (3,)."""
    return x[0] * y[0] + x[1] * y[1] + x[2] * y[2]


@njit(cache=True, error_model="numpy")
def least_reach(n: Array, nk: Array, half: Array, Q: Array, sign: float) -> float:
    """Lower bound on n(delta).(Q + sign delta), n(delta) = n + sum delta_k nk[k]."""
    value = dot(n, Q)
    for k in range(3):
        value -= half[k] * abs(sign * n[k] + dot(nk[k], Q))
        if sign != 0.0:
            value -= half[k] * half[k] * abs(nk[k, k])
            for j in range(k):
                value -= half[k] * half[j] * abs(nk[k, j] + nk[j, k])
    return value


@njit(cache=True, error_model="numpy")
def write_blame(n: Array, nk: Array, half: Array, Q: Array, sign: float, blame: Array) -> None:
    """Writes how much each half width takes of a reach; no part of the proof."""
    for k in range(3):
        blame[k] = half[k] * abs(sign * n[k] + dot(nk[k], Q))
        for j in range(3):
            blame[k] += 0.5 * half[k] * half[j] * abs(nk[k, j] + nk[j, k])


@njit(cache=True, error_model="numpy")
def largest_normal(n: Array, nk: Array, half: Array) -> float:
    """Upper bound on |n(delta)|; n is about 1 long."""
    along, across = np.sqrt(dot(n, n)), 0.0
    for k in range(3):
        along += half[k] * abs(dot(nk[k], n))
        across += half[k] * np.sqrt(dot(nk[k], nk[k]))
    return np.sqrt(along * along + across * across) * (1.0 + ROUNDING)


@njit(cache=True, error_model="numpy")
def judge_pair(
    A: Array, B: Array, C: Array, D: Array, half: Array, apart: float, error: float, extent: float,
    n: Array, nk: Array, Q: Array, blame: Array,
) -> tuple[int, float]:  # fmt: skip
    """Verdict on two cables A to B + delta and C to D + delta.

    Args:
        A: Exit point of the first, shape (3,) [m].
        B: Its anchor point at the middle.
        C: Exit point of the second.
        D: Its anchor point at the middle.
        half: Half widths of the position, shape (3,) [m].
        apart: How far their axes must be from each other, more than this [m].
        error: How far points of both may be off together [m].
        extent: Bound on all coordinates [m].
        n: Work space, shape (3,).
        nk: Work space, shape (3, 3).
        Q: Work space, shape (3,).
        blame: Gets how much each half width takes, shape (3,).

    Returns:
        Verdict; where it is open, by how much `INSIDE` is missed, or minus that of `OUTSIDE` [m].
    """
    x, y = segments_shares(A, B, C, D)
    for k in range(3):
        n[k] = A[k] + x * (B[k] - A[k]) - C[k] - y * (D[k] - C[k])
        nk[k, 0] = nk[k, 1] = nk[k, 2] = 0.0
        blame[k] = half[k]
    gap, size = np.sqrt(dot(n, n)), np.sqrt(dot(half, half))
    if gap - size - error > apart + ROUNDING * extent:
        return INSIDE, 0.0
    if gap <= apart:
        missing = gap + abs(x - y) * size + error + ROUNDING * extent - apart
        if missing > 0.0:
            missing = min(
                missing, _touch(A, B, C, D, x, y, half, extent, n, nk, Q, blame) + error - apart
            )
        return (OUTSIDE, 0.0) if missing <= 0.0 else (OPEN, -missing)
    missing = size
    if gap > FREE_AXIS * extent:
        for k in range(3):
            n[k] /= gap
        _turn_with(A, B, C, D, 0.0 < x < 1.0, 0.0 < y < 1.0, n, nk)
        least = np.inf
        for corner in range(4):
            sign = (0.0, 0.0, -1.0, 1.0)[corner]
            for k in range(3):
                first = A[k] if corner in (0, 2) else B[k]
                Q[k] = first - (C[k] if corner in (0, 3) else D[k])
            reach = least_reach(n, nk, half, Q, sign)
            if reach < least:
                least = reach
                write_blame(n, nk, half, Q, sign, blame)
        longest = largest_normal(n, nk, half)
        need = (apart + error) * longest + ROUNDING * extent * (1.0 + 2.0 * longest)
        if least > need:
            return INSIDE, 0.0
        missing = need - least
    return OPEN, missing


@njit(cache=True, error_model="numpy")
def _turn_with(
    A: Array, B: Array, C: Array, D: Array, first: bool, second: bool, n: Array, nk: Array
) -> None:
    """Writes n_k that keep n normal to the cables which it is normal to; no part of the proof."""
    aa = ab = bb = 0.0
    for k in range(3):
        a, b = B[k] - A[k], D[k] - C[k]
        aa += a * a
        ab += a * b
        bb += b * b
    whole = aa * bb - ab * ab
    if first and second and whole > PARALLEL * PARALLEL * aa * bb:
        p, q = (bb - ab) / whole, (aa - ab) / whole
    elif first and aa > 0.0:
        p, q = 1.0 / aa, 0.0
    elif second and bb > 0.0:
        p, q = 0.0, 1.0 / bb
    else:
        return
    for k in range(3):
        for j in range(3):
            nk[k, j] = -n[k] * (p * (B[j] - A[j]) + q * (D[j] - C[j]))


@njit(cache=True, error_model="numpy")
def _touch(
    A: Array, B: Array, C: Array, D: Array, x: float, y: float, half: Array, extent: float,
    n: Array, xk: Array, w: Array, blame: Array,
) -> float:  # fmt: skip
    """How far apart two points x(delta), y(delta) of the cables are at most; infinite: no idea.

    xk[0] and xk[1] get how the shares x and y follow delta; n and w are work space.
    """
    aa = ab = bb = 0.0
    for k in range(3):
        a, b = B[k] - A[k], D[k] - C[k]
        aa += a * a
        ab += a * b
        bb += b * b
    whole = aa * bb - ab * ab
    if not whole > PARALLEL * PARALLEL * aa * bb:
        return np.inf
    most_x = most_y = split = 0.0
    for k in range(3):
        a, b = (y - x) * (B[k] - A[k]), (y - x) * (D[k] - C[k])
        xk[0, k] = (bb * a - ab * b) / whole
        xk[1, k] = (ab * a - aa * b) / whole
        most_x += half[k] * abs(xk[0, k])
        most_y += half[k] * abs(xk[1, k])
        split += half[k] * abs(xk[0, k] - xk[1, k])
    if not (most_x <= x <= 1.0 - most_x and most_y <= y <= 1.0 - most_y):
        return np.inf
    size = np.sqrt(dot(half, half))
    for j in range(3):
        n[j] = A[j] + x * (B[j] - A[j]) - C[j] - y * (D[j] - C[j])
    far = np.sqrt(dot(n, n)) + split * size
    for k in range(3):
        for j in range(3):
            w[j] = xk[0, k] * (B[j] - A[j]) - xk[1, k] * (D[j] - C[j])
        w[k] += x - y
        step = half[k] * np.sqrt(dot(w, w))
        blame[k] = step + half[k] * abs(xk[0, k] - xk[1, k]) * size
        far += step
    return far + ROUNDING * extent * (1.0 + most_x + most_y)
