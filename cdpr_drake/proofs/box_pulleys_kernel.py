"""What pulleys do to cables within a box of poses: points, first order and bounds: numba kernels.

Notation and proof stand in `box_verdicts_kernel`, under **Pulleys at the frame** and **Pulleys at
the platform**.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from cdpr_drake.arrays import Array
from cdpr_drake.geometry.pulley_kernel import PULLEY_RADIUS, tangent
from cdpr_drake.geometry.two_pulleys_kernel import ANCHOR_RADIUS
from cdpr_drake.proofs.box_expansion_kernel import ANCHOR, BEND, EXIT, GAIN, ROUNDING, turn_axes

SWIVEL, ANCHOR_SWIVEL = 10, 14
"""First columns of the axes in a row of `CableSet.packed()`, next to the radii."""

ROUNDS = 30
"""Rounds of seeing each of two pulleys from the other's tangent point, at most."""

MOST_GAIN = 0.5
"""Two pulleys are bounded where a change comes back from the other by no more than this share."""


@njit(cache=True, error_model="numpy")
def straight_points(cables: Array, errors: Array, points: Array, off: Array) -> bool:
    """Writes what no pulley changes, and returns whether there is a pulley.

    Args:
        cables: `CableSet.packed()`, shape (m, 17).
        errors: r_A, r_B [m], shape (2,).
        points: Gets exit points in W and anchor points in P, shape (m, 6) [m].
        off: Gets `EXIT`, `ANCHOR`, `BEND`, `GAIN` of cables without pulleys, shape (m, 4).
    """
    pulleys = False
    for i in range(cables.shape[0]):
        for k in range(6):
            points[i, k] = cables[i, k]
        off[i, EXIT], off[i, ANCHOR], off[i, BEND], off[i, GAIN] = errors[0], errors[1], 0.0, 1.0
        pulleys = pulleys or cables[i, PULLEY_RADIUS] > 0.0 or cables[i, ANCHOR_RADIUS] > 0.0
    return pulleys


@njit(cache=True, error_model="numpy")
def _size(x: Array) -> float:
    return np.sqrt(x[0] * x[0] + x[1] * x[1] + x[2] * x[2])


@njit(cache=True, error_model="numpy")
def _seen(x: Array, n: Array) -> tuple[float, float]:
    """Distance of a point at x from the axis n through the foot, and its height along n [m]."""
    h = x[0] * n[0] + x[1] * n[1] + x[2] * n[2]
    rho = 0.0
    for k in range(3):
        rho += (x[k] - h * n[k]) ** 2
    return np.sqrt(rho), h


@njit(cache=True, error_model="numpy")
def _least(x: Array, n: Array, r: float, half: Array, reach: float) -> tuple[float, float]:
    """Lower bounds on rho and L for points within a box about x and a reach of it; 0: none.

    rho is convex, and so is the distance from the circle's middle from rho = r on: their tangents
    bound them.
    """
    rho, h = _seen(x, n)
    slip = ROUNDING * (rho + abs(h) + r)
    far = np.sqrt((rho - r) ** 2 + h * h)
    if not (rho > slip and far > slip):
        return 0.0, 0.0
    nearer = closer = 0.0
    for k in range(3):
        e = (x[k] - h * n[k]) / rho
        nearer += half[k] * abs(e)
        closer += half[k] * abs((rho - r) * e + h * n[k]) / far
    if rho < r:  # it bends inwards there, but never changes faster than the point moves
        closer = np.sqrt(half[0] ** 2 + half[1] ** 2 + half[2] ** 2)
    rho -= nearer + reach + slip
    far -= closer + reach + slip
    if not (rho > 0.0 and far > r * (1.0 + ROUNDING)):
        return 0.0, 0.0
    return rho, np.sqrt((far - r) * (far + r))


@njit(cache=True, error_model="numpy")
def _touch(x: Array, n: Array, r: float, out: Array) -> None:
    """Writes the tangent point of a cable to x, all seen from the foot of the pulley's axis."""
    rho, h = _seen(x, n)
    _, sine, cosine = tangent(rho, h, r)
    for k in range(3):
        out[k] = r * (1.0 + cosine) * (x[k] - h * n[k]) / rho + r * sine * n[k]


