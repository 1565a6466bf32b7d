"""A camera on two joints, pan and tilt: what turns it to a target, and what it sees as at rest.

The joints' frame M is as that of a camera, z ahead, x to the right, y down; pan turns to the right
about y of M, then tilt upwards about x. C is the camera as it is turned, C0 as it is with both
angles zero.

A servo that keeps the target in the image by these joints has two tasks. That of the joints is
image-based: the target's middle shall be in the middle of the image (`centring_rates`). That of the
platform is the servo's own, about C0: the turned camera's measurement is taken there by the angles
that the encoders read (`steady_view`), so that features, their interaction matrix and the camera's
mounting are those of a fixed camera, whose image has no rim, and the joints' motion is none of the
platform's.

Source: Chaumette and Hutchinson, Visual servo control, Part I, IEEE Robotics and Automation
Magazine 13(4), 2006, for the interaction matrix of a point; a camera that is turned beside the
robot is named in the servoing thesis, 1.4.2.
"""

from __future__ import annotations

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.arrays import Array

DAMPING = 1e-3
"""Of least squares where the camera looks along the axis of pan, and pan turns the image only."""

STEEPEST = 20.0
"""Largest |x / z| and |y / z| of a mark in C0, 87 deg: beyond, its image at unit focal length says
nothing."""


def turning_jacobian(tilt: float) -> Array:
    """Angular velocity of C in C by the rates of pan and tilt, shape (3, 2)."""
    return np.array([[0.0, 1.0], [np.cos(tilt), 0.0], [-np.sin(tilt), 0.0]])


def centre_jacobian(center: Array, tilt: float) -> Array:
    """Velocity of a point's image at unit focal length by the rates of pan and tilt, shape (2, 2).

    Args:
        center: The image (x, y), shape (2,) [-].
        tilt: Tilt [rad].
    """
    x, y = center
    turns = np.array([[x * y, -(1.0 + x * x), y], [1.0 + y * y, -x * y, -x]])
    return turns @ turning_jacobian(tilt)


def centring_rates(center: Array, tilt: float, gain: float) -> Array:
    """Rates of pan and tilt that take a target to the middle of the image, shape (2,) [rad/s].

    q_dot = -gain J^+ (x, y), with J of `centre_jacobian`; the error goes down as exp(-gain t) while
    the target rests.

    Args:
        center: Image of the target's middle at unit focal length, shape (2,) [-].
        tilt: Tilt as the encoder reads it [rad].
        gain: Of the law [1/s].
    """
    J = centre_jacobian(center, tilt)
    return np.asarray(-gain * np.linalg.solve(J.T @ J + DAMPING**2 * np.eye(2), J.T @ center))


def pointing_angles(p_MO: Array) -> Array:
    """Pan and tilt at which z of the camera points along a line of sight, shape (2,) [rad].

    Args:
        p_MO: A point on the line from where the axes meet, in M, shape (3,) [m].
    """
    x, y, z = p_MO
    return np.array([np.arctan2(x, z), np.arctan2(-y, np.hypot(x, z))])


def spiral(time: float, pitch: float, speed: float, reach: float) -> Array:
    """Angles of a search round where a target was, shape (2,) [rad].

    A spiral of Archimedes that is gone along at a steady speed, far from its middle; where it
    reaches beyond, it begins anew.

    Args:
        time: Since the search began [s].
        pitch: Distance of its turns [rad].
        speed: Along it [rad/s].
        reach: Radius up to which it goes [rad].
    """
    whole = np.pi * reach**2 / (speed * pitch)
    radius = np.sqrt(speed * pitch * (time % whole) / np.pi)
    angle = 2.0 * np.pi * radius / pitch
    return np.asarray(radius * np.array([np.cos(angle), np.sin(angle)]))


def steady_view(
    X_C0C: RigidTransform, X_CO: RigidTransform, marks: Array, p_OK: Array
) -> tuple[RigidTransform, Array] | None:
    """What a turned camera sees, as seen with both angles zero.

    Images of points go along their lines of sight as deep as the pose X_CO has the points; if the
    axes of the joints meet in Co, depth does not matter.

    Args:
        X_C0C: The turned camera, by its encoders [m].
        X_CO: Measured pose of the target in it [m].
        marks: Images of the target's points at unit focal length, shape (2, n) [-].
        p_OK: These points, shape (3, n) [m].

    Returns:
        X_C0O [m] and images at unit focal length, shape (2, n) [-]; None where a point is beside or
        behind C0.
    """
    depths = (X_CO @ p_OK)[2]
    p_C0K = X_C0C @ (depths * np.vstack([marks, np.ones(marks.shape[1])]))
    if np.any(np.max(np.abs(p_C0K[:2]), axis=0) > STEEPEST * p_C0K[2]):
        return None
    return X_C0C @ X_CO, p_C0K[:2] / p_C0K[2]


def encoder_turn(pan: float, tilt: float) -> float:
    """Largest rotation of the camera that errors of two encoders hide [rad].

    By errors dp and dt the camera is believed turned by exp(dp y) and then by dt about an axis
    across y, whatever the angles are: cos(theta / 2) = cos(dp / 2) cos(dt / 2). So errors of the
    joints are errors of the camera's mounting, of a rotation of at most that.

    Args:
        pan: Bound on the error of pan [rad].
        tilt: Bound on that of tilt [rad].
    """
    return float(2.0 * np.arccos(np.clip(np.cos(pan / 2.0) * np.cos(tilt / 2.0), -1.0, 1.0)))
