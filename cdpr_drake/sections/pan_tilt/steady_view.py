"""A turned camera's measurement as a camera at rest would have it."""

from __future__ import annotations

import numpy as np
from pydrake.common.value import AbstractValue, Value
from pydrake.math import RigidTransform
from pydrake.systems.framework import BasicVector, Context, LeafSystem, State, ValueProducer

from cdpr_drake.arrays import Array
from cdpr_drake.geometry.poses import pose_from_row, pose_row
from cdpr_drake.servoing.turned_view import steady_view
from cdpr_drake.vision.pinhole import Pinhole
from cdpr_drake.vision.target import PointTarget

_POSE = 7


class SteadyView(LeafSystem):
    """Takes what a camera on two joints measures to where the camera is with both angles zero, C0.

    ============ ============== ==== ============================================================
    port         type           unit meaning
    ============ ============== ==== ============================================================
    turned_X_CO  RigidTransform m    in, as `TargetMeasurement` has X_CO, of the turned camera
    turned_found vector(1)      -    in, its found
    turned_marks vector(2 n)    px   in, its corners
    X_BC_encoder RigidTransform m    in, the camera on its carrier by the joints' encoders
    corners      vector(2 n)    px   out, of the camera at rest, also beyond the rim of its image
    X_CO         RigidTransform m    out, X_C0O; identity if not found
    found        vector(1)      -    out, 1 or 0; 0 also where the target is beside or behind C0
    ============ ============== ==== ============================================================

    The encoders are read at the instants of the images, and wait with them as long as these are
    late. By `servoing.turned_view.steady_view`.
    """

    def __init__(
        self,
        target: PointTarget,
        pinhole: Pinhole,
        X_BC0: RigidTransform,
        rate: float,
        latency_frames: int = 0,
    ) -> None:
        """For a target, and a camera whose pose on its carrier with both angles zero is X_BC0 [m];
        images at `rate` [Hz], latency in whole frames."""
        super().__init__()
        self._target, self._pinhole, self._X_C0B = target, pinhole.ideal, X_BC0.inverse()
        self._pose = self.DeclareAbstractInputPort("turned_X_CO", Value(RigidTransform()))
        self._found = self.DeclareVectorInputPort("turned_found", 1)
        self._marks = self.DeclareVectorInputPort("turned_marks", target.size)
        self._encoder = self.DeclareAbstractInputPort("X_BC_encoder", Value(RigidTransform()))
        rest = np.tile(pose_row(X_BC0), latency_frames + 1)
        self._places = self.DeclareDiscreteState(rest)
        self.DeclarePeriodicUnrestrictedUpdateEvent(1.0 / rate, 0.0, self._read)
        # One entry of the cache for the outputs, which all come of one computation.
        inputs = (self._pose, self._found, self._marks)
        self._seen = self.DeclareCacheEntry(
            "seen",
            ValueProducer(lambda: Value(np.zeros(8 + target.size)), self._calc_seen),
            {self.xd_ticket(), *(self.input_port_ticket(port.get_index()) for port in inputs)},
        )
        ticket = {self._seen.ticket()}
        self.DeclareVectorOutputPort("corners", target.size, self._calc_marks, ticket)
        self.DeclareAbstractOutputPort(
            "X_CO", lambda: Value(RigidTransform()), self._calc_pose, ticket
        )
        self.DeclareVectorOutputPort("found", 1, self._calc_found, ticket)

    def _read(self, context: Context, state: State) -> None:
        places = state.get_mutable_discrete_state().get_mutable_vector(self._places)
        before = places.CopyToVector()
        now = pose_row(self._encoder.Eval(context))
        places.SetFromVector(np.concatenate([now, before[:-_POSE]]))

    def _calc_seen(self, context: Context, output: AbstractValue) -> None:
        values = np.zeros(8 + self._target.size)
        values[1] = 1.0
        if self._found.Eval(context)[0] != 0.0:
            place = context.get_discrete_state(self._places).value()[-_POSE:]
            marks = self._marks.Eval(context)
            seen = steady_view(
                self._X_C0B @ pose_from_row(place),
                self._pose.Eval(context),
                self._target.normalized(marks, self._pinhole),
                self._target.points,
            )
            if seen is not None:
                values[0], values[1:8] = 1.0, pose_row(seen[0])
                camera = self._pinhole
                u, v = camera.cx + camera.fx * seen[1][0], camera.cy + camera.fy * seen[1][1]
                values[8:] = np.array([u, v]).T.ravel()
        output.set_value(values)

    def _values(self, context: Context) -> Array:
        return np.asarray(self._seen.Eval(context))

    def _calc_marks(self, context: Context, output: BasicVector) -> None:
        output.set_value(self._values(context)[8:])

    def _calc_found(self, context: Context, output: BasicVector) -> None:
        output.set_value(self._values(context)[:1])

    def _calc_pose(self, context: Context, output: AbstractValue) -> None:
        output.set_value(pose_from_row(self._values(context)[1:8]))
