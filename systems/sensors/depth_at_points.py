"""Depths of the points of a target, as a depth camera beside a projected camera reads them."""

from __future__ import annotations

from typing import Any

import numpy as np
from pydrake.common.value import Value
from pydrake.math import RigidTransform
from pydrake.systems.framework import Context, State

from cdpr_drake.arrays import Array
from cdpr_drake.estimation.sensor_noise import sample_noise
from cdpr_drake.models.camera_catalogue import CameraFault
from cdpr_drake.models.sensor_catalogue import DepthSensorModel
from cdpr_drake.servoing.servo_task import CameraMounting
from cdpr_drake.systems.sensors.sampled_sensor import DEPTH_POINTS, SampledSensor, named_stream
from cdpr_drake.vision.pinhole import Pinhole
from cdpr_drake.vision.target import PointTarget


class DepthAtPoints(SampledSensor):
    """Reads the depth of each point of a target while that is in view.

    ====== ============== ==== ==============================================================
    port   type           unit meaning
    ====== ============== ==== ==============================================================
    X_WP   RigidTransform m    in, true pose of the platform
    X_WO   RigidTransform m    in, true pose of the object; only if it is not on the platform
    depths vector(n)      m    out, depth of each point along the optical axis; 0: none read
    ====== ============== ==== ==============================================================

    The depth camera looks through the same lens as the camera beside it, images come as late as
    that one's. The noise of a depth is normal, with the standard deviation noise + noise_per_square
    z^2; depths outside the type's limits are not read.

    Source: Khoshelham and Elberink, Sensors 12(2), 2012, for the square.
    """

    def __init__(
        self,
        model: DepthSensorModel,
        target: PointTarget,
        mounting: CameraMounting,
        pinhole: Pinhole,
        rate: float,
        *,
        latency_frames: int = 0,
        seed: int = 0,
        name: str = "",
        fault: CameraFault | None = None,
    ) -> None:
        """For a target, and where it and the camera are fixed.

        Images at `rate` [Hz], latency in whole frames; `name` tells its noise from that of others;
        in a `fault` of the camera it reads nothing.

        Raises:
            SensorError: The rate is not positive.
        """
        self._n = target.points.shape[1]
        super().__init__(self._n * (latency_frames + 1), rate)
        self.model, self._target, self._pinhole = model, target, pinhole
        self._mounting, self._fault, self._seed = mounting, fault, seed
        self._stream = named_stream(DEPTH_POINTS, name)
        self.DeclareAbstractInputPort("X_WP", Value(RigidTransform()))
        if not mounting.is_eye_to_hand():
            self.DeclareAbstractInputPort("X_WO", Value(RigidTransform()))
        self._declare_slice("depths", self._n * latency_frames, self._n)

    def truth(self, context: Context) -> RigidTransform:
        """Pose X_CO of the object in the camera [m]."""
        X_WO = None
        if not self._mounting.is_eye_to_hand():
            X_WO = self.GetInputPort("X_WO").Eval(context)
        return self._mounting.X_CO(self.GetInputPort("X_WP").Eval(context), X_WO)

    def measure(self, truth: Any, number: int) -> Array:
        """Depths of now, shape (n,) [m], of an object at a pose X_CO."""
        if not self._target.in_view(truth, self._pinhole):
            return np.zeros(self._n)
        depths = (truth @ self._target.points)[2]
        model = self.model
        deviation = model.noise + model.noise_per_square * depths**2
        read = depths + deviation * sample_noise(self._seed, self._stream, number, self._n)
        inside = (depths >= model.limits[0]) & (depths <= model.limits[1])
        return np.where(inside, read, 0.0)

    def _take_sample(self, context: Context, state: State) -> None:
        values = state.get_mutable_discrete_state().get_mutable_vector(self._sample)
        before, fault = values.CopyToVector(), self._fault
        now = self.measure(self.truth(context), self.number_at(context.get_time()))
        if fault is not None and fault.holds(context.get_time()):
            now = np.zeros(self._n)
        values.SetFromVector(np.concatenate([now, before[: -self._n]]))

    def reading(self, sample: Array) -> Array:
        """The depths that are on the port, shape (n,) [m]."""
        return sample[-self._n :]
