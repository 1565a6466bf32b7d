"""Features as kernels with one signature, so that a step of the law can evaluate any of them.

`kernel(numbers, seen, s, L)` writes s, shape (k,), and L, shape (k, 6). What is seen is one vector:
X_CO as its matrix (3, 4) column by column, the centre (2), the marks as `Sighting` has them, row by
row. The numbers are those of `VisualFeatures.packed`.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numba import njit, types
from numba.extending import intrinsic

from cdpr_drake.arrays import Array
from cdpr_drake.numerics.kernel_calls import call_at_address, kernel_address
from cdpr_drake.servoing.circle_features import ELLIPSE_SIZE, ellipses_interaction, plane_of
from cdpr_drake.servoing.interaction_matrix_kernel import point_into
from cdpr_drake.servoing.pose_features import (
    camera_pose_feature,
    hybrid_feature,
    object_pose_feature,
)

CENTER, MARKS = 12, 14
"""Where the centre and the marks begin in what is seen."""

_VECTOR, _MATRIX = types.float64[::1], types.float64[:, ::1]
_SIGNATURE = types.void(_VECTOR, _VECTOR, _VECTOR, _MATRIX)


def feature_kernel(kernel: Any) -> int:
    """Where the machine code of a kernel of features begins; for `call_features`."""
    return kernel_address(kernel, _SIGNATURE)


@intrinsic
def call_features(typing: Any, kernel: Any, numbers: Any, seen: Any, s: Any, L: Any) -> Any:
    """Calls the kernel of features at an address."""
    return _SIGNATURE.return_type(types.intp, *_SIGNATURE.args), call_at_address(_SIGNATURE)


@njit(cache=True)
def pose_parts(columns: Array) -> Any:
    """Rotation, shape (3, 3), and position, shape (3,) [m], from a matrix column by column."""
    R = np.empty((3, 3))
    for i in range(3):
        for j in range(3):
            R[i, j] = columns[3 * j + i]
    return R, columns[9:12].copy()


@njit(cache=True)
def _copy(s: Array, L: Array, s_out: Array, L_out: Array) -> None:
    for i in range(s.shape[0]):
        s_out[i] = s[i]
        for j in range(6):
            L_out[i, j] = L[i, j]


@njit(cache=True)
def object_pose_packed(numbers: Array, seen: Array, s: Array, L: Array) -> None:
    """`ObjectPoseFeatures`; numbers: X_CdO column by column."""
    R_CO, p_CO = pose_parts(seen)
    R_CdO, _ = pose_parts(numbers)
    found, matrix = object_pose_feature(R_CO, p_CO, R_CdO)
    _copy(found, matrix, s, L)


@njit(cache=True)
def camera_pose_packed(numbers: Array, seen: Array, s: Array, L: Array) -> None:
    """`CameraPoseFeatures`; numbers: X_CdO column by column."""
    R_CO, p_CO = pose_parts(seen)
    R_CdO, p_CdO = pose_parts(numbers)
    found, matrix = camera_pose_feature(R_CO, p_CO, R_CdO, p_CdO)
    _copy(found, matrix, s, L)


@njit(cache=True)
def hybrid_packed(numbers: Array, seen: Array, s: Array, L: Array) -> None:
    """`HybridFeatures`; numbers: X_CdO column by column, depth [m] or NaN for that of the pose."""
    R_CO, p_CO = pose_parts(seen)
    R_CdO, p_CdO = pose_parts(numbers)
    depth = p_CO[2] if np.isnan(numbers[12]) else numbers[12]
    center = seen[CENTER:MARKS]
    found, matrix = hybrid_feature(R_CO, p_CO, R_CdO, p_CdO, center, depth)
    _copy(found, matrix, s, L)


@njit(cache=True)
def points_packed(numbers: Array, seen: Array, s: Array, L: Array) -> None:
    """`PointFeatures`; numbers: for each its number in the marks, p_OK (3), depth or NaN [m]."""
    all_marks = (seen.shape[0] - MARKS) // 2
    for q in range(s.shape[0] // 2):
        point = numbers[5 * q : 5 * q + 5]
        k = int(point[0])
        x, y, depth = seen[MARKS + k], seen[MARKS + all_marks + k], point[4]
        if np.isnan(depth):
            depth = seen[2] * point[1] + seen[5] * point[2] + seen[8] * point[3] + seen[11]
        s[2 * q], s[2 * q + 1] = x, y
        point_into(x, y, depth, L, 2 * q)


@njit(cache=True)
def circles_packed(numbers: Array, seen: Array, s: Array, L: Array) -> None:
    """`CircleFeatures`; numbers: plane (A, B, C) [1/m], or NaN for that of the pose."""
    plane = numbers
    if np.isnan(numbers[0]):
        R_CO, p_CO = pose_parts(seen)
        plane = plane_of(R_CO, p_CO)
    marks = seen[MARKS:]
    matrix = ellipses_interaction(marks.reshape((-1, ELLIPSE_SIZE)), plane)
    _copy(marks, matrix, s, L)


@njit(cache=True)
def switched_packed(numbers: Array, seen: Array, s: Array, L: Array) -> None:
    """`SwitchedFeatures`; numbers: 1 for the camera's pose, 0 for the object's, X_CdO column by
    column, then those of `points_packed`."""
    X_CdO = numbers[1:13]
    if numbers[0] != 0.0:
        camera_pose_packed(X_CdO, seen, s[:6], L[:6])
    else:
        object_pose_packed(X_CdO, seen, s[:6], L[:6])
    points_packed(numbers[13:], seen, s[6:], L[6:])
