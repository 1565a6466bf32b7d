"""Wires a scenario into one Diagram: robot, camera, servo, estimator, monitor, logs."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from pydrake.math import RigidTransform
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.framework import Context, Diagram, DiagramBuilder, System

from cdpr_drake.models import (
    Robot,
    add_renderer,
    add_tag,
    load_camera,
    load_robot,
    make_rgbd_sensor,
)
from cdpr_drake.pinhole import Pinhole
from cdpr_drake.systems.cable_robot import CableRobot, automatic_step
from cdpr_drake.systems.log_row import RunLog, add_log
from cdpr_drake.systems.pose_estimators import ESTIMATORS
from cdpr_drake.systems.projected_camera import ProjectedCamera
from cdpr_drake.systems.run_monitor import RunMonitor, StopRules
from cdpr_drake.systems.scenario import Scenario
from cdpr_drake.systems.servo_model import make_servo_model
from cdpr_drake.systems.servo_schemes import SCHEMES
from cdpr_drake.systems.tag_detector import TagDetector
from cdpr_drake.systems.tag_measurement import TagMeasurement


@dataclass(frozen=True)
class VisualServo:
    """A scenario's diagram and the handles that a run needs.

    Attributes:
        scenario: The scenario.
        robot: Its robot.
        diagram: The diagram; subsystems robot, camera, detector (rendered camera only), servo,
            estimator, monitor; exported outputs of the same names as their ports.
        cable_robot: The robot's block.
        monitor: The block that ends the run.
        pinhole: The camera's intrinsic parameters.
        X_PC: True camera on the platform [m].
        X_WO: Tag in W [m].
        X_CdO: Desired pose of the tag in the camera [m].
        log: What the run stores.
        max_step: Integration step [s].
    """

    scenario: Scenario
    robot: Robot
    diagram: Diagram
    cable_robot: CableRobot
    monitor: RunMonitor
    pinhole: Pinhole
    X_PC: RigidTransform
    X_WO: RigidTransform
    X_CdO: RigidTransform
    log: RunLog
    max_step: float

    def make_context(self) -> Context:
        """A root context with the platform at rest at the initial pose, slack paid out if asked.

        Raises:
            InfeasibleTensionError: The initial pose cannot be held.
        """
        context = self.diagram.CreateDefaultContext()
        self.cable_robot.hang(
            self.cable_robot.GetMyMutableContextFromRoot(context),
            self.scenario.initial_pose.transform(),
            self.scenario.perturbations.slack,
        )
        return context


def build_visual_servo(scenario: Scenario) -> VisualServo:
    """Builds the diagram of a scenario.

    Raises:
        RobotFileError: The robot's file is not accepted.
        RenderingError: The camera is rendered and EGL is missing.
    """
    robot = load_robot(scenario.robot)
    settings = scenario.camera
    mount = robot.camera_mount(settings.mount)
    pinhole = load_camera(mount.model).pinhole(settings.width, settings.height)
    X_PC, X_WO = mount.pose.transform(), scenario.target.pose.transform()
    X_CdO = scenario.desired.transform()

    def add_target(plant: MultibodyPlant) -> None:
        add_tag(plant, scenario.target.tag_id, scenario.target.size, X_WO)

    builder = DiagramBuilder()
    block = builder.AddNamedSystem("robot", CableRobot(robot, add_target))
    measurement = _add_camera(builder, scenario, block, pinhole, X_PC, X_WO)
    model = make_servo_model(scenario, robot)
    servo = builder.AddNamedSystem("servo", SCHEMES[scenario.controller.scheme](scenario, model))
    systems: dict[System, tuple[str, ...]] = {
        block: ("X_WP", "lengths", "unstrained_lengths", "tensions"),
        measurement: ("X_CO", "found", "corners"),
        servo: ("platform_velocity", "cable_velocities"),
    }
    ports = {n: system.GetOutputPort(n) for system, names in systems.items() for n in names}
    estimator = ESTIMATORS[scenario.estimator.kind](scenario, model, builder, ports)
    monitor = builder.AddNamedSystem(
        "monitor", RunMonitor(_stop_rules(scenario, robot), X_CdO, scenario.controller.rate)
    )
    for name in ("X_CO", "found"):
        builder.Connect(measurement.GetOutputPort(name), servo.GetInputPort(name))
        builder.Connect(measurement.GetOutputPort(name), monitor.GetInputPort(name))
    builder.Connect(estimator.GetOutputPort("X_WP"), servo.GetInputPort("X_WP"))
    builder.Connect(block.GetOutputPort("X_WP"), monitor.GetInputPort("X_WP"))
    builder.Connect(ports["cable_velocities"], block.GetInputPort("cable_velocities"))
    log = _add_log(builder, scenario.log_rate, block, measurement, servo, estimator)
    for system, names in (
        (block, ("platform_state", "X_WP", "tensions", "lengths", "slack", "unstrained_lengths")),
        (measurement, ("corners", "X_CO", "found")),
        (servo, ("cable_velocities", "platform_velocity", "error", "gain")),
        (monitor, ("outcome",)),
    ):
        for name in names:
            builder.ExportOutput(system.GetOutputPort(name), name)
    builder.ExportOutput(estimator.GetOutputPort("X_WP"), "X_WP_estimated")
    diagram = builder.Build()
    diagram.set_name(scenario.name)
    integration = scenario.integration
    max_step = integration.max_step
    if max_step is None:
        # The stiffness changes with the pose: the shortest step at both ends of the way counts.
        ends = (scenario.initial_pose.transform(), X_WO @ (X_PC @ X_CdO).inverse())
        max_step = min(automatic_step(robot, X_WP, integration.integrator) for X_WP in ends)
    return VisualServo(
        scenario, robot, diagram, block, monitor, pinhole, X_PC, X_WO, X_CdO, log, max_step
    )


def _add_camera(
    builder: DiagramBuilder,
    scenario: Scenario,
    block: CableRobot,
    pinhole: Pinhole,
    X_PC: RigidTransform,
    X_WO: RigidTransform,
) -> TagMeasurement:
    """Adds the scenario's camera; returns the system with ports corners, X_CO, found."""
    settings, target = scenario.camera, scenario.target
    platform = block.in_plant.body
    if settings.kind == "projected":
        camera = ProjectedCamera(
            platform,
            X_PC,
            block.plant.world_body(),
            X_WO,
            target.size,
            pinhole,
            settings.rate,
            settings.latency_frames,
            settings.pixel_noise,
            scenario.seed,
        )
        projected = builder.AddNamedSystem("camera", camera)
        builder.Connect(block.GetOutputPort("body_poses"), projected.GetInputPort("body_poses"))
        return projected
    add_renderer(block.scene_graph)
    frame = block.plant.GetBodyFrameIdOrThrow(platform.index())
    sensor = builder.AddNamedSystem("camera", make_rgbd_sensor(frame, X_PC, pinhole))
    detector = builder.AddNamedSystem(
        "detector",
        TagDetector(target.tag_id, target.size, pinhole, settings.rate, settings.latency_frames),
    )
    builder.Connect(block.GetOutputPort("query_object"), sensor.query_object_input_port())
    builder.Connect(sensor.color_image_output_port(), detector.GetInputPort("color_image"))
    return detector


