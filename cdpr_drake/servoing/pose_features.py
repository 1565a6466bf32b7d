"""Poses as visual features, with their interaction matrices: PBVS in both forms, and 2 1/2 D.

PBVS controls theta u of R_CdC beside p_CO or p_CdC; 2 1/2 D servoing controls the camera's position
p_CdC, the object's centre in the image, and theta u_z. C is the camera, Cd the desired camera, O
the object. All are ordered (rotation, translation).

Source: servoing thesis 1.4.4 and 1.4.5, there ordered (translation, rotation); Chaumette and
Hutchinson, Visual servo control I, 2006.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from pydrake.math import RigidTransform

from cdpr_drake.arrays import Array
from cdpr_drake.geometry.poses import pose_error, rotation_vector_of_matrix
from cdpr_drake.servoing.interaction_matrix_kernel import (
    camera_pose_into,
    hybrid_into,
    object_pose_into,
    theta_u_into,
)


def pose_feature_error(X_CO: RigidTransform, X_CdO: RigidTransform) -> Array:
    """e = s - s* of the feature s = (theta u of R_CdC, p_CO), shape (6,) [rad, m].

    Args:
        X_CO: Pose of the object O in the camera frame C.
        X_CdO: The same for the desired camera frame Cd.

    Source: servoing thesis 1.4.4, there ordered (translation, rotation).
    """
    s, _ = object_pose_feature(*pose_arrays(X_CO), pose_arrays(X_CdO)[0])
    s[3:] -= X_CdO.translation()
    return np.asarray(s)


def pose_interaction(X_CO: RigidTransform, X_CdO: RigidTransform) -> Array:
    """L with de/dt = L @ V_C for `pose_feature_error` and an object at rest, shape (6, 6).

    V_C = (w, v) is the camera's twist in C [rad/s, m/s]. The exact matrix for p_CO, with [p_CO]x;
    it is singular only where theta is a multiple of 2 pi.

    Args:
        X_CO: Pose of the object O in the camera frame C.
        X_CdO: The same for the desired camera frame Cd.

    Source: Chaumette and Hutchinson, Visual servo control I, 2006; the servoing thesis' (1.47)
    has the error in place of p_CO.
    """
    return np.asarray(object_pose_feature(*pose_arrays(X_CO), pose_arrays(X_CdO)[0])[1])


def seen_pose_error(
    X_CO: RigidTransform, X_CdO: RigidTransform, free_rotation: bool = False
) -> tuple[float, float]:
    """Distance [m] and angle [rad] of the object in the camera from its desired pose.

    Args:
        X_CO: Pose of the object O in the camera frame C.
        X_CdO: The same for the desired camera frame Cd.
        free_rotation: Whether a rotation about the optical axis does not count: the angle is then
            the one between the optical axes.
    """
    distance, angle = pose_error(X_CO, X_CdO)
    if free_rotation:
        along = float(X_CdO.rotation().matrix()[2] @ X_CO.rotation().matrix()[2])
        across = np.cross(X_CdO.rotation().matrix()[2], X_CO.rotation().matrix()[2])
        angle = float(np.arctan2(np.linalg.norm(across), along))
    return distance, angle


def pose_arrays(X: RigidTransform) -> tuple[Array, Array]:
    """Rotation and position, in the order of C and writable, as other kernels have them: kernels
    are compiled for each kind of array anew."""
    return np.ascontiguousarray(X.rotation().matrix()), np.array(X.translation())


@njit(cache=True)
def theta_u_interaction(theta_u: Array) -> Array:
    """L with d(theta u)/dt = L @ w_C for the rotation R_CdC, w_C in C, shape (3, 3) [-].

    Args:
        theta_u: Angle times axis of R_CdC, shape (3,) [rad].

    Source: servoing thesis (1.46).
    """
    L = np.empty((3, 3))
    theta_u_into(theta_u, L)
    return L


@njit(cache=True)
def object_pose_feature(R_CO: Array, p_CO: Array, R_CdO: Array) -> tuple[Array, Array]:
    """s = (theta u of R_CdC, p_CO), shape (6,) [rad, m], and its L, shape (6, 6).

    Args:
        R_CO: Rotation of the object O in the camera frame C, shape (3, 3).
        p_CO: Its position there, shape (3,) [m].
        R_CdO: Rotation for the desired camera frame Cd, shape (3, 3).
    """
    s = np.empty(6)
    theta_u = rotation_vector_of_matrix(R_CdO @ R_CO.T)
    for i in range(3):  # not by slices, whose checks compile for seconds
        s[i], s[3 + i] = theta_u[i], p_CO[i]
    L = np.empty((6, 6))
    object_pose_into(s[:3], p_CO, L)
    return s, L


@njit(cache=True)
def camera_pose_feature(
    R_CO: Array, p_CO: Array, R_CdO: Array, p_CdO: Array
) -> tuple[Array, Array]:
    """s = (theta u of R_CdC, p_CdC), shape (6,) [rad, m], and its L, shape (6, 6).

    Args:
        R_CO: Rotation of the object O in the camera frame C, shape (3, 3).
        p_CO: Its position there, shape (3,) [m].
        R_CdO: Rotation for the desired camera frame Cd, shape (3, 3).
        p_CdO: Position there, shape (3,) [m].
    """
    s, R_CdC = camera_in_desired(R_CO, p_CO, R_CdO, p_CdO)
    L = np.empty((6, 6))
    camera_pose_into(s[:3], R_CdC, L)
    return s, L


@njit(cache=True)
def camera_in_desired(R_CO: Array, p_CO: Array, R_CdO: Array, p_CdO: Array) -> tuple[Array, Array]:
    """s of `camera_pose_feature`, and R_CdC, shape (3, 3)."""
    R_CdC = R_CdO @ R_CO.T
    s = np.empty(6)
    theta_u, p_CdC = rotation_vector_of_matrix(R_CdC), p_CdO - R_CdC @ p_CO
    for i in range(3):
        s[i], s[3 + i] = theta_u[i], p_CdC[i]
    return s, R_CdC


@njit(cache=True)
def hybrid_feature(
    R_CO: Array, p_CO: Array, R_CdO: Array, p_CdO: Array, center: Array, depth: float
) -> tuple[Array, Array]:
    """s = (x_o, y_o, theta u_z, p_CdC), shape (6,) [-, -, rad, m], and its L, shape (6, 6).

    ds/dt = L @ V_C for an object at rest; V_C = (w, v) is the camera's twist in C. The image
    features and theta u_z take the place of the rotation, so that they come first here.

    Args:
        R_CO: Rotation of the object O in the camera frame C, shape (3, 3).
        p_CO: Its position there, shape (3,) [m].
        R_CdO: Rotation for the desired camera frame Cd, shape (3, 3).
        p_CdO: Position there, shape (3,) [m].
        center: Image (x_o, y_o) of the object's origin at unit focal length, shape (2,) [-].
        depth: Z of the object's origin in C [m].

    Source: servoing thesis 1.4.5, (1.50)-(1.52), there ordered (p_CdC, x_o, y_o, theta u_z) and
    with twists (translation, rotation).
    """
    s, R_CdC = camera_in_desired(R_CO, p_CO, R_CdO, p_CdO)
    L = np.empty((6, 6))
    hybrid_into(s[:3], R_CdC, center[0], center[1], depth, L)
    s[0], s[1] = center[0], center[1]
    return s, L
