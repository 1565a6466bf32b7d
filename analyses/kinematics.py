"""Kinematics of a robot: cable lengths at a pose, the pose at cable lengths, and a drawing."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.analyses.frame.result import Result, Table
from cdpr_drake.analyses.frame.verb import verb
from cdpr_drake.analyses.frame.words import Numbers, PoseWord, RobotWord
from cdpr_drake.arrays import Array
from cdpr_drake.errors import EquilibriumError, TensionProblemError
from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.geometry.poses import angles_from_rotation
from cdpr_drake.models.robot_loader import as_robot
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.models.robot_statics import as_pose, check_pose
from cdpr_drake.statics.forward_kinematics import ForwardKinematics, PoseFit
from cdpr_drake.summaries import numbers

if TYPE_CHECKING:
    from matplotlib.figure import Figure

DOUBTFUL = 0.005
"""A residual above this share of the mean length is remarked: measured lengths of a machine are off
by less."""


@dataclass(frozen=True, eq=False, repr=False)
class CableLengths(Result):
    """Lengths and directions of a robot's cables at a pose.

    Attributes:
        robot: The robot.
        X_WP: The pose [m].
        geometry: Geometry of the cables, as `Robot.geometry_words`.
        lengths: From A along the groove of the pulley and straight to B, shape (m,) [m].
        directions: Unit vectors u in W along the free parts, from where a cable leaves its pulley,
            A without one, to B, shape (3, m) [-]. A tension t pulls the platform with -t u.
    """

    robot: Robot
    X_WP: RigidTransform
    geometry: str
    lengths: Array
    directions: Array

    def as_dict(self) -> dict[str, Any]:
        """For JSON; keys end in units."""
        return {
            "robot": self.robot.name,
            **pose_numbers(self.X_WP),
            "geometry": self.geometry,
            "lengths_m": self.lengths.tolist(),
            "directions": self.directions.T.tolist(),
        }

    def tables(self) -> list[Table]:
        """A row for each cable."""
        place = numbers(self.X_WP.translation())
        title = f"Cables of {self.robot.name} at ({place}) m, {self.geometry}"
        each = zip(self.robot.cables, self.lengths, self.directions.T, strict=True)
        rows = [
            (cable.name, f"{length:.5f}", *(f"{x:.4f}" for x in u)) for cable, length, u in each
        ]
        return [Table(title, ("cable", "length [m]", "u_x", "u_y", "u_z"), rows)]

    def figures(self) -> dict[str, Callable[[], Figure]]:
        """The robot at the pose."""
        return {"pose": lambda: plot(self.robot, self.X_WP)}


@dataclass(frozen=True, eq=False, repr=False)
class PoseFromLengths(Result):
    """The pose of a robot's platform that fits cable lengths best.

    Attributes:
        robot: The robot.
        lengths: The lengths, shape (m,) [m].
        fit: The pose with its residuals, Jacobian, `covariance` and `condition`.
        geometry: Geometry of the cables, as `Robot.geometry_words`.
    """

    robot: Robot
    lengths: Array
    fit: PoseFit
    geometry: str

    @property
    def X_WP(self) -> RigidTransform:
        """The pose [m]."""
        return self.fit.X_WP

    @property
    def residuals(self) -> Array:
        """Lengths at the pose minus `lengths`, shape (m,) [m]."""
        return self.fit.residuals

    def deviations(self) -> tuple[float, float] | None:
        """Standard deviations of the position [m] and of the rotation [rad], root sums of squares
        over the axes, from the scatter of the lengths; None without redundant cables."""
        scatter = self.fit.scatter()
        if scatter is None:
            return None
        variances, turns = np.diag(self.fit.covariance(scatter)), self.fit.turns
        return float(np.sqrt(variances[turns:].sum())), float(np.sqrt(variances[:turns].sum()))

    def as_dict(self) -> dict[str, Any]:
        """For JSON; keys end in units."""
        deviations = self.deviations()
        return {
            "robot": self.robot.name,
            "geometry": self.geometry,
            "lengths_m": self.lengths.tolist(),
            **pose_numbers(self.X_WP),
            "residuals_m": self.residuals.tolist(),
            "length_scatter_m": self.fit.scatter(),
            "position_deviation_m": None if deviations is None else deviations[0],
            "rotation_deviation_deg": None if deviations is None else np.degrees(deviations[1]),
            "steps": self.fit.steps,
            "remarks": self.remarks(),
        }

    def remarks(self) -> list[str]:
        """What speaks against the lengths or the pose; empty for nothing."""
        remarks, worst = [], int(np.argmax(np.abs(self.residuals)))
        residual = abs(float(self.residuals[worst]))
        if residual > DOUBTFUL * float(np.mean(self.lengths)):
            remarks.append(
                f"the lengths belong to no pose: the best fit misses that of "
                f"{self.robot.cables[worst].name} by {1e3 * residual:.3g} mm"
            )
        try:
            check_pose(self.robot, self.X_WP)
        except TensionProblemError as problem:
            remarks.append(str(problem).removeprefix("pose: found "))
        return remarks

    def tables(self) -> list[Table]:
        """The pose and how well it fits."""
        angles = np.degrees(angles_from_rotation(self.X_WP.rotation()))
        largest = float(np.max(np.abs(self.residuals)))
        rows = [
            ("geometry", self.geometry),
            ("position [m]", numbers(self.X_WP.translation(), 5)),
            ("angles [deg]", numbers(angles)),
            ("residuals", f"at most {1e3 * largest:.2g} mm, in {self.fit.steps} steps"),
        ]
        deviations = self.deviations()
        if deviations is not None:
            distance, angle = 1e3 * deviations[0], np.degrees(deviations[1])
            rows.append(("standard deviation", f"{distance:.2g} mm, {angle:.2g} deg"))
        return [Table(f"Pose of {self.robot.name} from its cable lengths", (), rows)]

    def lines(self) -> list[str]:
        """Remarks."""
        return [f"remark: {words}" for words in self.remarks()]

    def figures(self) -> dict[str, Callable[[], Figure]]:
        """The robot at the pose."""
        from cdpr_drake.analyses.visualization.path_figures import poses_figure

        title = f"{self.robot.name}: pose from cable lengths, {self.geometry}"
        return {"pose": lambda: poses_figure(title, self.robot, {"platform": self.X_WP})}


@verb()
def solve_inverse_kinematics(
    robot: RobotWord, pose: PoseWord = None, *, pulleys: bool = True
) -> CableLengths:
    """Computes lengths and directions of the cables at a pose.

    Args:
        robot: Robot by name or file.
        pose: Pose X_WP of the platform [m, deg]; default: its home.
        pulleys: Take the robot's pulleys into account; without them cables run from fixed exit
            points.

    Raises:
        CableGeometryError: A cable cannot run there.
        TensionProblemError: It is no pose, the pose is outside the frame, or the robot cannot have
            it.

    Source: servoing thesis (1.5), (1.15) to (1.17).
    """
    loaded = as_robot(robot, "solve_inverse_kinematics")
    X_WP = as_pose(loaded, pose)
    check_pose(loaded, X_WP)
    paths = cable_paths(X_WP, loaded.cable_set(pulleys))
    return CableLengths(loaded, X_WP, loaded.geometry_words(pulleys), paths.lengths, paths.u_W)


@verb()
def solve_forward_kinematics(
    robot: RobotWord, lengths: Numbers, guess: PoseWord = None, *, pulleys: bool = True
) -> PoseFromLengths:
    """Finds the pose near a guess that fits cable lengths best, by least squares.

    Measured lengths of more cables than degrees of freedom contradict each other by their errors:
    the pose minimises the sum of squared residuals, and the result has the residuals, and the
    deviations of the pose that follow from their scatter. Read them: lengths that belong to no pose
    show there.

    Args:
        robot: Robot by name or file, with at least as many cables as degrees of freedom.
        lengths: Cable lengths from A to B, stretched if the cables are elastic, l1,...,lm [m].
        guess: Pose X_WP of the platform [m, deg]; default: its home.
        pulleys: Take the robot's pulleys into account; without them cables run from fixed exit
            points.

    Raises:
        ForwardKinematicsError: A residual is above a tenth of the mean length; without redundant
            cables, no pose near the guess has these lengths; or they do not determine one.

    Source: servoing thesis, section 2.2.3.
    """
    loaded = as_robot(robot, "solve_forward_kinematics")
    solver = ForwardKinematics(loaded.cable_set(pulleys), loaded.motion_type())
    start = as_pose(loaded, guess)
    measured = checked_lengths(lengths, len(loaded.cables), loaded.name)
    fit = solver.best_pose(measured, start)
    return PoseFromLengths(loaded, measured, fit, loaded.geometry_words(pulleys))


@verb()
def plot(robot: RobotWord, pose: PoseWord = None) -> Figure:
    """Draws a robot with its frame, cables and platform at a pose, in 3D.

    Args:
        robot: Robot by name or file.
        pose: Pose X_WP of the platform [m, deg]; default: its home.

    Raises:
        TensionProblemError: It is no pose.
    """
    from cdpr_drake.analyses.visualization.path_figures import poses_figure

    loaded = as_robot(robot, "plot")
    return poses_figure(loaded.title or loaded.name, loaded, {"platform": as_pose(loaded, pose)})


def pose_numbers(X_WP: RigidTransform) -> dict[str, list[float]]:
    """A pose for JSON [m, deg]."""
    angles = np.degrees(angles_from_rotation(X_WP.rotation()))
    return {"position_m": X_WP.translation().tolist(), "angles_deg": angles.tolist()}


def checked_lengths(lengths: Sequence[float] | Array | None, m: int, name: str) -> Array:
    """Lengths of a robot's m cables as an array, shape (m,) [m].

    Raises:
        EquilibriumError: Not one for each cable, or not above 0.
    """
    try:
        values = np.asarray(lengths, float)
    except (TypeError, ValueError):
        values = np.empty(0)
    if values.shape != (m,):
        raise EquilibriumError(
            f"lengths: found shape {values.shape}; accepted: ({m},), one for each cable of "
            f"{name} [m]"
        )
    if not (np.all(np.isfinite(values)) and np.min(values) > 0.0):
        raise EquilibriumError(f"lengths: found {np.min(values):g}; accepted: > 0 [m]")
    return values
