"""The 2 1/2 D feature: the camera's position, the object's centre in the image, and theta u_z."""

from __future__ import annotations

import numpy as np
from numba import njit

from cdpr_drake.arrays import Array
from cdpr_drake.features.pose import camera_pose_feature


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
    pose, L_pose = camera_pose_feature(R_CO, p_CO, R_CdO, p_CdO)
    x, y = center[0], center[1]
    s = np.empty(6)
    s[0], s[1], s[2] = x, y, pose[2]
    s[3:] = pose[3:]
    L = np.zeros((6, 6))
    L[0, 0], L[0, 1], L[0, 2] = x * y, -(1.0 + x * x), y
    L[1, 0], L[1, 1], L[1, 2] = 1.0 + y * y, -x * y, -x
    L[0, 3], L[0, 5] = -1.0 / depth, x / depth
    L[1, 4], L[1, 5] = -1.0 / depth, y / depth
    L[2] = L_pose[2]
    L[3:] = L_pose[3:]
    return s, L
