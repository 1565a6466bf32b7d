"""A trajectory of poses as ports of a diagram."""

from __future__ import annotations

from pydrake.common.value import AbstractValue, Value
from pydrake.math import RigidTransform
from pydrake.systems.framework import BasicVector, Context, LeafSystem

from cdpr_drake.trajectories import MOTION_SIZE, PoseTrajectory, write_motion


class PoseTrajectorySource(LeafSystem):
    """What a trajectory of the platform asks for at the time of the context.

    ====== ============== ========== ========================================================
    port   type           unit       meaning
    ====== ============== ========== ========================================================
    X_WP   RigidTransform m          out, pose
    V_WP   vector(6)      rad/s, m/s out, (w, v) of P in W, v that of Po
    A_WP   vector(6)      rad/s^2,   out, (alpha, a) of P in W, a that of Po
                          m/s^2
    motion vector(19)     all these  out, the three in one row, the pose as quaternion wxyz
                                     and origin; one port of numbers is cheap in a control loop
    ====== ============== ========== ========================================================
    """

    def __init__(self, trajectory: PoseTrajectory) -> None:
        """For a trajectory that begins at its own start time."""
        super().__init__()
        self._trajectory, self._stretches = trajectory, trajectory.stretches()
        time = {self.time_ticket()}
        self.DeclareAbstractOutputPort(
            "X_WP", lambda: Value(RigidTransform()), self._calc_pose, time
        )
        self.DeclareVectorOutputPort("V_WP", 6, self._calc_velocity, time)
        self.DeclareVectorOutputPort("A_WP", 6, self._calc_acceleration, time)
        self.DeclareVectorOutputPort("motion", MOTION_SIZE, self._calc_motion, time)

    def _calc_pose(self, context: Context, output: AbstractValue) -> None:
        output.set_value(self._trajectory.pose(context.get_time()))

    def _calc_velocity(self, context: Context, output: BasicVector) -> None:
        output.set_value(self._trajectory.velocity(context.get_time()))

    def _calc_acceleration(self, context: Context, output: BasicVector) -> None:
        output.set_value(self._trajectory.acceleration(context.get_time()))

    def _calc_motion(self, context: Context, output: BasicVector) -> None:
        write_motion(context.get_time(), self._stretches, output.get_mutable_value())
