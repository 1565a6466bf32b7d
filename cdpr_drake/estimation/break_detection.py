"""When a cable counts as broken: limits from what sensors and beliefs are good for.

A broken cable reads what its sensor shows of nothing, s at most, and so may one that is slack, or
wanted with less than s. What tells them apart is that its winch winds up more cable than there can
be: see `break_detection_kernel`. By how much that has to be follows from the noise of lengths and
an accepted number of false alarms, and from bounds of what is wrong with exit points, anchor points
and the believed pose.

A break is found when its winch has wound up the limit h. A winch under the tension loop of
`control.tension_controller_kernel` winds with (1 + K_P) / K_D per newton that is missing, or with
its winding speed where its reading counts as slack. So within a time D that is certain of cables
that are wanted with

    t >= s + h K_D / ((1 + K_P) D),

while that stays so and the platform does not come nearer to the exit point. With less, the sensor's
constant error may be what is wanted; then nothing is wound up, and no sensor tells of the break.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cdpr_drake.arrays import Array
from cdpr_drake.errors import SensorError
from cdpr_drake.estimation.break_detection_kernel import (
    BEFORE,
    MEMORY_ROWS,
    RULE_SIZE,
)
from cdpr_drake.estimation.failure_detection import threshold


@dataclass(frozen=True)
class BreakRule:
    """When a cable counts as broken.

    Attributes:
        noise: What noise alone makes of a residual, with the accepted rate of false alarms [m].
        points: Bound of the errors of an exit point and of an anchor point together [m].
        pose: Bound of how far the error of the believed pose changes, at an anchor point, while a
            cable does not pull [m].
        in_a_row: Samples in a row above the limit that make an alarm.
    """

    noise: float
    points: float
    pose: float
    in_a_row: int

    def packed(self) -> Array:
        """As `break_step` takes it, shape (`RULE_SIZE`,)."""
        rule = np.empty(RULE_SIZE)
        rule[:] = self.noise, self.points, self.pose, self.in_a_row
        return rule

    def limit(self, turned: float) -> float:
        """Limit of a residual after a cable's direction turned by |u - u_b|; 1 where it never
        pulled [m]."""
        return self.noise + self.pose + self.points * turned


def fresh_memory(cables: int) -> Array:
    """The memory of `break_step` before the first sample, shape (`MEMORY_ROWS`, m)."""
    memory = np.zeros((MEMORY_ROWS, cables))
    memory[BEFORE] = np.nan
    return memory


def residual_noise(sigma: float, *, samples: float, cables: int, false_alarms: float) -> float:
    """What noise makes of residuals in so many samples, but for so many false alarms [m].

    A residual is the difference of two lengths, now and when the cable last pulled. Samples in a
    row do not count, since they share the latter.

    Args:
        sigma: Standard deviation of a length [m].
        samples: How many there will be.
        cables: How many residuals at each.
        false_alarms: How many are accepted.

    Raises:
        SensorError: A number makes no sense.
    """
    return threshold(
        float(np.sqrt(2.0) * sigma), samples=samples, residuals=cables, in_a_row=1,
        false_alarms=false_alarms,
    )  # fmt: skip


def silent_reading(
    accuracy: float, noise: float, *, samples: float, cables: int, false_alarms: float
) -> float:
    """What tension sensors read at most of cables that pull nothing [N].

    Args:
        accuracy: Largest constant error [N].
        noise: Standard deviation of readings [N].
        samples: How many there will be.
        cables: How many sensors.
        false_alarms: How many may read more.

    Raises:
        SensorError: A number makes no sense.
    """
    return threshold(
        noise, bias=accuracy, samples=samples, residuals=cables, in_a_row=1,
        false_alarms=false_alarms,
    )  # fmt: skip


def detectable_tension(
    limit: float, *, silent: float, winding_per_newton: float, within: float
) -> float:
    """Wanted tension from which on a break is certainly found in time; see the module [N].

    Args:
        limit: h, of the residual [m].
        silent: s, the largest reading of a cable that pulls nothing [N].
        winding_per_newton: (1 + K_P) / K_D of the tension loop [m/(N s)].
        within: D [s].

    Raises:
        SensorError: A number makes no sense.
    """
    for name, value in (
        ("limit", limit), ("silent", silent), ("winding_per_newton", winding_per_newton),
        ("within", within),
    ):  # fmt: skip
        if not (np.isfinite(value) and (value > 0.0 or (name == "silent" and value == 0.0))):
            raise SensorError(f"detectable_tension: {name}: found {value}; accepted: a number > 0")
    return float(silent + limit / (winding_per_newton * within))
