"""The 2 1/2 D feature: the camera's position, the object's centre in the image, and theta u_z."""

from __future__ import annotations

import numpy as np
from numba import njit

from cdpr_drake.arrays import Array
from cdpr_drake.features.interaction_kernel import hybrid_into
from cdpr_drake.features.pose import camera_in_desired


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
