"""Poses, twists and rotations, and what is measured of them.

Angles (phi, theta, psi) mean R = Rx(phi) Ry(theta) Rz(psi), which is not Drake's RollPitchYaw.
Twists and adjoints are ordered (rotation, translation). A pose as numbers is a row of seven:
quaternion (w, x, y, z) with w >= 0, then position [m], made and read by `rows` alone.

Source: Gazebo thesis (2.1); servoing thesis 1.4 and (2.1).
"""

from cdpr_drake.spatial.path_deviation import distances_from_line
from cdpr_drake.spatial.pose_repeatability import Repeatability, repeatability
from cdpr_drake.spatial.pose_step_kernel import solve_damped, turn_pose
from cdpr_drake.spatial.poses import (
    adjoint,
    adjoint_of_arrays,
    angles_from_rotation,
    cross_matrix,
    exponential,
    logarithm,
    place_error,
    pose_error,
    pose_from_angles,
    rotation_from_angles,
    rotation_from_vector,
    rotation_vector,
    rotation_vector_of_matrix,
)
from cdpr_drake.spatial.rotation_kernel import (
    quaternion_into,
    quaternion_of_matrix,
    rotation_into,
    rotations_of_quaternions,
    turning_into,
)
from cdpr_drake.spatial.rows import (
    pose_from_row,
    pose_row,
    pose_rows,
    pose_rows_distance,
    pose_rows_of,
)

__all__ = [
    "Repeatability", "adjoint", "adjoint_of_arrays", "angles_from_rotation", "cross_matrix",
    "distances_from_line", "exponential", "logarithm", "place_error", "pose_error",
    "pose_from_angles", "pose_from_row", "pose_row", "pose_rows", "pose_rows_distance",
    "pose_rows_of", "quaternion_into", "quaternion_of_matrix", "repeatability",
    "rotation_from_angles", "rotation_from_vector", "rotation_into", "rotation_vector",
    "rotation_vector_of_matrix", "rotations_of_quaternions", "solve_damped", "turn_pose",
    "turning_into",
]  # fmt: skip
