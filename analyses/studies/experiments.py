"""Poses and perturbations of experiments, as items for scenarios.

First, poses beside a pose: what the thesis gives as a size and an axis. Then the experiments of
case study VII: start, servo, planned path, and perturbation sets d1 to d4.

Source: servoing thesis 4.3.1.
"""

from __future__ import annotations

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.arrays import Array
from cdpr_drake.geometry.poses import (
    angles_from_rotation,
    pose_from_angles,
    rotation_from_vector,
    rotation_vector,
)

POINT_ERROR = 0.005
"""Distance by which exit and anchor points of cables are believed wrongly [m], each in a direction
of its own, where the servoing thesis says no more: manufacturing errors as it prints them, in the
baseline bounds for both robots, section 3.3.3, and again for experiments on ACROBOT, 4.3.1."""

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
    return "[" + ", ".join(map(_number, values)) + "]"


def _number(value: float) -> str:
    """Nine digits, as every reader of YAML takes them for a number: 1.0e-05, not 1e-05."""
    mantissa, exponent, power = f"{value:.9g}".partition("e")
    dot = ".0" if exponent and "." not in mantissa else ""
    return f"{mantissa}{dot}{exponent}{power}"


DIRECTIONS = "Directions of the perturbations are not printed and drawn for each run."
"""Why runs cannot be those that were published."""

DRAWN = "Directions of perturbations are not printed; each run draws its own from its seed."
"""What studies assume of these directions."""

START = as_transform(((0.107, -0.026, 0.35), (20.0, -20.0, 0.0)))
"""Initial pose of the platform in W."""

X_PC = as_transform(((-0.0631, 0.0, 0.01), (0.0, 180.0, 0.0)))
"""True pose of the camera on the small platform."""

SETUP = (
    "controller.scheme=2.5d",
    "controller.rate=20",
    "camera.rate=20",
    "controller.lambda_0=2.0",
    "controller.lambda_infinity=0.4",
    "controller.lambda_slope=30",
    "controller.sigma=4.0",
    pose_item("initial_pose", START),
    "desired={position: [0, 0, 0.09], angles_deg: [180, 0, 180]}",
    "target.pose={position: [0.2369, 0.25, 0.04]}",
)

TIME = 12.0
"""Time for which the path of the features is planned [s]: about what the servo takes without."""

TRACKING = (f"trajectory={{duration: {TIME:g}}}", "controller.lambda_infinity=2.0")


def _belief(distance: float, angle_deg: float, axis: tuple[float, float, float]) -> tuple[str, str]:
    X = turned(START, np.zeros(3), angle_deg, np.array(axis))
    return (
        pose_item("perturbations.initial_pose", X),
        f"perturbations.initial_pose_shift={{distance: {distance:g}}}",
    )


def _camera(angle_deg: float, axis: tuple[float, float, float]) -> str:
    return camera_belief(X_PC, turned(X_PC, np.zeros(3), angle_deg, np.array(axis)))


def _camera_place(distance: float) -> str:
    return f"perturbations.camera_pose_shift={{distance: {distance:g}}}"


def wrong_points(distance: float = POINT_ERROR) -> tuple[str, str]:
    """Items for exit and anchor points that are believed wrongly by a distance [m]."""
    return (
        f"perturbations.exit_points={distance:g}",
        f"perturbations.anchor_points={distance:g}",
    )


def _belief_of_d1() -> str:
    X = as_transform(((0.0, -0.15, 0.25), (15.0, -25.0, 3.0)))
    return pose_item("perturbations.initial_pose", X)


SETS: dict[str, tuple[str, ...]] = {
    "none": (),
    "d1": (_belief_of_d1(), _camera(18.0, (0.61, -0.51, -0.61))),
    "d2": (
        *_belief(0.13, 9.5, (-0.52, 0.85, -0.04)),
        _camera(12.5, (0.78, -0.51, -0.35)),
        _camera_place(0.05),
        *wrong_points(0.005),
    ),
    "d3": (
        *_belief(0.075, 8.0, (0.6, 0.78, -0.15)),
        _camera(18.0, (0.15, -0.63, 0.76)),
        _camera_place(0.05),
        *wrong_points(0.01),
    ),
    "d4": (
        *_belief(0.11, 6.0, (-0.49, -0.5, 0.71)),
        _camera(15.0, (-0.47, -0.65, -0.60)),
    ),
}
"""Perturbation sets of section 4.3.1."""
