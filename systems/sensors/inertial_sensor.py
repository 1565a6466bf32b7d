"""An inertial measurement unit on the platform: its readings, and what it feels added up.

`InertialSensor` reads at its rate. `InertialMotion` adds up what it feels between readings, for
estimators slower than it is.

Source: see the two classes.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from pydrake.common.value import Value
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.math import SpatialAcceleration, SpatialVelocity
from pydrake.systems.framework import Context, State

from cdpr_drake.arrays import Array
from cdpr_drake.estimation.sensor_noise import sample_noise, sensor_random
from cdpr_drake.geometry.poses import rotation_from_vector, rotation_vector
from cdpr_drake.models.sensor_catalogue import InertialSensorModel
from cdpr_drake.systems.sensors.sampled_sensor import INERTIAL, SampledSensor

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


_READING = 13
_TURN, _VELOCITY, _POSITION, _RATE, _TIME = (
    slice(_READING, _READING + 9),
    slice(_READING + 9, _READING + 12),
    slice(_READING + 12, _READING + 15),
    slice(_READING + 15, _READING + 18),
    _READING + 18,
)
_TRUE_TURN, _TRUE_VELOCITY = slice(32, 41), slice(41, 44)
"""Places in a sample: what the base class reads, the sums, how it truly moved at the reading."""


class InertialMotion(InertialSensor):
    """An `InertialSensor` with one more port.

    =============== ========== ======= =========================================================
    port            type       unit    meaning
    =============== ========== ======= =========================================================
    inertial_motion vector(19) -, m/s, out, since the first reading: rotation of the platform P
                               m, s    row by row; what its specific force adds up to, once and
                                       twice, in P as it was at first; its angular velocity in P;
                                       time of the last reading
    =============== ========== ======= =========================================================

    Between two readings the sensor adds up by itself what it feels, far faster than it reads, as
    the delta angles and delta velocities of such sensors do: the change of angle and of velocity is
    the true one, and the errors are those of the reading times the time. Readings of the
    moment, on the other ports, do not add up to the motion where cables vibrate. All is
    turned into P, also biases; it is felt at So, to which the sums belong.

    Source: Savage, Strapdown inertial navigation integration algorithm design, JGCD 21, 1998; sums
    as Forster, Carlone, Dellaert and Scaramuzza, IEEE Trans. Robotics 33(1), 2017, (30)-(33).
    """

    size = _TRUE_VELOCITY.stop

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
        """As `InertialSensor`."""
        super().__init__(model, X_PS, body=body, gravity=gravity, seed=seed, rate=rate)
        self._R_PS = X_PS.rotation().matrix()
        self._declare_slice("inertial_motion", _READING, 19)

    def truth(self, context: Context) -> Array:
        """As the base class, then rotation of P row by row and velocity of So in W, shape (18,)."""
        X_WP = self._pose.Eval(context)
        V_WP = self._velocities.Eval(context)[self._body]
        R = X_WP.rotation().matrix()
        lever = R @ self._X_PS.translation()
        v_S = V_WP.translational() + np.cross(V_WP.rotational(), lever)
        return np.concatenate([super().truth(context), R.ravel(), v_S])

    def next_sample(self, sample: Array, truth: Array, number: int) -> Array:
        """The sample after another one, shape (44,)."""
        read = super().next_sample(sample[:_READING], truth[:6], number)
        errors = read[:6] - truth[:6]
        after = np.empty(self.size)
        after[:_READING], after[_RATE] = read, self._R_PS @ read[3:6]
        after[_TRUE_TURN], after[_TRUE_VELOCITY] = truth[6:15], truth[15:18]
        after[_TIME] = (number - 1) / self._rate
        before = int(sample[_READING - 1])
        if before == 0:
            after[_TURN] = np.eye(3).ravel()
            after[_VELOCITY] = after[_POSITION] = 0.0
            return after
        elapsed = (number - before) / self._rate
        R0, R1 = (values[_TRUE_TURN].reshape(3, 3) for values in (sample, after))
        turn = rotation_vector(RotationMatrix.ProjectToRotationMatrix(R0.T @ R1))
        turn += self._R_PS @ errors[3:] * elapsed
        change = after[_TRUE_VELOCITY] - sample[_TRUE_VELOCITY] - self._gravity * elapsed
        R = sample[_TURN].reshape(3, 3)
        felt = R @ (R0.T @ change + self._R_PS @ errors[:3] * elapsed)
        after[_TURN] = (R @ rotation_from_vector(turn).matrix()).ravel()
        after[_VELOCITY] = sample[_VELOCITY] + felt
        after[_POSITION] = sample[_POSITION] + (sample[_VELOCITY] + 0.5 * felt) * elapsed
        return after
