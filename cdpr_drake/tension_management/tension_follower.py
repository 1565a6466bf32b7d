"""Follows wanted tensions from both sides by cable velocities."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cdpr_drake.arrays import Array


@dataclass(frozen=True)
class TensionFollower:
    """A PID controller for each cable, from the tension that is missing to a cable velocity.

    Attributes:
        proportional: Velocity per missing tension [m/(N s)].
        integral: Velocity per missing tension and second [m/(N s2)].
        derivative: Velocity per rate of the missing tension [m/N].
        fastest: Largest velocity of a correction [m/s]. While a cable is at it, its integral does
            not grow further.

    Source: servoing thesis 5.2.1, "Obtaining the threshold through TDA", and Fig. 5.3.
    """

    proportional: float
    integral: float = 0.0
    derivative: float = 0.0
    fastest: float = np.inf

    def step(
        self, missing: Array, before: Array | None, integrated: Array, period: float
    ) -> tuple[Array, Array]:
        """Cable velocities and the new integral.

        Args:
            missing: Wanted tensions less measured ones, shape (m,) [N].
            before: The same a period before; None at the first step.
            integrated: Integral of the missing tensions so far, shape (m,) [N s].
            period: Time between steps [s].

        Returns:
            Velocities to be added to the commanded ones, shape (m,) [m/s], negative where tension
            is missing, and the integral with this step, shape (m,) [N s].
        """
        grown = integrated + period * missing
        rate = np.zeros_like(missing) if before is None else (missing - before) / period
        wanted = -(self.proportional * missing + self.integral * grown + self.derivative * rate)
        held = np.clip(wanted, -self.fastest, self.fastest)
        # An integral that would push further against the limit is left as it was.
        winding = (held != wanted) & (np.sign(missing) == -np.sign(wanted))
        return held, np.where(winding, integrated, grown)
