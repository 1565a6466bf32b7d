"""What a visual servo finds at its start and at its goal, before anything is simulated."""

from __future__ import annotations

from cdpr_drake.arrays import Array
from cdpr_drake.errors import InfeasibleTensionError, ScenarioError, TensionProblemError
from cdpr_drake.models.mechanism_schema import Mechanism
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.systems.diagrams.pan_tilt import aimed_mounting
from cdpr_drake.systems.diagrams.servo_models import LoopServo
from cdpr_drake.systems.diagrams.torque_control import TORQUE
from cdpr_drake.systems.diagrams.visual_servo import VisualServo
from cdpr_drake.systems.robots.cable_robot import (
    SEMI_IMPLICIT,
    STEP_SHARE,
    automatic_step,
    holding_tensions,
)
from cdpr_drake.systems.scenarios.tension_control_scenario import TensionScenario
from cdpr_drake.systems.scenarios.visual_servo_scenario import Scenario
from cdpr_drake.systems.worlds.contact import contact_law, contact_step

MOST_STEPS = 1e9
"""Integration steps of a run; more would take days."""


def check_start(servo: VisualServo | LoopServo) -> None:
    """Makes sure that the camera sees the target at the start, or can be turned so that it does.

    Raises:
        ScenarioError: It does not; says where the target would be.
    """
    scenario, pinhole = servo.scenario, servo.pinhole
    X_WP, joints = scenario.initial_pose.transform(), scenario.camera.pan_tilt
    X_CO, aimed = servo.X_CO(X_WP, 0.0), ""
    if joints is not None:
        mounting = aimed_mounting(servo.mounting, joints, X_CO)
        X_CO, aimed = mounting.X_CO(X_WP, servo.motion.at(0.0)), ", aimed by camera.pan_tilt,"
    if servo.target.in_view(X_CO, pinhole):
        return
    depth = float(X_CO.translation()[2])
    if depth <= 0.0:
        where = f"it is {-depth:.3g} m behind the camera"
    else:
        u, v = pinhole.project(X_CO.translation()[:, None])[:, 0]
        where = f"its middle would be at ({u:.0f}, {v:.0f}) px, {depth:.3g} m away"
        low_u, high_u = 0, pinhole.width - 1
        low_v, high_v = 0, pinhole.height - 1
        if low_u <= u <= high_u and low_v <= v <= high_v:
            where += "; it is turned away from the camera, or a part of it is outside"
    raise ScenarioError(
        f"{scenario.name}: initial_pose: the camera{aimed} does not see the target at the start: "
        f"{where}; accepted: all of it within {pinhole.width} x {pinhole.height} px, face on"
    )


def goal_warnings(servo: VisualServo | LoopServo) -> list[str]:
    """What speaks against the desired pose; the run may show that it does not matter."""
    scenario, warnings = servo.scenario, []
    if not servo.target.in_view(servo.X_CdO, servo.pinhole):
        warnings.append(
            f"{scenario.name}: desired: the camera does not see all of the target from there"
        )
    if not servo.free_rotation:
        X_WPd = servo.desired_platform_pose()
        try:
            holding_tensions(servo.robot, X_WPd, scenario.cables.cable_set(servo.robot))
        except (InfeasibleTensionError, TensionProblemError) as problem:
            warnings.append(f"{scenario.name}: desired: outside the static workspace: {problem}")
    return warnings


def check_length(name: str, duration: float, step: float) -> None:
    """Refuses runs that would never end.

    Args:
        name: Name of the scenario.
        duration: Longest simulated time [s].
        step: Integration step [s].

    Raises:
        ScenarioError: The duration has more than `MOST_STEPS` integration steps.
    """
    steps = duration / step
    if steps > MOST_STEPS:
        raise ScenarioError(
            f"{name}: duration: found {duration:g} s, {steps:.2g} integration steps of {step:g} s; "
            f"accepted: at most {MOST_STEPS:g} steps"
        )


def limit_warnings(key: str, given: Array | None, limited: Robot | Mechanism) -> list[str]:
    """What is said where a scenario replaces the tension bounds of a robot's file.

    Args:
        key: The scenario's key.
        given: Its smallest and largest tension, shape (2,) [N]; None: the robot's.
        limited: The robot or mechanism.
    """
    own = limited.tension_limits()
    if given is None or (float(given[0]), float(given[1])) == own:
        return []
    return [
        f"{key} = {given[0]:g} to {given[1]:g} N replace tension_bounds of {limited.name}, "
        f"{own[0]:g} to {own[1]:g} N; null takes those"
    ]


def servo_limit_warnings(scenario: Scenario, robot: Robot) -> list[str]:
    """`limit_warnings` of a visual servo, which limits tensions where its winches are by torque."""
    settings = scenario.torque_control
    if settings is None or scenario.winches.mode != TORQUE:
        return []
    return limit_warnings("torque_control.limits", settings.limits, robot)


def contact_warnings(scenario: Scenario | TensionScenario, robot: Robot) -> list[str]:
    """What speaks against a given integration step where the platform touches something."""
    world, given = scenario.world, scenario.integration.max_step
    if world is None or world.contact is None or given is None:
        return []
    method = scenario.integration.integrator
    largest = contact_step(robot, contact_law(world.contact, robot), world.friction(), method)
    if given <= largest:
        return []
    return [
        f"{scenario.name}: integration.max_step: found {given:g}; the largest stable one of "
        f"{method} for contact is about {largest:.3g} s: what touches may jitter"
    ]


def sheave_warnings(scenario: Scenario | TensionScenario, robot: Robot) -> list[str]:
    """What is said where friction in grooves is in the robot's file, and cables run in none."""
    friction = robot.cable_behaviour().sheave_friction
    runs = scenario.cables.pulleys and robot.cable_set().has_pulleys()
    if friction == 0.0 or runs:
        return []
    return [
        f"{scenario.name}: cable.behaviour.sheave_friction {friction:g} of {robot.name} does "
        "nothing without pulleys; cables.pulleys=true has cables run over those of the robot"
    ]


def step_warnings(servo: VisualServo | LoopServo) -> list[str]:
    """What speaks against a given integration step: a stiff cable then swings without end."""
    scenario, given = servo.scenario, servo.scenario.integration.max_step
    if given is None or scenario.integration.integrator == SEMI_IMPLICIT:
        return []
    ends = (scenario.initial_pose.transform(), servo.desired_platform_pose())
    method = scenario.integration.integrator
    steps = [automatic_step(servo.robot, X_WP, method, scenario) for X_WP in ends]
    largest = min(steps) / STEP_SHARE
    if given <= largest:
        return []
    return [
        f"{scenario.name}: integration.max_step: found {given:g}; the largest stable one of "
        f"{method} is about {largest:.3g} s: tensions are not to be trusted, the run may diverge"
    ]
