"""Checks the section `adaptation` and adds its block beside a servo."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from pydrake.systems.framework import DiagramBuilder, OutputPort, System

from cdpr_drake.cables.models import CABLE_MODELS
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.schema.declarations import Refusal, Scope
from cdpr_drake.systems.cameras.target_measurement import TargetMeasurement
from cdpr_drake.systems.controllers.tension_management_settings import (
    DISTRIBUTION,
    LENGTH,
    POLYGON,
)
from cdpr_drake.systems.diagrams.controller import make_tasks
from cdpr_drake.systems.diagrams.servo_models import ServoModel
from cdpr_drake.systems.estimators.geometry_learner import BELIEVED_POINTS, GeometryLearner
from cdpr_drake.systems.estimators.recursive_calibration import RecursiveCalibration
from cdpr_drake.systems.monitoring.belief_check import BeliefCheck
from cdpr_drake.systems.monitoring.servo_criterion import ServoCriterion
from cdpr_drake.systems.robots.assembly import RobotBlock
from cdpr_drake.systems.scenarios.visual_servo_scenario import VisualServoSettings
from cdpr_drake.systems.sensors.sensor_readings import SensorReadings
from cdpr_drake.vision.target import PointTarget

if TYPE_CHECKING:
    from cdpr_drake.systems.scenarios.visual_servo_scenario import Scenario

BY_LENGTHS = ("cable_lengths", "fusion", "sensor_fusion")
"""How names of estimators begin that reckon with the points that are believed at the start."""

BY_MODEL = (DISTRIBUTION, LENGTH, POLYGON)
"""Kinds of tension management that do."""


def adaptation_refusals(scope: Scope) -> Iterator[Refusal]:
    """Scenarios in which points cannot be learnt, or others would go by the old ones."""
    if scope.whole.adaptation is None or any(scope.whole.target.refusals(scope)):
        return
    for found, accepted in _obstacles(scope.whole, scope.robot):
        if found:
            yield "adaptation", f"a section with {found}", accepted


def _obstacles(scenario: Scenario, robot: Robot) -> list[tuple[str, str]]:
    """What is found that does not go with a section, or nothing, and what does."""
    target, manager = scenario.target, scenario.tension_management
    kinds = (scenario.estimator.kind, *scenario.estimator.compare)
    counting = [kind for kind in kinds if kind.startswith(BY_LENGTHS)]
    encoder = scenario.sensors.rate("encoder")
    planned = [
        name
        for name in ("trajectory", "open_loop", "pose_plan", "remote", "stability")
        if getattr(scenario, name, None) is not None
    ]
    whole = robot.motion_type().is_free and len(robot.cables) >= 6
    images = 1.0 if encoder is None else encoder / scenario.camera.rate
    return [
        ("" if whole else f"{robot.name}, {robot.motion}, {len(robot.cables)} cables",
         "3R3T with at least 6 cables"),
        (f"pulleys at the platform of {robot.name}"
         if robot.cable_set().has_platform_pulleys() else "", "pulleys at the frame alone"),
        (f"several cables on a winch of {robot.name}"
         if robot.winch_groups().are_shared() else "", "a winch for each cable"),
        (f"cables.model {scenario.cables.model_of(robot)}"
         if CABLE_MODELS[scenario.cables.model_of(robot)].sags else "", "cables that do not sag"),
        ("" if target.kind == "tag" else f"target.kind {target.kind}", "tag"),
        ("" if scenario.target_rests() else "a target that moves", "one that rests in the world"),
        (f"estimators {', '.join(counting)}, which would go by the points of the start"
         if counting else "", "estimators that lengths do not enter"),
        (f"tension_management.kind {manager.kind}, which would go by the points of the start"
         if manager is not None and manager.kind in BY_MODEL else "",
         "null, constant, adaptive, by_length or image"),
        ("winches.mode torque" if scenario.winches.mode == "torque" else "",
         "velocity or position"),
        (f"section {planned[0]}" if planned else "", "none of it"),
        (f"controller.scheme {scenario.controller.scheme}, which the stability criterion does not "
         "judge" if not _is_judged(scenario) else "", "all six motions by one law"),
        (f"encoders at {encoder:g} Hz and images at {scenario.camera.rate:g} Hz"
         if abs(images - round(images)) > 1e-9 or images < 0.5 else "",
         "sensors.encoder_rate a multiple of camera.rate, so that both are of the same instant"),
    ]  # fmt: skip


def _is_judged(scenario: Scenario) -> bool:
    if scenario.target.kind != "tag":
        return True  # said already
    tasks = make_tasks(scenario, scenario.target.target())
    partitioned = scenario.controller.scheme in ("partitioned", "switching")
    return tasks[-1].features.rank == 6 and not partitioned


def add_geometry_learner(
    builder: DiagramBuilder,
    settings: VisualServoSettings,
    robot: RobotBlock,
    *,
    model: ServoModel,
    readings: SensorReadings,
    measurement: TargetMeasurement,
    servo: System,
    estimated: OutputPort,
    name: str,
) -> GeometryLearner | None:
    """Adds a `GeometryLearner` if settings ask for one, and lets the servo go by its points."""
    wanted = settings.adaptation
    if wanted is None:
        return None
    believed, target, pinhole = model.believed, model.target, model.pinhole
    assert isinstance(target, PointTarget)
    real = robot.forces.cable_set()
    cables = believed.cables
    if not real.has_pulleys():
        cables = cables.without_pulleys()
    if settings.perturbations.believed_robot is None:
        cables = replace(cables, stiffness=real.stiffness)
    learner = RecursiveCalibration(
        cables, believed.X_PC, believed.X_WP0, target.points, wanted.beforehand(),
        wanted.rules(float(np.sqrt(pinhole.fx * pinhole.fy))),
    )  # fmt: skip
    judged = believed.cables
    if not settings.controller.pulleys:
        judged = judged.without_pulleys()
    criterion = ServoCriterion(
        cables=cables,
        believed=replace(believed, cables=judged),
        camera=believed.X_PC,
        features=model.controller.tasks[-1].features,
        target=target,
        sees=model.X_CO,
        judges_law=model.controller.law.uses_all_features(),
    )
    block = GeometryLearner(
        wanted,
        learner,
        (target, pinhole),
        settings.camera.rate,
        latency_frames=settings.camera.latency_frames,
        believed=np.array([believed.cables.p_WA.T, believed.cables.p_PB.T]),
        judge=BeliefCheck(criterion, model.X_CdO),
        seed=settings.seed,
    )
    builder.AddNamedSystem(name, block)
    for port in ("X_CO", "found", target.mark):
        builder.Connect(measurement.GetOutputPort(port), block.GetInputPort(port))
    for port in ("measured_lengths", "measured_tensions"):
        builder.Connect(readings.port(port), block.GetInputPort(port))
    builder.Connect(estimated, block.GetInputPort("X_WP"))
    builder.Connect(block.GetOutputPort(BELIEVED_POINTS), servo.GetInputPort(BELIEVED_POINTS))
    return block
