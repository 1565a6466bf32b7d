"""Checks the section `torque_control` and puts its block between a servo and winches by torque."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from pydrake.systems.framework import DiagramBuilder, System
from pydrake.systems.primitives import MatrixGain

from cdpr_drake.control.torque_law import TorqueServoLaw
from cdpr_drake.errors import TensionProblemError
from cdpr_drake.geometry.cable_paths import cable_paths
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.models.robot_statics import tension_problem
from cdpr_drake.numerics.explicit_integration import explicit_integrators
from cdpr_drake.schema.declarations import Refusal, Scope, told
from cdpr_drake.servoing.servo_task import BelievedRobot
from cdpr_drake.systems.controllers.computed_torque import platform_dynamics
from cdpr_drake.systems.controllers.torque_controller import TorqueController
from cdpr_drake.systems.controllers.torque_settings import SMALLEST_SLACK, TORQUE, TorqueControl
from cdpr_drake.systems.robots.assembly import RobotBlock
from cdpr_drake.systems.robots.cable_robot import SEMI_IMPLICIT
from cdpr_drake.systems.scenarios.visual_servo_scenario import VisualServoSettings
from cdpr_drake.systems.sensors.sensor_readings import SensorReadings
from cdpr_drake.tensions.methods import method_for

if TYPE_CHECKING:
    from cdpr_drake.systems.scenarios.visual_servo_scenario import Scenario

WHOLE = 1e-6
"""A period over a step that is this near to a whole number is one: decimal rates are rounded."""


def torque_refusals(scope: Scope) -> Iterator[Refusal]:
    """What contradicts winches by torque, or what these make no sense with."""
    scenario, robot, mode = scope.whole, scope.robot, scope.whole.winches.mode
    if mode != TORQUE:
        if scenario.torque_control is not None:
            found = f"a section with winches.mode {mode}"
            yield "torque_control", found, "null, or mode torque"
        return
    if scenario.tension_management is not None:
        accepted = "null: tensions are what torques are commanded for"
        yield "tension_management", "a section with winches.mode torque", accepted
    settings = scenario.torque_control or TorqueControl()
    low, high = settings.wanted_limits(robot)
    if low > high:
        margin = settings.margin
        found = f"{margin:g} with limits {low - margin:g} to {high + margin:g} N"
        accepted = "at most half of what is between them, the first one not above the second"
        yield "torque_control.margin", found, accepted
    slack, most = settings.slack_below, max(0.5 * low, SMALLEST_SLACK)
    if slack is not None and slack > most:
        accepted = f"at most {most:g} [N], half of the smallest wanted tension"
        yield "torque_control.slack_below", f"{slack:g}", accepted
    try:
        method_for(settings.method, len(robot.cables) - robot.motion_type().freedom, False)
    except TensionProblemError as problem:
        yield told(problem, "torque_control.method")
    rate, step, servo = settings.rate, scenario.integration.max_step, scenario.controller.rate
    if rate < servo:
        yield "torque_control.rate", f"{rate:g}", f"at least controller.rate = {servo:g} [Hz]"
    if step is not None and not is_whole_step(rate, step):
        accepted = (
            f"a whole number of steps of integration.max_step = {step:g} s for each of control"
        )
        yield "torque_control.rate", f"{rate:g}", accepted


def is_whole_step(rate: float, step: float) -> bool:
    """Whether a period of a rate [Hz] has a whole number of steps [s], but for rounding."""
    steps = 1.0 / (rate * step)
    return round(steps) >= 1 and math.isclose(steps, round(steps), rel_tol=WHOLE)


def winch_group_refusals(scope: Scope) -> Iterator[Refusal]:
    """What does not work with several cables on one winch."""
    scenario, robot, groups = scope.whole, scope.robot, scope.robot.winch_groups()
    if not groups.are_shared():
        return
    motions, name = robot.motion_type().freedom, robot.name
    if groups.count < motions:
        found = f"{name} with {groups.count} winches for {len(robot.cables)} cables"
        yield "robot", found, f"at least {motions} for a visual servo, one for each motion"
    if scenario.tension_management is not None:
        found = "a section, which takes up slack cable by cable"
        yield "tension_management", found, f"null for {name}"
    integrator = scenario.integration.integrator
    if scenario.winches.has_motors() and integrator == SEMI_IMPLICIT:
        found = f"{integrator} with motors that have several cables each"
        accepted = f"{' or '.join(explicit_integrators())} for {name}"
        yield "integration.integrator", found, accepted


def tension_limits(scenario: Scenario, robot: Robot) -> tuple[float, float]:
    """Limits of tensions [N] that a run by torque is judged by, without the margin."""
    settings = scenario.torque_control or TorqueControl()
    low, high = settings.wanted_limits(robot)
    return low - settings.margin, high + settings.margin


def torque_law(
    settings: TorqueControl, robot: Robot, believed: BelievedRobot, servo: VisualServoSettings
) -> TorqueServoLaw:
    """The law that settings ask for, with what is believed of the robot.

    Args:
        settings: The section.
        robot: The robot: its winches and limits.
        believed: What is believed of its cables.
        servo: The servo before it; the robot that it believes in has platform and friction.

    Raises:
        RobotFileError: The robot's file does not say enough of its motors.
    """
    cables, winch = believed.cables, robot.winch_law()
    file = servo.perturbations.believed_robot
    base = robot if file is None else load_robot(file)
    if not servo.controller.pulleys:
        cables = cables.without_pulleys()
    at_home = tension_problem(robot, robot.home.transform(), cables=cables)
    radii = winch.drum.radii(cables.count)
    low, high = settings.wanted_limits(robot)
    bounds = np.repeat([[low], [high]], cables.count, axis=1)
    return TorqueServoLaw(
        cables,
        platform_dynamics(base),
        bounds,
        wrench=settings.servo_wrench(servo.controller.rate),
        loop=settings.tension_controller(float(np.mean(radii)), base.winch_law().friction, low),
        period=1.0 / settings.rate,
        row_scale=at_home.scale_of_rows.copy(),
        method=settings.method,
        height=float(robot.plane_height or 0.0),
        drums=np.array([radii, 1.0 / robot.winch_groups().sizes()]),
    )


STIFFEST_SHARE = 0.5
"""Length of the shortest cable that a warning reckons with, per that at the start: the platform
comes near its exit points."""


def loop_warnings(scenario: Scenario, robot: Robot) -> list[str]:
    """What speaks against the gains of a tension loop: cables too stiff for its rate."""
    if scenario.winches.mode != TORQUE:
        return []
    settings, winch = scenario.torque_control or TorqueControl(), robot.winch_law()
    cables = scenario.cables.cable_set(robot)
    lengths = cable_paths(scenario.initial_pose.transform(), cables).lengths
    stiffness = float(np.max(cables.stiffness / lengths)) / STIFFEST_SHARE
    low, _ = settings.wanted_limits(robot)
    retardation = float(np.max(cables.retardation))

    def stable(proportional: float) -> bool:
        loops = [
            replace(
                settings.tension_controller(radius, winch.friction, low), proportional=proportional
            )
            for radius in np.unique(winch.drum.radii(cables.count))
        ]
        poles = [
            loop.largest_pole(1.0 / settings.rate, stiffness, winch.inertia, retardation)
            for loop in loops
        ]
        return max(poles) < 1.0

    if stable(settings.proportional):
        return []
    words = (
        f"{scenario.name}: torque_control.proportional: found {settings.proportional:g}; the "
        f"tension loop is not stable at {settings.rate:g} Hz with cables of {stiffness:.2g} N/m"
    )
    best = [share for share in TRIED if stable(share * settings.proportional)]
    if best:
        return [f"{words}; at {best[0] * settings.proportional:.3g} it is"]
    return [f"{words}; a higher torque_control.rate or softer cables may help"]


TRIED = (0.75, 0.5, 0.35, 0.25, 0.1, 0.0)
"""Shares of a gain that is too large, of which a warning names the first that is stable."""


def add_torque_controller(
    builder: DiagramBuilder,
    settings: VisualServoSettings,
    robot: RobotBlock,
    *,
    believed: BelievedRobot,
    name: str,
) -> TorqueController | None:
    """Adds a `TorqueController` for winches that are commanded by torque; None for others."""
    if not robot.HasInputPort("motor_torques"):
        return None
    wanted = settings.torque_control or TorqueControl()
    law = torque_law(wanted, robot.robot, believed, settings)
    return builder.AddNamedSystem(name, TorqueController(law, wanted.rate))


def connect_torque_controller(
    builder: DiagramBuilder,
    torque: TorqueController,
    robot: RobotBlock,
    *,
    readings: SensorReadings,
    servo: System,
    estimator: System,
) -> None:
    """Connects it to the servo before it, sensors, drives and winches."""
    for port, source in (
        ("platform_velocity", servo.GetOutputPort("platform_velocity")),
        ("X_WP", estimator.GetOutputPort("X_WP")),
        ("tensions", readings.port("measured_tensions")),
        ("length_rates", robot.GetOutputPort("unstrained_length_rates")),
    ):
        builder.Connect(source, torque.GetInputPort(port))
    torques, groups = torque.GetOutputPort("motor_torques"), robot.robot.winch_groups()
    if groups.are_shared():  # a motor holds all cables on its winch
        total = builder.AddNamedSystem("winch_torques", MatrixGain(groups.to_cables().T))
        builder.Connect(torques, total.get_input_port())
        torques = total.get_output_port()
    builder.Connect(torques, robot.GetInputPort("motor_torques"))
