"""What is known about a robot at a pose, by the verbs, and the pose's coordinates for sliders.

What computes is imported at the first question: a page without numbers needs none of it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import product
from typing import TYPE_CHECKING, TypeVar, cast

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.arrays import Array
from cdpr_drake.errors import CdprError
from cdpr_drake.geometry.poses import angles_from_rotation, pose_from_angles
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.studio.results import subject_of

if TYPE_CHECKING:
    from cdpr_drake.analyses.statics.robot_at_rest import RobotAtRest
    from cdpr_drake.analyses.workspaces.conditions import PoseConditions

T = TypeVar("T")

USUAL_METHOD = "quadratic_program"


@dataclass(frozen=True)
class PoseAxis:
    """A coordinate of the pose: name as x or ψ, words, unit m or deg, least and largest value."""

    name: str
    words: str
    unit: str
    lower: float
    upper: float


class RobotQuestions:
    """A robot at many poses; what does not depend on the pose is computed once.

    Coordinates of a pose are those that the platform can change: of a body in space position and
    angles, R = Rx(φ) Ry(θ) Rz(ψ); in a plane or on a line those of its joint, along its axes.

    Attributes:
        subject: The robot as what results are about.
        axes: What each coordinate is.
    """

    def __init__(self, robot: Robot) -> None:
        """About a robot; computes nothing yet."""
        self.robot, self.subject = robot, subject_of(robot)
        self._joint, motion = robot.joint(), robot.motion_type()
        units = [1.0] * motion.num_moves + [np.pi / 180.0] * motion.num_turns
        self._units, self.axes = np.array(units), _axes(robot)

    def coordinates(self, X_WP: RigidTransform) -> list[float]:
        """The coordinates of a pose [m, deg]."""
        return [float(value) for value in self._all(X_WP)[: len(self._units)] / self._units]

    def pose(self, coordinates: Sequence[float]) -> RigidTransform:
        """The pose with such coordinates [m, deg], else as at home."""
        q = self._all(self.robot.home.transform())
        q[: len(self._units)] = coordinates * self._units
        return pose_from_angles(q[:3], q[3:]) if self._joint.is_floating else self._joint.pose_at(q)

    def _all(self, X_WP: RigidTransform) -> Array:
        """All coordinates of the joint [m, rad]; of a body in space position and angles."""
        if self._joint.is_floating:
            return np.concatenate([X_WP.translation(), angles_from_rotation(X_WP.rotation())])
        return self._joint.coordinates(X_WP)

    @cached_property
    def methods(self) -> list[str]:
        """Names of the tension distribution methods that take this robot."""
        from cdpr_drake.tensions.methods import METHODS

        if self.robot.is_underactuated():
            return [USUAL_METHOD]
        redundancy = len(self.robot.cables) - self.robot.motion_type().freedom
        return [name for name, method in METHODS.items() if method.takes(redundancy)]

    @cached_property
    def conditions(self) -> PoseConditions:
        """What measures of poses have to know."""
        from cdpr_drake.analyses.workspaces.robot_conditions import pose_conditions

        return pose_conditions(self.robot)


def _axes(robot: Robot) -> list[PoseAxis]:
    """What the coordinates of a robot's platform are, within the frame."""
    joint, motion, home = robot.joint(), robot.motion_type(), robot.home.position
    # Home may lie outside a frame that was assumed.
    box = np.minimum(robot.frame.lower, home), np.maximum(robot.frame.upper, home)
    corners = np.array(list(product(*zip(*box, strict=True)))).T
    rows = joint.X_WF.inverse().multiply(corners)
    place = "W" if joint.is_as_world() else "the plane" if motion.is_plane else "the line"
    names, words = "ψ", "turn about the plane's normal"
    if joint.is_floating:
        names, words = "φθψ", "R = Rx(φ) Ry(θ) Rz(ψ)"
    return [
        *(PoseAxis(name, f"{name} of Po in {place}", "m", float(min(row)), float(max(row)))
          for name, row in zip("xyz"[: motion.num_moves], rows, strict=False)),
        *(PoseAxis(name, words, "deg", -180.0, 180.0) for name in names[: motion.num_turns]),
    ]  # fmt: skip


