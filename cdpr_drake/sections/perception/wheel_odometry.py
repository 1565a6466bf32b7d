"""Where a robot on two driven wheels believes to be, by counting their turns."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from pydrake.common.value import AbstractValue, Value
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.systems.framework import Context, State

from cdpr_drake.arrays import Array
from cdpr_drake.estimation.sensor_noise import encoder_readings, sample_noise, sensor_random
from cdpr_drake.systems.sensors.sampled_sensor import ODOMETRY, SampledSensor
from cdpr_drake.trajectories.mobile_robot import MobileRobotMotion

_ROLLED, _COUNTED, _PLACE, _TRUE = slice(0, 2), slice(2, 4), slice(4, 7), slice(7, 9)


@dataclass(frozen=True, kw_only=True)
class WheelModel:
    """Wheels, their encoders, and what is wrong with both.

    Attributes:
        radius: Of the wheels, as it is believed [m].
        counts_per_turn: Counts of an encoder per turn of its wheel.
        scale_error: Standard deviation of the relative error of a wheel's radius, drawn once.
        base_error: Standard deviation of the relative error of the wheels' distance, drawn once.
        slip: Standard deviation of what a wheel turns too much on one metre, growing with the
            root of the way [m/sqrt(m)].
    """

    radius: float
    counts_per_turn: int
    scale_error: float = 0.0
    base_error: float = 0.0
    slip: float = 0.0


class WheelOdometry(SampledSensor):
    """Counts the turns of a mobile robot's wheels, and integrates its pose from them.

    =============== ============== ==== ========================================================
    port            type           unit meaning
    =============== ============== ==== ========================================================
    wheel_distances vector(2)      m    out, latest, left and right: by the encoders and the
                                        believed radius
    X_WO_odometry   RigidTransform m    out, latest pose of the robot, which is right at time 0
    =============== ============== ==== ========================================================

    Between two samples the robot is believed to drive an arc of a circle. A sample in which the
    true robot goes over from a straight to a bend is no such arc: that costs a little even without
    other errors.

    Source: Borenstein and Feng, 1996, for the errors; Thrun, Burgard, Fox, Probabilistic Robotics,
    2005, 5.4, for the arc.
    """

    def __init__(
        self,
        motion: MobileRobotMotion,
        model: WheelModel,
        *,
        seed: int = 0,
        rate: float = 50.0,
    ) -> None:
        """On a robot that moves by itself, with samples at `rate` [Hz].

        Raises:
            SensorError: The rate is not positive.
        """
        super().__init__(9, rate)
        self._motion, self._model, self._seed = motion, model, seed
        random = sensor_random(seed, ODOMETRY).standard_normal(3)
        self._scale = 1.0 + model.scale_error * random[:2]
        self._base = motion.wheel_base() * (1.0 + model.base_error * float(random[2]))
        self._declare_slice("wheel_distances", 2, 2)
        self.DeclareAbstractOutputPort(
            "X_WO_odometry",
            lambda: Value(RigidTransform()),
            self._calc_pose,
            {self.discrete_state_ticket(self._sample)},
        )

    def truth(self, context: Context) -> Array:
        """How far the wheels have rolled, left and right, shape (2,) [m]."""
        return np.array(self._motion.wheel_distances(context.get_time()))

    def measure(self, truth: Any, number: int) -> Array:
        """A sample after none; see `next_sample`."""
        return self.next_sample(self.nothing(), truth, number)

    def next_sample(self, sample: Array, truth: Array, number: int) -> Array:
        """The sample after another one, shape (9,): rolled, counted, place, true distances."""
        model, way = self._model, truth - sample[_TRUE]
        noise = sample_noise(self._seed, ODOMETRY, number, 2)
        rolled = sample[_ROLLED] + self._scale * way + model.slip * np.sqrt(np.abs(way)) * noise
        counted = model.radius * encoder_readings(rolled / model.radius, model.counts_per_turn)
        left, right = counted - sample[_COUNTED]
        place = arc_end(sample[_PLACE], left, right, self._base)
        return np.concatenate([rolled, counted, place, truth])

    def _take_sample(self, context: Context, state: State) -> None:
        number = self.number_at(context.get_time())
        values = state.get_mutable_discrete_state().get_mutable_vector(self._sample)
        values.SetFromVector(self.next_sample(values.CopyToVector(), self.truth(context), number))

    def reading(self, sample: Array) -> RigidTransform:
        """X_WO of a sample [m]."""
        x, y, heading = sample[_PLACE]
        X_SO = RigidTransform(RotationMatrix.MakeZRotation(heading), [x, y, 0.0])
        return self._motion.at(0.0) @ X_SO

    def _calc_pose(self, context: Context, output: AbstractValue) -> None:
        output.set_value(self.reading(self.sample(context)))


def arc_end(place: Array, left: float, right: float, base: float) -> Array:
    """Where a robot is after an arc on which its wheels roll so far.

    Args:
        place: x, y [m] and heading [rad] before, shape (3,).
        left: How far the left wheel rolls [m].
        right: How far the right wheel rolls [m].
        base: Distance of the wheels [m].

    Returns:
        x, y, heading after it, shape (3,).
    """
    way, turned = 0.5 * (left + right), (right - left) / base
    x, y, heading = place
    chord = way * float(np.sinc(0.5 * turned / np.pi))
    middle = heading + 0.5 * turned
    return np.array([x + chord * np.cos(middle), y + chord * np.sin(middle), heading + turned])
