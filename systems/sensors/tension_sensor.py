"""Tension sensors, one on every cable."""

from __future__ import annotations

import numpy as np

from cdpr_drake.arrays import Array
from cdpr_drake.errors import SensorError
from cdpr_drake.estimation.sensor_noise import sample_noise, sensor_random, tension_readings
from cdpr_drake.models.sensor_catalogue import TensionSensorModel
from cdpr_drake.systems.sensors.sampled_sensor import SampledSensor

STREAM = 101
"""Tells the random numbers of this sensor from those of others."""


class TensionSensor(SampledSensor):
    """Reads cable tensions with constant error, noise, resolution and range.

    ================= ========= ==== ==========================================================
    port              type      unit meaning
    ================= ========= ==== ==========================================================
    tensions          vector(m) N    in, true tensions
    measured_tensions vector(m) N    out, latest readings
    ================= ========= ==== ==========================================================

    A sensor reads t + s + b + noise, rounded and limited to its range: s what it shows while the
    cable is slack, from the cable's weight and from calibration, b a constant error drawn once,
    uniform within the accuracy, noise normal with the repeatability as standard deviation.

    Source: servoing thesis, table A.6 and sections 5.3.1, 5.3.2.
    """

    def __init__(
        self,
        model: TensionSensorModel,
        count: int,
        seed: int = 0,
        slack_readings: Array | None = None,
        rate: float | None = None,
    ) -> None:
        """With m = `count` sensors of a type.

        Args:
            model: The type.
            count: How many, m.
            seed: Seed of constant errors and noise.
            slack_readings: s, what the sensors show while the cables are slack, shape (m,) [N];
                zero if None.
            rate: Readings per second [Hz]; those of the type if None.

        Raises:
            SensorError: The rate or `slack_readings` cannot be.
        """
        super().__init__(count, model.rate_hz if rate is None else rate)
        slack = np.zeros(count) if slack_readings is None else np.asarray(slack_readings, float)
        if slack.shape != (count,):
            raise SensorError(
                f"slack_readings: found {slack.size} numbers; accepted: one per cable, {count} [N]"
            )
        self._model = model
        self._seed = seed
        constant = sensor_random(seed, STREAM).uniform(-1.0, 1.0, count)
        self._offset = slack + model.accuracy * constant
        self._limits = (float(model.limits[0]), float(model.limits[1]))
        self.DeclareVectorInputPort("tensions", count)
        self._declare_slice("measured_tensions", 0, count)

    def offsets(self) -> Array:
        """What each sensor reads beyond the tension, s + b, shape (m,) [N]."""
        return self._offset.copy()

    def measure(self, truth: Array, number: int) -> Array:
        """Readings of now, shape (m,) [N]."""
        standard = sample_noise(self._seed, STREAM, number, len(self._offset))
        noise = self._model.repeatability * standard
        return tension_readings(truth, self._offset, noise, self._model.resolution, self._limits)

    def reading(self, sample: Array) -> Array:
        """The sample itself, shape (m,) [N]."""
        return sample
