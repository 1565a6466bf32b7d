"""The robot as it believes itself to be while it handles a box."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from pydrake.math import RigidTransform

from cdpr_drake.models import Robot
from cdpr_drake.servoing import BelievedRobot
from cdpr_drake.systems.diagrams import random_shifts, shifted_pose
from cdpr_drake.systems.scenarios import PickAndPlaceScenario

_POINTS, _INITIAL_POSE, _CAMERAS = 1, 2, (3, 5)
"""Streams of random numbers of one seed; the first ones are those of a visual servo."""


def camera_poses(
    scenario: PickAndPlaceScenario, robot: Robot, *, believed: bool
) -> tuple[RigidTransform, RigidTransform]:
    """Poses X_PC of the cameras that look at box and goal, true or believed [m]."""
    first = robot.camera_mount(scenario.camera.mount).pose.transform()
    other = scenario.goal_camera
    poses = [first, first if other is None else other.pose.transform()]
    if believed:
        shift = scenario.perturbations.camera_pose_shift
        streams = _CAMERAS if other is not None else (_CAMERAS[0],) * 2
        poses = [
            shifted_pose(pose, shift, np.random.default_rng([scenario.seed, stream]))
            for pose, stream in zip(poses, streams, strict=True)
        ]
    return poses[0], poses[1]


def believed_robot(scenario: PickAndPlaceScenario, robot: Robot) -> BelievedRobot:
    """The robot as servo and dead reckoning believe it to be."""
    errors, true = scenario.perturbations, robot.cable_set()

    def stream(number: int) -> np.random.Generator:
        return np.random.default_rng([scenario.seed, number])

    points = stream(_POINTS)
    return BelievedRobot(
        cables=replace(
            true,
            p_WA=true.p_WA + random_shifts(true.count, errors.exit_points, points),
            p_PB=true.p_PB + random_shifts(true.count, errors.anchor_points, points),
        ),
        X_PC=camera_poses(scenario, robot, believed=True)[0],
        X_WP0=shifted_pose(
            scenario.initial_pose.transform(), errors.initial_pose_shift, stream(_INITIAL_POSE)
        ),
        motions=robot.servo_rows("pick and place"),
        cable_speed=robot.winch.rated_cable_speed(),
    )
