"""What tells of failures other than broken cables: motors, sensors, camera.

* A motor: what of J dw/dt = tau + rho t - F_v w - f nothing explains, smoothed as a momentum
  observer does,

      r = K (J w - int (tau + rho t - F_v w - f + r) dt),   dr/dt = K (e - r),

  e being the torque on the rotor beyond what was asked for, cable and friction. Without power
  e = -tau while the drum turns; a drum that is blocked takes what friction could not hold. Slower
  than T F_s / J friction is a reaction of up to F_s, see `winches.friction`.
* A tension sensor with noise that reads the same to the last bit several times in a row.
* An encoder beside what the drive knows of its speed: l0 - int s dt, with a leak, so that what
  integration gets wrong does not add up.
* A camera: for how long the target was not found, and for how long it was seen at the very same
  place, which no new image shows if there is noise in it.

Each is one step of a memory that is an array.

Source: De Luca, Mattone: Sensorless robot collision detection and hybrid force/motion control,
ICRA 2005, for the observer.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from scipy.special import ndtr

from cdpr_drake.arrays import Array
from cdpr_drake.errors import SensorError
from cdpr_drake.estimation.failure_detection import threshold


class Friction(Protocol):
    """What is asked of a law of friction, such as `winches.friction.FrictionLaw`."""

    @property
    def static(self) -> float:
        """F_s [N m]."""

    @property
    def viscous(self) -> float:
        """F_v [N m s/rad]."""

    @property
    def settling_time(self) -> float:
        """T [s]."""

    def dry(self, speed: Array) -> Array:
        """Largest dry friction at speeds [rad/s], in [N m]."""


@dataclass(frozen=True)
class MotorWatch:
    """Torque of motors that nothing explains.

    Attributes:
        radius: rho of each cable's drum over the gear, shape (m,) [m/rad].
        friction: As it is believed.
        inertia: J at the motor's shaft [kg m^2].
        bandwidth: K [1/s].
        period: Between samples [s].
    """

    radius: Array
    friction: Friction
    inertia: float
    bandwidth: float
    period: float

    def __post_init__(self) -> None:
        """Refuses what does not settle.

        Raises:
            SensorError: K T is not between 0 and 1.
        """
        share = self.bandwidth * self.period
        if not 0.0 < share < 1.0:
            raise SensorError(
                f"bandwidth of a motor's watch: found {self.bandwidth:g} with samples every "
                f"{self.period:g} s; accepted: above 0, below {1.0 / self.period:g} [1/s]"
            )

    def fresh(self) -> Array:
        """The memory before the first sample: integral and residual, shape (2, m)."""
        return np.array([np.full(len(self.radius), np.nan), np.zeros(len(self.radius))])

    def limit(
        self, accuracy: float, noise: float, *, samples: float, in_a_row: int, false_alarms: float
    ) -> float:  # fmt: skip
        """Torque that friction and tension sensors may leave unexplained [N m].

        Static friction: which way it acts while a drum turns round, no sensor tells. Then what a
        sensor's constant error makes, and its noise behind the observer's smoothing.

        Args:
            accuracy: Largest constant error of a tension sensor [N].
            noise: Standard deviation of its readings [N].
            samples: How many there will be.
            in_a_row: How many must lie above, of either sign.
            false_alarms: How many are accepted.

        Raises:
            SensorError: A number makes no sense.
        """
        share, radius = self.bandwidth * self.period, float(np.max(self.radius))
        sigma = radius * noise * float(np.sqrt(share / (2.0 - share)))
        return threshold(
            sigma, bias=self.friction.static + radius * accuracy, samples=samples,
            residuals=2 * len(self.radius), in_a_row=in_a_row, false_alarms=false_alarms,
        )  # fmt: skip

    def slowest(self) -> float:
        """Speed below which a drum counts as standing [rad/s]."""
        return self.friction.settling_time * self.friction.static / self.inertia

    def stands(self, rates: Array) -> Array:
        """Whether drums stand, by the rates of their lengths, shape (m,) [m/s]."""
        return np.asarray(np.abs(rates / self.radius) <= self.slowest())

    def step(self, memory: Array, torques: Array, tensions: Array, rates: Array) -> Array:
        """The memory after a sample; its second row are residuals, shape (m,) [N m].

        Args:
            memory: As it was.
            torques: Asked for, positive pays out, shape (m,) [N m].
            tensions: Measured, shape (m,) [N].
            rates: Of unstrained lengths as drives know them, shape (m,) [m/s].
        """
        gathered, residuals = memory
        speeds = rates / self.radius
        momentum = self.inertia * speeds
        if np.isnan(gathered[0]):
            gathered = momentum
        free = torques + self.radius * tensions - self.friction.viscous * speeds
        held = np.clip(free, -self.friction.static, self.friction.static)
        dry = np.where(self.stands(rates), held, np.sign(speeds) * self.friction.dry(speeds))
        residuals = self.bandwidth * (momentum - gathered)
        gathered = gathered + self.period * (free - dry + residuals)
        return np.array([gathered, residuals])


def repeats_in_a_row(noise: float, resolution: float, *, readings: float, accepted: float) -> int:
    """How many equal readings in a row say that a sensor is frozen.

    Args:
        noise: Standard deviation of its readings, independent of each other.
        resolution: Step between readings; 0: none.
        readings: How many there will be in all.
        accepted: How many false alarms are accepted in all of them.

    Raises:
        SensorError: Readings of a sensor that works are the same, too.
    """
    if not noise > 0.0:
        raise SensorError(
            f"watch of frozen sensors: found noise {noise:g}, with which equal readings say "
            "nothing; accepted: a number > 0"
        )
    if resolution == 0.0:
        return 2
    same = float(2.0 * ndtr(0.5 * resolution / noise) - 1.0)  # in the middle of a step
    count = np.inf if same >= 1.0 else np.log(accepted / readings) / np.log(same)
    if not count <= MOST_REPEATS:
        raise SensorError(
            f"watch of frozen sensors: found resolution {resolution:g} with noise {noise:g}, with "
            f"which {MOST_REPEATS} equal readings in a row say nothing; accepted: a finer one"
        )
    return max(int(np.ceil(count)) + 1, 2)


MOST_REPEATS = 1000
"""Equal readings in a row beyond which one does not wait."""


def count_repeats(memory: Array, readings: Array) -> Array:
    """How often readings were the same in a row, and the last ones, shape (2, m).

    Args:
        memory: The same of the sample before; readings NaN before any.
        readings: Of now, shape (m,).
    """
    counts, before = memory
    return np.array([np.where(readings == before, counts + 1.0, 0.0), readings])


@dataclass(frozen=True)
class EncoderWatch:
    """By how much measured lengths lag behind what drives know of their speeds.

    Attributes:
        period: Between samples [s].
        leak: Time in which differences are forgotten [s].
    """

    period: float
    leak: float

    def fresh(self, count: int) -> Array:
        """The memory before the first sample: lag, last lengths and rates, shape (3, m)."""
        return np.array([np.zeros(count), np.full(count, np.nan), np.zeros(count)])

    def step(self, memory: Array, lengths: Array, rates: Array) -> Array:
        """The memory after a sample; its first row are lags, shape (m,) [m].

        Args:
            memory: As it was.
            lengths: Measured, unstrained, shape (m,) [m].
            rates: As drives know them, shape (m,) [m/s].
        """
        lag, before, earlier = memory
        moved = np.where(np.isnan(before), 0.0, lengths - before)
        expected = np.where(np.isnan(before), 0.0, 0.5 * self.period * (earlier + rates))
        lag = (1.0 - self.period / self.leak) * lag + expected - moved
        return np.array([lag, lengths, rates])
