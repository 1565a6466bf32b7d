"""Reach: bring the platform to a pose, and hold it there.

    reward = 1 - tanh sqrt((d / 0.25 reach)^2 + (angle / 0.2)^2) - costs

with distance d and angle from the goal; costs are those of `robot_task.EFFORT`.
"""

from __future__ import annotations

import numpy as np
from pydrake.math import RigidTransform
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import RigidBody

from cdpr_drake.analyses.learning.robot_picture import GOAL_COLOR, add_shown_body
from cdpr_drake.analyses.learning.robot_task import (
    ANGLE,
    DISTANCE_SHARE,
    NEAR_ANGLE,
    NEAR_SHARE,
    RobotTask,
    TaskOptions,
)
from cdpr_drake.analyses.learning.task_kernel import add_closeness, write_aims
from cdpr_drake.arrays import Array
from cdpr_drake.geometry.poses import pose_from_row, pose_row
from cdpr_drake.models.robot_in_plant import platform_shape


class ReachTask(RobotTask):
    """Goals are poses of the box; the observation ends with where the goal is (6)."""

    def __init__(self, count: int, options: TaskOptions) -> None:
        """As `RobotTask`."""
        super().__init__(count, options)
        self._goals = np.tile(self._home_row, (count, 1))
        self._errors = np.zeros((count, 2))
        self._error_scales = np.array([DISTANCE_SHARE * self.reach, ANGLE])

    def _aimed(self) -> int:
        return 6

    def _begin(self, row: int, random: np.random.Generator) -> RigidTransform:
        start = self._drawn_pose(random)
        self._goals[row] = pose_row(self.box.rest(self._drawn_pose(random)))
        return start

    def _look(self, rows: np.ndarray, moved: bool) -> None:
        write_aims(self.batch.poses, self._goals, self.scales, self._own(), self._errors)

    def _judge(self, actions: Array) -> None:
        add_closeness(self._errors, self._error_scales, np.ones(self.count), self.rewards)

    def goals(self) -> Array:
        """Rows of `pose_row` that the platforms shall reach, shape (count, 7) [-, m]."""
        return self._goals.copy()

    def add_bodies(self, plant: MultibodyPlant) -> list[RigidBody]:
        """The platform where it shall be."""
        goal = add_shown_body(plant, "goal")
        X_PShape, shape = platform_shape(self.robot)
        plant.RegisterVisualGeometry(goal, X_PShape, shape, "goal", GOAL_COLOR)
        return [goal]

    def places(self, row: int) -> list[RigidTransform]:
        """That of the goal."""
        return [pose_from_row(self._goals[row])]

    def infos(self) -> dict[str, np.ndarray]:
        """Distance [m], angle [rad], and whether both are small."""
        distance, angle = self._errors.T.copy()
        near = (distance < NEAR_SHARE * self.reach) & (angle < NEAR_ANGLE)
        return {"distance": distance, "angle": angle, "success": near}
