"""Estimates how features change because the object moves, from what the camera's motion leaves."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cdpr_drake.arrays import Array

KINDS = ("none", "difference", "constant_velocity", "constant_acceleration")

UNKNOWN_VARIANCE = 1e6
"""Variance of a state of which nothing is known, per variance of its measurement."""


def feature_drift(s: Array, s_before: Array, own_rate: Array, period: float) -> Array:
    """The part of ds/dt that the object's motion causes, shape (k,) [1/s of the features' units].

    Args:
        s: Features now, shape (k,).
        s_before: Features one period before, shape (k,).
        own_rate: L @ V_C that the camera was moved with in between, shape (k,).
        period: [s].

    Source: servoing thesis (1.57).
    """
    return (s - s_before) / period - own_rate


@dataclass(frozen=True)
class MotionFilter:
    """A Kalman filter of the drift, one and the same for all features.

    Attributes:
        kind: One of `KINDS`. "difference" takes the measured drift as it is; the model of
            "constant_velocity" is that the object's velocity, so the drift b, is constant but for
            white noise; that of "constant_acceleration" that db/dt is.
        ratio: Standard deviation of the model's change within a second, per standard deviation
            of one measured drift; large follows at once, small smooths [-, or 1/s].
        period: Time between measurements [s].

    The state is (b, db/dt, their covariance); what is measured is b alone.

    Source: servoing thesis 1.4.6; the models as in Chaumette and Santos, Tracking a moving object
    by visual servoing, 1993.
    """

    kind: str
    ratio: float
    period: float

    @staticmethod
    def start(size: int) -> Array:
        """State before the first measurement for `size` features, shape (2 size + 3,)."""
        return np.concatenate([np.zeros(2 * size), [UNKNOWN_VARIANCE, 0.0, UNKNOWN_VARIANCE]])

    def step(self, state: Array, measured: Array) -> tuple[Array, Array]:
        """Takes one measured drift, shape (k,); returns the estimate and the new state."""
        k = len(measured)
        if self.kind == "difference":
            return measured, state
        b, slope = state[:k], state[k : 2 * k]
        p, c, q = state[2 * k :]  # variances of b and db/dt and their covariance
        T, noise = self.period, self.ratio**2
        if self.kind == "constant_velocity":
            p = p + noise * T
            gain = p / (p + 1.0)
            b = b + gain * (measured - b)
            return b, np.concatenate([b, slope, [(1.0 - gain) * p, 0.0, q]])
        p = p + 2.0 * T * c + T * T * q + noise * T**3 / 3.0
        c = c + T * q + noise * T * T / 2.0
        q = q + noise * T
        gain, gain_slope = p / (p + 1.0), c / (p + 1.0)
        b = b + T * slope
        off = measured - b
        b, slope = b + gain * off, slope + gain_slope * off
        return b, np.concatenate(
            [b, slope, [(1.0 - gain) * p, (1.0 - gain) * c, q - gain_slope * c]]
        )
