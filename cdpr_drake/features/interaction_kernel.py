"""Interaction matrices of all schemes, as one kernel that stability is judged with.

Rows and columns are ordered (rotation, translation): rows of the error first those that belong to
the orientation, then those of the position; columns (w, v) of the camera's twist in C.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from cdpr_drake.arrays import Array
from cdpr_drake.numerics import copy_matrix

PBVS, PBVS_LINE, TWO_HALF_D, IBVS = range(4)
"""Codes of the schemes, the places of `stability.criterion.SCHEMES`."""


@njit(cache=True)
def rotation_of(vector: Array, R: Array) -> None:
    """R <- exp([vector]x), from shape (3,) [rad] to (3, 3). Source: Rodrigues."""
    x, y, z = vector[0], vector[1], vector[2]
    square = x * x + y * y + z * z
    theta = np.sqrt(square)
    if theta > 1e-8:
        a, b = np.sin(theta) / theta, 2.0 * (np.sin(0.5 * theta) / theta) ** 2
    else:
        a, b = 1.0 - square / 6.0, 0.5 - square / 24.0
    R[0, 0] = 1.0 - b * (y * y + z * z)
    R[1, 1] = 1.0 - b * (x * x + z * z)
    R[2, 2] = 1.0 - b * (x * x + y * y)
    R[0, 1] = b * x * y - a * z
    R[1, 0] = b * x * y + a * z
    R[0, 2] = b * x * z + a * y
    R[2, 0] = b * x * z - a * y
    R[1, 2] = b * y * z - a * x
    R[2, 1] = b * y * z + a * x


@njit(cache=True)
def theta_u_matrix(theta_u: Array, L: Array, sign: float = 1.0) -> None:
    """L[:3, :3] <- L_w(theta u), or its inverse for sign -1.

    The inverse is I - sinc^2(theta / 2) theta / 2 [u]x + (1 - sinc(theta)) [u]x^2.

    Source: servoing thesis (1.46).
    """
    x, y, z = theta_u[0], theta_u[1], theta_u[2]
    square = x * x + y * y + z * z
    theta = np.sqrt(square)
    if theta < 1e-4:
        a = 0.5 * sign
        b = 1.0 / 12.0 if sign > 0.0 else 1.0 / 6.0
    elif sign > 0.0:
        a, b = 0.5, (1.0 - 0.5 * theta / np.tan(0.5 * theta)) / square
    else:
        a = -2.0 * (np.sin(0.5 * theta) / theta) ** 2
        b = (1.0 - np.sin(theta) / theta) / square
    L[0, 0] = 1.0 - b * (y * y + z * z)
    L[1, 1] = 1.0 - b * (x * x + z * z)
    L[2, 2] = 1.0 - b * (x * x + y * y)
    L[0, 1] = b * x * y - a * z
    L[1, 0] = b * x * y + a * z
    L[0, 2] = b * x * z + a * y
    L[2, 0] = b * x * z - a * y
    L[1, 2] = b * y * z - a * x
    L[2, 1] = b * y * z + a * x


@njit(cache=True)
def interaction_into(
    scheme: int, theta_u: Array, lever: Array, p_CO: Array, R_CO: Array, p_OK: Array, L: Array
) -> None:
    """L <- the interaction matrix, shape (6, 6), or (2 k, 6) for k points of IBVS.

    Args:
        scheme: Code of the scheme.
        theta_u: Rotation vector of R_CdC, shape (3,) [rad].
        lever: e_t or p_CO, shape (3,) [m]; for PBVS only.
        p_CO: Position of the object in the camera frame, shape (3,) [m]; for 2 1/2 D and IBVS.
        R_CO: Orientation of the object, shape (3, 3); for IBVS.
        p_OK: Points of the object, shape (3, k) [m]; for IBVS.
        L: Output.

    Source: servoing thesis (1.47), (1.48), (1.50), (1.43).
    """
    L[:] = 0.0
    if scheme == IBVS:
        for k in range(p_OK.shape[1]):
            X, Y, Z = p_CO[0], p_CO[1], p_CO[2]
            for j in range(3):
                X += R_CO[0, j] * p_OK[j, k]
                Y += R_CO[1, j] * p_OK[j, k]
                Z += R_CO[2, j] * p_OK[j, k]
            x, y = X / Z, Y / Z
            i = 2 * k
            L[i, 0], L[i, 1], L[i, 2] = x * y, -(1.0 + x * x), y
            L[i, 3], L[i, 5] = -1.0 / Z, x / Z
            L[i + 1, 0], L[i + 1, 1], L[i + 1, 2] = 1.0 + y * y, -x * y, -x
            L[i + 1, 4], L[i + 1, 5] = -1.0 / Z, y / Z
        return
    theta_u_matrix(theta_u, L)
    if scheme == PBVS:
        L[3, 3], L[4, 4], L[5, 5] = -1.0, -1.0, -1.0
        L[3, 0], L[3, 1], L[3, 2] = 0.0, -lever[2], lever[1]
        L[4, 0], L[4, 1], L[4, 2] = lever[2], 0.0, -lever[0]
        L[5, 0], L[5, 1], L[5, 2] = -lever[1], lever[0], 0.0
        return
    R = np.empty((3, 3))
    rotation_of(theta_u, R)
    copy_matrix(R, L[3:, 3:])
    if scheme == TWO_HALF_D:
        x, y, Z = p_CO[0] / p_CO[2], p_CO[1] / p_CO[2], p_CO[2]
        L[0, 0], L[0, 1], L[0, 2] = x * y, -(1.0 + x * x), y
        L[1, 0], L[1, 1], L[1, 2] = 1.0 + y * y, -x * y, -x
        L[0, 3], L[0, 5] = -1.0 / Z, x / Z
        L[1, 4], L[1, 5] = -1.0 / Z, y / Z
