"""Control laws of visual servoing: adaptive gain, continuous start, saturation."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

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
        span = self.at_zero - self.at_infinity
        if span == 0.0:
            return self.at_zero
        x = float(np.linalg.norm(error))
        return span * float(np.exp(-self.slope / span * x)) + self.at_infinity


def servo_velocity(
    L: Array, error: Array, gain: float, start: Array, sigma: float, time: float
) -> Array:
    """Velocity -lambda (L^+ e - L_0^+ e_0 exp(-sigma t)), shape (k,).

    Args:
        L: Interaction matrix with de/dt = L @ velocity, shape (n, k).
        error: e, shape (n,).
        gain: lambda [1/s].
        start: L_0^+ e_0 at the start of the task, shape (k,); zeros for an abrupt start.
        sigma: Rate at which the start is forgotten [1/s].
        time: Time since the start of the task [s].

    Source: servoing thesis (1.33), (1.35).
    """
    wanted = np.linalg.pinv(L) @ error
    return np.asarray(-gain * (wanted - start * np.exp(-sigma * time)), float)


def saturation_share(rates: Array, limit: float) -> float:
    """Largest share in (0, 1] of rates, shape (m,), that keeps all within +-limit, same unit.

    Scaling by one share keeps the direction of motion.
    """
    largest = float(np.max(np.abs(rates)))
    return 1.0 if largest <= limit else limit / largest
