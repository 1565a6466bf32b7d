"""What is known about a robot at one pose, and who is asked for it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.arrays import Array
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.studio.workbench.pose_axes import pose_axes

if TYPE_CHECKING:
    from cdpr_drake.analyses.statics.static_query import StaticReport
    from cdpr_drake.studio.workbench.pose_solver import PoseSolver

USUAL_METHOD = "quadratic_program"


@dataclass(frozen=True, kw_only=True, eq=False)
class PoseAnswer:
    """A robot at a pose; what cannot be had is None, and a line says why.

    Attributes:
        robot: The robot.
        X_WP: The pose.
        method: Which distributed the tensions.
        methods: Names of those that take this robot.
        status: Of the tensions, in words.
        tensions: As `cdpr tension` prints them, shape (m,) [N]; NaN where there are none.
        slack: Which cables are slack by them, shape (m,).
        lengths: Of the straight paths between exit and anchor points over pulleys, shape (m,) [m].
        why_no_tensions: Why there are none; empty: there are.
        rest: As `cdpr static` prints it.
        why_no_rest: Why it is None.
        capacity_margin: As `cdpr workspace --measure capacity-margin` [N].
        clearance: Least distance of cables and platform from what they may meet [m].
        nearest: What is at that distance, in words.
        notes: Why one of the last two is None.
    """

    robot: Robot
    X_WP: RigidTransform
    method: str
    methods: list[str]
    status: str
    tensions: Array
    slack: np.ndarray
    lengths: Array | None
    why_no_tensions: str
    rest: StaticReport | None
    why_no_rest: str
    capacity_margin: float | None
    clearance: float | None
    nearest: str
    notes: str


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
