"""Where searches for poses may begin by the platform's motion type."""

from __future__ import annotations

import numpy as np
from pydrake.math import RigidTransform, RotationMatrix

from cdpr_drake.arrays import Array
from cdpr_drake.geometry.poses import rotation_from_vector, rotation_vector
from cdpr_drake.models.robot_schema import Robot


def on_motion(robot: Robot, X_WP: RigidTransform) -> RigidTransform:
    """The pose nearest to one that the platform can have, by its motion type and home pose [m].

    A point mass keeps the orientation of home, a body in a plane turns about its normal; lines and
    planes go through the home position. Bodies in space and in horizontal planes stay as they are.
    """
    motion = robot.motion_type()
    if motion.num_turns == 3 or motion.is_horizontal_body:
        return X_WP
    home = robot.home.transform()
    step = X_WP.translation() - home.translation()
    B = motion.basis(home.rotation().matrix())[3:, motion.num_turns :]
    place = home.translation() + B @ (B.T @ step)
    if motion.num_turns == 2:
        return RigidTransform(X_WP.rotation(), place)
    R = home.rotation()
    if motion.num_turns == 1:
        axis = np.asarray(motion.axis)
        angle = float(axis @ rotation_vector(X_WP.rotation() @ R.inverse()))
        R = RotationMatrix(rotation_from_vector(angle * axis) @ R)
    return RigidTransform(R, place)


def off_plane(robot: Robot) -> Array | None:
    """The normal of the plane in which a platform moves, shape (3,); None: it does in none."""
    motion = robot.motion_type()
    return np.asarray(motion.axis, float) if motion.is_plane else None
