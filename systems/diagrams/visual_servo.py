"""Wires a scenario into one Diagram: robot, camera, servo, estimator, monitor, logs."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from pydrake.math import RigidTransform
from pydrake.systems.framework import Context, Diagram, DiagramBuilder, System
from pydrake.systems.primitives import Integrator

from cdpr_drake.features.pose import seen_pose_error
from cdpr_drake.models.camera_catalogue import load_camera
from cdpr_drake.models.robot_loader import load_robot
from cdpr_drake.models.robot_schema import Robot
from cdpr_drake.systems.cameras.camera_mounting import Sight
from cdpr_drake.systems.cameras.target_measurement import TargetMeasurement
from cdpr_drake.systems.cameras.targets import make_target
from cdpr_drake.systems.diagrams.believed_robot import make_servo_model
from cdpr_drake.systems.diagrams.camera import add_camera, scene_adder
from cdpr_drake.systems.diagrams.controller import make_controller
from cdpr_drake.systems.diagrams.estimator_kinds import EstimatorTask
from cdpr_drake.systems.diagrams.estimators import add_estimators
from cdpr_drake.systems.monitoring.breaking_load_watch import BreakWatch
from cdpr_drake.systems.monitoring.log_row import RunLog, add_log
from cdpr_drake.systems.monitoring.run_monitor import RunMonitor, StopRules
from cdpr_drake.systems.robots.cable_robot import CableRobot, automatic_step
from cdpr_drake.systems.scenarios.visual_servo_scenario import Scenario
from cdpr_drake.systems.sensors.readings import READINGS, ScenarioReadings
from cdpr_drake.systems.servos.feature_servo import FeatureServo
from cdpr_drake.systems.servos.open_loop_servo import OpenLoopServo, open_loop_plan
from cdpr_drake.systems.servos.settings import NextTask
from cdpr_drake.trajectories.moving_pose import MovingPose
from cdpr_drake.vision.pinhole import Pinhole
from cdpr_drake.vision.target import Target


@dataclass(frozen=True)
class VisualServo:
    """A scenario's diagram and the handles that a run needs.

    Attributes:
        scenario: The scenario.
        robot: Its robot.
        diagram: The diagram; subsystems robot, camera, detector (rendered camera only), servo,
            estimator, monitor, wanted_lengths (winches by position only); exported outputs of
            the same names as their ports.
        cable_robot: The robot's block.
        servo: The visual servo's block.
        monitor: The block that ends the run.
        target: What the camera looks at.
        pinhole: The camera's intrinsic parameters.
        sight: Where camera and object truly are.
        motion: How the object moves in W, unless it is on the platform.
        X_CdO: Desired pose of the object in the camera, that of the last task [m].
        log: What the run stores.
        max_step: Integration step [s].
        watch: Watches for broken cables; None where no breaking load is known.
        wanted_lengths: Integrates the servo's cable velocities for winches that are commanded by
            position; None for others.
    """

    scenario: Scenario
    robot: Robot
    diagram: Diagram
    cable_robot: CableRobot
    servo: FeatureServo
    monitor: RunMonitor
    target: Target
    pinhole: Pinhole
    sight: Sight
    motion: MovingPose
    X_CdO: RigidTransform
    log: RunLog
    max_step: float
    watch: BreakWatch | None = None
    wanted_lengths: Integrator | None = None

    @property
    def X_PC(self) -> RigidTransform:
        """True camera on the platform, for eye in hand [m]."""
        return self.sight.X_BC

    @property
    def X_WO(self) -> RigidTransform:
        """Object in W at time 0, for eye in hand [m]."""
        return self.motion.at(0.0)

    @property
    def free_rotation(self) -> bool:
        """Whether the rotation about the optical axis is left free."""
        return self.servo.controller.tasks[-1].features.rank < 6

    @property
    def feature_names(self) -> tuple[str, ...]:
        """Names of the features, with their units."""
        return self.servo.controller.tasks[-1].features.names

    def X_CO(self, X_WP: RigidTransform, time: float) -> RigidTransform:
        """True pose of the object in the camera for a pose of the platform at a time [s]."""
        return self.sight.X_CO(X_WP, self.motion.at(time))

    def desired_platform_pose(self, time: float = 0.0) -> RigidTransform:
        """Pose X_WP from which the object is seen as desired at a time [s]."""
        return self.sight.X_WP(self.X_CdO, self.motion.at(time))

    def seen_error(self, X_WP: RigidTransform, time: float) -> tuple[float, float]:
        """True distance [m] and angle [rad] of the object in the camera from its desired pose."""
        return seen_pose_error(self.X_CO(X_WP, time), self.X_CdO, self.free_rotation)

    def make_context(self) -> Context:
        """A root context with the platform at rest at the initial pose, slack paid out if asked.

        Raises:
            InfeasibleTensionError: The initial pose cannot be held.
        """
        context = self.diagram.CreateDefaultContext()
        block = self.cable_robot
        own = block.GetMyMutableContextFromRoot(context)
        block.hang(own, self.scenario.initial_pose.transform(), self.scenario.perturbations.slack)
        if self.wanted_lengths is not None:
            lengths = block.GetOutputPort("unstrained_lengths").Eval(own)
            integrator = self.wanted_lengths.GetMyMutableContextFromRoot(context)
            self.wanted_lengths.set_integral_value(integrator, lengths)
        return context


def build_visual_servo(scenario: Scenario) -> VisualServo:
    """Builds the diagram of a scenario.

    Raises:
        RobotFileError: The robot's file is not accepted.
        RenderingError: The camera is rendered and EGL is missing.
        ScenarioError: A sensor reads more often than the simulation steps.
    """
    robot = load_robot(scenario.robot)
    settings = scenario.camera
    mount = robot.camera_mount(settings.mount)
    pinhole = load_camera(mount.model).pinhole(settings.width, settings.height)
    target, motion = make_target(scenario.target), scenario.target.path()
    on_platform = scenario.target.carrier == "platform"
    sight = Sight(mount.pose.transform(), motion.at(0.0) if on_platform else None)
    last_task = (scenario.next_tasks or [NextTask(time=0.0, desired=scenario.desired)])[-1]
    X_CdO = last_task.desired.transform()

    builder = DiagramBuilder()
    block = builder.AddNamedSystem(
        "robot",
        CableRobot(
            robot,
            scene_adder(scenario),
            cables=scenario.cables,
            winches=scenario.winches,
            damping=scenario.damping,
        ),
    )
    measurement = add_camera(builder, scenario, block, target, pinhole, sight)
    model = make_servo_model(scenario, robot)
    controller = make_controller(scenario, model, target)
    plan = open_loop_plan(scenario.open_loop, model, sight.X_WP(X_CdO, motion.at(0.0)))
    rate = scenario.controller.rate
    if plan is None:
        servo = FeatureServo(controller, target, pinhole, rate)
    else:
        servo = OpenLoopServo(controller, target, pinhole, rate, model, plan)
    builder.AddNamedSystem("servo", servo)
    task = EstimatorTask(scenario, model, target, pinhole)
    readings = ScenarioReadings(builder, scenario.sensors, scenario.seed, robot, block)
    estimator, *compared = add_estimators(builder, task, robot, block, measurement, servo, readings)
    free = controller.tasks[-1].features.rank < 6
    monitor = builder.AddNamedSystem(
        "monitor",
        RunMonitor(
            _stop_rules(scenario, robot),
            X_CdO,
            rate,
            free,
            last_task.time,
            np.inf if plan is None else plan.end_time + scenario.stop.hold,
        ),
    )
    for name in ("X_CO", "found"):
        builder.Connect(measurement.GetOutputPort(name), monitor.GetInputPort(name))
    for name in ("X_CO", "found", target.mark):
        builder.Connect(measurement.GetOutputPort(name), servo.GetInputPort(name))
    builder.Connect(estimator.GetOutputPort("X_WP"), servo.GetInputPort("X_WP"))
    watch = None
    if robot.cable.breaking_load is not None:
        loads = block.forces.cable_set().breaking_load
        watch = builder.AddNamedSystem("watch", BreakWatch(loads, scenario.stop.broken_cable))
        builder.Connect(block.GetOutputPort("tensions"), watch.GetInputPort("tensions"))
    builder.Connect(block.GetOutputPort("X_WP"), monitor.GetInputPort("X_WP"))
    wanted = _command_winches(builder, scenario, servo, block)
    log = _add_log(builder, scenario, block, measurement, servo, estimator, compared, readings)
    for system, names in (
        (block, ("platform_state", "X_WP", "tensions", "lengths", "slack", "unstrained_lengths")),
        (measurement, (target.mark, "X_CO", "found")),
        (servo, ("cable_velocities", "platform_velocity", "error", "gain")),
        (monitor, ("outcome",)),
    ):
        for name in names:
            builder.ExportOutput(system.GetOutputPort(name), name)
    builder.ExportOutput(estimator.GetOutputPort("X_WP"), "X_WP_estimated")
    diagram = builder.Build()
    diagram.set_name(scenario.name)
    # The stiffness changes with the pose: the shortest step at both ends of the way counts.
    ends = (scenario.initial_pose.transform(), sight.X_WP(X_CdO, motion.at(0.0)))
    max_step = _integration_step(scenario, robot, ends, readings)
    return VisualServo(
        scenario=scenario,
        robot=robot,
        diagram=diagram,
        cable_robot=block,
        servo=servo,
        monitor=monitor,
        watch=watch,
        wanted_lengths=wanted,
        target=target,
        pinhole=pinhole,
        sight=sight,
        motion=motion,
        X_CdO=X_CdO,
        log=log,
        max_step=max_step,
    )


def _command_winches(
    builder: DiagramBuilder, scenario: Scenario, servo: System, block: CableRobot
) -> Integrator | None:
    """Connects the servo to the winches; returns what makes lengths of its velocities, if any."""
    velocities = servo.GetOutputPort("cable_velocities")
    if scenario.winches.mode != "position":
        builder.Connect(velocities, block.GetInputPort("cable_velocities"))
        return None
    wanted = builder.AddNamedSystem("wanted_lengths", Integrator(velocities.size()))
    builder.Connect(velocities, wanted.get_input_port())
    builder.Connect(wanted.get_output_port(), block.GetInputPort("commanded_lengths"))
    return wanted


def _integration_step(
    scenario: Scenario,
    robot: Robot,
    poses: tuple[RigidTransform, ...],
    readings: ScenarioReadings,
) -> float:
    """The scenario's step, or one that is stable at these poses and meets all readings [s]."""
    integration = scenario.integration
    if integration.max_step is not None:
        readings.check_step(integration.max_step)
        return integration.max_step
    stable = (
        automatic_step(
            robot, X_WP, integration.integrator, scenario.winches, cables=scenario.cables
        )
        for X_WP in poses
    )
    return min(*stable, readings.shortest_period())


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
    scenario: Scenario,
    block: System,
    measurement: TargetMeasurement,
    servo: System,
    estimator: System,
    compared: list[System],
    readings: ScenarioReadings,
) -> RunLog:
    """Logs what the summary, the figures and the replay need."""
    mark = measurement.target.mark
    ports = {
        "X_WP": block.GetOutputPort("X_WP"),
        "X_WP_estimated": estimator.GetOutputPort("X_WP"),
        "X_CO_measured": measurement.GetOutputPort("X_CO"),
        "found": measurement.GetOutputPort("found"),
        f"{mark}_px": measurement.GetOutputPort(mark),
        "error": servo.GetOutputPort("error"),
        "gain": servo.GetOutputPort("gain"),
        "platform_velocity": servo.GetOutputPort("platform_velocity"),
        "cable_velocities": servo.GetOutputPort("cable_velocities"),
        "tensions": block.GetOutputPort("tensions"),
        "lengths": block.GetOutputPort("lengths"),
        "unstrained_lengths": block.GetOutputPort("unstrained_lengths"),
        "slack": block.GetOutputPort("slack"),
    }
    if scenario.open_loop is not None:
        ports["X_WP_planned"] = servo.GetOutputPort("X_WP_planned")
    for name, other in zip(scenario.estimator.compare, compared, strict=True):
        ports[f"X_WP_{name}"] = other.GetOutputPort("X_WP")
    for sensor in scenario.sensors.log:
        ports[READINGS[sensor]] = readings.port(READINGS[sensor])
    for name in ("applied_torques", "friction_torques"):
        if block.HasOutputPort(name):  # motors on the winches
            ports[name] = block.GetOutputPort(name)
    return add_log(builder, ports, scenario.log_rate)
