"""Huber's cost of residuals: squares, and from some sigmas on no more than linear."""

from __future__ import annotations

import numpy as np

from cdpr_drake.arrays import Array

HUBER = 4.0
"""From how many sigmas on a residual counts linearly."""


def huber_limit(rest: Array) -> float:
    """From where residuals count linearly: `HUBER` of their own spread, which is at least 1.

    Sigmas may be wrong by a factor for a whole kind of measurement: who is off is so beside others.
    """
    return HUBER * (max(1.4826 * float(np.median(np.abs(rest))), 1.0) if len(rest) else 1.0)


def huber_weights(rest: Array, limit: float) -> Array:
    """Weights with which least squares make a step down the cost, shape (r,)."""
    return np.asarray(np.minimum(1.0, limit / np.maximum(np.abs(rest), 1e-300)))


def huber_cost(rest: Array, limit: float) -> float:
    """Sum of squares, of |x| limit (2 - limit / |x|) beyond the limit."""
    size = np.abs(rest)
    inner = np.minimum(size, limit)
    return float(np.sum(inner**2 + 2.0 * inner * (size - inner)))
