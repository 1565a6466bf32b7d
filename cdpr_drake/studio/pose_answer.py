"""What is known about a robot at a pose, by the verbs, and the pose's coordinates for sliders.

What computes is imported at the first question: a page without numbers needs none of it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import product
from typing import TYPE_CHECKING, TypeVar

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.arrays import Array
from cdpr_drake.errors import CdprError
from cdpr_drake.geometry.poses import angles_from_rotation, pose_from_angles
from cdpr_drake.models.robot_schema import Robot

if TYPE_CHECKING:
    from cdpr_drake.analyses.statics.robot_at_rest import RobotAtRest
    from cdpr_drake.analyses.tensions import Tensions
    from cdpr_drake.analyses.workspaces.conditions import PoseConditions

T = TypeVar("T")

USUAL_METHOD = "quadratic_program"


@dataclass(frozen=True, kw_only=True, eq=False)
class PoseAnswer:
    """A robot at a pose; what cannot be had is None, and a line says why.

    Attributes:
        robot: The robot.
        X_WP: The pose.
        method: Name of the tension distribution method.
        balance: Answer of `solve_tensions`.
        why_no_tensions: Why there are no tensions; empty: there are, or `status` says it.
        rest: Answer of `solve_static`.
        why_no_rest: Why it is None.
        lengths: Of the straight paths between exit and anchor points over pulleys, shape (m,) [m].
        capacity_margin: As `cdpr workspace --measure capacity-margin` [N].
        why_no_margin: Why it is None; empty: it is not finite, or there is one.
        clearance: Least distance of cables and platform from what they may meet [m].
        nearest: What is at that distance, in words.
    """

    robot: Robot
    X_WP: RigidTransform
    method: str
    balance: Tensions | None
    why_no_tensions: str
    rest: RobotAtRest | None
    why_no_rest: str
    lengths: Array | None
    capacity_margin: float | None
    why_no_margin: str
    clearance: float | None
    nearest: str

    @property
    def tensions(self) -> Array:
        """Tensions as `cdpr tension` prints them, shape (m,) [N]; NaN where there are none."""
        none = np.full(len(self.robot.cables), np.nan)
        return none if self.balance is None else self.balance.tensions

    @property
    def slack(self) -> np.ndarray:
        """True for cables without tension, shape (m,)."""
        return np.nan_to_num(self.tensions, nan=1.0) <= 0.0

    @property
    def status(self) -> str:
        """Verdict on the tensions; empty without any."""
        return "" if self.balance is None else self.balance.status


class RobotQuestions:
    """Answers for one robot at many poses; what does not depend on the pose is computed once."""

    def __init__(self, robot: Robot) -> None:
        """About a robot; computes nothing yet."""
        self.robot = robot
        self.axes = pose_axes(robot)

    @cached_property
    def methods(self) -> list[str]:
        """Names of the tension distribution methods that take this robot."""
        from cdpr_drake.tensions.methods import METHODS

        if self.robot.is_underactuated():
            return [USUAL_METHOD]
        redundancy = len(self.robot.cables) - self.robot.motion_type().freedom
        return [name for name, method in METHODS.items() if method.takes(redundancy)]

    @cached_property
    def _conditions(self) -> PoseConditions:
        from cdpr_drake.analyses.workspaces.robot_conditions import pose_conditions

        return pose_conditions(self.robot)

    def at(
        self, X_WP: RigidTransform, method: str = USUAL_METHOD, reference: float | None = None
    ) -> PoseAnswer:
        """Everything at a pose.

        Args:
            X_WP: The pose.
            method: A name of `tensions.METHODS`.
            reference: Desired tension of all cables [N], for methods that need one.
        """
        from cdpr_drake.analyses.statics.robot_at_rest import RobotAtRest
        from cdpr_drake.analyses.statics.static import solve_static
        from cdpr_drake.analyses.tensions import solve_tensions
        from cdpr_drake.geometry.cable_paths import cable_paths

        robot = self.robot
        method = USUAL_METHOD if robot.is_underactuated() else method
        balance, why_no_tensions = _or_refusal(
            lambda: solve_tensions(robot, X_WP, method=method, reference=reference)
        )
        if balance is not None and balance.control is not None and np.isnan(balance.tensions[0]):
            why_no_tensions = "; ".join(
                f"nothing balances {row['combination']}, {row['unbalanced']:.4g}"
                for row in balance.uncontrolled()
            )
        rest, why_no_rest = _or_refusal(lambda: solve_static(robot, X_WP))
        lengths, _ = _or_refusal(lambda: cable_paths(X_WP, robot.cable_set()).lengths)
        gap, _ = _or_refusal(lambda: self._clearance(X_WP))
        margin, why_no_margin = _or_refusal(lambda: self._capacity_margin(X_WP))
        return PoseAnswer(
            robot=robot, X_WP=X_WP, method=method, balance=balance,
            why_no_tensions=why_no_tensions, rest=rest if isinstance(rest, RobotAtRest) else None,
            why_no_rest=why_no_rest, lengths=lengths, why_no_margin=why_no_margin,
            capacity_margin=margin if margin is not None and np.isfinite(margin) else None,
            clearance=gap[0] if gap else None, nearest=gap[1] if gap else "",
        )  # fmt: skip

    def _clearance(self, X_WP: RigidTransform) -> tuple[float, str] | None:
        """Least distance [m] and what is there; None: there is nothing to meet."""
        from cdpr_drake.workspaces.cable_interference import PART_NAMES, clearances

        gaps = clearances(self._conditions.around, *_stacked(X_WP))[0]
        if np.all(np.isnan(gaps)):
            return None
        nearest = int(np.nanargmin(gaps))
        return float(gaps[nearest]), PART_NAMES[nearest]

    def _capacity_margin(self, X_WP: RigidTransform) -> float:
        from cdpr_drake.analyses.workspaces.conditions import MEASURES, Poses

        poses = Poses(0, 1, *_stacked(X_WP))
        return float(MEASURES["capacity-margin"].value(self._conditions, poses)[0])


def _or_refusal(question: Callable[[], T]) -> tuple[T | None, str]:
    """The answer, or None and why it was refused."""
    try:
        return question(), ""
    except CdprError as refusal:
        return None, str(refusal)


def _stacked(X_WP: RigidTransform) -> tuple[Array, Array]:
    """Position, shape (1, 3) [m], and rotation, shape (1, 3, 3)."""
    return X_WP.translation()[np.newaxis], X_WP.rotation().matrix()[np.newaxis]


@dataclass(frozen=True)
class PoseAxis:
    """A coordinate of the pose: name as x or ψ, words, unit m or deg, least and largest value."""

    name: str
    words: str
    unit: str
    lower: float
    upper: float


def pose_axes(robot: Robot) -> list[PoseAxis]:
    """The coordinates that a robot's platform can change, within the frame.

    Of a body in space position and angles, R = Rx(φ) Ry(θ) Rz(ψ); of a platform in a plane or on a
    line, the coordinates of its joint, along the plane's axes.
    """
    home = robot.home.position  # may lie outside a frame that was assumed
    lower, upper = np.minimum(robot.frame.lower, home), np.maximum(robot.frame.upper, home)
    joint, motion = robot.joint(), robot.motion_type()
    where = "W" if joint.is_as_world() else "the plane" if motion.is_plane else "the line"
    turns = [("ψ", "turn about the plane's normal")] * motion.num_turns
    if joint.is_floating:
        where = "W"
        turns = [(name, "R = Rx(φ) Ry(θ) Rz(ψ)") for name in "φθψ"[: motion.num_turns]]
    else:
        corners = np.array(list(product(*zip(lower, upper, strict=True)))).T
        corners = joint.X_WF.inverse().multiply(corners)
        lower, upper = corners.min(axis=1), corners.max(axis=1)
    moves = zip("xyz"[: motion.num_moves], lower, upper, strict=False)
    return [
        *(PoseAxis(name, f"{name} of Po in {where}", "m", float(a), float(b))
          for name, a, b in moves),
        *(PoseAxis(name, words, "deg", -180.0, 180.0) for name, words in turns),
    ]  # fmt: skip


def axis_values(robot: Robot, X_WP: RigidTransform) -> list[float]:
    """The coordinates of a pose [m, deg], in the order of `pose_axes`."""
    joint, motion = robot.joint(), robot.motion_type()
    if joint.is_floating:
        moves, turns = X_WP.translation(), angles_from_rotation(X_WP.rotation())
    else:
        moves, turns = np.split(joint.coordinates(X_WP), [2])
    values = *moves[: motion.num_moves], *np.degrees(turns[: motion.num_turns])
    return [float(value) for value in values]


def pose_at(robot: Robot, values: Sequence[float]) -> RigidTransform:
    """The pose with coordinates [m, deg] in the order of `pose_axes`."""
    joint, motion = robot.joint(), robot.motion_type()
    if joint.is_floating:
        if not motion.num_turns:
            return RigidTransform(robot.home.transform().rotation(), np.array(values[:3]))
        return pose_from_angles(np.array(values[:3]), np.radians(values[3:6]))
    q = np.zeros(3)
    q[: motion.num_moves] = values[: motion.num_moves]
    if motion.num_turns:
        q[2] = np.radians(values[motion.num_moves])
    elif not joint.is_line:
        q[2] = joint.coordinates(robot.home.transform())[2]
    return joint.pose_at(q)
