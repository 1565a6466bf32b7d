"""An inertial measurement unit on the platform."""

from __future__ import annotations

from typing import Any

import numpy as np
from pydrake.common.value import Value
from pydrake.math import RigidTransform
from pydrake.multibody.math import SpatialAcceleration, SpatialVelocity
from pydrake.systems.framework import Context, State

from cdpr_drake.arrays import Array
from cdpr_drake.estimation import sample_noise, sensor_random
from cdpr_drake.models import InertialSensorModel
from cdpr_drake.systems.perception.streams import INERTIAL
from cdpr_drake.systems.sensors import SampledSensor

_READ, _BIAS, _NUMBER = slice(0, 6), slice(6, 12), 12


class InertialSensor(SampledSensor):
    """Measures specific force and angular velocity in its own frame S.

    ================== ========================= ======= ========================================
    port               type                      unit    meaning
    ================== ========================= ======= ========================================
    X_WP               RigidTransform            m       in, true pose of the platform
    body_velocities    list[SpatialVelocity]     rad/s   in, of all bodies in W, as MultibodyPlant
                                                 m/s     has them
    body_accelerations list[SpatialAcceleration] rad/s^2 in, of all bodies in W, as MultibodyPlant
                                                 m/s^2   has them
    specific_force     vector(3)                 m/s^2   out, latest reading, in S
    angular_velocity   vector(3)                 rad/s   out, latest reading, in S
    imu_biases         vector(6)                 m/s^2   out, biases of the accelerometers and of
                                                 rad/s   the gyroscopes that the reading has
    ================== ========================= ======= ========================================

    The specific force is the acceleration of So less gravity: at rest it is as much as gravity, and
    points up. White noise has the standard deviation density times root of the rate; biases begin
    normally distributed and walk by walk times root of the time between readings.

    Source: the model of IMU noise of EuRoC and Kalibr; Woodman, 2007.

    Attributes:
        size: Numbers of a sample.
    """

    size = 13

    def __init__(
        self,
        model: InertialSensorModel,
        X_PS: RigidTransform,
        *,
        body: int,
        gravity: Array,
        seed: int = 0,
        rate: float | None = None,
    ) -> None:
        """On a platform.

        Args:
            model: The type.
            X_PS: Pose of S on the platform [m].
            body: Place of the platform among the plant's bodies.
            gravity: Acceleration of gravity in W, shape (3,) [m/s^2].
            seed: Seed of biases and noise.
            rate: Readings per second [Hz]; those of the type if None.

        Raises:
            SensorError: The rate is not positive.
        """
        super().__init__(self.size, model.rate_hz if rate is None else rate)
        self.model, self._X_PS, self._body, self._seed = model, X_PS, body, seed
        self._gravity = np.asarray(gravity, float)
        root = float(np.sqrt(self._rate))
        self._noise = np.repeat([model.accelerometer_noise * root, model.gyroscope_noise * root], 3)
        self._walk = np.repeat([model.accelerometer_walk / root, model.gyroscope_walk / root], 3)
        start = np.repeat([model.accelerometer_bias, model.gyroscope_bias], 3)
        self._start = start * sensor_random(seed, INERTIAL).standard_normal(6)
        self._limits = np.repeat([model.accelerometer_limit, model.gyroscope_limit], 3)
        self._pose = self.DeclareAbstractInputPort("X_WP", Value(RigidTransform()))
        self._velocities = self.DeclareAbstractInputPort(
            "body_velocities", Value[list[SpatialVelocity]]()
        )
        self._accelerations = self.DeclareAbstractInputPort(
            "body_accelerations", Value[list[SpatialAcceleration]]()
        )
        self._declare_slice("specific_force", 0, 3)
        self._declare_slice("angular_velocity", 3, 3)
        self._declare_slice("imu_biases", 6, 6)

    def truth(self, context: Context) -> Array:
        """Specific force and angular velocity in S without errors, shape (6,)."""
        X_WP = self._pose.Eval(context)
        w = self._velocities.Eval(context)[self._body].rotational()
        A_WP = self._accelerations.Eval(context)[self._body]
        r = X_WP.rotation() @ self._X_PS.translation()
        a = A_WP.translational() + np.cross(A_WP.rotational(), r) + np.cross(w, np.cross(w, r))
        R_SW = (X_WP.rotation() @ self._X_PS.rotation()).matrix().T
        return np.concatenate([R_SW @ (a - self._gravity), R_SW @ w])

    def measure(self, truth: Any, number: int) -> Array:
        """A reading with the biases of time 0; see `next_sample`."""
        return self.next_sample(self.nothing(), truth, number)

    def next_sample(self, sample: Array, truth: Array, number: int) -> Array:
        """The sample after another one: reading, biases, number, shape (13,)."""
        passed = number - sample[_NUMBER] if sample[_NUMBER] > 0.0 else 0.0
        bias = sample[_BIAS] if sample[_NUMBER] > 0.0 else self._start
        random = sample_noise(self._seed, INERTIAL, number, 12)
        bias = bias + np.sqrt(passed) * self._walk * random[6:]
        read = np.clip(truth + bias + self._noise * random[:6], -self._limits, self._limits)
        return np.concatenate([read, bias, [number]])

    def _take_sample(self, context: Context, state: State) -> None:
        number = self.number_at(context.get_time())
        values = state.get_mutable_discrete_state().get_mutable_vector(self._sample)
        values.SetFromVector(self.next_sample(values.CopyToVector(), self.truth(context), number))

    def reading(self, sample: Array) -> Array:
        """Specific force and angular velocity, shape (6,)."""
        return sample[_READ]
