"""An inertial measurement unit that adds up what it feels, for estimators slower than it is."""

from __future__ import annotations

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.arrays import Array
from cdpr_drake.models import InertialSensorModel
from cdpr_drake.spatial import exponential
from cdpr_drake.systems.perception.inertial_sensor import InertialSensor

_READING = 13
_TURN, _VELOCITY, _POSITION, _RATE, _TIME = (
    slice(_READING, _READING + 9),
    slice(_READING + 9, _READING + 12),
    slice(_READING + 12, _READING + 15),
    slice(_READING + 15, _READING + 18),
    _READING + 18,
)


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

    Between two readings the rate of turning and the specific force are the mean of both. Readings
    are turned into P, and so are biases; they are felt at So, which is where the sums belong.

    Source: Forster, Carlone, Dellaert and Scaramuzza, IEEE Trans. Robotics 33(1), 2017, (30)-(33).
    """

    size = _READING + 19

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

    def next_sample(self, sample: Array, truth: Array, number: int) -> Array:
        """The sample after another one, shape (32,)."""
        read = super().next_sample(sample[:_READING], truth, number)
        force, rate = self._R_PS @ read[:3], self._R_PS @ read[3:6]
        after = np.empty(self.size)
        after[:_READING], after[_RATE] = read, rate
        before = int(sample[_READING - 1])
        after[_TIME] = (number - 1) / self._rate
        if before == 0:
            after[_TURN] = np.eye(3).ravel()
            after[_VELOCITY] = after[_POSITION] = 0.0
            return after
        elapsed = (number - before) / self._rate
        R = sample[_TURN].reshape(3, 3)
        turn = 0.5 * elapsed * (sample[_RATE] + rate)
        R_after = R @ exponential(np.concatenate([turn, np.zeros(3)])).rotation().matrix()
        before_force = self._R_PS @ sample[:3]
        felt = 0.5 * (R @ before_force + R_after @ force)
        after[_TURN] = R_after.ravel()
        after[_VELOCITY] = sample[_VELOCITY] + felt * elapsed
        after[_POSITION] = sample[_POSITION] + sample[_VELOCITY] * elapsed + 0.5 * felt * elapsed**2
        return after