@njit(cache=True, error_model="numpy")
def _first_order(x: Array, n: Array, r: float, N: Array) -> float:
    """Writes N = d(x - tangent point)/dx, shape (3, 3), and returns |N|."""
    rho, h = _seen(x, n)
    L, sine, cosine = tangent(rho, h, r)
    e, y, u, m = np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    for k in range(3):
        e[k] = (x[k] - h * n[k]) / rho
        u[k], m[k] = sine * e[k] - cosine * n[k], cosine * e[k] + sine * n[k]
    for k in range(3):
        a, b = (k + 1) % 3, (k + 2) % 3
        y[k] = n[a] * e[b] - n[b] * e[a]
    along, beside = r / L, r * (1.0 + cosine) / rho
    for j in range(3):
        for k in range(3):
            N[j, k] = along * u[j] * m[k] - beside * y[j] * y[k]
        N[j, j] += 1.0
    return max(0.5 * (along + np.sqrt(along * along + 4.0)), abs(1.0 - beside)) * (1.0 + ROUNDING)


@njit(cache=True, error_model="numpy")
def _bend(r: float, rho: float, L: float) -> float:
    """Bound on the second derivative of the tangent point along a unit vector [1/m]."""
    normal = max(r / (L * L), 2.0 * r / (rho * rho))
    beside = r / (rho * L) + 2.0 * r / (rho * rho)
    along = max(r / (L * L) * (1.0 + r / L), beside)
    return np.sqrt(normal * normal + along * along + beside * beside) * (1.0 + ROUNDING)


