"""Poses as angles, twists, rotation vectors, adjoints and rows of numbers; distances of poses.

Angles (phi, theta, psi) mean R = Rx(phi) Ry(theta) Rz(psi). Twists and adjoints are ordered
(rotation, translation). A row is seven numbers: quaternion (w, x, y, z) with w >= 0 [-], then
position [m].

Source: Gazebo thesis (2.1); servoing thesis (1.37), (2.1).
"""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np
from numba import njit
from pydrake.common.eigen_geometry import Quaternion
from pydrake.math import RigidTransform, RotationMatrix

from cdpr_drake.arrays import Array
from cdpr_drake.geometry.rotation_kernel import quaternion_into, quaternion_of_matrix


def rotation_from_angles(angles: Array) -> RotationMatrix:
    """R = Rx(phi) Ry(theta) Rz(psi) from angles (phi, theta, psi), shape (3,) [rad].

    This is not Drake's RollPitchYaw, which multiplies in the opposite order.

    Source: Gazebo thesis (2.1), whose formula is meant, not its text.
    """
    phi, theta, psi = (float(a) for a in angles)
    return (
        RotationMatrix.MakeXRotation(phi)
        @ RotationMatrix.MakeYRotation(theta)
        @ RotationMatrix.MakeZRotation(psi)
    )


def angles_from_rotation(R: RotationMatrix) -> Array:
    """Inverse of `rotation_from_angles`, theta within [-pi/2, pi/2], shape (3,) [rad]."""
    m = R.matrix()
    theta = np.arctan2(m[0, 2], np.hypot(m[0, 0], m[0, 1]))
    if np.hypot(m[0, 0], m[0, 1]) < 1e-12:  # gimbal lock: only phi +- psi is determined
        return np.array([np.arctan2(m[2, 1], m[1, 1]), theta, 0.0])
    return np.array([np.arctan2(-m[1, 2], m[2, 2]), theta, np.arctan2(-m[0, 1], m[0, 0])])


def pose_from_angles(position: Array, angles: Array) -> RigidTransform:
    """Pose from position, shape (3,) [m], and angles (phi, theta, psi), shape (3,) [rad]."""
    return RigidTransform(rotation_from_angles(angles), np.asarray(position, float))


def cross_matrix(p: Array) -> Array:
    """[p]x with [p]x q = p x q, from shape (3,) to (3, 3), same unit."""
    x, y, z = p
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def rotation_vector(R: RotationMatrix) -> Array:
    """theta u, angle times axis of R with theta in [0, pi], shape (3,) [rad]."""
    return np.asarray(rotation_vector_of_matrix(np.ascontiguousarray(R.matrix())))


@njit(cache=True, error_model="numpy")
def rotation_vector_of_matrix(R: Array) -> Array:
    """`rotation_vector` of a rotation matrix, shape (3, 3); by its unit quaternion."""
    # Of the quaternion's components, times four. In scalars, which compile in half the time.
    w2, x2 = 1.0 + R[0, 0] + R[1, 1] + R[2, 2], 1.0 + R[0, 0] - R[1, 1] - R[2, 2]
    y2, z2 = 1.0 - R[0, 0] + R[1, 1] - R[2, 2], 1.0 - R[0, 0] - R[1, 1] + R[2, 2]
    wx, wy, wz = R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]
    xy, xz, yz = R[0, 1] + R[1, 0], R[0, 2] + R[2, 0], R[1, 2] + R[2, 1]
    w, x, y, z, largest = w2, wx, wy, wz, w2
    if x2 > largest:
        w, x, y, z, largest = wx, x2, xy, xz, x2
    if y2 > largest:
        w, x, y, z, largest = wy, xy, y2, yz, y2
    if z2 > largest:
        w, x, y, z = wz, xz, yz, z2
    size = np.sqrt(w * w + x * x + y * y + z * z)
    w, x, y, z = w / size, x / size, y / size, z / size
    if w < 0.0:
        w, x, y, z = -w, -x, -y, -z
    norm = np.sqrt(x * x + y * y + z * z)
    factor = 2.0 if norm < 1e-12 else 2.0 * np.arctan2(norm, w) / norm
    return np.array([x * factor, y * factor, z * factor])


def rotation_from_vector(theta_u: Array) -> RotationMatrix:
    """Inverse of `rotation_vector`: exp([theta u]x), from shape (3,) [rad]. Source: Rodrigues."""
    return exponential(np.concatenate([theta_u, np.zeros(3)])).rotation()


def exponential(twist: Array) -> RigidTransform:
    """Pose reached from rest at the identity by a constant body twist during unit time.

    Args:
        twist: (rotation vector [rad], translation [m]), shape (6,); a velocity times a duration.

    Source: servoing thesis (2.1), there ordered (translation, rotation).
    """
    X = np.empty((3, 4))
    exponential_into(np.ascontiguousarray(twist, dtype=float), X)
    return RigidTransform.MakeUnchecked(X)


