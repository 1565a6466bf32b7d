"""Poses of a platform: those that its motion allows, those at which it rests, their order."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.analyses.logs.measurements import on_motion
from cdpr_drake.arrays import Array
from cdpr_drake.errors import CalibrationError, CdprError
from cdpr_drake.geometry.poses import angles_from_rotation, place_error, pose_from_angles
from cdpr_drake.models.robot_schema import Pose, Robot
from cdpr_drake.models.robot_statics import tension_problem
from cdpr_drake.tensions.methods import distribute

DRAWS = 60
"""Poses drawn for each pose that is needed, before the search ends."""

LARGEST_TURN = 0.35
"""Turns about each axis, from the pose at home [rad]."""

RIM = 0.12
"""Share of the frame's size that poses keep from its sides."""


def schema_pose(X: RigidTransform) -> Pose:
    """A pose as files of robots and scenarios have it."""
    angles = np.degrees(angles_from_rotation(X.rotation()))
    return Pose(position=np.array(X.translation()), angles_deg=angles)


def in_short_hops(poses: Sequence[RigidTransform], start: RigidTransform) -> list[RigidTransform]:
    """Poses in an order in which each is the nearest one that is left, from a start X_WP [m]."""
    left, ordered, here = list(poses), [], start
    while left:
        here = left.pop(min(range(len(left)), key=lambda k: place_error(left[k], here)))
        ordered.append(here)
    return ordered


def rest_poses(
    robot: Robot, count: int, random: np.random.Generator, least: float | None = None
) -> tuple[list[RigidTransform], Array]:
    """Poses that tensions within the robot's limits hold, and those tensions.

    Args:
        robot: The robot.
        count: Number of poses k.
        random: Draws them from the robot's frame.
        least: Smallest tension [N]; default: a hundredth of the platform's weight, or the robot's.

    Returns:
        Poses X_WP [m], and tensions of least squares, shape (k, m) [N].

    Raises:
        CalibrationError: Hardly any pose can be held.
    """
    lower, upper = np.asarray(robot.frame.lower, float), np.asarray(robot.frame.upper, float)
    low, high = robot.tension_limits()
    if least is None:
        least = max(low, 0.01 * robot.platform.mass * robot.gravity)
    rim, R_WH = RIM * (upper - lower), robot.home.transform().rotation()
    cables = robot.cable_set()
    poses: list[RigidTransform] = []
    tensions: list[Array] = []
    for _ in range(DRAWS * count):
        place, turn = random.uniform(lower + rim, upper - rim), random.uniform(-1.0, 1.0, 3)
        if robot.is_planar():
            place[2], turn[:2] = robot.plane_height or 0.0, 0.0
        R = R_WH @ pose_from_angles(np.zeros(3), LARGEST_TURN * turn).rotation()
        X_WP = on_motion(robot, RigidTransform(R, place))
        try:
            problem = tension_problem(robot, X_WP, limits=(least, high), cables=cables)
            solution = distribute(problem, "quadratic_program")
        except CdprError:
            continue
        if solution.status == "feasible":
            poses.append(X_WP)
            tensions.append(np.asarray(solution.tensions, float))
            if len(poses) == count:
                return poses, np.array(tensions)
    raise CalibrationError(
        f"poses: found {len(poses)} of {DRAWS * count} drawn in the frame of {robot.name} that "
        f"tensions of {least:g} to {high:g} N hold; accepted: at least {count}"
    )
