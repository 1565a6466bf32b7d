"""Interval arithmetic on arrays, rounded outwards: sums, products, quotients, roots, sines.

Where an operation has no finite result, such as one over an interval that holds zero, the ends are
infinite or NaN; what is made of them is no finite bound either.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from cdpr_drake.arrays import Array


@dataclass(frozen=True, eq=False)
class Interval:
    """Arrays of intervals [low, high]; results contain all that the operands could give."""

    low: Array
    high: Array

    @staticmethod
    def of(value: Array | float) -> Interval:
        """Numbers as intervals of no width."""
        value = np.asarray(value, float)
        return Interval(value, value)

    def __add__(self, other: Interval) -> Interval:
        return _outward(self.low + other.low, self.high + other.high)

    def __sub__(self, other: Interval) -> Interval:
        return _outward(self.low - other.high, self.high - other.low)

    def __mul__(self, other: Interval) -> Interval:
        products = (
            self.low * other.low, self.low * other.high,
            self.high * other.low, self.high * other.high,
        )  # fmt: skip
        return _outward(np.minimum.reduce(products), np.maximum.reduce(products))

    def __neg__(self) -> Interval:
        return Interval(-self.high, -self.low)

    def __getitem__(self, index: Any) -> Interval:
        return Interval(self.low[index], self.high[index])

    def transposed(self) -> Interval:
        """With axes in reverse order."""
        return Interval(self.low.T, self.high.T)

    def square(self) -> Interval:
        """Squares, never below zero."""
        ends = self.low * self.low, self.high * self.high
        holds_zero = (self.low <= 0.0) & (self.high >= 0.0)
        least = np.where(holds_zero, 0.0, np.minimum(*ends))
        result = _outward(least, np.maximum(*ends))
        return Interval(np.maximum(result.low, 0.0), result.high)

    def root(self) -> Interval:
        """Square roots of what is not below zero."""
        result = _outward(np.sqrt(np.maximum(self.low, 0.0)), np.sqrt(self.high))
        return Interval(np.maximum(result.low, 0.0), result.high)

    def reciprocal(self) -> Interval:
        """One over it; everything where it holds zero."""
        holds_zero = (self.low <= 0.0) & (self.high >= 0.0)
        with np.errstate(divide="ignore", over="ignore"):
            low = np.where(holds_zero, -np.inf, 1.0 / self.high)
            high = np.where(holds_zero, np.inf, 1.0 / self.low)
        return _outward(low, high)

    def within(self, low: float, high: float) -> Interval:
        """Less what is outside [low, high], where it is known not to be."""
        return Interval(np.clip(self.low, low, high), np.clip(self.high, low, high))

    def widened(self, by: Array | float) -> Interval:
        """With both ends moved outwards, by a number or an array."""
        return _outward(self.low - by, self.high + by)

    def magnitude(self) -> Array:
        """The largest absolute values."""
        return np.maximum(np.abs(self.low), np.abs(self.high))

    def times(self, factor: float) -> Interval:
        """Times a power of two, which is exact."""
        ends = self.low * factor, self.high * factor
        return Interval(np.minimum(*ends), np.maximum(*ends))


TRIG_SHARE = 1e-15
"""Relative error that is allowed for sines and cosines; libraries are within 2.3e-16."""


def _outward(low: Array, high: Array) -> Interval:
    """Rounding to nearest errs by less than the next number."""
    return Interval(np.nextafter(low, -np.inf), np.nextafter(high, np.inf))


def cardinal_sine(angle: Interval) -> Interval:
    """sin(x) / x of angles in [0, pi], where it falls; 1 at zero [rad]."""
    low, high = (np.sinc(end / np.pi) for end in (angle.high, angle.low))
    return _outward(low - TRIG_SHARE, high + TRIG_SHARE)


def stacked(parts: list[Interval]) -> Interval:
    """Intervals of one shape as one array of them, along a new first axis."""
    return Interval(np.array([p.low for p in parts]), np.array([p.high for p in parts]))


def total(terms: Interval) -> Interval:
    """Sum along the first axis."""
    result = terms[0]
    for i in range(1, len(terms.low)):
        result = result + terms[i]
    return result


def dot(a: Interval, b: Interval) -> Interval:
    """Sum of products along the first axis of both."""
    result = a[0] * b[0]
    for i in range(1, len(a.low)):
        result = result + a[i] * b[i]
    return result


def cross(a: Interval, b: Interval) -> Interval:
    """Cross product along the first axis, of length 3."""
    return stacked(
        [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
    )


def matrix_product(A: Array, B: Interval) -> Interval:
    """A matrix of numbers, shape (n, n), times intervals, shape (n, ...)."""
    return stacked([dot(Interval.of(row), B) for row in A])


def rotation(vector: Interval, largest: float) -> Interval:
    """Rotation matrices exp([v]x) of vectors in a box that are no longer than `largest`.

    The natural extension of Rodrigues' formula, I + a [v]x + b [v]x^2.

    Args:
        vector: Rotation vectors, shape (3, ...) [rad].
        largest: At most pi [rad].

    Returns:
        Shape (3, 3, ...).
    """
    squares = vector.square()
    angle = total(squares).root().within(0.0, np.nextafter(largest, np.inf))
    a, half = cardinal_sine(angle), cardinal_sine(angle.times(0.5))
    b = half.square().times(0.5)
    x, y, z = vector[0], vector[1], vector[2]
    (ax, ay, az), (xy, xz, yz) = (a * x, a * y, a * z), (b * (x * y), b * (x * z), b * (y * z))
    one = Interval.of(np.ones_like(x.low))
    xx, yy, zz = (one - b * (squares[i] + squares[j]) for i, j in ((1, 2), (0, 2), (0, 1)))
    rows = [[xx, xy - az, xz + ay], [xy + az, yy, yz - ax], [xz - ay, yz + ax, zz]]
    return stacked([stacked(row) for row in rows])


def product(A: Interval, B: Interval) -> Interval:
    """Matrix products, shapes (n, k, ...) and (k, m, ...), of intervals."""
    return stacked([dot(A[i][:, None], B) for i in range(len(A.low))])


def left_inverse(J: Interval) -> Interval:
    """J^+ = (J'J)^-1 J' of narrow J of full column rank, shape (m, n, N), so (n, m, N).

    With R near (J'J)^-1 and E = 1 - R J'J, whose row sums are at most b < 1, it is
    (1 - E)^-1 R J', which differs from R J' in each column by at most b / (1 - b) times its largest
    entry. Infinite where b is not below one.
    """
    Jt = Interval(np.swapaxes(J.low, 0, 1), np.swapaxes(J.high, 0, 1))
    G = product(Jt, J)
    middle = np.moveaxis(0.5 * (G.low + G.high), -1, 0)
    good = np.linalg.cond(middle) < 1.0 / np.finfo(float).eps
    R = np.full_like(middle, np.nan)
    R[good] = np.linalg.inv(middle[good])
    near = Interval.of(np.moveaxis(R, 0, -1))
    n = G.low.shape[0]
    E = Interval.of(np.eye(n)[:, :, None]) - product(near, G)
    first = product(near, Jt)
    b = np.max(_row_sums(E.magnitude()), axis=0)
    share = np.where(b < 0.5, np.nextafter(2.0 * b, np.inf), np.inf)  # b / (1 - b) <= 2 b
    return first.widened(share * np.max(first.magnitude(), axis=0))


def _row_sums(terms: Array) -> Array:
    """Upper ends of the sums of not negative terms along the second axis."""
    exact = np.sum(terms, axis=1)
    return np.asarray(exact * (1.0 + terms.shape[1] * np.finfo(float).eps))
