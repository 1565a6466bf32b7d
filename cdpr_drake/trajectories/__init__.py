"""Motions over time: quintic time laws, poses through waypoints, steady motions,
a mobile robot on its track; and geometric paths, which have a law of time as `TimedPath`.

Poses are X_WP of the platform or X_WO of an object; velocities and accelerations are spatial
vectors (rotation, translation) in W.

Source: Gazebo thesis (6.19) to (6.21), with signs as Drake's PiecewisePolynomial has them.
"""

from cdpr_drake.trajectories.mobile_robot import MobileRobotMotion, RoundedTrack
from cdpr_drake.trajectories.moving_pose import MovingPose, SteadyMotion, WaypointMotion
from cdpr_drake.trajectories.path_kernel import PIECE_NUMBERS, POINT_SIZE, path_point
from cdpr_drake.trajectories.pose_path import PosePath, smooth_path, straight_path
from cdpr_drake.trajectories.pose_trajectory import (
    MOTION_SIZE,
    PoseTrajectory,
    motion_row,
    write_motion,
)
from cdpr_drake.trajectories.sampled_motion import (
    MOTION_COLUMNS,
    TIME_COLUMN,
    read_motion,
    sampled_motion,
)
from cdpr_drake.trajectories.timed_path import TimedPath

__all__ = [
    "MOTION_COLUMNS", "MOTION_SIZE", "PIECE_NUMBERS", "POINT_SIZE", "TIME_COLUMN",
    "MobileRobotMotion", "MovingPose", "PosePath", "PoseTrajectory", "RoundedTrack",
    "SteadyMotion", "TimedPath", "WaypointMotion", "motion_row", "path_point", "read_motion",
    "sampled_motion", "smooth_path", "straight_path", "write_motion",
]  # fmt: skip
