"""Pieces of the laws of visual servoing: adaptive gain, least squares, saturation."""

from __future__ import annotations

import math
from dataclasses import dataclass

from numba import njit

from cdpr_drake.arrays import Array


@dataclass(frozen=True)
class AdaptiveGain:
    """Gain that falls from `at_zero` to `at_infinity` as the error grows.

    Attributes:
        at_zero: lambda(0) [1/s].
        at_infinity: lambda(infinity) [1/s]; equal to `at_zero` for a constant gain.
        slope: Fall of lambda at 0, per unit of the error's 2-norm [1/s].

    Source: servoing thesis (1.31).
    """

    at_zero: float
    at_infinity: float
    slope: float

    def __call__(self, error: Array) -> float:
        """lambda [1/s] for an error, any shape (n,), its components as they come (m and rad)."""
        size = math.sqrt(float(error @ error))
        return float(adaptive_gain(self.at_zero, self.at_infinity, self.slope, size))


@njit(cache=True)
def adaptive_gain(at_zero: float, at_infinity: float, slope: float, size: float) -> float:
    """lambda [1/s] for an error of this 2-norm; see `AdaptiveGain`."""
    span = at_zero - at_infinity
    if span == 0.0:
        return at_zero
    return span * math.exp(-slope / span * size) + at_infinity


@njit(cache=True)
def saturation_share(rates: Array, limit: float) -> float:
    """Largest share in (0, 1] of rates, shape (m,), that keeps all within +-limit, same unit.

    Scaling by one share keeps the direction of motion.
    """
    largest = 0.0
    for rate in rates:
        largest = max(largest, abs(rate))
    return 1.0 if largest <= limit else limit / largest