class PoseAnswer:
    """A robot at a pose; what cannot be had is None, and a line says why.

    Attributes:
        tensions: As `cdpr tension` prints them, shape (m,) [N]; NaN where there are none.
        slack: True for cables without tension, shape (m,).
        status: Verdict on the tensions; empty without any.
        why_no_tensions: Why there are no tensions; empty: there are, or `status` says it.
        geometry: Of the cables, in words: what becomes of pulleys.
        rest: Answer of `solve_static`.
        lengths: Of the straight paths between exit and anchor points over pulleys, shape (m,) [m].
        capacity_margin: As `cdpr workspace --measure capacity-margin` [N].
        why_no_margin: Why it is None; empty: it is not finite, or there is one.
        clearance: Least distance of cables and platform from what they may meet [m].
        nearest: What is at that distance, in words.
    """

    def __init__(
        self, about: RobotQuestions, X_WP: RigidTransform, method: str = USUAL_METHOD,
        reference: float | None = None,
    ) -> None:  # fmt: skip
        """Computes it; some methods of `tensions.METHODS` need a desired tension [N]."""
        from cdpr_drake.analyses.statics.static import solve_static
        from cdpr_drake.analyses.tensions import solve_tensions
        from cdpr_drake.analyses.workspaces.conditions import MEASURES, Poses
        from cdpr_drake.geometry.cable_paths import cable_paths
        from cdpr_drake.workspaces.cable_interference import PART_NAMES, clearances

        robot = self.robot = about.robot
        self.subject, self.X_WP = about.subject.at(X_WP), X_WP
        self.method = USUAL_METHOD if robot.is_underactuated() else method
        balance, self.why_no_tensions = _or_refusal(
            lambda: solve_tensions(robot, X_WP, method=self.method, reference=reference)
        )
        self.status = "" if balance is None else balance.status
        self.tensions = np.full(len(robot.cables), np.nan) if balance is None else balance.tensions
        self.slack: np.ndarray = np.nan_to_num(self.tensions, nan=1.0) <= 0.0
        if balance is not None and balance.control is not None and np.isnan(self.tensions[0]):
            self.why_no_tensions = "; ".join(
                f"nothing balances {row['combination']}, {row['unbalanced']:.4g}"
                for row in balance.uncontrolled()
            )
        self.rest, self.why_no_rest = _or_refusal(
            lambda: cast("RobotAtRest", solve_static(robot, X_WP))
        )
        cables = robot.cable_set()
        self.geometry = cables.geometry_words()
        self.lengths, _ = _or_refusal(lambda: cable_paths(X_WP, cables).lengths)
        place = X_WP.translation()[np.newaxis], X_WP.rotation().matrix()[np.newaxis]
        margin, self.why_no_margin = _or_refusal(
            lambda: MEASURES["capacity-margin"].value(about.conditions, Poses(0, 1, *place))[0]
        )
        self.capacity_margin = _finite(margin)
        gaps, _ = _or_refusal(lambda: clearances(about.conditions.around, *place)[0])
        gaps = np.array([np.nan]) if gaps is None else gaps
        nearest = int(np.argmin(np.nan_to_num(gaps, nan=np.inf)))
        self.clearance = _finite(gaps[nearest])
        self.nearest = "" if self.clearance is None else PART_NAMES[nearest]


def _or_refusal(question: Callable[[], T]) -> tuple[T | None, str]:
    """The answer, or None and why it was refused."""
    try:
        return question(), ""
    except CdprError as refusal:
        return None, str(refusal)


def _finite(value: float | None) -> float | None:
    return None if value is None or not np.isfinite(value) else float(value)
