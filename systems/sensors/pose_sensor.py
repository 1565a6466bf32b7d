"""A system that measures the platform's pose from outside: a tracker or metrology."""

from __future__ import annotations

import numpy as np
from pydrake.common.value import AbstractValue, Value
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.systems.framework import Context

from cdpr_drake.arrays import Array
from cdpr_drake.estimation.sensor_noise import (
    PoseBias,
    moved_pose,
    random_direction,
    random_rotation,
    sample_noise,
    sensor_random,
)
from cdpr_drake.models.sensor_catalogue import PoseSensorModel
from cdpr_drake.systems.sensors.sampled_sensor import SampledSensor

STREAM = 103
"""Tells the random numbers of this sensor from those of others."""


class PoseSensor(SampledSensor):
    """Measures the pose of the platform with a bias that grows away from its registration.

    ============= ============== ==== ========================================================
    port          type           unit meaning
    ============= ============== ==== ========================================================
    X_WP          RigidTransform m    in, true pose of the platform
    X_WP_measured RigidTransform m    out, latest measurement
    ============= ============== ==== ========================================================

    The bias is a `PoseBias` of the sizes that the type gives, in directions that the seed decides;
    the noise is normal, in each coordinate of the position in W and in each component of a
    rotation vector in P.
    """

    def __init__(
        self,
        model: PoseSensorModel,
        X_WK: RigidTransform | None = None,
        seed: int = 0,
        rate: float | None = None,
    ) -> None:
        """With a type of sensor.

        Args:
            model: The type.
            X_WK: Pose of the platform where the sensor was registered; identity if None [m].
            seed: Seed of the bias and the noise.
            rate: Poses per second [Hz]; those of the type if None.

        Raises:
            SensorError: The rate is not positive.
        """
        super().__init__(12, model.rate_hz if rate is None else rate)
        random = sensor_random(seed, STREAM)
        self._bias = PoseBias(
            X_WK=RigidTransform() if X_WK is None else X_WK,
            offset=model.position_accuracy * random_direction(random),
            per_distance=model.error_per_distance * random_rotation(random),
            per_angle=model.error_per_angle * random_rotation(random),
            turn=float(np.radians(model.rotation_accuracy_deg)) * random_direction(random),
        )
        self._deviation = np.repeat(
            [model.position_repeatability, np.radians(model.rotation_repeatability_deg)], 3
        )
        self._seed = seed
        self.DeclareAbstractInputPort("X_WP", Value(RigidTransform()))
        self.DeclareAbstractOutputPort(
            "X_WP_measured",
            lambda: Value(RigidTransform()),
            self._calc_pose,
            {self.discrete_state_ticket(self._sample)},
        )

    def bias(self) -> PoseBias:
        """The systematic error that the seed gave."""
        return self._bias

    def measure(self, truth: RigidTransform, number: int) -> Array:
        """Pose of now: rotation row by row, position, shape (12,)."""
        X_WP = truth
        noise = self._deviation * sample_noise(self._seed, STREAM, number, 6)
        X = moved_pose(X_WP, self._bias.shift(X_WP) + noise[:3], self._bias.turn + noise[3:])
        return np.concatenate([X.rotation().matrix().ravel(), X.translation()])

    def _calc_pose(self, context: Context, output: AbstractValue) -> None:
        output.set_value(self.reading(self.sample(context)))

    def reading(self, sample: Array) -> RigidTransform:
        """The pose of a sample [m]; the identity before the first."""
        if not sample.any():
            return RigidTransform()
        R = RotationMatrix.ProjectToRotationMatrix(sample[:9].reshape(3, 3))
        return RigidTransform(R, sample[9:])