@njit(cache=True, error_model="numpy")
def see_pulleys(
    pose: Array, half: Array, cables: Array, errors: Array, first_order: bool, points: Array,
    off: Array, turns: Array,
) -> bool:  # fmt: skip
    """Writes how cables over pulleys run at the middle of a box, and bounds on what changes.

    Where a bound by derivatives is worse, or a cable might not run, it is that of all tangent
    points there are: within 2 r of the exit point, and of the anchor point.

    Args:
        pose: Position [m] and angles [rad], shape (6,).
        half: Half widths of the box, shape (6,).
        cables: `CableSet.packed()`, shape (m, 17).
        errors: r_A, r_B [m], shape (2,).
        first_order: Whether whoever asks follows the first order by N; otherwise all that a tangent
            point moves is in `EXIT` and `ANCHOR`.
        points: Gets tangent points, those at the exit in W, those at the platform in P, where there
            are pulleys, shape (m, 6) [m].
        off: Gets `EXIT`, `ANCHOR`, `BEND`, `GAIN` there, shape (m, 4).
        turns: Gets N of cables with `BEND` above 0, shape (m, 3, 3).

    Returns:
        Whether all cables run at every pose of the box; only then it may be inside.
    """
    R, axes, size, still = np.empty((3, 3)), np.empty((3, 3)), np.empty(3), np.zeros(3)
    x, y, A, B, more = np.empty(3), np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    turn_axes(pose[3:], R, axes)
    shift = _size(half)  # of the position
    turn = half[3] + half[4] + half[5]
    for k in range(3):
        size[k] = half[k]
    own, runs = errors[0] + errors[1], True
    for i in range(cables.shape[0]):
        r, s = cables[i, PULLEY_RADIUS], cables[i, ANCHOR_RADIUS]
        if r == 0.0 and s == 0.0:
            continue
        b, n_A, n_B = cables[i, 3:6], cables[i, SWIVEL:13], cables[i, ANCHOR_SWIVEL:17]
        extent = r + s
        for k in range(3):
            more[k] = cables[i, k] - pose[k]  # from Po to the exit point
            extent += abs(cables[i, k]) + abs(pose[k]) + abs(b[k])
        for k in range(3):
            x[k] = R[k, 0] * b[0] + R[k, 1] * b[1] + R[k, 2] * b[2] - more[k]
            y[k] = R[0, k] * more[0] + R[1, k] * more[1] + R[2, k] * more[2] - b[k]
            A[k], B[k] = 0.0, 0.0  # tangent points, from exit and anchor point
            points[i, k], points[i, 3 + k] = cables[i, k], b[k]
        off[i, EXIT], off[i, ANCHOR] = errors[0] + 2.0 * r, errors[1] + 2.0 * s
        off[i, BEND], off[i, GAIN] = 0.0, 1.0
        a = c = 0.0
        slip = ROUNDING * extent
        reach = turn * _size(b) + own
        if r > 0.0:
            rho, L = _least(x, n_A, r, size, 2.0 * s + reach)
            runs = runs and L > 0.0
            if L == 0.0:
                continue
            a = max(r / L, 2.0 * r / rho) * (1.0 + ROUNDING)
            slip += ROUNDING * extent * (extent / L + extent / rho)
            if s == 0.0 and first_order:
                reach += shift
                bend = 0.5 * _bend(r, rho, L) * reach * reach
                if bend < 2.0 * r:
                    _touch(x, n_A, r, A)
                    off[i, GAIN] = _first_order(x, n_A, r, turns[i])
                    off[i, BEND], off[i, EXIT] = bend, errors[0] + slip
                    for k in range(3):
                        points[i, k] = cables[i, k] + A[k]
                continue
        if s > 0.0:
            reach = 2.0 * r + shift + turn * _size(more) + own  # the box of positions is turned
            rho, L = _least(y, n_B, s, still, reach)
            runs = runs and L > 0.0
            if L == 0.0:
                continue
            c = max(s / L, 2.0 * s / rho) * (1.0 + ROUNDING)
            slip += ROUNDING * extent * (extent / L + extent / rho)
        if a * c > MOST_GAIN:
            runs = False
            continue
        slip += max(1.0, a) / (1.0 - a * c) * _settle(R, x, y, n_A, n_B, r, s, A, B)
        square = 0.0
        for k in range(3):
            more[k] += A[k]
            square += (b[k] + B[k]) ** 2
        moved_A, moved_B = shift + turn * _size(more), shift + turn * np.sqrt(square)
        exit_off = (1.0 + a) * errors[0] + a * (moved_B + (1.0 + c) * errors[1] + c * moved_A)
        exit_off *= (1.0 + ROUNDING) / (1.0 - a * c)
        anchor_off = (1.0 + c) * errors[1] + c * (exit_off + moved_A)
        if exit_off + slip < off[i, EXIT]:
            off[i, EXIT] = exit_off + slip
            for k in range(3):
                points[i, k] += A[k]
        if anchor_off + slip < off[i, ANCHOR]:
            off[i, ANCHOR] = anchor_off + slip
            for k in range(3):
                points[i, 3 + k] += B[k]
    return runs


@njit(cache=True, error_model="numpy")
def _settle(
    R: Array, x: Array, y: Array, n_A: Array, n_B: Array, r: float, s: float, A: Array, B: Array
) -> float:
    """Writes tangent points from exit point, in W, and anchor point, in P; what they are off [m].

    Each is that for the other; what the last round still moved, over 1 - a c, bounds the error.
    """
    seen, before, moved = np.empty(3), np.empty(3), np.inf
    for _ in range(ROUNDS):
        if r > 0.0:
            for k in range(3):
                seen[k] = x[k] + R[k, 0] * B[0] + R[k, 1] * B[1] + R[k, 2] * B[2]
            _touch(seen, n_A, r, A)
        if s == 0.0:
            return 0.0
        for k in range(3):
            before[k] = B[k]
            seen[k] = y[k] + R[0, k] * A[0] + R[1, k] * A[1] + R[2, k] * A[2]
        _touch(seen, n_B, s, B)
        if r == 0.0:
            return 0.0
        last, moved = moved, 0.0
        for k in range(3):
            moved += (B[k] - before[k]) ** 2
        moved = np.sqrt(moved)
        if moved >= last:
            break
    return moved
