"""TODO docstring."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.systems.scenarios.visual_servo_scenario import Scenario
from cdpr_drake.systems.servos.believed_robot import (
    _CAMERA,
    _INITIAL_POSE,
    _POINTS,
    ALL_MOTIONS,
    PLANAR_MOTIONS,
    ServoModel,
    random_shifts,
    shifted_pose,
)


def make_servo_model(scenario: Scenario, robot: Robot) -> ServoModel:
    """The robot as controller and estimators believe it to be."""
    perturbations = scenario.perturbations

    def stream(number: int) -> np.random.Generator:
        return np.random.default_rng([scenario.seed, number])

    true = robot.cable_set()
    m, points = true.count, stream(_POINTS)
    p_WA = true.p_WA + random_shifts(
        m, perturbations.exit_points, points, perturbations.exit_points_together
    )
    p_PB = true.p_PB + random_shifts(
        m, perturbations.anchor_points, points, perturbations.anchor_points_together
    )
    if perturbations.exit_point_shifts is not None:
        p_WA = p_WA + perturbations.exit_point_shifts.T
    if perturbations.anchor_point_shifts is not None:
        p_PB = p_PB + perturbations.anchor_point_shifts.T
    X_PC = robot.camera_mount(scenario.camera.mount).pose.transform()
    if perturbations.camera_pose is not None:
        X_PC = X_PC @ perturbations.camera_pose.transform()
    X_WP0 = (perturbations.initial_pose or scenario.initial_pose).transform()
    planar = robot.is_planar()
    return ServoModel(
        cables=replace(true, p_WA=p_WA, p_PB=p_PB),
        X_PC=shifted_pose(X_PC, perturbations.camera_pose_shift, stream(_CAMERA)),
        X_WP0=shifted_pose(X_WP0, perturbations.initial_pose_shift, stream(_INITIAL_POSE), planar),
        motions=PLANAR_MOTIONS if planar else ALL_MOTIONS,
        cable_speed=robot.winch.rated_cable_speed(),
    )
