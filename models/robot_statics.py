"""The statics of a robot at a pose, as a tension problem."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.arrays import Array
from cdpr_drake.errors import TensionProblemError
from cdpr_drake.geometry.cable_paths import cable_jacobian
from cdpr_drake.geometry.cable_set import CableSet
from cdpr_drake.geometry.poses import angles_from_rotation, pose_error
from cdpr_drake.geometry.straight_cables import gravity_wrench
from cdpr_drake.models.robot_schema import Robot, pose_of
from cdpr_drake.tensions.problem import TensionProblem

if TYPE_CHECKING:
    from cdpr_drake.statics.controlled_wrenches import WrenchControl
    from cdpr_drake.statics.rigid_platform import RigidPlatform

OFF_JOINT = 1e-6
"""How far a pose may be off what the motion type lets the platform have [m, rad]."""


def rigid_platform(robot: Robot) -> RigidPlatform:
    """The robot's platform for equilibria, stiffness and vibrations."""
    from cdpr_drake.models.robot_in_plant import platform_inertia
    from cdpr_drake.statics.rigid_platform import RigidPlatform

    spatial = platform_inertia(robot)
    return RigidPlatform(
        robot.platform.mass,
        robot.center_of_mass(),
        spatial.CalcRotationalInertia().CopyToFullMatrix3(),
        robot.gravity,
        robot.motion_type(),
        robot.down(),
    )


def tension_problem(
    robot: Robot,
    X_WP: RigidTransform,
    wrench: Array | None = None,
    *,
    limits: tuple[float, float] | None = None,
    mass: float | None = None,
    reference: Array | None = None,
    length_scale: float | None = None,
    cables: CableSet | None = None,
) -> TensionProblem:
    """Which tensions hold the platform at rest?

    Args:
        robot: The robot; there are the rows of `MotionType.components` only, those of a robot in a
            horizontal plane (moment about z, f_x, f_y).
        X_WP: Pose of the platform.
        wrench: External wrench on the platform about Po in W, without its weight, shape (6,)
            (moment, force) [N m, N].
        limits: Smallest and largest tension [N]; None: the robot's.
        mass: Mass of the platform [kg]; None: the robot's.
        reference: Wanted tensions, shape (m,) [N].
        length_scale: By which methods that relax divide moments to compare them with forces [m];
            None: root mean square of the anchor points' distances from Po.
        cables: The cables; None: the robot's, pulleys included.

    Raises:
        CableGeometryError: A cable cannot run.
        TensionProblemError: The pose lies outside the frame, W is singular there, or a number
            makes no sense.
    """
    balance = wrench_balance(
        robot, X_WP, wrench, limits=limits, mass=mass, length_scale=length_scale, cables=cables
    )
    return TensionProblem(
        balance.W, balance.wrench, balance.lower, balance.upper, reference, balance.row_scale
    )


@dataclass(frozen=True, eq=False)
class WrenchBalance:
    """What tensions have to balance, W t + w = 0, with any number of cables.

    Attributes:
        W: Wrench matrix, shape (n, m), rows as `MotionType.components` has them.
        wrench: External wrench w, shape (n,) [N m, N].
        lower: Smallest tensions, shape (m,) [N].
        upper: Largest tensions, shape (m,) [N].
        row_scale: What makes moments and forces comparable, shape (n,) [m, -].
        turns: How many rows, the first ones, are moments.
    """

    W: Array
    wrench: Array
    lower: Array
    upper: Array
    row_scale: Array
    turns: int

    def control(self) -> WrenchControl:
        """What the cables can do about it."""
        from cdpr_drake.statics.controlled_wrenches import wrench_control

        return wrench_control(
            self.W, self.wrench, self.lower, self.upper, self.row_scale, turns=self.turns
        )


def wrench_balance(
    robot: Robot,
    X_WP: RigidTransform,
    wrench: Array | None = None,
    *,
    limits: tuple[float, float] | None = None,
    mass: float | None = None,
    length_scale: float | None = None,
    cables: CableSet | None = None,
) -> WrenchBalance:
    """As `tension_problem`, also for fewer cables than degrees of freedom; arguments as there.

    Raises:
        CableGeometryError: A cable cannot run.
        TensionProblemError: The pose lies outside the frame, or a number makes no sense.
    """
    check_pose(robot, X_WP)
    if mass is not None and not (np.isfinite(mass) and mass >= 0.0):
        raise TensionProblemError(f"mass: found {mass:g}; accepted: >= 0 [kg]")
    if wrench is not None and np.shape(wrench) != (6,):
        raise TensionProblemError(
            f"wrench: found {np.size(wrench)} numbers; accepted: 6 (moment [N m], force [N])"
        )
    if length_scale is not None and not (np.isfinite(length_scale) and length_scale > 0.0):
        raise TensionProblemError(f"length_scale: found {length_scale:g}; accepted: above 0 [m]")
    cables = robot.cable_set() if cables is None else cables
    W = -cable_jacobian(X_WP, cables).T
    weight = robot.platform.mass if mass is None else mass
    total = gravity_wrench(X_WP, weight, robot.center_of_mass(), robot.gravity_vector())
    if wrench is not None:
        total = total + wrench
    row_scale = _row_scale(robot, length_scale)
    motion, R = robot.motion_type(), X_WP.rotation().matrix()
    W, total = motion.components(W, R), motion.components(total, R)
    low, high = robot.tension_limits(limits)
    m = len(robot.cables)
    return WrenchBalance(W, total, np.full(m, low), np.full(m, high), row_scale, motion.num_turns)


