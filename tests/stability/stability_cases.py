"""Cases and poses that the tests of stability share."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from pydrake.math import RigidTransform, RollPitchYaw

from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.stability.desired_view import FixedObject, OppositeCorner
from cdpr_drake.stability.stability_case import StabilityCase


def spatial_case(scheme: str, **changes: object) -> StabilityCase:
    robot = load_robot("acrobot_large")
    target = FixedObject(
        RigidTransform([0.1, -0.05, -0.4]),
        RigidTransform(RollPitchYaw(0.2, np.pi - 0.3, 0.4), [0.02, -0.03, 0.5]),
    )
    case = StabilityCase(
        robot.cable_set().without_pulleys(),
        scheme,
        X_PC=RigidTransform(RollPitchYaw(np.pi, 0.1, -0.2), [-0.06, 0.01, 0.02]),
        target=target,
        p_OK=np.array([[-0.1, 0.1, 0.1, -0.1], [0.1, 0.1, -0.1, -0.1], [0.0, 0.02, 0.0, 0.01]]),
    )
    return replace(case, **changes)


def planar_case() -> StabilityCase:
    robot = load_robot("planar")
    return StabilityCase(
        robot.cable_set().without_pulleys(),
        planar=True,
        X_PC=RigidTransform(RollPitchYaw(np.pi, 0.0, 0.3), [0.02, 0.01, 0.1]),
        target=OppositeCorner(np.full(3, -0.55), np.full(3, 0.55)),
    )


def random_poses(count: int, planar: bool = False) -> np.ndarray:
    random = np.random.default_rng(1)
    poses = np.zeros((count, 7))
    poses[:, 0] = 1.0
    poses[:, 1:4] = random.uniform(-0.1, 0.1, (count, 3))
    if planar:
        poses[:, 1:3] = 0.0
    poses[:, 4:] = random.uniform([-0.3, -0.3, 0.1], [0.3, 0.3, 0.7], (count, 3))
    return poses
