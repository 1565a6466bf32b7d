"""Poses beside a pose, as items for a scenario: what the thesis gives as a size and an axis."""

from __future__ import annotations

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.arrays import Array
from cdpr_drake.poses import (
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
    """X shifted in its parent frame [m], and turned about an axis of its own frame [deg]."""
    u = axis / np.linalg.norm(axis)
    turn = rotation_from_vector(np.radians(angle_deg) * u)
    return RigidTransform(X.rotation() @ turn, X.translation() + shift)


def between(X: RigidTransform, Y: RigidTransform) -> tuple[Array, Array]:
    """Direction from X to Y in their parent frame, and axis of the turn in X, unit vectors."""
    shift = Y.translation() - X.translation()
    turn = rotation_vector(X.rotation().inverse() @ Y.rotation())
    return shift / np.linalg.norm(shift), turn / np.linalg.norm(turn)


def _list(values: Array) -> str:
    return "[" + ", ".join(f"{value:.9g}" for value in values) + "]"
