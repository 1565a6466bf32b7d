"""What tells that something failed: residuals that are near zero while nothing has, and thresholds.

* Lengths: r_i = l_i(X) - l0_i - t_i l0_i / (E S)_i. A cable that is there has the length of its
  path when it pulls, and is longer than that when it is slack, so that r_i is at most noise; that
  of a cable which is gone grows by what its winch winds up and by what the platform moves away.
* Tensions: r_i = t*_i - t_i, wanted less measured. Fast, but slack looks the same.
* Torque: r_i = tau_i + rho t_i - F_v w_i - J dw_i/dt, of a motor whose torque is what was asked for
  and whose tension sensor reads the cable: at most dry friction. Else it has no power, or the
  sensor does not follow.

An alarm is one residual above its threshold at several samples in a row. With normal noise of
standard deviation sigma that is independent from sample to sample, m residuals at N samples, n in
a row, are expected to give m N Q(x)^n false alarms with Q the normal tail beyond x sigma: x
follows from how many are accepted. Constant errors within a bound are added to the threshold.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import ndtri

from cdpr_drake.arrays import Array
from cdpr_drake.errors import SensorError


def length_residuals(lengths: Array, unstrained: Array, tensions: Array, stiffness: Array) -> Array:
    """By how much cables should be taut and do not pull, shape (m,) [m].

    Args:
        lengths: Of the paths from exit to anchor points at the believed pose, shape (m,) [m].
        unstrained: Measured unstrained lengths, shape (m,) [m].
        tensions: Measured, shape (m,) [N].
        stiffness: E S, shape (m,) [N].
    """
    return np.asarray(lengths - unstrained * (1.0 + tensions / stiffness))


def threshold(
    sigma: float, *, bias: float = 0.0, samples: float, residuals: int, in_a_row: int,
    false_alarms: float,
) -> float:  # fmt: skip
    """Threshold of residuals, in their unit.

    Args:
        sigma: Standard deviation of their noise.
        bias: Bound of their constant errors.
        samples: How many samples there will be.
        residuals: How many at each.
        in_a_row: n, how many must lie above.
        false_alarms: How many false alarms are accepted in all of that.

    Raises:
        SensorError: A number makes no sense.
    """
    for name, value, fits in (
        ("sigma", sigma, sigma >= 0.0), ("bias", bias, bias >= 0.0),
        ("samples", samples, samples > 0.0), ("residuals", residuals, residuals > 0),
        ("in_a_row", in_a_row, in_a_row > 0), ("false_alarms", false_alarms, false_alarms > 0.0),
    ):  # fmt: skip
        if not (fits and np.isfinite(value)):
            raise SensorError(f"threshold: {name}: found {value}; accepted: a number > 0")
    share = min(false_alarms / (samples * residuals), 0.5)
    return float(bias - sigma * ndtri(share ** (1.0 / in_a_row)))


@dataclass(frozen=True)
class AlarmRule:
    """When residuals are an alarm.

    Attributes:
        threshold: Above which one counts, in its unit.
        in_a_row: At how many samples in a row.
    """

    threshold: float
    in_a_row: int

    def step(self, counts: Array, residuals: Array) -> tuple[Array, Array]:
        """One sample.

        Args:
            counts: Of samples above in a row so far, shape (m,); those of alarms stay.
            residuals: Of now, shape (m,).

        Returns:
            The counts, and 1 for each that is an alarm, shape (m,).
        """
        held = counts >= self.in_a_row
        counts = np.where(held, counts, np.where(residuals > self.threshold, counts + 1.0, 0.0))
        return counts, (counts >= self.in_a_row).astype(float)
