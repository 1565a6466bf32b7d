"""Interaction matrices as kernels that write into arrays: for control and for its stability.

Rows are ordered (rotation, translation), first those of the features that belong to the
orientation; columns (w, v) of the camera's twist in C [rad/s, m/s], for an object at rest.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from cdpr_drake.arrays import Array
from cdpr_drake.geometry.rotation_kernel import turning_into
from cdpr_drake.numerics.kernel_calls import as_number


@njit(cache=True)
def theta_u_into(theta_u: Array, L: Array, sign: float = 1.0) -> None:
    """L[:3, :3] <- L_w(theta u) with d(theta u)/dt = L_w w_C, or its inverse for sign -1.

    L_w = I + [theta u]x / 2 + (1 - sinc(theta) / sinc^2(theta / 2)) [u]x^2, and its inverse is
    I - sinc^2(theta / 2) theta / 2 [u]x + (1 - sinc(theta)) [u]x^2.

    Args:
        theta_u: Angle times axis of R_CdC, shape (3,) [rad].
        L: Output.
        sign: 1 or -1.

    Source: servoing thesis (1.46).
    """
    x, y, z = theta_u[0], theta_u[1], theta_u[2]
    square = x * x + y * y + z * z
    theta = np.sqrt(square)
    if sign > 0.0:  # sinc(theta) / sinc^2(theta / 2) = (theta / 2) / tan(theta / 2)
        a, b = 0.5, 1.0 / 12.0 + square / 720.0
        if theta > 1e-3:
            b = (1.0 - 0.5 * theta / np.tan(0.5 * theta)) / square
    elif theta < 1e-4:
        a, b = -0.5, 1.0 / 6.0
    else:
        a = -2.0 * (np.sin(0.5 * theta) / theta) ** 2
        b = (1.0 - np.sin(theta) / theta) / square
    turning_into(theta_u, a, b, L)


@njit(cache=True)
def object_pose_into(theta_u: Array, lever: Array, L: Array) -> None:
    """L <- L of (theta u, p_CO), shape (6, 6).

    Args:
        theta_u: Angle times axis of R_CdC, shape (3,) [rad].
        lever: p_CO for the exact matrix, e_t as the thesis has it, shape (3,) [m].
        L: Output.

    Source: Chaumette and Hutchinson, Visual servo control I, 2006; servoing thesis (1.47).
    """
    L[:] = 0.0
    theta_u_into(theta_u, L)
    L[3, 1], L[3, 2], L[4, 2] = -lever[2], lever[1], -lever[0]
    L[4, 0], L[5, 0], L[5, 1] = lever[2], -lever[1], lever[0]
    L[3, 3], L[4, 4], L[5, 5] = -1.0, -1.0, -1.0


@njit(cache=True)
def camera_pose_into(theta_u: Array, R_CdC: Array, L: Array) -> None:
    """L <- L of (theta u, p_CdC), shape (6, 6).

    Args:
        theta_u: Angle times axis of R_CdC, shape (3,) [rad].
        R_CdC: The rotation itself, shape (3, 3).
        L: Output.

    Source: servoing thesis (1.48).
    """
    L[:] = 0.0
    theta_u_into(theta_u, L)
    for i in range(3):
        for j in range(3):
            L[3 + i, 3 + j] = R_CdC[i, j]


@njit(cache=True)
def hybrid_into(theta_u: Array, R_CdC: Array, x: float, y: float, Z: float, L: Array) -> None:
    """L <- L of the 2 1/2 D feature (x_o, y_o, theta u_z, p_CdC), shape (6, 6).

    Args:
        theta_u: Angle times axis of R_CdC, shape (3,) [rad].
        R_CdC: The rotation itself, shape (3, 3).
        x: Image of the object's origin at unit focal length [-].
        y: The same.
        Z: Depth of the object's origin in C [m].
        L: Output.

    Source: servoing thesis (1.50)-(1.52).
    """
    camera_pose_into(theta_u, R_CdC, L)
    point_into(x, y, Z, L, as_number(0))


@njit(cache=True)
def point_into(x: float, y: float, Z: float, L: Array, i: int) -> None:
    """L[i : i + 2] <- L of the image (x, y) of a point at unit focal length [-] and depth Z [m].

    Source: servoing thesis (1.43), (1.44).
    """
    L[i, 0], L[i, 1], L[i, 2] = x * y, -(1.0 + x * x), y
    L[i, 3], L[i, 4], L[i, 5] = -1.0 / Z, 0.0, x / Z
    L[i + 1, 0], L[i + 1, 1], L[i + 1, 2] = 1.0 + y * y, -x * y, -x
    L[i + 1, 3], L[i + 1, 4], L[i + 1, 5] = 0.0, -1.0 / Z, y / Z
