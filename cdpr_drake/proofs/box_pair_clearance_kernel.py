"""Proofs that two cables stay clear, or do not, at every pose of a box: numba kernels.

Notation and proof stand in `box_verdicts_kernel`, under **Interference**.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from cdpr_drake.arrays import Array
from cdpr_drake.proofs.box_expansion_kernel import INSIDE, OPEN, OUTSIDE, ROUNDING
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
def least_reach(
    n: Array, nk: Array, half: Array, numbers: int, Q: Array, moves: Array, still: bool
) -> float:
    """Lower bound on n(delta).(Q + sum delta_k m_k), n(delta) = n + sum delta_k nk[k].

    Args:
        n: Shape (3,).
        nk: Shape (6, 3).
        half: Half widths of a pose, shape (6,).
        numbers: So many of them, the first, vary.
        Q: Shape (3,) [m].
        moves: m_k, shape (6, 3).
        still: Whether all m_k are zero.
    """
    value = dot(n, Q)
    for k in range(numbers):
        if half[k] == 0.0:
            continue
        if still:
            value -= half[k] * abs(dot(nk[k], Q))
            continue
        value -= half[k] * abs(dot(n, moves[k]) + dot(nk[k], Q))
        value -= half[k] * half[k] * abs(dot(nk[k], moves[k]))
        for j in range(k):
            value -= half[k] * half[j] * abs(dot(nk[k], moves[j]) + dot(nk[j], moves[k]))
    return value


@njit(cache=True, error_model="numpy")
def write_blame(
    n: Array, nk: Array, half: Array, numbers: int, Q: Array, moves: Array, still: bool,
    blame: Array,
) -> None:  # fmt: skip
    """Writes how much each half width takes of a reach; no part of the proof."""
    for k in range(numbers):
        blame[k] = half[k] * abs((0.0 if still else dot(n, moves[k])) + dot(nk[k], Q))
        for j in range(numbers):
            if still and (k > 2 or j > 2):
                continue
            mixed = nk[k, j] + nk[j, k] if still else dot(nk[k], moves[j]) + dot(nk[j], moves[k])
            blame[k] += 0.5 * half[k] * half[j] * abs(mixed)


@njit(cache=True, error_model="numpy")
def largest_normal(n: Array, nk: Array, half: Array, numbers: int) -> float:
    """Upper bound on |n(delta)|; n is about 1 long."""
    along, across = np.sqrt(dot(n, n)), 0.0
    for k in range(numbers):
        along += half[k] * abs(dot(nk[k], n))
        across += half[k] * np.sqrt(dot(nk[k], nk[k]))
    return np.sqrt(along * along + across * across) * (1.0 + ROUNDING)


@njit(cache=True, error_model="numpy")
def swing(moves: Array, half: Array, numbers: int) -> float:
    """How far a point is moved by the angles at most, to first order [m]."""
    found = 0.0
    for k in range(3, numbers):
        found += half[k] * np.sqrt(dot(moves[k], moves[k]))
    return found


@njit(cache=True, error_model="numpy")
def judge_pair(
    A: Array, B: Array, C: Array, D: Array, first: Array, second: Array, half: Array, numbers: int,
    apart: float, error: float, extent: float, n: Array, nk: Array, Q: Array, moves: Array,
    blame: Array,
) -> tuple[int, float]:  # fmt: skip
    """Verdict on two cables A to B + sum delta_k B^k and C to D + sum delta_k D^k.

    Args:
        A: Exit point of the first, shape (3,) [m].
        B: Its anchor point at the middle.
        C: Exit point of the second.
        D: Its anchor point at the middle.
        first: B^k, shape (6, 3); of the position the axes.
        second: D^k, likewise.
        half: Half widths of the pose, shape (6,) [m, rad].
        numbers: So many of them, the first, vary: 3 or 6.
        apart: How far their axes must be from each other, more than this [m].
        error: How far points of both may be off together, beside that [m].
        extent: Bound on all coordinates [m].
        n: Work space, shape (3,).
        nk: Work space, shape (6, 3).
        Q: Work space, shape (3,).
        moves: Work space, shape (6, 3).
        blame: Gets how much each half width takes, shape (6,).

    Returns:
        Verdict; where it is open, by how much `INSIDE` is missed, or minus that of `OUTSIDE` [m].
    """
    x, y = segments_shares(A, B, C, D)
    for k in range(3):
        n[k] = A[k] + x * (B[k] - A[k]) - C[k] - y * (D[k] - C[k])
        blame[k] = half[k]
    for k in range(3, numbers):
        blame[k] = half[k] * np.sqrt(max(dot(first[k], first[k]), dot(second[k], second[k])))
    nk[:] = 0.0
    gap = np.sqrt(dot(n, n))
    size = np.sqrt(half[0] * half[0] + half[1] * half[1] + half[2] * half[2])
    turned = swing(first, half, numbers), swing(second, half, numbers)
    if gap - size - turned[0] - turned[1] - error > apart + ROUNDING * extent:
        return INSIDE, 0.0
    if gap <= apart:
        missing = gap + abs(x - y) * size + error + ROUNDING * extent - apart
        missing += x * turned[0] + y * turned[1]
        if missing > 0.0:
            far = _touch(
                A, B, C, D, first, second, x, y, half, numbers, turned, extent, n, nk, Q, blame
            )
            missing = min(missing, far + error - apart)
        return (OUTSIDE, 0.0) if missing <= 0.0 else (OPEN, -missing)
    missing = size + turned[0] + turned[1]
    if gap > FREE_AXIS * extent:
        for k in range(3):
            n[k] /= gap
        _turn_with(A, B, C, D, first, second, 0.0 < x < 1.0, 0.0 < y < 1.0, numbers, n, nk)
        least = np.inf
        for corner in range(4):
            still = corner == 0 or (corner == 1 and numbers == 3)
            for k in range(3):
                start = A[k] if corner in (0, 2) else B[k]
                Q[k] = start - (C[k] if corner in (0, 3) else D[k])
                for j in range(numbers):
                    moves[j, k] = first[j, k] if corner in (1, 3) else 0.0
                    moves[j, k] -= second[j, k] if corner in (1, 2) else 0.0
            reach = least_reach(n, nk, half, numbers, Q, moves, still)
            if reach < least:
                least = reach
                write_blame(n, nk, half, numbers, Q, moves, still, blame)
        longest = largest_normal(n, nk, half, numbers)
        need = (apart + error) * longest + ROUNDING * extent * (1.0 + 2.0 * longest)
        if least > need:
            return INSIDE, 0.0
        missing = need - least
    return OPEN, missing


@njit(cache=True, error_model="numpy")
def _turn_with(
    A: Array, B: Array, C: Array, D: Array, first: Array, second: Array, on_first: bool,
    on_second: bool, numbers: int, n: Array, nk: Array,
) -> None:  # fmt: skip
    """Writes n_k that keep n normal to the cables which it is normal to; no part of the proof."""
    aa = ab = bb = 0.0
    for k in range(3):
        a, b = B[k] - A[k], D[k] - C[k]
        aa += a * a
        ab += a * b
        bb += b * b
    whole = aa * bb - ab * ab
    both = on_first and on_second and whole > PARALLEL * PARALLEL * aa * bb
    if not both and not (on_first and aa > 0.0) and not (on_second and bb > 0.0):
        return
    for k in range(numbers):
        # nk.(B - A) = -n.B^k and nk.(D - C) = -n.D^k; those of the position are the same.
        u = 1.0 if k < 3 else dot(n, first[k])
        v = 1.0 if k < 3 else dot(n, second[k])
        if both:
            p, q = (bb * u - ab * v) / whole, (aa * v - ab * u) / whole
        elif on_first and aa > 0.0:
            p, q = u / aa, 0.0
        else:
            p, q = 0.0, v / bb
        for j in range(3):
            nk[k, j] = -(n[k] if k < 3 else 1.0) * (p * (B[j] - A[j]) + q * (D[j] - C[j]))


@njit(cache=True, error_model="numpy")
def _touch(
    A: Array, B: Array, C: Array, D: Array, first: Array, second: Array, x: float, y: float,
    half: Array, numbers: int, turned: tuple[float, float], extent: float, n: Array, xk: Array,
    w: Array, blame: Array,
) -> float:  # fmt: skip
    """How far apart two points x(delta), y(delta) of the cables are at most; infinite: no idea.

    xk[:, 0] and xk[:, 1] get how the shares x and y follow delta; n and w are work space.
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
    for k in range(numbers):
        a = b = 0.0
        for j in range(3):
            m = y * second[k, j] - x * first[k, j]
            a += m * (B[j] - A[j])
            b += m * (D[j] - C[j])
        xk[k, 0] = (bb * a - ab * b) / whole
        xk[k, 1] = (ab * a - aa * b) / whole
        most_x += half[k] * abs(xk[k, 0])
        most_y += half[k] * abs(xk[k, 1])
        split += half[k] * abs(xk[k, 0] - xk[k, 1])
    if not (most_x <= x <= 1.0 - most_x and most_y <= y <= 1.0 - most_y):
        return np.inf
    size = np.sqrt(half[0] * half[0] + half[1] * half[1] + half[2] * half[2])
    for j in range(3):
        n[j] = A[j] + x * (B[j] - A[j]) - C[j] - y * (D[j] - C[j])
    far = np.sqrt(dot(n, n)) + split * size + most_x * turned[0] + most_y * turned[1]
    for k in range(numbers):
        for j in range(3):
            w[j] = xk[k, 0] * (B[j] - A[j]) - xk[k, 1] * (D[j] - C[j])
            w[j] += x * first[k, j] - y * second[k, j]
        step = half[k] * np.sqrt(dot(w, w))
        blame[k] = step + half[k] * abs(xk[k, 0] - xk[k, 1]) * size
        blame[k] += half[k] * (abs(xk[k, 0]) * turned[0] + abs(xk[k, 1]) * turned[1])
        far += step
    return far + ROUNDING * extent * (1.0 + most_x + most_y)
