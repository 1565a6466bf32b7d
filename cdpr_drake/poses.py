"""Poses written as position and three angles, twists, rotation vectors and adjoints."""

from __future__ import annotations

import numpy as np
from pydrake.math import RigidTransform, RotationMatrix

from cdpr_drake.arrays import Array


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
    q = R.ToQuaternion().wxyz()
    if q[0] < 0.0:
        q = -q
    norm = float(np.linalg.norm(q[1:]))
    if norm < 1e-12:
        return np.asarray(2.0 * q[1:], float)
    return np.asarray(q[1:] * (2.0 * np.arctan2(norm, q[0]) / norm), float)


def rotation_from_vector(theta_u: Array) -> RotationMatrix:
    """Inverse of `rotation_vector`: exp([theta u]x), from shape (3,) [rad]. Source: Rodrigues."""
    theta = float(np.linalg.norm(theta_u))
    cross = cross_matrix(theta_u)
    a = np.sinc(theta / np.pi)
    b = 0.5 * np.sinc(theta / (2.0 * np.pi)) ** 2
    return RotationMatrix.ProjectToRotationMatrix(np.eye(3) + a * cross + b * cross @ cross)


def exponential(twist: Array) -> RigidTransform:
    """Pose reached from rest at the identity by a constant body twist during unit time.

    Args:
        twist: (rotation vector [rad], translation [m]), shape (6,); a velocity times a duration.

    Source: servoing thesis (2.1), there ordered (translation, rotation).
    """
    w, v = np.asarray(twist[:3], float), np.asarray(twist[3:], float)
    theta = float(np.linalg.norm(w))
    cross = cross_matrix(w)
    b = 0.5 * np.sinc(theta / (2.0 * np.pi)) ** 2
    c = (1.0 - np.sinc(theta / np.pi)) / theta**2 if theta > 1e-4 else 1.0 / 6.0 - theta**2 / 120.0
    V = np.eye(3) + b * cross + c * cross @ cross
    return RigidTransform(rotation_from_vector(w), V @ v)


def adjoint(X_AB: RigidTransform) -> Array:
    """Ad with V_A = Ad @ V_B for one rigid body on which frames A and B are fixed, shape (6, 6).

    V_B is the twist of B expressed in B, V_A that of A expressed in A, both (rotation,
    translation) [rad/s, m/s].

    Source: servoing thesis (1.37), there ordered (translation, rotation).
    """
    R = X_AB.rotation().matrix()
    Ad = np.zeros((6, 6))
    Ad[:3, :3] = R
    Ad[3:, 3:] = R
    Ad[3:, :3] = cross_matrix(X_AB.translation()) @ R
    return Ad


def pose_error(X_AB: RigidTransform, X_AC: RigidTransform) -> tuple[float, float]:
    """Distance [m] and angle [rad] between two poses given in the same frame A."""
    distance = float(np.linalg.norm(X_AB.translation() - X_AC.translation()))
    return distance, float(np.linalg.norm(rotation_vector(X_AB.rotation().inverse() @ X_AC.rotation())))
