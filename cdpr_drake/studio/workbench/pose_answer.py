"""What is known about a robot at one pose."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.arrays import Array
from cdpr_drake.models.robot_schema import Robot

if TYPE_CHECKING:
    from cdpr_drake.analyses.statics.robot_at_rest import RobotAtRest

USUAL_METHOD = "quadratic_program"


@dataclass(frozen=True, kw_only=True, eq=False)
class PoseAnswer:
    """A robot at a pose; what cannot be had is None, and a line says why.

    Attributes:
        robot: The robot.
        X_WP: The pose.
        geometry: Geometry of the cables, as `Robot.geometry_words`.
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
    geometry: str
    method: str
    methods: list[str]
    status: str
    tensions: Array
    slack: np.ndarray
    lengths: Array | None
    why_no_tensions: str
    rest: RobotAtRest | None
    why_no_rest: str
    capacity_margin: float | None
    clearance: float | None
    nearest: str
    notes: str
