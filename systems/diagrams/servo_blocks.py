"""Adds a visual servo to a cable robot in somebody's builder."""

from __future__ import annotations

from dataclasses import dataclass, field, fields

from pydrake.systems.framework import Context, DiagramBuilder, OutputPort, System
from pydrake.systems.primitives import Adder, ConstantVectorSource, Integrator, MatrixGain

from cdpr_drake.arrays import Array
from cdpr_drake.errors import ScenarioError
from cdpr_drake.systems.cameras.target_measurement import TargetMeasurement
from cdpr_drake.systems.cameras.turning_camera import turning_camera
from cdpr_drake.systems.controllers.feature_servo import FeatureServo
from cdpr_drake.systems.controllers.tension_corrector import TensionCorrector
from cdpr_drake.systems.controllers.torque_controller import TorqueController
from cdpr_drake.systems.diagrams.beliefs import winch_offsets
from cdpr_drake.systems.diagrams.camera import add_camera, add_target
from cdpr_drake.systems.diagrams.estimators import EstimatorInputs, add_estimator
from cdpr_drake.systems.diagrams.fusion_models import steers
from cdpr_drake.systems.diagrams.servo_models import ServoModel, servo_model
from cdpr_drake.systems.diagrams.tension_management import add_tension_corrector
from cdpr_drake.systems.diagrams.torque_control import (
    add_torque_controller,
    connect_torque_controller,
)
from cdpr_drake.systems.estimators.estimator_kinds import EstimatorSettings, EstimatorTask
from cdpr_drake.systems.robots.assembly import RobotBlock
from cdpr_drake.systems.robots.platform_wrench import APPLIED_WRENCH
from cdpr_drake.systems.scenarios.visual_servo_scenario import VisualServoSettings
from cdpr_drake.systems.sections import Platform, add_pushes, sections_of
from cdpr_drake.systems.sensors.sensor_readings import SensorReadings


@dataclass(frozen=True, kw_only=True)
class VisualServoBlocks(ServoModel):
    """The blocks of a visual servo in a builder, and what it is about.

    Attributes:
        block: The robot that it moves.
        measurement: The camera, with the ports of `TargetMeasurement`.
        sight: What shows the target as a camera at its mounting has it: the camera, or the view of
            one that turns; with the outputs X_CO, found and marks.
        servo: The servo.
        estimator: The estimator that the servo listens to.
        compared: Estimators that run beside it.
        readings: The sensors.
        wanted_lengths: Integrates cable velocities for winches that are commanded by position;
            None for others.
        corrector: Takes up slack; None unless asked for.
        torque: Makes torques of the servo's twist; None unless winches are commanded by torque.
        prefix: What the names of the blocks begin with.
        logged: What sections log, by the names of the quantities.
    """

    block: RobotBlock
    measurement: TargetMeasurement
    sight: System
    servo: FeatureServo
    estimator: System
    compared: tuple[System, ...]
    readings: SensorReadings
    wanted_lengths: Integrator | None
    corrector: TensionCorrector | None = None
    torque: TorqueController | None = None
    prefix: str = ""
    logged: dict[str, OutputPort] = field(default_factory=dict)

    def take_lengths(self, context: Context, lengths: Array) -> None:
        """Starts what integrates wanted lengths at lengths, shape (m,) [m], in the root context."""
        if self.wanted_lengths is not None:
            lengths = lengths[list(self.block.robot.winch_groups().first_cables())]
            integrator = self.wanted_lengths.GetMyMutableContextFromRoot(context)
            self.wanted_lengths.set_integral_value(integrator, lengths)


