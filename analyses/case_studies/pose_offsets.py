"""Poses beside a pose, as items for a scenario: what the thesis gives as a size and an axis."""

from __future__ import annotations

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.arrays import Array
from cdpr_drake.spatial import (
    angles_from_rotation,
    pose_from_angles,
    rotation_from_vector,
    rotation_vector,
)

Angles = tuple[tuple[float, float, float], tuple[float, float, float]]
"""A pose as files write it: position [m], angles (phi, theta, psi) [deg]."""


def as_transform(pose: Angles) -> RigidTransform:
    """The pose as a RigidTransform."""
    return pose_from_angles(np.array(pose[0]), np.radians(pose[1]))


def pose_item(key: str, X: RigidTransform) -> str:
    """A pose as an item "key={position: [...], angles_deg: [...]}"."""
    angles = np.degrees(angles_from_rotation(X.rotation()))
    return f"{key}={{position: {_list(X.translation())}, angles_deg: {_list(angles)}}}"


def turned(X: RigidTransform, shift: Array, angle_deg: float, axis: Array) -> RigidTransform:
    """A belief about X that is shifted in X's parent frame [m] and turned about an axis of it.

    The turn is the one that takes the belief to X: R = exp(theta [u]x) R_belief. The one printed
    pair of a pose and a belief, set d1 of the servoing thesis 4.3.1, has this form.
    """
    u = axis / np.linalg.norm(axis)
    turn = rotation_from_vector(-np.radians(angle_deg) * u)
    return RigidTransform(turn @ X.rotation(), X.translation() + shift)


def between(X: RigidTransform, belief: RigidTransform) -> tuple[Array, Array]:
    """Direction of the shift and axis of the turn of `turned`, unit vectors in the parent frame."""
    shift = belief.translation() - X.translation()
    turn = rotation_vector(X.rotation() @ belief.rotation().inverse())
    return shift / np.linalg.norm(shift), turn / np.linalg.norm(turn)


def camera_belief(X_PC: RigidTransform, belief: RigidTransform) -> str:
    """The item for a controller that believes the camera to be at `belief` on the platform."""
    return pose_item("perturbations.camera_pose", X_PC.inverse() @ belief)


def _list(values: Array) -> str:
    return "[" + ", ".join(f"{value:.9g}" for value in values) + "]"
