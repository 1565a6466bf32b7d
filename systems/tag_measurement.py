"""What cameras report about a tag: the ports and the delay line that they share."""

from __future__ import annotations

from abc import abstractmethod

import numpy as np
from pydrake.common.value import AbstractValue, Value
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.systems.framework import BasicVector, Context, LeafSystem, State

from cdpr_drake.apriltag import TagPoseSolver
from cdpr_drake.arrays import Array
from cdpr_drake.pinhole import Pinhole

_FRAME_SIZE = 1 + 8 + 12
"""Numbers that one image leaves: found, four corners (u, v), X_CO (rotation row by row, origin)."""


class TagMeasurement(LeafSystem):
    """Measures a tag at a fixed rate; base of the rendered and of the projected camera.

    ======= ============== ==== ===========================================================
    port    type           unit meaning
    ======= ============== ==== ===========================================================
    corners vector(8)      px   out, (u, v) of the four corners, order of `tag_corners`
    X_CO    RigidTransform m    out, tag frame O in camera frame C; identity if not found
    found   vector(1)      -    out, 1 or 0
    ======= ============== ==== ===========================================================

    The image of time t is on the ports for a controller that acts at t, since it is taken by an
    unrestricted update, which Drake performs before the discrete updates of the same time; with
    a latency of n frames the ports lag by n periods.
    """

    def __init__(self, size: float, pinhole: Pinhole, rate: float, latency_frames: int) -> None:
        """For a tag of edge `size` [m], images at `rate` [Hz], latency in whole frames."""
        super().__init__()
        self._solver = TagPoseSolver(size, pinhole)
        self._frames = self.DeclareDiscreteState((latency_frames + 1) * _FRAME_SIZE)
        self._oldest = latency_frames * _FRAME_SIZE
        self.DeclarePeriodicUnrestrictedUpdateEvent(1.0 / rate, 0.0, self._take_image)
        ticket = {self.discrete_state_ticket(self._frames)}
        self.DeclareVectorOutputPort("corners", 8, self._calc_corners, ticket)
        self.DeclareAbstractOutputPort(
            "X_CO", lambda: Value(RigidTransform()), self._calc_pose, ticket
        )
        self.DeclareVectorOutputPort("found", 1, self._calc_found, ticket)

    @abstractmethod
    def find_corners(self, context: Context) -> Array | None:
        """Corners (u, v) in the image of now, shape (2, 4) [px], or None."""

    def _take_image(self, context: Context, state: State) -> None:
        frames = state.get_mutable_discrete_state().get_mutable_vector(self._frames)
        values = frames.CopyToVector()
        values[_FRAME_SIZE:] = values[:-_FRAME_SIZE].copy()
        values[:_FRAME_SIZE] = 0.0
        corners = self.find_corners(context)
        X_CO = None if corners is None else self._solver.solve(corners)
        if corners is not None and X_CO is not None:
            values[0] = 1.0
            values[1:9] = corners.T.ravel()
            values[9:18] = X_CO.rotation().matrix().ravel()
            values[18:21] = X_CO.translation()
        frames.SetFromVector(values)

    def _frame(self, context: Context) -> Array:
        values = context.get_discrete_state_vector().value()
        return np.asarray(values[self._oldest : self._oldest + _FRAME_SIZE])

    def _calc_corners(self, context: Context, output: BasicVector) -> None:
        output.set_value(self._frame(context)[1:9])

    def _calc_found(self, context: Context, output: BasicVector) -> None:
        output.set_value(self._frame(context)[:1])

    def _calc_pose(self, context: Context, output: AbstractValue) -> None:
        frame = self._frame(context)
        if frame[0] == 0.0:
            output.set_value(RigidTransform())
        else:
            R = RotationMatrix.ProjectToRotationMatrix(frame[9:18].reshape(3, 3))
            output.set_value(RigidTransform(R, frame[18:21]))
