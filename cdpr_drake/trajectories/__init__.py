"""Motions over time: quintic time laws, poses through waypoints, steady motions.

Poses are X_WP of the platform or X_WO of an object; velocities and accelerations are spatial
vectors (rotation, translation) in W.

Source: Gazebo thesis (6.19) to (6.21), with signs as Drake's PiecewisePolynomial has them.
"""

from cdpr_drake.trajectories.moving_pose import MovingPose, SteadyMotion, WaypointMotion
from cdpr_drake.trajectories.pose_trajectory import (
    MOTION_SIZE,
    PoseTrajectory,
    motion_row,
    write_motion,
)

__all__ = [
    "MOTION_SIZE", "MovingPose", "PoseTrajectory", "SteadyMotion", "WaypointMotion",
    "motion_row", "write_motion",
]  # fmt: skip