@njit(cache=True)
def exponential_into(twist: Array, X: Array) -> None:
    """X, shape (3, 4) <- exp of the twist; R by a unit quaternion, so it is orthonormal."""
    x, y, z = twist[0], twist[1], twist[2]
    square = x * x + y * y + z * z
    theta = np.sqrt(square)
    if theta > 1e-4:
        half_sinc = np.sin(theta / 2.0) / theta
        b = (1.0 - np.cos(theta)) / square
        c = (theta - np.sin(theta)) / (square * theta)
    else:
        half_sinc = 0.5 - square / 48.0
        b = 0.5 - square / 24.0
        c = 1.0 / 6.0 - square / 120.0
    qw = np.cos(theta / 2.0)
    quaternion_into(qw, half_sinc * x, half_sinc * y, half_sinc * z, 2.0, X)
    u, v, w = twist[3], twist[4], twist[5]
    # p = v + b (theta u x v) + c (theta u x (theta u x v))
    cx, cy, cz = y * w - z * v, z * u - x * w, x * v - y * u
    X[0, 3] = u + b * cx + c * (y * cz - z * cy)
    X[1, 3] = v + b * cy + c * (z * cx - x * cz)
    X[2, 3] = w + b * cz + c * (x * cy - y * cx)


def write_pose(X: RigidTransform, out: Array) -> None:
    """Writes a pose as numbers for a state: rotation row by row, position; out has shape (12,)."""
    matrix = X.GetAsMatrix34()
    out[:9].reshape(3, 3)[:] = matrix[:, :3]
    out[9:] = matrix[:, 3]


@njit(cache=True, error_model="numpy")
def floating_pose_into(state: Array, X: Array) -> float:
    """X, shape (3, 4) [-, m] <- pose of a floating body.

    Args:
        state: Its quaternion (w, x, y, z) of any length but 0, its position [m], and what else
            there is.
        X: Overwritten; no pose if what is returned is 0 or not finite.

    Returns:
        The square of the quaternion's length.
    """
    square = 0.0
    for i in range(4):
        square += state[i] * state[i]
    length = math.sqrt(square)
    w, x, y, z = state[0] / length, state[1] / length, state[2] / length, state[3] / length
    s = 2.0 / ((x * x + z * z) + (y * y + w * w))
    sx, sy, sz = s * x, s * y, s * z
    X[0, 0], X[1, 1], X[2, 2] = (
        1.0 - sy * y - sz * z, 1.0 - sx * x - sz * z, 1.0 - sx * x - sy * y
    )  # fmt: skip
    X[0, 1], X[1, 0] = sy * x - sz * w, sy * x + sz * w
    X[0, 2], X[2, 0] = sz * x + sy * w, sz * x - sy * w
    X[1, 2], X[2, 1] = sz * y - sx * w, sz * y + sx * w
    for i in range(3):
        X[i, 3] = state[4 + i]
    return square


def logarithm(X: RigidTransform) -> Array:
    """Inverse of `exponential`: the twist (rotation vector [rad], translation [m]), shape (6,).

    The angle lies within [0, pi]; at a half turn either sense of turning is right.
    """
    theta_u = rotation_vector(X.rotation())
    p = X.translation()
    square = float(theta_u @ theta_u)
    # v = p - theta u x p / 2 + c theta u x (theta u x p)
    if square > 1e-6:
        half = np.sqrt(square) / 2.0
        c = (1.0 - half / np.tan(half)) / square
    else:
        c = 1.0 / 12.0 + square / 720.0
    across = np.cross(theta_u, p)
    return np.concatenate([theta_u, p - across / 2.0 + c * np.cross(theta_u, across)])


def adjoint(X_AB: RigidTransform) -> Array:
    """Ad with V_A = Ad @ V_B for one rigid body on which frames A and B are fixed, shape (6, 6).

    V_B is the twist of B expressed in B, V_A that of A expressed in A, both (rotation,
    translation) [rad/s, m/s].

    Source: servoing thesis (1.37), there ordered (translation, rotation).
    """
    # As kernels have them, so that it is compiled once.
    R, p = np.ascontiguousarray(X_AB.rotation().matrix()), np.array(X_AB.translation())
    return np.asarray(adjoint_of_arrays(R, p))


@njit(cache=True)
def adjoint_of_arrays(R: Array, p: Array) -> Array:
    """`adjoint` of a pose with rotation R, shape (3, 3), and position p, shape (3,) [m]."""
    Ad = np.zeros((6, 6))
    for j in range(3):
        for i in range(3):  # not by slices, whose checks compile for seconds
            Ad[i, j] = Ad[3 + i, 3 + j] = R[i, j]
        Ad[3, j] = p[1] * R[2, j] - p[2] * R[1, j]
        Ad[4, j] = p[2] * R[0, j] - p[0] * R[2, j]
        Ad[5, j] = p[0] * R[1, j] - p[1] * R[0, j]
    return Ad


def euclidean_length(vector: Array) -> float:
    """2-norm of a few numbers, shape (n,), their squares added from the first to the last.

    NumPy's `dot` adds in an order that is another one on another processor.
    """
    total = 0.0
    for value in vector.tolist():
        total += value * value
    return math.sqrt(total)


def pose_error(X_AB: RigidTransform, X_AC: RigidTransform) -> tuple[float, float]:
    """Distance [m] and angle [rad] between two poses given in the same frame A."""
    turn = rotation_vector(X_AB.rotation().inverse() @ X_AC.rotation())
    return place_error(X_AB, X_AC), euclidean_length(turn)


def place_error(X_AB: RigidTransform, X_AC: RigidTransform) -> float:
    """Distance alone between two poses given in the same frame A [m]."""
    apart = X_AB.translation() - X_AC.translation()
    return euclidean_length(apart)


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
