"""An inertial measurement unit that adds up what it feels, for estimators slower than it is."""

from __future__ import annotations

import numpy as np
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.systems.framework import Context

from cdpr_drake.arrays import Array
from cdpr_drake.models import InertialSensorModel
from cdpr_drake.spatial import rotation_from_vector, rotation_vector
from cdpr_drake.systems.perception.inertial_sensor import InertialSensor

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
