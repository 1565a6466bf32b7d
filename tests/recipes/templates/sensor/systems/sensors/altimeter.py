"""A sensor of the platform's height."""

from __future__ import annotations

from dataclasses import dataclass

from pydrake.common.value import Value
from pydrake.math import RigidTransform

from cdpr_drake.arrays import Array
from cdpr_drake.estimation.sensor_noise import sensor_random
from cdpr_drake.systems.sensors.sampled_sensor import SampledSensor

STREAM = 907
"""Tells the random numbers of this sensor from those of others."""


@dataclass(frozen=True)
class AltimeterModel:
    """A type: readings per second [Hz], and the largest constant error [m]."""

    rate_hz: float = 50.0
    accuracy: float = 0.002


class Altimeter(SampledSensor):
    """Reads the height of the platform, wrong by a constant.

    ====== ============== ==== =================================
    port   type           unit meaning
    ====== ============== ==== =================================
    X_WP   RigidTransform m    in, true pose of the platform
    height vector(1)      m    out, latest reading
    ====== ============== ==== =================================
    """

    def __init__(self, model: AltimeterModel, seed: int, rate: float) -> None:
        """Of a type, with the seed of its error and readings per second [Hz]."""
        super().__init__(1, rate)
        self.error = sensor_random(seed, STREAM).uniform(-model.accuracy, model.accuracy)
        self.DeclareAbstractInputPort("X_WP", Value(RigidTransform()))
        self.DeclareStateOutputPort("height", self._sample)

    def measure(self, truth: RigidTransform, number: int) -> Array:
        """As the base class says."""
        return truth.translation()[2:] + self.error

    def reading(self, sample: Array) -> Array:
        """As the base class says."""
        return sample
