"""Checks the section `wrench_estimation` and adds its block beside a servo."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from pydrake.systems.framework import DiagramBuilder

from cdpr_drake.cables.models import CABLE_MODELS
from cdpr_drake.estimation.wrench_observers import WrenchError
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.models.robot_statics import rigid_platform
from cdpr_drake.schema.declarations import Refusal, Scope
from cdpr_drake.servoing.servo_task import BelievedRobot
from cdpr_drake.systems.estimators.length_estimator import EncoderLengths
from cdpr_drake.systems.estimators.wrench_estimator import WrenchEstimator
from cdpr_drake.systems.robots.assembly import RobotBlock
from cdpr_drake.systems.scenarios.visual_servo_scenario import VisualServoSettings
from cdpr_drake.systems.sensors.sensor_kinds import SensorSettings
from cdpr_drake.systems.sensors.sensor_readings import SensorReadings

if TYPE_CHECKING:
    pass


def wrench_refusals(scope: Scope) -> Iterator[Refusal]:
    """Robots of which cables and lengths do not tell all of a wrench."""
    scenario, robot = scope.whole, scope.robot
    if scenario.wrench_estimation is None:
        return
    if not robot.motion_type().is_free or len(robot.cables) < 6:
        found = f"a section for {robot.name}, {robot.motion} with {len(robot.cables)} cables"
        yield "wrench_estimation", found, "3R3T with at least 6"
    model = scenario.cables.model_of(robot)
    if CABLE_MODELS[model].sags:
        accepted = "cables that do not sag, whose lengths and tensions tell the pose"
        yield "wrench_estimation", f"a section with cables.model {model}", accepted


def reading_error(sensors: SensorSettings, robot: Robot, friction: float) -> WrenchError:
    """What the readings of a robot's sensors err by.

    Args:
        sensors: The section.
        robot: The robot.
        friction: Share of a tension that pulleys before the sensors take.
    """
    noise = offset = length = 0.0
    if sensors.rate("tension") is not None:
        model = sensors.model("tension")
        noise = float(np.hypot(model.repeatability, model.resolution / np.sqrt(12.0)))
        offset = float(model.accuracy / np.sqrt(3.0))
    if sensors.rate("encoder") is not None:
        turn = 2.0 * np.pi / sensors.model("encoder").counts_per_turn
        radius = float(np.mean(robot.drum().radii(len(robot.cables))))
        length = turn * radius / np.sqrt(12.0)
    return WrenchError(noise=noise, offset=offset, friction=friction, length=length)


def add_wrench_estimator(
    builder: DiagramBuilder,
    settings: VisualServoSettings,
    robot: RobotBlock,
    *,
    believed: BelievedRobot,
    readings: SensorReadings,
    name: str,
) -> WrenchEstimator | None:
    """Adds a `WrenchEstimator` if settings ask for one; platform and cables are as believed."""
    wanted = settings.wrench_estimation
    if wanted is None:
        return None
    file = settings.perturbations.believed_robot
    base = robot.robot if file is None else load_robot(file)
    cables = believed.cables
    if not robot.forces.cable_set().has_pulleys():
        cables = cables.without_pulleys()
    if file is None:
        cables = replace(cables, stiffness=robot.forces.cable_set().stiffness)
    block = WrenchEstimator(
        wanted, EncoderLengths(cables, elastic=True), rigid_platform(base), believed.X_WP0,
        reading_error(settings.sensors, robot.robot, wanted.believed_share()),
    )  # fmt: skip
    builder.AddNamedSystem(name, block)
    for port in ("measured_tensions", "measured_lengths"):
        builder.Connect(readings.port(port), block.GetInputPort(port))
    return block
