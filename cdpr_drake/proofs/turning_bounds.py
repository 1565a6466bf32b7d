"""What a timed path that turns asks of its platform, bounded at every instant.

On a stretch of a `TimedPath` quaternion q and position p are polynomials of s, u = d2s/dt2 is
constant and x = (ds/dt)^2 is linear in s. With N = |q|^2 and V = 2 vec(q* q'), the velocity in P is
w = V/N ds/dt, a point at r in P is at C/N from Po with C = vec(q r q*), and

    alpha = (V N u + (V' N - V N') x) / N^2,
    (C/N)' = (C' N - C N') / N^2,
    (C/N)'' = (C'' N^2 - 2 C' N N' - C N N'' + 2 C N'^2) / N^3.

All numerators are polynomials of s, which the control points of their Bernstein forms bound, and so
is N; no sample is taken.

Source: Farouki, The Bernstein polynomial basis, 2012.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from math import comb

import numpy as np

from cdpr_drake.arrays import Array
from cdpr_drake.trajectories.pose_path import DEGREE, POSE_NUMBERS
from cdpr_drake.trajectories.timed_path import TimedPath


@dataclass(frozen=True, eq=False)
class TurningBounds:
    """Bounds over a whole motion.

    Attributes:
        accelerations: Of the centre of mass Co in W, component by component, shape (3,) [m/s^2].
        moments: Of I_Co alpha + w x I_Co w in P, shape (3,) [N m].
        speed: Of Po [m/s].
        anchor_speed: Of the fastest anchor point, which no cable's speed exceeds [m/s].
    """

    accelerations: Array
    moments: Array
    speed: float
    anchor_speed: float


def turning_bounds(motion: TimedPath, p_PCo: Array, I_PCo: Array, p_PB: Array) -> TurningBounds:
    """Bounds of a motion, of all its stretches.

    Args:
        motion: The motion.
        p_PCo: Centre of mass in P, shape (3,) [m].
        I_PCo: Rotational inertia about Co in P, shape (3, 3) [kg m^2].
        p_PB: Anchor points in P, shape (3, m) [m].
    """
    one = _Stretches(motion)
    low, high = one.sum(
        one.p1 * one.u + _times(one.x, one.p2), one.acceleration(np.asarray(p_PCo, float)), 3
    )
    fastest = np.sqrt(np.max(motion_ends(motion), axis=1))
    anchors = [one.sum(one.p1, one.rate(r), 2) for r in np.asarray(p_PB, float).T]
    return TurningBounds(
        np.max(np.maximum(-low, high), axis=0),
        np.max(one.largest(one.moment(np.asarray(I_PCo, float)), 2), axis=0),
        float(np.max(np.linalg.norm(_largest(one.p1), axis=1) * fastest)),
        max(float(np.max(np.linalg.norm(np.maximum(-a, b), axis=1) * fastest)) for a, b in anchors),
    )


def motion_ends(motion: TimedPath) -> Array:
    """(ds/dt)^2 at both ends of each stretch, shape (k, 2) [m^2/s^2]."""
    x = motion.squared_speeds
    return np.column_stack([x[:-1], x[1:]])


class _Stretches:
    """Polynomials on 0 to 1 of all stretches, ascending powers, shape (k, degree + 1, numbers)."""

    def __init__(self, motion: TimedPath) -> None:
        rows, self.way = motion.stretches(), np.diff(motion.stations)[:, np.newaxis, np.newaxis]
        c = rows[:, 4:].reshape(-1, DEGREE + 1, POSE_NUMBERS)
        c = c * self.way ** np.arange(DEGREE + 1)[:, np.newaxis]
        self.q, self.p1 = c[:, :, :4], self.slope(c[:, :, 4:])
        self.q1, self.p2 = self.slope(self.q), self.slope(self.p1)
        self.u = rows[:, 3, np.newaxis, np.newaxis]
        first, last = motion_ends(motion).T
        self.x = np.stack([first, last - first], axis=1)[:, :, np.newaxis]
        self.N = np.sum(_times(self.q, self.q), axis=2, keepdims=True)
        self.N1 = self.slope(self.N)
        self.N2 = self.slope(self.N1)
        ends = _control_points(self.N)[:, :, 0]
        self.least, self.most = np.min(ends, axis=1), np.max(ends, axis=1)

    def slope(self, poly: Array) -> Array:
        """Derivative by s."""
        n = poly.shape[1]
        return np.asarray(np.arange(1, n)[:, np.newaxis] * poly[:, 1:] / self.way, float)

    def moment(self, inertia: Array) -> Array:
        """N^2 times the moment about Co."""
        V = 2.0 * _product(_conjugate(self.q), self.q1)[:, :, 1:]
        V1 = 2.0 * _product(_conjugate(self.q), self.slope(self.q1))[:, :, 1:]
        alpha = _times(V, self.N) * self.u
        alpha = alpha + _times(self.x, _times(V1, self.N) - _times(V, self.N1))
        return np.asarray(alpha @ inertia.T + _times(self.x, _cross(V, V @ inertia.T)), float)

    def turned(self, r: Array) -> Array:
        """N times a vector of P, in W."""
        fixed = np.zeros((len(self.q), 1, 4))
        fixed[:, 0, 1:] = r
        return _product(_product(self.q, fixed), _conjugate(self.q))[:, :, 1:]

    def rate(self, r: Array) -> Array:
        """N^2 times the first derivative by s of a vector of P, in W."""
        C = self.turned(r)
        return _times(self.slope(C), self.N) - _times(C, self.N1)

    def acceleration(self, r: Array) -> Array:
        """N^3 times the acceleration of a point of P against Po, in W."""
        C = self.turned(r)
        C1 = self.slope(C)
        bend = (
            _times(_times(self.slope(C1), self.N), self.N)
            - 2.0 * _times(_times(C1, self.N), self.N1)
            - _times(_times(C, self.N), self.N2)
            + 2.0 * _times(_times(C, self.N1), self.N1)
        )
        return _times(self.rate(r), self.N) * self.u + _times(self.x, bend)

    def largest(self, numerator: Array, power: int) -> Array:
        """Bounds of the sizes of a numerator by a power of N, shape (k, numbers)."""
        return np.asarray(_largest(numerator) / self.least[:, np.newaxis] ** power, float)

    def sum(self, plain: Array, numerator: Array, power: int) -> tuple[Array, Array]:
        """Both bounds of a polynomial plus a numerator by a power of N, shape (k, numbers)."""
        first, second = _control_points(plain), _control_points(numerator)
        by = self.least[:, np.newaxis] ** power, self.most[:, np.newaxis] ** power
        low, high = np.min(second, axis=1), np.max(second, axis=1)
        low, high = np.minimum(low / by[0], low / by[1]), np.maximum(high / by[0], high / by[1])
        return np.min(first, axis=1) + low, np.max(first, axis=1) + high


def _times(a: Array, b: Array) -> Array:
    """Product of polynomials, number by number."""
    if a.shape[1] < b.shape[1]:
        a, b = b, a
    numbers = max(a.shape[2], b.shape[2])
    out = np.zeros((len(a), a.shape[1] + b.shape[1] - 1, numbers))
    for k in range(b.shape[1]):
        out[:, k : k + a.shape[1]] += a * b[:, k : k + 1]
    return out


def _product(a: Array, b: Array) -> Array:
    """Product of polynomials of quaternions wxyz."""
    scalar, vector = slice(0, 1), slice(1, 4)
    dot = np.sum(_times(a[:, :, vector], b[:, :, vector]), axis=2, keepdims=True)
    w = _times(a[:, :, scalar], b[:, :, scalar]) - dot
    v = _times(a[:, :, scalar], b[:, :, vector]) + _times(a[:, :, vector], b[:, :, scalar])
    return np.concatenate([w, v + _cross(a[:, :, vector], b[:, :, vector])], axis=2)


def _cross(a: Array, b: Array) -> Array:
    i, j = [1, 2, 0], [2, 0, 1]
    return _times(a[:, :, i], b[:, :, j]) - _times(a[:, :, j], b[:, :, i])


def _conjugate(q: Array) -> Array:
    return np.asarray(q * np.array([1.0, -1.0, -1.0, -1.0]), float)


def _control_points(poly: Array) -> Array:
    return np.asarray(_to_control_points(poly.shape[1] - 1) @ poly, float)


@cache
def _to_control_points(n: int) -> Array:
    return np.array(
        [[comb(i, j) / comb(n, j) if j <= i else 0.0 for j in range(n + 1)] for i in range(n + 1)]
    )


def _largest(poly: Array) -> Array:
    return np.asarray(np.max(np.abs(_control_points(poly)), axis=1), float)
