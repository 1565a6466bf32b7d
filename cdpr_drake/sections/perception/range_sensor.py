"""A laser scanner, or a single beam."""

from __future__ import annotations

import numpy as np
from pydrake.common.value import AbstractValue, Value
from pydrake.geometry import FrameId, QueryObject
from pydrake.math import RigidTransform
from pydrake.systems.framework import Context

from cdpr_drake.arrays import Array
from cdpr_drake.geometry.ray_shapes import fan_angles, fan_directions, reported_ranges
from cdpr_drake.models.sensor_catalogue import RangeSensorModel
from cdpr_drake.systems.sensors.sampled_sensor import (
    RANGES,
    SampledSensor,
    large_noise,
    named_stream,
)
from cdpr_drake.systems.sensors.scene_shapes import SceneShapes


class RangeSensor(SampledSensor):
    """Measures distances along beams to what is in the scene.

    ============ ============== ==== ==========================================================
    port         type           unit meaning
    ============ ============== ==== ==========================================================
    query_object QueryObject    -    in, of the scene graph
    X_BH         RigidTransform m    in, may stay open: pose of the head H that carries the sensor
                                     on the body B; the identity where it is open
    ranges       vector(k)      m    out, latest scan, beam by beam; inf beyond the largest range,
                                     -inf below the smallest
    ============ ============== ==== ==========================================================

    The beams start at So and lie in the plane z = 0 of the sensor's frame S, by angle from x to y.
    What is fixed to the body that carries the sensor is not seen, unless that is the world; nor
    are cables, which are no geometry of the scene. All beams of a scan are of one instant.

    Source: ROS REP 117 for what is out of range.
    """

    def __init__(
        self,
        model: RangeSensorModel,
        parent: FrameId,
        X_HS: RigidTransform,
        *,
        name: str = "",
        seed: int = 0,
        rate: float | None = None,
        sees: str = "perception",
        sees_parent: bool = False,
    ) -> None:
        """On a body of a scene.

        Args:
            model: The type.
            parent: Geometry frame of the body B that carries it.
            X_HS: Pose of S in the head H, in B where there is no head [m].
            name: Its name, which tells its noise from that of others.
            seed: Seed of the noise.
            rate: Scans per second [Hz]; those of the type if None.
            sees: One of `ROLES`.
            sees_parent: Whether it sees what is fixed to its own body.

        Raises:
            SensorError: The rate is not positive.
        """
        super().__init__(model.beams, model.rate_hz if rate is None else rate)
        self.model = model
        first, last = np.radians([model.first_angle_deg, model.last_angle_deg])
        self.angles = fan_angles(float(first), float(last), model.beams)
        self._directions = fan_directions(self.angles)
        self._parent, self._X_HS = parent, X_HS
        self._seed, self._stream = seed, named_stream(RANGES, name)
        self._shapes = SceneShapes(sees, None if sees_parent else parent)
        self.DeclareAbstractInputPort("query_object", AbstractValue.Make(QueryObject()))
        self._head = self.DeclareAbstractInputPort("X_BH", Value(RigidTransform()))
        self._declare_slice("ranges", 0, model.beams)

    def truth(self, context: Context) -> Array:
        """True distances along the beams, inf where there is nothing, shape (k,) [m].

        Raises:
            SensorError: The scene has a shape that rays cannot be cast on.
        """
        query = self.get_input_port(0).Eval(context)
        X_WS = query.GetPoseInWorld(self._parent) @ self._X_HS
        if self._head.HasValue(context):
            X_WS = query.GetPoseInWorld(self._parent) @ self._head.Eval(context) @ self._X_HS
        directions = self._directions @ X_WS.rotation().matrix().T
        return self._shapes.cast(query, X_WS.translation(), directions)[0]

    def measure(self, truth: Array, number: int) -> Array:
        """The scan of now, shape (k,) [m]."""
        model, noise = self.model, np.zeros(len(truth))
        if model.noise > 0.0 or model.noise_share > 0.0:
            there = np.where(np.isfinite(truth), truth, 0.0)
            noise = large_noise(self._seed, self._stream, number, len(truth))
            noise *= model.noise + model.noise_share * there
        limits = (float(model.limits[0]), float(model.limits[1]))
        return reported_ranges(truth, noise, limits, model.resolution)

    def reading(self, sample: Array) -> Array:
        """The sample itself, shape (k,) [m]."""
        return sample