def add_visual_servo(
    builder: DiagramBuilder,
    robot: RobotBlock,
    settings: VisualServoSettings,
    *,
    X_WO: OutputPort | None = None,
    name: str = "",
) -> VisualServoBlocks:
    """Adds camera, servo, estimator and sensors to a robot, and lets the servo command its winches.

    Args:
        builder: The builder that has the robot.
        robot: A `CableRobot`, a `CompiledCableRobot`, or what `add_cable_robot` returned.
        settings: The servo; a scenario is one, too.
        X_WO: Pose of the target in the world [m]. None: the robot's port of that name, or a target
            that is added here. One on the platform is drawn only by a `CableRobot`.
        name: Put before the names of the blocks, so that several servos can be told apart.

    Returns:
        Handles.

    Raises:
        RenderingError: The camera is rendered and EGL is missing.
        ScenarioError: Two sections log a quantity of one name.
        VisualFeatureError: The target does not have what the scheme needs.
    """
    prefix = f"{name}_" if name else ""
    model = servo_model(settings, robot.robot)
    target, pinhole = model.target, model.pinhole
    if X_WO is None and not model.mounting.is_eye_to_hand():
        if robot.HasOutputPort("X_WO"):
            X_WO = robot.GetOutputPort("X_WO")
        elif robot.scene_graph is not None:
            X_WO = add_target(builder, robot.scene_graph, settings.target, name=prefix + "target")
    measurement = add_camera(
        builder,
        robot,
        settings.camera,
        target=target,
        mounting=model.mounting,
        pinhole=pinhole,
        X_WO=X_WO,
        seed=settings.seed,
        image_bias=settings.perturbations.image_bias,
        name=name,
    )
    _, turning = turning_camera(settings)
    sight: System = measurement
    if turning is not None:
        sight = turning.add_view(builder, model, measurement, settings, prefix)
    servo = model.make_servo(settings)
    builder.AddNamedSystem(prefix + "servo", servo)
    task = model.estimator_task(settings)
    readings = SensorReadings(builder, robot, settings.sensors, seed=settings.seed, name=name)
    ports = {port: sight.GetOutputPort(port) for port in ("X_CO", "found")}
    ports["platform_velocity"] = servo.GetOutputPort("platform_velocity")
    torque = add_torque_controller(
        builder, settings, robot, believed=model.believed, name=prefix + "torque_controller"
    )
    if torque is not None:  # what the platform does then is not what it was asked for
        ports["platform_velocity"] = torque.GetOutputPort("platform_twist")
    inputs = EstimatorInputs(
        builder,
        robot,
        settings,
        pinhole=pinhole,
        readings=readings,
        ports=ports,
        X_WO=X_WO,
        name=name,
    )
    estimator, *compared = _add_estimators(builder, settings.estimator, task, inputs, prefix)
    for port, source in seen_ports(settings, sight, estimator, target.mark).items():
        builder.Connect(source, servo.GetInputPort(port))
    builder.Connect(estimator.GetOutputPort("X_WP"), servo.GetInputPort("X_WP"))
    for port in ("tensions", "lengths"):
        if servo.HasInputPort(port):
            builder.Connect(robot.GetOutputPort(port), servo.GetInputPort(port))
    corrector, velocities = add_tension_corrector(
        builder, settings, robot, believed=model.believed, readings=readings, servo=servo,
        estimator=estimator, name=prefix + "corrector",
    )  # fmt: skip
    if torque is not None:
        connect_torque_controller(
            builder, torque, robot, readings=readings, servo=servo, estimator=estimator
        )
    velocities = _run_off(builder, velocities, winch_offsets(settings, velocities.size()), prefix)
    blocks = VisualServoBlocks(
        **{each.name: getattr(model, each.name) for each in fields(model)},
        block=robot,
        measurement=measurement,
        sight=sight,
        servo=servo,
        estimator=estimator,
        compared=tuple(compared),
        readings=readings,
        wanted_lengths=_command_winches(builder, velocities, robot, prefix),
        corrector=corrector,
        torque=torque,
        prefix=prefix,
    )
    sections = [section for _, section in sections_of(settings)]
    for key, section in sections_of(settings):
        logged = section.add_to(builder, blocks, settings)
        if twice := blocks.logged.keys() & logged.keys():
            raise ScenarioError(f"{key}: logs {', '.join(sorted(twice))}, as another section does")
        blocks.logged.update(logged)
    platform = Platform(
        robot=robot.robot, X_WP=robot.GetOutputPort("X_WP"),
        state=robot.GetOutputPort("platform_state"), seed=settings.seed, prefix=prefix,
    )  # fmt: skip
    wrench = add_pushes(builder, sections, platform)
    if wrench is not None:
        builder.Connect(wrench, robot.GetInputPort(APPLIED_WRENCH))
        blocks.logged[APPLIED_WRENCH] = wrench
    return blocks


def seen_ports(
    settings: VisualServoSettings, sight: System, estimator: System, mark: str
) -> dict[str, OutputPort]:
    """What shows a servo its target, by the names of its inputs: what looks at it, see
    `VisualServoBlocks.sight`, or the estimator where that fuses cameras and steers."""
    if steers(settings):
        names = {"X_CO": "X_CO_fused", "found": "fused_found", mark: "fused_marks"}
        return {name: estimator.GetOutputPort(port) for name, port in names.items()}
    return {name: sight.GetOutputPort(name) for name in ("X_CO", "found", mark)}


def _add_estimators(
    builder: DiagramBuilder,
    settings: EstimatorSettings,
    task: EstimatorTask,
    inputs: EstimatorInputs,
    prefix: str,
) -> list[System]:
    """Adds the estimator that the servo listens to, then those that run beside it."""
    kinds = {"estimator": settings.kind, **{f"estimator_{kind}": kind for kind in settings.compare}}
    return [
        add_estimator(builder, kind, task, inputs, name=prefix + block)
        for block, kind in kinds.items()
    ]


def _run_off(
    builder: DiagramBuilder, velocities: OutputPort, offsets: Array | None, prefix: str
) -> OutputPort:
    """Adds velocities by which winches run off; the port with what the winches really do."""
    if offsets is None:
        return velocities
    run_off = builder.AddNamedSystem(prefix + "winch_offsets", ConstantVectorSource(offsets))
    both = builder.AddNamedSystem(prefix + "winch_velocities", Adder(2, len(offsets)))
    for index, port in enumerate((velocities, run_off.get_output_port())):
        builder.Connect(port, both.get_input_port(index))
    return both.get_output_port()


def _command_winches(
    builder: DiagramBuilder, velocities: OutputPort, robot: RobotBlock, prefix: str
) -> Integrator | None:
    """Connects velocities to the winches; returns what makes lengths of them, if any.

    Winches by torque get none. A winch with several cables goes by the mean of theirs.
    """
    if robot.HasInputPort("motor_torques"):
        return None
    groups = robot.robot.winch_groups()
    if groups.are_shared():
        mean = builder.AddNamedSystem(prefix + "bundles", MatrixGain(groups.means()))
        builder.Connect(velocities, mean.get_input_port())
        velocities = mean.get_output_port()
    if not robot.HasInputPort("commanded_lengths"):
        builder.Connect(velocities, robot.GetInputPort("cable_velocities"))
        return None
    wanted = builder.AddNamedSystem(prefix + "wanted_lengths", Integrator(velocities.size()))
    builder.Connect(velocities, wanted.get_input_port())
    builder.Connect(wanted.get_output_port(), robot.GetInputPort("commanded_lengths"))
    if robot.HasInputPort("commanded_length_rates"):
        builder.Connect(velocities, robot.GetInputPort("commanded_length_rates"))
    return wanted
