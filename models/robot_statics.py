"""The statics of a robot at a pose, as a tension problem."""

from __future__ import annotations

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.arrays import Array
from cdpr_drake.equilibria import HangingPlatform
from cdpr_drake.errors import TensionProblemError
from cdpr_drake.geometry import PLANAR_ROWS, CableSet, cable_jacobian, gravity_wrench
from cdpr_drake.models.robot_in_plant import platform_inertia
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.statics import RigidPlatform
from cdpr_drake.tensions import TensionProblem


def rigid_platform(robot: Robot) -> RigidPlatform:
    """The robot's platform for equilibria, stiffness and vibrations."""
    spatial = platform_inertia(robot)
    return RigidPlatform(
        robot.platform.mass,
        robot.center_of_mass(),
        spatial.CalcRotationalInertia().CopyToFullMatrix3(),
        robot.gravity,
        robot.is_planar(),
    )


def hanging_platform(robot: Robot, *, pulleys: bool) -> HangingPlatform:
    """The robot's platform on its cables, for all its equilibria; over pulleys or without."""
    cables = robot.cable_set()
    return HangingPlatform(
        cables=cables if pulleys else cables.without_pulleys(),
        weight_W=np.array([0.0, 0.0, -robot.platform.mass * robot.gravity]),
        p_PCo=robot.center_of_mass(),
        num_turns=1 if robot.is_planar() else 3,
        num_moves=2 if robot.is_planar() else 3,
        home=robot.home.transform(),
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
        robot: The robot; a planar one has the rows (moment about z, f_x, f_y) only.
        X_WP: Pose of the platform.
        wrench: External wrench on the platform about Po in W, beside its weight, shape (6,)
            (moment, force) [N m, N].
        limits: Smallest and largest tension [N]; None: the robot's.
        mass: Mass of the platform [kg]; None: the robot's.
        reference: Wanted tensions, shape (m,) [N].
        length_scale: By which methods that relax divide moments to compare them with forces [m];
            None: root mean square of the anchor points' distances from Po.
        cables: The cables; None: the robot's, from fixed exit points.

    Raises:
        CableGeometryError: A cable cannot run.
        TensionProblemError: The pose lies outside the frame, W is singular there, or a number
            makes no sense.
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
    cables = robot.cable_set().without_pulleys() if cables is None else cables
    W = -cable_jacobian(X_WP, cables).T
    weight = robot.platform.mass if mass is None else mass
    total = gravity_wrench(X_WP, weight, robot.center_of_mass(), robot.gravity)
    if wrench is not None:
        total = total + wrench
    row_scale = _row_scale(robot, length_scale)
    if robot.is_planar():
        W, total = W[list(PLANAR_ROWS)], total[list(PLANAR_ROWS)]
    low, high = robot.tension_limits(limits)
    m = len(robot.cables)
    return TensionProblem(W, total, np.full(m, low), np.full(m, high), reference, row_scale)


def _row_scale(robot: Robot, length_scale: float | None = None) -> Array:
    """What makes moments and forces of a robot comparable, one number per row of W [m, -].

    Args:
        robot: The robot; a planar one has three rows, others six.
        length_scale: For moments [m]; None: root mean square of the anchor points' distances
            from Po.
    """
    if length_scale is None:
        squares = np.sum(robot.anchor_points() ** 2, axis=0)
        length_scale = float(np.sqrt(np.mean(squares))) or 1.0  # all in Po: no moments at all
    scale = np.array([*[length_scale] * 3, 1.0, 1.0, 1.0])
    return scale[list(PLANAR_ROWS)] if robot.is_planar() else scale


def check_pose(robot: Robot, X_WP: RigidTransform) -> None:
    """Checks that the platform is within the robot's frame.

    Raises:
        TensionProblemError: Po lies outside of it.
    """
    p = X_WP.translation()
    lower, upper = robot.frame.lower, robot.frame.upper
    if np.any(p < lower) or np.any(p > upper):
        raise TensionProblemError(
            f"pose: found {_words(p)}, outside the frame of {robot.name}; "
            f"accepted: {_words(lower)} to {_words(upper)} [m]"
        )


def _words(values: Array) -> str:
    return "(" + ", ".join(f"{value:g}" for value in values) + ")"
