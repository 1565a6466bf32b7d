"""Puts what a robot does when a cable breaks into a diagram, and checks section `emergency`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from pydrake.systems.framework import DiagramBuilder, OutputPort

from cdpr_drake.errors import ScenarioError
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.systems.controllers.emergency import (
    CONTINUE,
    FOUND,
    HOLD,
    REDISTRIBUTE,
    EmergencyReaction,
)
from cdpr_drake.systems.diagrams.servo_blocks import VisualServoBlocks
from cdpr_drake.systems.diagrams.torque_control import TORQUE
from cdpr_drake.systems.monitoring.break_detector import BreakDetector
from cdpr_drake.systems.robots.failures import BROKEN, JAMMED

if TYPE_CHECKING:
    from cdpr_drake.systems.scenarios.visual_servo_scenario import Scenario


def check_emergency(scenario: Scenario, robot: Robot, path: Path) -> None:
    """Refuses reactions that the scenario's winches cannot do.

    Raises:
        ScenarioError: Names the field, what was found and what is accepted.
    """
    settings = scenario.emergency
    if settings is None:
        return
    where = f"{path}: emergency"
    if scenario.failures is None:
        raise ScenarioError(
            f"{where}: found a section without failures; accepted: null, or with a section "
            "failures, which may be {}"
        )
    if robot.winch_groups().are_shared():
        raise ScenarioError(
            f"{where}: found a section with {robot.name}, which has several cables on one winch; "
            "accepted: null"
        )
    if settings.reaction != REDISTRIBUTE and settings.motion == CONTINUE:
        raise ScenarioError(
            f"{where}.motion: found {CONTINUE} with reaction {settings.reaction}; accepted: {HOLD}"
        )
    if settings.reaction == REDISTRIBUTE and scenario.winches.mode != TORQUE:
        raise ScenarioError(
            f"{where}.reaction: found {REDISTRIBUTE} with winches.mode {scenario.winches.mode}; "
            f"accepted: stop, or winches.mode {TORQUE}"
        )


def add_emergency(
    builder: DiagramBuilder, scenario: Scenario, blocks: VisualServoBlocks
) -> dict[str, OutputPort]:
    """Adds a scenario's reaction to a servo; returns what it logs.

    Subsystems: break_detector (where breaks are found), emergency.
    """
    settings = scenario.emergency
    if settings is None:
        return {}
    block, count = blocks.block, len(blocks.robot.cables)
    known = block.GetOutputPort(BROKEN)
    logged = {}
    if settings.known == FOUND:
        believed = blocks.believed.cables
        if not scenario.controller.pulleys:
            believed = believed.without_pulleys()
        detector = builder.AddNamedSystem(
            "break_detector",
            BreakDetector(believed, settings.rule(count), settings.rate, settings.slack_below),
        )
        for name, source in (
            ("X_WP", blocks.estimator.GetOutputPort("X_WP")),
            ("tensions", blocks.readings.port("measured_tensions")),
            ("lengths", blocks.readings.port("measured_lengths")),
        ):
            builder.Connect(source, detector.GetInputPort(name))
        known = detector.GetOutputPort("found_broken")
        logged = {"found_broken": known, "break_residuals": detector.GetOutputPort("residuals")}
    reaction = builder.AddNamedSystem("emergency", EmergencyReaction(settings, count))
    builder.Connect(known, reaction.GetInputPort("found_broken"))
    builder.Connect(reaction.GetOutputPort("jammed"), block.GetInputPort(JAMMED))
    left_out = reaction.GetOutputPort("left_out")
    if settings.reaction == REDISTRIBUTE:
        assert blocks.torque is not None
        builder.Connect(left_out, blocks.torque.GetInputPort("left_out"))
        builder.Connect(reaction.GetOutputPort("halted"), blocks.torque.GetInputPort("halted"))
    return logged | {"left_out": left_out}
