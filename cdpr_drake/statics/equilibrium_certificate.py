"""Proof by intervals that near a pose there is one pose of rest and no other.

Krawczyk's operator K = x - C F(x) + (1 - C J(X)) (X - x) of the equations of rest, with C about
J(x)^-1: where K lies inside the box X, the equations have exactly one solution in X. The equations
are those of `rest_equations`, here in real numbers with the scale alpha = q of the pose itself, and
their constants are the doubles that they are given as.

Source: Moore, Kearfott and Cloud, Introduction to Interval Analysis, 2009, theorem 8.3.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cdpr_drake.arrays import Array
from cdpr_drake.numerics.interval_arithmetic import (
    Interval,
    cross,
    dot,
    matrix_product,
    stacked,
    total,
)

RADII = (1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8)
"""Half the boxes that are tried, relative to the scale of lengths, the largest first."""

SHARP = 1e-10
"""Half the box in which the solution itself is sought, so that much can be said of it."""

NEWTON_STEPS = 5
"""From a pose to the best that doubles can say."""


@dataclass(frozen=True, eq=False)
class ProvenBox:
    """A box with exactly one solution.

    Attributes:
        radius: Half its width of the position [m].
        off: How far the solution is from the pose at most: position [m], quaternion (of length
            one) [-].
        tense: Whether all tensions are proven to be positive.
    """

    radius: float
    off: tuple[float, float]
    tense: bool


def prove_rest(
    constants: Array, x: Array, rows: np.ndarray, columns: np.ndarray
) -> ProvenBox | None:
    """The largest box about a solution in which the equations have no other, or None.

    Args:
        constants: As of `rest_equations`, real, in metres, shape (k + 1, 7).
        x: A solution but for rounding: p (3) [m], q (4), lambda (k) [1/m].
        rows: Equations that hold.
        columns: Unknowns that are not fixed.
    """
    k = len(constants) - 1
    scale = 1.0 + float(np.max(np.abs(constants[:k, :3] - x[:3])))
    alpha = x[3:7] / np.linalg.norm(x[3:7])
    x = x.copy()
    x[3:7] = alpha
    given = x.copy()
    widths = np.ones(k + 7)
    widths[:3] = scale
    widths[7:] = 1.0 / scale
    for _ in range(NEWTON_STEPS):
        F, J = _equations(constants, Interval.of(x), alpha)
        f, slope = _middle(F)[rows], _middle(J)[np.ix_(rows, columns)]
        try:
            x[columns] -= np.linalg.solve(slope, f)
        except np.linalg.LinAlgError:
            return None
    F, J = _equations(constants, Interval.of(x), alpha)
    try:
        C = np.linalg.inv(_middle(J)[np.ix_(rows, columns)])
    except np.linalg.LinAlgError:
        return None
    if not np.all(np.isfinite(C)):
        return None
    newton = matrix_product(C, F[rows])

    def enclosure(radius: float) -> Interval | None:
        """Where the solution is, relative to x, if one is in the box."""
        reach = np.zeros(k + 7)
        reach[columns] = radius * widths[columns]
        _, slopes = _equations(constants, Interval(x - reach, x + reach), alpha)
        rest = Interval.of(np.eye(len(rows))) - matrix_product(C, slopes[np.ix_(rows, columns)])
        around = Interval(-reach[columns], reach[columns])
        off = total((rest * around).transposed()) - newton
        inside = np.all(off.low > around.low) and np.all(off.high < around.high)
        return off if inside else None

    for radius in RADII:
        off = enclosure(radius)
        if off is None:
            continue
        sharp = enclosure(SHARP)
        off = off if sharp is None else sharp
        far = np.zeros(k + 7)
        far[columns] = np.maximum(-off.low, off.high)
        position = float(np.linalg.norm(far[:3] + np.abs(x[:3] - given[:3])))
        turn = float(np.linalg.norm(far[3:7] + np.abs(x[3:7] - given[3:7])))
        return ProvenBox(radius * scale, (position, turn), bool(np.all(x[7:] - far[7:] > 0.0)))
    return None


def _equations(P: Array, x: Interval, alpha: Array) -> tuple[Interval, Interval]:
    """Left sides and Jacobian of the equations of rest over a box, see `rest_equations`."""
    k = len(P) - 1
    n = k + 7
    p, q, tight = x[0:3], x[3:7], x[7:]
    a, b, L = (Interval.of(P[:k, s].T) for s in (slice(0, 3), slice(3, 6), 6))
    c, w = Interval.of(P[k, 0:3]), Interval.of(P[k, 3:6])
    D = dot(q, q)
    d = stacked([p[r] - a[r] for r in range(3)])
    B, dB = _turned(q, b), _turned_slopes(q, b)
    M, dM = _turned(q, c), _turned_slopes(q, c)
    square = dot(d, d) + dot(b, b) - L
    pull, moment = d * D + B, cross(B, d)
    zero = Interval.of(0.0)
    F: list[Interval] = [zero] * n
    J: list[list[Interval]] = [[zero] * n for _ in range(n)]
    length = D * square + dot(d, B).times(2.0)
    load, turn = cross(M, w), [cross(slope, w) for slope in dM]
    for i in range(k):
        F[i] = length[i]
        for r in range(3):
            J[i][r] = (D * d[r, i] + B[r, i]).times(2.0)
        for j in range(4):
            J[i][3 + j] = (q[j] * square[i] + dot(d[:, i], dB[j][:, i])).times(2.0)
    by_turn = [cross(slope, d) for slope in dB]
    for r in range(3):
        f, g = k + r, k + 3 + r
        s, t = (r + 1) % 3, (r + 2) % 3
        F[f] = dot(tight, pull[r]) - D * w[r]
        F[g] = dot(tight, moment[r]) - load[r]
        J[f][r] = total(tight) * D
        J[g][t] = dot(tight, B[s])
        J[g][s] = -dot(tight, B[t])
        for i in range(k):
            J[f][7 + i], J[g][7 + i] = pull[r, i], moment[r, i]
        for j in range(4):
            both = dot(tight, (q[j] * d[r]).times(2.0) + dB[j][r])
            J[f][3 + j] = both - (q[j] * w[r]).times(2.0)
            J[g][3 + j] = dot(tight, by_turn[j][r]) - turn[j][r]
    F[n - 1] = dot(Interval.of(alpha), q) - Interval.of(alpha @ alpha)
    for j in range(4):
        J[n - 1][3 + j] = Interval.of(alpha[j])
    return stacked(F), stacked([stacked(row) for row in J])


def _turned(q: Interval, b: Interval) -> Interval:
    """M(q) b, shape as b."""
    s, v = q[0], q[1:4]
    vv, along = dot(v, v), dot(v, b)
    side = cross(v, b)
    return stacked(
        [(s * s - vv) * b[r] + (v[r] * along + s * side[r]).times(2.0) for r in range(3)]
    )


def _turned_slopes(q: Interval, b: Interval) -> list[Interval]:
    """Its derivatives by q, four of its shape."""
    s, v = q[0], q[1:4]
    along, side = dot(v, b), cross(v, b)
    slopes = [stacked([(s * b[r] + side[r]).times(2.0) for r in range(3)])]
    for j in range(3):
        k, m = (j + 1) % 3, (j + 2) % 3
        rows = [(v[r] * b[j] - v[j] * b[r]).times(2.0) for r in range(3)]
        rows[j] = rows[j] + along.times(2.0)
        rows[k] = rows[k] - (s * b[m]).times(2.0)
        rows[m] = rows[m] + (s * b[k]).times(2.0)
        slopes.append(stacked(rows))
    return slopes


def _middle(x: Interval) -> Array:
    return 0.5 * (x.low + x.high)
