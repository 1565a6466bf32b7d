"""Who is asked about a robot at a pose."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING

from pydrake.math import RigidTransform

from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.studio.workbench.pose_answer import USUAL_METHOD, PoseAnswer
from cdpr_drake.studio.workbench.pose_axes import pose_axes

if TYPE_CHECKING:
    from cdpr_drake.studio.workbench.pose_solver import PoseSolver


class RobotQuestions:
    """Asks about one robot at many poses; what computes is imported at the first question."""

    def __init__(self, robot: Robot) -> None:
        """About a robot."""
        self.robot = robot
        self.axes = pose_axes(robot)

    @cached_property
    def _solver(self) -> PoseSolver:
        from cdpr_drake.studio.workbench.pose_solver import PoseSolver

        return PoseSolver(self.robot)

    def at(
        self, X_WP: RigidTransform, method: str = USUAL_METHOD, reference: float | None = None
    ) -> PoseAnswer:
        """Everything at a pose.

        Args:
            X_WP: The pose.
            method: A name of `tensions.METHODS`.
            reference: Wanted tension of all cables [N], for methods that need one.
        """
        return self._solver.at(X_WP, method, reference)
