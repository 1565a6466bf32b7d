"""Poses as rows of seven numbers: quaternion (w, x, y, z) with w >= 0 [-], then position [m]."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numba import njit
from pydrake.common.eigen_geometry import Quaternion
from pydrake.math import RigidTransform

from cdpr_drake.arrays import Array
from cdpr_drake.spatial.rotation_kernel import quaternion_of_matrix


def pose_row(X: RigidTransform) -> Array:
    """A pose as (qw, qx, qy, qz, x, y, z), qw not negative, shape (7,) [-, m]."""
    q = X.rotation().ToQuaternion().wxyz()
    return np.concatenate([q if q[0] >= 0.0 else -q, X.translation()])


def pose_rows(poses: Iterable[RigidTransform]) -> Array:
    """Poses as rows of `pose_row`, shape (n, 7) [-, m]."""
    return np.array([pose_row(X) for X in poses], float).reshape(-1, 7)


def pose_rows_of(matrices: Array) -> Array:
    """Rows of `pose_row` from matrices (3, 4) of poses, row by row, shape (n, 12) [-, m]."""
    rows = np.empty((len(matrices), 7))
    _fill_rows(np.ascontiguousarray(matrices), rows)
    return rows


@njit(cache=True)
def _fill_rows(matrices: Array, rows: Array) -> None:
    for n in range(matrices.shape[0]):
        X = matrices[n].reshape(3, 4)
        quaternion_of_matrix(X, rows[n])
        for i in range(3):
            rows[n, 4 + i] = X[i, 3]


def pose_from_row(row: Array) -> RigidTransform:
    """Inverse of `pose_row`, from shape (7,) [-, m]; the quaternion may be of any length but 0."""
    return RigidTransform(Quaternion(row[:4] / np.linalg.norm(row[:4])), row[4:])


def pose_rows_distance(rows: Array, others: Array) -> tuple[Array, Array]:
    """Distances [m] and angles [rad] between poses in rows, shape (n, 7), as (n,)."""
    distance = np.linalg.norm(rows[:, 4:] - others[:, 4:], axis=1)
    q, r = rows[:, :4], others[:, :4]
    # The vector part of conj(q) r, whose norm is the sine of half the angle.
    vector = q[:, :1] * r[:, 1:] - r[:, :1] * q[:, 1:] - np.cross(q[:, 1:], r[:, 1:])
    sine = np.linalg.norm(vector, axis=1)
    cosine = np.abs(np.sum(q * r, axis=1))
    return distance, 2.0 * np.arctan2(sine, cosine)
