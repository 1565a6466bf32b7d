"""A robot's limits as those of a motion, and its path through poses."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.analyses.workspaces.workspace_files import load_wrench_set
from cdpr_drake.control.task_space import PlatformDynamics
from cdpr_drake.errors import (
    PlanningError,
    RobotFileError,
    TensionProblemError,
    WrenchSetError,
    accepted_names,
)
from cdpr_drake.geometry.cable_set import CableSet
from cdpr_drake.geometry.poses import angles_from_rotation
from cdpr_drake.geometry.straight_cables import ALL_ROWS, PLANAR_ROWS
from cdpr_drake.models.robot_in_plant import platform_inertia
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.models.robot_statics import check_pose
from cdpr_drake.planning.limits import MotionLimits
from cdpr_drake.planning.path_task import PathTask
from cdpr_drake.systems.controllers.computed_torque import platform_dynamics
from cdpr_drake.trajectories.curved_path import Move, curved_path, points_on_arcs
from cdpr_drake.trajectories.pose_path import PosePath, smooth_path, straight_path
from cdpr_drake.workspaces.demanded_wrenches import SpatialSet

UPWARDS = 5  # row of a spatial vector along which the weight acts

CORNERS = ("smooth", "blend", "rest")
"""What a path does at its poses: a spline through them, straight lines with rounded corners, or
straight lines with a rest in each corner."""

RESERVE = 0.05
"""Default of the share of the limits that a plan leaves to the feedback that tracks it."""

TOLERANCE = 5e-3  # default of how far rounded corners may pass from a pose [m]

ARC_STEP = float(np.radians(5.0))
"""Largest distance of the points of an arc that a spline goes through [rad]."""


def robot_limits(
    robot: Robot, tensions: tuple[float, float] | None = None, *,
    cable_speed: float | None = None, cable_acceleration: float | None = None,
    speed: float | None = None,
) -> MotionLimits:  # fmt: skip
    """The limits of a robot, without reserve.

    Of the rated torque friction takes its largest part first: the static one, and the viscous one
    at the largest cable speed. Layers of cable on the drum are left out: rho is that of the first.

    Args:
        robot: The robot.
        tensions: Smallest and largest tension; default: the robot's [N].
        cable_speed: Largest speed of a cable; default: at the motor's rated speed [m/s].
        cable_acceleration: Largest acceleration of a cable; default: no limit [m/s^2].
        speed: Largest speed of Po; default: no limit [m/s].

    Raises:
        PlanningError: A limit is not accepted.
    """
    lower, upper = robot.tension_limits(tensions)
    winch, radii = robot.winch, robot.drum().radii(len(robot.cables))
    if robot.winch_groups().are_shared() or np.ptp(radii) > 0.0:
        raise PlanningError(
            f"robot {robot.name}: found several cables on a winch, or cables of several diameters "
            "on their drums; accepted for a plan: a winch for each cable, all alike"
        )
    ratio = float(radii[0])
    if cable_speed is None:
        cable_speed = winch.rated_cable_speed()
    torque = np.inf if winch.motor_torque is None else winch.motor_torque
    if np.isfinite(torque) and winch.friction is not None:
        torque -= winch.friction.static + winch.friction.viscous * cable_speed / ratio
    if torque <= 0.0:
        raise PlanningError(
            f"robot {robot.name}: winch.motor_torque: found {winch.motor_torque:g} N m, which "
            "is less than the friction; accepted: more"
        )
    return MotionLimits(
        lower=lower, upper=upper, cable_speed=cable_speed, torque=torque,
        cable_acceleration=np.inf if cable_acceleration is None else cable_acceleration,
        inertia=winch.inertia or 0.0, ratio=ratio, speed=np.inf if speed is None else speed,
    )  # fmt: skip


def path_task(
    robot: Robot, limits: MotionLimits | None = None, cables: CableSet | None = None, *,
    reserve: float = 0.0, resist: SpatialSet | Path | str | None = None,
) -> PathTask:  # fmt: skip
    """A robot for planning, with its limits less a reserve.

    Args:
        robot: The robot.
        limits: Limits without reserve; default: `robot_limits`.
        cables: Its cables; default: over its pulleys.
        reserve: Share of all limits that is left to feedback, see `MotionLimits.within`.
        resist: Wrenches on the platform that every point of a path must resist, or their file.

    Raises:
        PlanningError: A limit is not accepted, there are too few cables, or the platform moves
            along no axes of W.
        WrenchSetError: The wrenches are no polytope, or have too many corners.
        CdprError: The file cannot be read.
    """
    dynamics = moved_dynamics(robot)
    weight = robot.platform.mass * robot.gravity if UPWARDS in dynamics.motions else 0.0
    limits = (robot_limits(robot) if limits is None else limits).within(reserve, weight)
    cables = robot.cable_set() if cables is None else cables
    names = [cable.name for cable in robot.cables]
    if resist is None:
        return PathTask(cables, dynamics, limits, names)
    wrenches = resist if isinstance(resist, SpatialSet) else load_wrench_set(Path(resist))
    try:
        rows = wrenches.corners(dynamics.motions)
    except WrenchSetError as problem:
        file = "" if wrenches is resist else f"{resist}: "
        raise WrenchSetError(f"{file}{problem}") from problem
    corners = np.zeros((len(rows), 6))
    corners[:, list(dynamics.motions)] = rows  # a planar platform feels no others
    return PathTask(cables, dynamics, limits, names, corners)


def pose_in_degrees(X_WP: RigidTransform) -> list[float]:
    """x, y, z [m], phi, theta, psi [deg]."""
    angles = np.degrees(angles_from_rotation(X_WP.rotation()))
    return [*X_WP.translation().tolist(), *angles.tolist()]


def moved_dynamics(robot: Robot) -> PlatformDynamics:
    """A robot's platform: a body as computed torque knows it, or a point mass along axes of W.

    Raises:
        PlanningError: It moves otherwise.
        RobotFileError: Its gravity is tilted.
    """
    kind = robot.motion_type()
    if not kind.is_point and kind.rows in (ALL_ROWS, PLANAR_ROWS):
        return platform_dynamics(robot)
    if not kind.is_point or kind.rows is None:
        axis = "" if robot.axis is None else f", axis {np.round(robot.axis, 6).tolist()}"
        raise PlanningError(
            f"robot {robot.name}: motion: found {robot.motion}{axis}; accepted by a plan: 3R3T, "
            "2T1R in a horizontal plane, or 1T, 2T, 3T along axes of W"
        )
    if robot.gravity > 0.0 and robot.down() != (0.0, 0.0, -1.0):
        raise RobotFileError(
            f"robot {robot.name}: gravity_direction: found {robot.gravity_direction.tolist()}; "
            "accepted by a plan: along -z of W"
        )
    damping = robot.damping.translation, robot.damping.rotation
    return PlatformDynamics(platform_inertia(robot), robot.gravity, kind.rows, damping=damping)


def length_scale(robot: Robot) -> float:
    """By which turns count as lengths: root mean square distance of the anchor points [m]."""
    squares = np.sum(robot.cable_set().p_PB ** 2, axis=0)
    return float(np.sqrt(np.mean(squares))) or 1.0


def make_path(
    robot: Robot, poses: Sequence[RigidTransform], corners: str, tolerance: float = TOLERANCE,
    moves: Sequence[Move] = (),
) -> PosePath:  # fmt: skip
    """The path of a robot through poses.

    Args:
        robot: The robot.
        poses: X_WP, at least two [m].
        corners: One of `CORNERS`.
        tolerance: How far `blend` may pass from a corner, above 0 [m].
        moves: How it goes from each pose to the next, lines and arcs, with largest speeds; none:
            straight lines without. A `smooth` path goes through points of arcs, `ARC_STEP` apart.

    Raises:
        PlanningError: The name or the tolerance is not accepted, or a pose lies outside the robot's
            frame or is one that its platform cannot have.
        TrajectoryError: The poses make no path.
    """
    if corners not in CORNERS:
        raise PlanningError(f"corners: found {corners!r}; {accepted_names(corners, CORNERS)}")
    if not (np.isfinite(tolerance) and tolerance > 0.0):
        raise PlanningError(f"tolerance: found {tolerance:g}; accepted: above 0 [m]")
    for number, X in enumerate(poses, 1):
        _check_place(robot, X, f"{number} of {len(poses)} poses")
    scale = length_scale(robot)
    rounding = tolerance if corners == "blend" else 0.0
    if not moves:
        smooth = corners == "smooth"
        return smooth_path(poses, scale) if smooth else straight_path(poses, scale, rounding)
    points, ways = points_on_arcs(poses, moves, scale, ARC_STEP)
    for X in points:
        _check_place(robot, X, "on an arc")
    if corners != "smooth":
        return curved_path(poses, moves, scale, rounding)
    speeds = np.array([way.speed for way in ways])
    return replace(
        smooth_path(points, scale), speeds=speeds if np.any(np.isfinite(speeds)) else None
    )


def _check_place(robot: Robot, X_WP: RigidTransform, where: str) -> None:
    try:
        check_pose(robot, X_WP)
    except TensionProblemError as problem:
        raise PlanningError(f"path: {where}: {problem}") from problem