def _row_scale(robot: Robot, length_scale: float | None = None) -> Array:
    """What makes moments and forces of a robot comparable, one number per row of W [m, -].

    Args:
        robot: The robot, which has as many rows as degrees of freedom.
        length_scale: For moments [m]; None: root mean square of the anchor points' distances
            from Po.
    """
    if length_scale is None:
        squares = np.sum(robot.anchor_points() ** 2, axis=0)
        length_scale = float(np.sqrt(np.mean(squares))) or 1.0  # all in Po: no moments at all
    motion = robot.motion_type()
    return np.array([*[length_scale] * motion.num_turns, *[1.0] * motion.num_moves])


def as_wrench(
    wrench: Sequence[float] | Array | None = None,
    force: Sequence[float] | Array | None = None,
    moment: Sequence[float] | Array | None = None,
) -> Array | None:
    """A wrench on the platform about Po in W, moments first.

    Args:
        wrench: (m_x, m_y, m_z, f_x, f_y, f_z), shape (6,) [N m, N].
        force: Instead of the wrench: (f_x, f_y, f_z), shape (3,) [N].
        moment: Instead of the wrench, with or without a force: (m_x, m_y, m_z), shape (3,) [N m].

    Returns:
        Shape (6,) (moment, force) [N m, N]; None if none of them is given.

    Raises:
        TensionProblemError: Both ways are given, or a shape or number is not accepted.
    """
    parts = {"moment": (moment, 3, "[N m]"), "force": (force, 3, "[N]")}
    if wrench is None and force is None and moment is None:
        return None
    if wrench is not None:
        if force is not None or moment is not None:
            other = "moment" if force is None else "force"
            raise TensionProblemError(
                f"wrench, {other}: found both; accepted: a wrench, or a force and a moment"
            )
        parts = {"wrench": (wrench, 6, "(moment [N m], force [N])")}
    numbers = []
    for name, (given, size, unit) in parts.items():
        try:
            part = np.zeros(size) if given is None else np.asarray(given, float)
        except (TypeError, ValueError):
            part = np.empty(0)
        if part.shape != (size,):
            raise TensionProblemError(
                f"{name}: found {np.size(np.array(given, object))} numbers; accepted: {size} {unit}"
            )
        if not np.all(np.isfinite(part)):
            raise TensionProblemError(f"{name}: found {_words(part)}; accepted: finite {unit}")
        numbers.append(part)
    return np.concatenate(numbers)


def as_pose(robot: Robot, pose: object = None) -> RigidTransform:
    """X_WP of a pose that is given in one of several ways.

    Args:
        robot: The robot.
        pose: X_WP as `robot_schema.pose_of` takes it; None: the home pose.

    Raises:
        TensionProblemError: It is none of these, or no pose.
    """
    return pose_of(robot.home, pose)


def check_pose(robot: Robot, X_WP: RigidTransform) -> None:
    """Checks that the platform is within the robot's frame, and on its line or in its plane.

    A frame that was assumed refuses no pose.

    Raises:
        TensionProblemError: Po lies outside the frame, or the robot cannot have this pose.
    """
    p = X_WP.translation()
    lower, upper = robot.frame.bounds()
    if np.any(p < lower) or np.any(p > upper):
        raise TensionProblemError(
            f"pose: found {_words(p)}, outside the frame of {robot.name}; "
            f"accepted: {_words(lower)} to {_words(upper)} [m]"
        )
    if robot.motion_type().is_free:
        return
    near = robot.joint().nearest(X_WP)
    distance, angle = pose_error(near, X_WP)
    if distance > OFF_JOINT or (angle > OFF_JOINT and not robot.motion_type().is_point):
        raise TensionProblemError(
            f"pose: found {_words(p)} m, {_words(_degrees(X_WP))} deg, which {robot.name} cannot "
            f"have, a robot of type {robot.motion}; accepted: as the nearest, "
            f"{_words(near.translation())} m, {_words(_degrees(near))} deg"
        )


def _degrees(X_WP: RigidTransform) -> Array:
    return np.degrees(angles_from_rotation(X_WP.rotation()))


def _words(values: Array) -> str:
    return "(" + ", ".join(f"{round(float(value), 9) + 0.0:g}" for value in values) + ")"
