"""The coordinates of a platform's pose that a motion type leaves free, for sliders."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.geometry.poses import angles_from_rotation, pose_from_angles
from cdpr_drake.models.robot_schema import Robot

ANGLES = ("φ", "θ", "ψ")


@dataclass(frozen=True)
class PoseAxis:
    """A coordinate of the pose.

    Attributes:
        name: As x or ψ.
        words: What it is.
        unit: m or deg.
        lower: Smallest value.
        upper: Largest value.
    """

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
    if joint.is_floating:
        axes = [
            PoseAxis(name, f"{name} of Po in W", "m", float(lower[k]), float(upper[k]))
            for k, name in enumerate("xyz")
        ]
        turns = ANGLES if motion.num_turns else ()
        return axes + [_angle(name, "R = Rx(φ) Ry(θ) Rz(ψ)") for name in turns]
    corners = np.array(list(product(*zip(lower, upper, strict=True)))).T
    seen = joint.X_WF.inverse().multiply(corners)
    where = "W" if joint.is_as_world() else "the plane" if motion.is_plane else "the line"
    axes = [
        PoseAxis(name, f"{name} of Po in {where}", "m", float(ends.min()), float(ends.max()))
        for name, ends in zip("xy"[: motion.num_moves], seen, strict=False)
    ]
    return axes + [_angle("ψ", "turn about the plane's normal")] * motion.num_turns


def _angle(name: str, words: str) -> PoseAxis:
    return PoseAxis(name, words, "deg", -180.0, 180.0)


def axis_values(robot: Robot, X_WP: RigidTransform) -> list[float]:
    """The coordinates of a pose [m, deg], in the order of `pose_axes`."""
    joint, motion = robot.joint(), robot.motion_type()
    if joint.is_floating:
        angles = np.degrees(angles_from_rotation(X_WP.rotation()))
        values = [*X_WP.translation(), *(angles if motion.num_turns else ())]
    else:
        q = joint.coordinates(X_WP)
        values = [*q[: motion.num_moves], *np.degrees(q[2 : 2 + motion.num_turns])]
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