def _stop_rules(scenario: Scenario, robot: Robot) -> StopRules:
    stop = scenario.stop
    return StopRules(
        stop.position,
        float(np.radians(stop.rotation_deg)),
        stop.hold,
        stop.target_lost,
        robot.frame.lower,
        robot.frame.upper,
    )


def _add_log(
    builder: DiagramBuilder,
    rate: float,
    block: System,
    measurement: System,
    servo: System,
    estimator: System,
) -> RunLog:
    """Logs what the summary, the figures and the replay need."""
    ports = {
        "X_WP": block.GetOutputPort("X_WP"),
        "X_WP_estimated": estimator.GetOutputPort("X_WP"),
        "X_CO_measured": measurement.GetOutputPort("X_CO"),
        "found": measurement.GetOutputPort("found"),
        "corners_px": measurement.GetOutputPort("corners"),
        "error": servo.GetOutputPort("error"),
        "gain": servo.GetOutputPort("gain"),
        "platform_velocity": servo.GetOutputPort("platform_velocity"),
        "cable_velocities": servo.GetOutputPort("cable_velocities"),
        "tensions": block.GetOutputPort("tensions"),
        "lengths": block.GetOutputPort("lengths"),
        "unstrained_lengths": block.GetOutputPort("unstrained_lengths"),
        "slack": block.GetOutputPort("slack"),
    }
    return add_log(builder, ports, rate)
