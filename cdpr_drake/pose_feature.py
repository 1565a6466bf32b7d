"""The pose of the object as a visual feature, and its interaction matrix (PBVS)."""

from __future__ import annotations

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.arrays import Array
from cdpr_drake.poses import cross_matrix, rotation_vector


def pose_feature_error(X_CO: RigidTransform, X_CdO: RigidTransform) -> Array:
    """e = s - s* of the feature s = (theta u of R_CdC, p_CO), shape (6,) [rad, m].

    Args:
        X_CO: Pose of the object O in the camera frame C.
        X_CdO: The same for the desired camera frame Cd.

    Source: servoing thesis 1.4.4, there ordered (translation, rotation).
    """
    R_CdC = X_CdO.rotation() @ X_CO.rotation().inverse()
    return np.concatenate([rotation_vector(R_CdC), X_CO.translation() - X_CdO.translation()])


def theta_u_interaction(theta_u: Array) -> Array:
    """L with d(theta u)/dt = L @ w_C for the rotation R_CdC, w_C in C, shape (3, 3) [-].

    Args:
        theta_u: Angle times axis of R_CdC, shape (3,) [rad].

    Source: servoing thesis (1.46).
    """
    theta = float(np.linalg.norm(theta_u))
    half = cross_matrix(theta_u) / 2.0
    if theta < 1e-6:
        return np.asarray(np.eye(3) + half, float)
    u = cross_matrix(theta_u / theta)
    # sinc(theta) / sinc(theta / 2)^2 = (theta / 2) / tan(theta / 2)
    share = 1.0 - theta / 2.0 / np.tan(theta / 2.0)
    return np.asarray(np.eye(3) + half + share * u @ u, float)


def pose_interaction(X_CO: RigidTransform, X_CdO: RigidTransform) -> Array:
    """L with de/dt = L @ V_C for `pose_feature_error` and an object at rest, shape (6, 6).

    V_C = (w, v) is the camera's twist in C [rad/s, m/s]. The exact matrix for p_CO, with [p_CO]x;
    it is singular only where theta is a multiple of 2 pi.

    Args:
        X_CO: Pose of the object O in the camera frame C.
        X_CdO: The same for the desired camera frame Cd.

    Source: Chaumette and Hutchinson, Visual servo control I, 2006; the servoing thesis' (1.47)
    has the error in the place of p_CO.
    """
    L = np.zeros((6, 6))
    L[:3, :3] = theta_u_interaction(pose_feature_error(X_CO, X_CdO)[:3])
    L[3:, :3] = cross_matrix(X_CO.translation())
    L[3:, 3:] = -np.eye(3)
    return L
