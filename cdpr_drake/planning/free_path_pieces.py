"""Pieces of a free path from knot to knot: cubic coordinates, and what links them, with Jacobians.

Between knots h = T / parts apart the acceleration of the coordinates goes from a to b, linear in
time; x = (q, v, a, b, T) has what the piece is made of.
"""

from __future__ import annotations

import numpy as np
from scipy.interpolate import CubicSpline

from cdpr_drake.arrays import Array

Shape = tuple[int, int]


def between(x: Array, parts: int, share: float, order: int = 2) -> tuple[Array, Array]:
    """Coordinates and derivatives by time at a share of the way in time from a knot to the next.

    Args:
        x: Coordinates q, their derivatives v and a at the first knot, those b of second order at
            the second, and the time T of the whole motion [s], shape (4 n + 1,).
        parts: Pieces of the whole motion.
        share: 0 at the first knot, 1 at the second.
        order: Derivatives that are wanted, 0 to 2.

    Returns:
        q, and v, a as wanted, shape ((order + 1) n,), and their Jacobian by x.
    """
    n = (len(x) - 1) // 4
    given, h, s = x[: 4 * n].reshape(4, n), x[4 * n] / parts, share
    here = np.array([
        [1.0, s * h, h * h * (0.5 * s * s - s**3 / 6.0), h * h * s**3 / 6.0],
        [0.0, 1.0, h * (s - 0.5 * s * s), h * 0.5 * s * s],
        [0.0, 0.0, 1.0 - s, s],
    ])  # fmt: skip
    by_h = np.array([
        [0.0, s, h * (s * s - s**3 / 3.0), h * s**3 / 3.0],
        [0.0, 0.0, s - 0.5 * s * s, 0.5 * s * s],
        [0.0, 0.0, 0.0, 0.0],
    ])  # fmt: skip
    rows = order + 1
    return (here[:rows] @ given).ravel(), _spread(here[:rows], by_h[:rows] @ given / parts)


def link(x: Array, parts: int) -> tuple[Array, Array]:
    """What is left between the ends of two pieces, 0 where they are one motion, and its Jacobian.

    Args:
        x: q, v and a at a knot, q, v and a at the next, and T, shape (6 n + 1,).
        parts: Pieces of the whole motion.
    """
    n = (len(x) - 1) // 6
    given, h = x[: 6 * n].reshape(6, n), x[6 * n] / parts
    here = np.array([
        [-1.0, -h, -h * h / 3.0, 1.0, 0.0, -h * h / 6.0],
        [0.0, -1.0, -0.5 * h, 0.0, 1.0, -0.5 * h],
    ])  # fmt: skip
    by_h = np.array([
        [0.0, -1.0, -2.0 * h / 3.0, 0.0, 0.0, -h / 3.0],
        [0.0, 0.0, -0.5, 0.0, 0.0, -0.5],
    ])  # fmt: skip
    return (here @ given).ravel(), _spread(here, by_h @ given / parts)


def _spread(weights: Array, last: Array) -> Array:
    """Jacobian of sums of vectors of n numbers with weights, and of one number behind them."""
    rows, n = last.shape
    columns = weights.shape[1]
    out = np.zeros((rows, n, columns * n + 1))
    each = np.arange(n)
    for j in range(columns):
        out[:, each, j * n + each] = weights[:, j, np.newaxis]
    out[:, :, -1] = last
    return out.reshape(rows * n, -1)


def fitted(q: Array, duration: float) -> tuple[Array, Array]:
    """Derivatives at knots of the smooth motion from rest to rest through coordinates there.

    Its pieces are cubic, so that it is one that `link` accepts.

    Args:
        q: Shape (k, n).
        duration: From the first to the last [s].

    Returns:
        First and second derivatives by time, shape (k, n) each.
    """
    times = np.linspace(0.0, duration, len(q))
    spline = CubicSpline(times, q, bc_type="clamped")
    return np.asarray(spline(times, 1)), np.asarray(spline(times, 2))


def samples(q: Array, v: Array, a: Array, duration: float, count: int) -> Array:
    """Coordinates with both derivatives between knots, shape (k - 1, count + 1, 3 n).

    Args:
        q: At the knots, shape (k, n).
        v: Their derivatives.
        a: Their second derivatives.
        duration: Of the motion [s].
        count: Parts into which each piece is cut; the first sample is at a knot, the last at the
            next.
    """
    h = duration / (len(q) - 1)
    s = np.linspace(0.0, 1.0, count + 1)[np.newaxis, :, np.newaxis]
    q0, v0, a0, b = (x[:, np.newaxis] for x in (q[:-1], v[:-1], a[:-1], a[1:]))
    grow = b - a0
    return np.concatenate(
        [
            q0 + s * h * v0 + (s * h) ** 2 * (0.5 * a0 + s * grow / 6.0),
            v0 + s * h * (a0 + 0.5 * s * grow),
            a0 + s * grow,
        ],
        axis=2,
    )
