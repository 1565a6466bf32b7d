"""Checks of a scenario before it is simulated: refusals and warnings."""

from __future__ import annotations

from typing import Any

from cdpr_drake.arrays import Array
from cdpr_drake.errors import InfeasibleTensionError, ScenarioError, TensionProblemError
from cdpr_drake.models.mechanism_schema import Mechanism
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.systems.cameras.turning_camera import turning_camera
from cdpr_drake.systems.controllers.torque_settings import TORQUE
from cdpr_drake.systems.robots.cable_robot import (
    SEMI_IMPLICIT,
    STEP_SHARE,
    automatic_step,
    holding_tensions,
)
from cdpr_drake.systems.worlds.contact import contact_law, contact_step

MOST_STEPS = 1e9
"""Integration steps of a run; more would take days."""


def check_length(scenario: Any, step: float) -> None:
    """Refuses runs that would never end.

    Raises:
        ScenarioError: The duration has more than `MOST_STEPS` integration steps [s].
    """
    steps = scenario.duration / step
    if steps > MOST_STEPS:
        raise ScenarioError(
            f"{scenario.name}: duration: found {scenario.duration:g} s, {steps:.2g} integration "
            f"steps of {step:g} s; accepted: at most {MOST_STEPS:g} steps"
        )


def check_start(servo: Any) -> None:
    """Makes sure that the camera sees the target at the start, or can be turned so that it does.

    Raises:
        ScenarioError: It does not; says where the target would be.
    """
    scenario, pinhole = servo.scenario, servo.pinhole
    key, turning = turning_camera(scenario)
    X_WP = scenario.initial_pose.transform()
    X_CO, aimed = servo.X_CO(X_WP, 0.0), ""
    if turning is not None:
        mounting = turning.aimed(servo.mounting, X_CO)
        X_CO, aimed = mounting.X_CO(X_WP, servo.motion.at(0.0)), f", aimed by {key},"
    if servo.target.in_view(X_CO, pinhole):
        return
    depth = float(X_CO.translation()[2])
    if depth <= 0.0:
        place = f"it is {-depth:.3g} m behind the camera"
    else:
        u, v = pinhole.project(X_CO.translation()[:, None])[:, 0]
        place = f"its middle would be at ({u:.0f}, {v:.0f}) px, {depth:.3g} m away"
        if 0 <= u <= pinhole.width - 1 and 0 <= v <= pinhole.height - 1:
            place += "; it is turned away from the camera, or a part of it is outside"
    raise ScenarioError(
        f"{scenario.name}: initial_pose: the camera{aimed} does not see the target at the start: "
        f"{place}; accepted: all of it within {pinhole.width} x {pinhole.height} px, face on"
    )


def goal_warnings(servo: Any) -> list[str]:
    """What speaks against the desired pose; the run may show that it does not matter."""
    name, warnings = f"{servo.scenario.name}: desired:", []
    if not servo.target.in_view(servo.X_CdO, servo.pinhole):
        warnings.append(f"{name} the camera does not see all of the target from there")
    if not servo.free_rotation:
        try:
            cables = servo.scenario.cables.cable_set(servo.robot)
            holding_tensions(servo.robot, servo.desired_platform_pose(), cables)
        except (InfeasibleTensionError, TensionProblemError) as problem:
            warnings.append(f"{name} outside the static workspace: {problem}")
    return warnings


def limit_warnings(key: str, limits: Array | None, body: Robot | Mechanism) -> list[str]:
    """What is said if a scenario replaces the tension bounds of a robot's file.

    Args:
        key: The scenario's key.
        limits: Its smallest and largest tension, shape (2,) [N]; None: those of the file.
        body: The robot or mechanism.
    """
    own = body.tension_limits()
    if limits is None or (float(limits[0]), float(limits[1])) == own:
        return []
    return [
        f"{key} = {limits[0]:g} to {limits[1]:g} N replace tension_bounds of {body.name}, "
        f"{own[0]:g} to {own[1]:g} N; null takes those"
    ]


def servo_limit_warnings(scenario: Any, robot: Robot) -> list[str]:
    """`limit_warnings` of a visual servo, which has limits if its winches are driven by torque."""
    settings = scenario.torque_control
    if settings is None or scenario.winches.mode != TORQUE:
        return []
    return limit_warnings("torque_control.limits", settings.limits, robot)


def contact_warnings(scenario: Any, robot: Robot) -> list[str]:
    """What speaks against a given integration step where the platform touches something."""
    world, step = scenario.world, scenario.integration.max_step
    if world is None or world.contact is None or step is None:
        return []
    method = scenario.integration.integrator
    largest = contact_step(robot, contact_law(world.contact, robot), world.friction(), method)
    words = f"{method} for contact is about {largest:.3g} s: what touches may jitter"
    return _step_warning(scenario, step, largest, words)


def step_warnings(servo: Any) -> list[str]:
    """What speaks against a given integration step: a stiff cable then swings without end."""
    scenario, step = servo.scenario, servo.scenario.integration.max_step
    method = scenario.integration.integrator
    if step is None or method == SEMI_IMPLICIT:
        return []
    ends = (scenario.initial_pose.transform(), servo.desired_platform_pose())
    steps = [automatic_step(servo.robot, X_WP, method, scenario) for X_WP in ends]
    largest = min(steps) / STEP_SHARE
    words = (
        f"{method} is about {largest:.3g} s: tensions are not to be trusted, the run may diverge"
    )
    return _step_warning(scenario, step, largest, words)


def _step_warning(scenario: Any, step: float, largest: float, words: str) -> list[str]:
    if step <= largest:
        return []
    return [
        f"{scenario.name}: integration.max_step: found {step:g}; the largest stable one of {words}"
    ]


def sheave_warnings(scenario: Any, robot: Robot) -> list[str]:
    """What is said if the robot's file has friction in grooves, and no cable runs in a groove."""
    friction = robot.cable_behaviour().sheave_friction
    if friction == 0.0 or (scenario.cables.pulleys and robot.cable_set().has_pulleys()):
        return []
    return [
        f"{scenario.name}: cable.behaviour.sheave_friction {friction:g} of {robot.name} does "
        "nothing without pulleys; cables.pulleys=true has cables run over those of the robot"
    ]
