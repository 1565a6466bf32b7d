"""Velocities that take up slack: where a tension is too small, or a cable too long."""

from __future__ import annotations

import numpy as np

from cdpr_drake.arrays import Array


def tension_correction(tensions: Array, thresholds: Array, gains: Array) -> Array:
    """Cable velocities that wind up cables whose tension is below a threshold.

    Args:
        tensions: Measured tensions, shape (m,) [N].
        thresholds: Tension below which a cable counts as slack, shape (m,) [N].
        gains: Velocity per missing tension, not negative, shape (m,) [m/(N s)].

    Returns:
        To be added to the commanded velocities, shape (m,) [m/s]; never positive.

    Source: servoing thesis (5.1); with `adaptive_gains` (5.4).
    """
    missing = np.maximum(np.subtract(thresholds, tensions), 0.0)
    return -np.asarray(gains) * missing


def adaptive_gains(lengths: Array, expected: Array, gain_per_length: float) -> Array:
    """Gains for `tension_correction` that grow with what each cable is too long by.

    Args:
        lengths: Measured unstrained lengths, shape (m,) [m].
        expected: Lengths at the believed pose, shape (m,) [m].
        gain_per_length: Gain per surplus length, not negative [1/(N s)].

    Returns:
        Gains, shape (m,) [m/(N s)]; zero for a cable that is shorter than expected, which (5.3)
        would pay out.

    Source: servoing thesis (5.3).
    """
    return gain_per_length * np.maximum(np.subtract(lengths, expected), 0.0)


def length_correction(
    tensions: Array,
    lengths: Array,
    expected: Array,
    *,
    allowance: float,
    slowness: float,
    period: float,
    count: int = 2,
) -> Array:
    """Cable velocities that wind up the cables of least tension to the length that is expected.

    Args:
        tensions: Measured tensions, shape (m,) [N].
        lengths: Measured unstrained lengths, shape (m,) [m].
        expected: Lengths at the believed pose, shape (m,) [m].
        allowance: Surplus that is left alone, l_t, not negative [m].
        slowness: Number of periods that the correction takes, k_l, at least 1.
        period: Time between corrections [s].
        count: How many cables are corrected; of equal tensions the first ones.

    Returns:
        To be added to the commanded velocities, shape (m,) [m/s]; never positive.

    Source: servoing thesis (5.5).
    """
    found = np.zeros(len(tensions))
    for cable in np.argsort(tensions, kind="stable")[:count]:
        surplus = lengths[cable] - expected[cable] - allowance
        if surplus > 0.0:
            found[cable] = -surplus / (slowness * period)
    return found
