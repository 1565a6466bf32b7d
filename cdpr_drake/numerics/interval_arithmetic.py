"""Interval arithmetic on arrays, rounded outwards: sums and products.

Where an operation has no finite result the ends are infinite or NaN; what is made of them is no
finite bound either.
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

    def times(self, factor: float) -> Interval:
        """Times a power of two, which is exact."""
        ends = self.low * factor, self.high * factor
        return Interval(np.minimum(*ends), np.maximum(*ends))


def _outward(low: Array, high: Array) -> Interval:
    """Rounding to nearest errs by less than the next number."""
    return Interval(np.nextafter(low, -np.inf), np.nextafter(high, np.inf))


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
