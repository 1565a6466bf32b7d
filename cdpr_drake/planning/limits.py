"""What a motion may ask of cables and winches."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace

import numpy as np

from cdpr_drake.arrays import Array
from cdpr_drake.errors import PlanningError


@dataclass(frozen=True, kw_only=True)
class MotionLimits:
    """Limits of a motion; infinite where there is none.

    The motor's torque that a motion needs is tau = (J / rho) d2l/dt2 - rho t, positive where it
    pays out, with t the tension, l the cable's length, J the inertia at the shaft and rho the way
    of the cable per angle of the motor. Friction is not in it: `torque` is what the friction leaves
    of the rated torque.

    Attributes:
        lower: Smallest tension of all cables, at least 0 [N].
        upper: Largest tension, above the smallest [N].
        cable_speed: Largest |dl/dt| [m/s].
        cable_acceleration: Largest |d2l/dt2| [m/s^2].
        torque: Largest |tau| [N m].
        inertia: J; 0 where it is not known [kg m^2].
        ratio: rho [m/rad].
        speed: Largest speed of Po [m/s].
    """

    lower: float
    upper: float
    cable_speed: float = np.inf
    cable_acceleration: float = np.inf
    torque: float = np.inf
    inertia: float = 0.0
    ratio: float = 1.0
    speed: float = np.inf

    def __post_init__(self) -> None:
        """Checks the numbers.

        Raises:
            PlanningError: A limit is negative, zero, NaN, or the tensions' cross.
        """
        for one in fields(self):
            value = float(getattr(self, one.name))
            zero = one.name in ("lower", "inertia")
            if np.isnan(value) or value < 0.0 or (value == 0.0 and not zero):
                accepted = "at least 0" if zero else "above 0"
                raise PlanningError(f"limits: {one.name}: found {value:g}; accepted: {accepted}")
        if not (self.lower < self.upper < np.inf):
            raise PlanningError(
                f"limits: tensions: found {self.lower:g} to {self.upper:g} N; accepted: a smallest "
                "below a largest tension, both finite"
            )

    def within(self, share: float, weight: float) -> MotionLimits:
        """Limits that keep something for the feedback that tracks the motion.

        Args:
            share: Share of every limit that is kept, from 0 to below 0.5. Of the tensions it is
                that of the platform's weight or of their range, whichever is smaller, at both ends:
                a feedback corrects accelerations, and these are counted by the weight.
            weight: Of the platform [N]; 0 where no gravity acts in the plane of its motion.

        Raises:
            PlanningError: The share is not accepted.
        """
        if not 0.0 <= share < 0.5:
            raise PlanningError(f"reserve: found {share:g}; accepted: from 0 to below 0.5")
        span = self.upper - self.lower
        kept = share * (min(span, weight) if weight > 0.0 else span)
        left = 1.0 - share
        return replace(
            self,
            lower=self.lower + kept,
            upper=self.upper - kept,
            cable_speed=left * self.cable_speed,
            cable_acceleration=left * self.cable_acceleration,
            torque=left * self.torque,
            speed=left * self.speed,
        )

    def packed(self) -> Array:
        """For the kernels of `planning`, in the order of the fields, shape (8,)."""
        return np.array([float(getattr(self, one.name)) for one in fields(self)])


LOWER, UPPER, CABLE_SPEED, CABLE_ACCELERATION, TORQUE, INERTIA, RATIO, SPEED = range(8)
"""Entries of `MotionLimits.packed`."""
