"""Checks of a scenario that need more than one field, or its robot."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from cdpr_drake.errors import ScenarioError
from cdpr_drake.models import Pose, Robot
from cdpr_drake.typed_yaml import closest

if TYPE_CHECKING:
    from cdpr_drake.systems.scenario import Scenario


def check_scenario(scenario: Scenario, robot: Robot, path: Path) -> None:
    """Refuses what the robot cannot do or what contradicts itself.

    Raises:
        ScenarioError: Names the file, the field, what was found and what is accepted.
    """
    for check in CHECKS:
        check(scenario, robot, path)


def _check_mount(scenario: Scenario, robot: Robot, path: Path) -> None:
    mounts = [mount.name for mount in robot.cameras if mount.parent == "platform"]
    if scenario.camera.mount not in mounts:
        raise ScenarioError(
            f"{path}: camera.mount: {scenario.camera.mount!r} is not on the platform of "
            f"{robot.name}; {closest(scenario.camera.mount, mounts)}"
        )


def _check_poses(scenario: Scenario, robot: Robot, path: Path) -> None:
    poses = {"initial_pose": scenario.initial_pose}
    if scenario.perturbations.initial_pose is not None:
        poses["perturbations.initial_pose"] = scenario.perturbations.initial_pose
    for key, pose in poses.items():
        if np.any(pose.position < robot.frame.lower) or np.any(pose.position > robot.frame.upper):
            raise ScenarioError(
                f"{path}: {key}.position: found {words(pose.position)}, outside the frame; "
                f"accepted: {words(robot.frame.lower)} to {words(robot.frame.upper)} [m]"
            )
        if robot.is_planar():
            _check_planar(key, pose, robot, path)


def _check_planar(key: str, pose: Pose, robot: Robot, path: Path) -> None:
    if pose.position[2] != robot.plane_height or np.any(pose.angles_deg[:2] != 0.0):
        raise ScenarioError(
            f"{path}: {key}: found {words(pose.position)} m, {words(pose.angles_deg)} "
            f"deg; accepted for the planar {robot.name}: z = {robot.plane_height:g} m, "
            "phi = theta = 0"
        )


def _check_gains(scenario: Scenario, robot: Robot, path: Path) -> None:
    controller = scenario.controller
    if controller.lambda_infinity > controller.lambda_0:
        raise ScenarioError(
            f"{path}: controller.lambda_infinity: found {controller.lambda_infinity:g}; "
            f"accepted: at most lambda_0 = {controller.lambda_0:g} [1/s]"
        )


def _check_desired(scenario: Scenario, robot: Robot, path: Path) -> None:
    if scenario.desired.position[2] <= 0.0:
        raise ScenarioError(
            f"{path}: desired.position: found {words(scenario.desired.position)}; "
            "accepted: z > 0 [m], in front of the camera"
        )


def _check_perturbations(scenario: Scenario, robot: Robot, path: Path) -> None:
    perturbations, m = scenario.perturbations, len(robot.cables)
    for name in ("exit_point_shifts", "anchor_point_shifts", "slack"):
        value = getattr(perturbations, name)
        if value is not None and len(value) != m:
            raise ScenarioError(
                f"{path}: perturbations.{name}: found {len(value)} rows; accepted: one for each "
                f"of the {m} cables of {robot.name}"
            )


def words(values: np.ndarray) -> str:
    """Numbers as "(1, 2, 3)", for messages."""
    return "(" + ", ".join(f"{value:g}" for value in values) + ")"


CHECKS: list[Callable[[Scenario, Robot, Path], None]] = [
    _check_mount,
    _check_poses,
    _check_gains,
    _check_desired,
    _check_perturbations,
]
"""Every check of a scenario, in order; each raises a ScenarioError or says nothing."""
