"""Open-loop motion along a plan by the model alone: what visual servoing is compared with.

`OpenLoopSettings` is the scenario section `open_loop`: a planned motion of the platform instead of
visual servoing.
"""

from collections.abc import Callable
from typing import Annotated, Any

import numpy as np
from pydrake.common.value import AbstractValue, Value
from pydrake.math import RigidTransform
from pydrake.systems.framework import Context

from cdpr_drake.arrays import Array
from cdpr_drake.geometry.cable_paths import cable_jacobian
from cdpr_drake.models.robot_schema import Pose
from cdpr_drake.schema.declarations import In, filled, settings
from cdpr_drake.servoing.controller import ServoController
from cdpr_drake.servoing.servo_law import saturation_share
from cdpr_drake.servoing.servo_task import BelievedRobot
from cdpr_drake.systems.controllers.feature_servo import FeatureServo
from cdpr_drake.trajectories.pose_trajectory import PoseTrajectory
from cdpr_drake.vision.pinhole import Pinhole
from cdpr_drake.vision.target import Target


@settings
class PlatformWaypoint:
    """A pose of the platform to reach and rest in."""

    pose: Annotated[Pose, "Pose of the platform in W."]
    duration: Annotated[float, In("s", gt=0.0), "Time from the pose before."]


@settings
class OpenLoopSettings:
    """The platform follows a plan from the pose believed at the start; images are only logged."""

    duration: Annotated[
        float,
        In("s", gt=0.0),
        "Time to the pose from which the target is seen as desired; without waypoints.",
    ] = 10.0
    waypoints: Annotated[list[PlatformWaypoint], "Poses to pass instead, each at rest."] = filled(
        list
    )


class OpenLoopServo(FeatureServo):
    """Cable velocities l_dot = J(planned pose) V(planned), with the believed robot's Jacobian J.

    Ports are those of `FeatureServo`, so that the two are exchanged for each other, and

    ============ ============== ==== ==========================================
    port         type           unit meaning
    ============ ============== ==== ==========================================
    X_WP_planned RigidTransform m    out, pose of the plan at the time of now
    ============ ============== ==== ==========================================

    Neither images nor the estimated pose X_WP move anything; the features' error is computed
    while the target is seen, to be logged; the gain is zero. Velocities are held between updates.

    Source: servoing thesis (A.15)-(A.21).
    """

    def __init__(
        self,
        controller: ServoController,
        target: Target,
        pinhole: Pinhole,
        rate: float,
        trajectory: PoseTrajectory,
    ) -> None:
        """With features whose error is logged, a rate [Hz], the plan."""
        super().__init__(controller, target, pinhole, rate)
        self.trajectory = trajectory
        self.DeclareAbstractOutputPort(
            "X_WP_planned", lambda: Value(RigidTransform()), self._calc_plan, {self.time_ticket()}
        )

    def decide(
        self, read: Callable[[str], Any], memory: Array, time: float
    ) -> tuple[dict[str, Array], Array]:
        """As that of `FeatureServo`, with the velocities of the plan."""
        outputs, memory = super().decide(read, memory, time)
        robot = self.controller.robot
        X_WP, V_WP = self.trajectory.pose(time), self.trajectory.velocity(time)
        rates = cable_jacobian(X_WP, robot.cables) @ V_WP
        share = saturation_share(rates, robot.cable_speed)
        R_PW = X_WP.rotation().matrix().T
        V_P = (R_PW @ V_WP.reshape(2, 3).T).T.ravel()
        outputs |= {
            "cable_velocities": share * rates,
            "platform_velocity": share * V_P,
            "gain": np.zeros(1),
        }
        return outputs, memory

    def _calc_plan(self, context: Context, output: AbstractValue) -> None:
        output.set_value(self.trajectory.pose(context.get_time()))


def open_loop_plan(
    settings: OpenLoopSettings | None, robot: BelievedRobot, X_WPd: RigidTransform
) -> PoseTrajectory | None:
    """The plan that a scenario asks for, from the pose believed at the start; None if it does not.

    Args:
        settings: The scenario's section.
        robot: The robot as it is believed to be.
        X_WPd: Pose from which the target is seen as desired, the end if no poses are given [m].
    """
    if settings is None:
        return None
    if not settings.waypoints:
        return PoseTrajectory((robot.X_WP0, X_WPd), (settings.duration,))
    poses = (robot.X_WP0, *(point.pose.transform() for point in settings.waypoints))
    return PoseTrajectory(poses, tuple(point.duration for point in settings.waypoints))
